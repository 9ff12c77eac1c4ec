#include "stepdiag/controller/compensator.hpp"

#include <algorithm>
#include <limits>

#include "controller/checks.hpp"
#include "controller/compensator_tables.hpp"
#include "controller/fingerprint.hpp"
#include "machine/table_header.hpp"
#include "stepdiag/core/error.hpp"

namespace stepdiag {
namespace {

constexpr double inverse_bound_mm = 1e-10;
constexpr double steepest_contraction = 0.1;  // the errors of machine tools have slopes a hundred times smaller

// Positions outside by less than this count as inside, so that rounding is not decisive. Results have twice this
// tolerance, so that forward accepts the results of command.
constexpr double edge_slack = 1e-6;  // mm

std::array<double, 3> array(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

// Number of steps of answer_command after which the residual of the inverse is below iteration_bound for any table. The
// first step is as long as the estimate of e, which exceeds the bound of |e| by a hundredth at most, and 1.1 times
// that.
int largest_step_count(double error, double contraction) {
    const double factor = contraction * (2.0 + contraction);
    int count = 1;
    for (double left = 2.2 * error; left > iteration_bound; left *= factor) ++count;
    return count;
}

const Answers& answers(const CompensatorTables& tables, const double* temperature) {
    return temperature ? tables.answers_at_temperature : tables.answers;
}

ScaleRange scale_range(const ParameterTable& table, const CompensatorOptions& options, const std::string& name) {
    const std::optional<Expansion> expansion = check_temperatures(table, options, name);
    if (!expansion) return {};
    return {options.temperatures[0], options.temperatures[1], expansion->reference, read(expansion->coefficient.data()),
            read(expansion->fixed_point.data())};
}

// Calls `make`. Prefixes the messages of its exceptions with the table's name.
template <class Make>
auto named(const std::string& name, Make&& make) {
    try {
        return make();
    } catch (const InvalidArgument& error) {
        throw InvalidArgument(name + ": " + error.what());
    }
}

}  // namespace

Compensator Compensator::load(const std::string& path, const std::string& chain, const CompensatorOptions& options) {
    return Compensator(read_parameter_table(path), path, chain, options);
}

std::unique_ptr<CompensatorTables> make_tables(const ParameterTable& table, const std::string& name,
                                               const std::string& chain, const CompensatorOptions& options) {
    check(options);
    const Chain controllers = Chain::parse(chain), own = chain_of(table, name);
    if (!(own == controllers))
        throw InvalidArgument(name + ": chain: expected the controller's " + controllers.name() + ", got " +
                              own.name());
    const Eigen::Vector3d edges = lengths_of(table, "volume_mm", name), tool = lengths_of(table, "tool_mm", name);
    check_volume(edges, options, name);
    check_tool(tool, options, name);
    check_nodes(table, edges, name);
    const ErrorModel model =
        named(name, [&] { return ErrorModel(own, ErrorMap(table), array(edges), options.margin, options.approach); });
    const ScaleRange scales = scale_range(table, options, name);
    const ErrorModel::Bounds bounds = named(name, [&] { return model.bounds(options.largest_tool, scales.largest()); });
    if (!(bounds.contraction < steepest_contraction))
        throw InvalidArgument(name + ": expected errors that change by less than " +
                              std::to_string(steepest_contraction) + " mm/mm, got up to " +
                              std::to_string(bounds.contraction) + "; are the values in um and urad?");
    // A step is longer than its residual by the factor 1.1 at most.
    const double last_step = std::min(iteration_bound / (bounds.bend + bounds.contraction * bounds.contraction),
                                      0.9 * AxisPlace::slack),
                 uncapped = std::max(options.largest_correction - AxisPlace::slack, 0.0);
    const Box volume = {{0.0, 0.0, 0.0}, {edges.x(), edges.y(), edges.z()}};
    return std::unique_ptr<CompensatorTables>(new CompensatorTables{
        model,
        answers_for(own, are_fused_answers_known(), false),
        answers_for(own, are_fused_answers_known(), true),
        scales,
        read(options.origin.data()),
        volume,
        volume.grown(options.margin),
        Box{}.grown(farthest_position),
        volume.grown(edge_slack),
        volume.grown(2.0 * edge_slack),
        options.outside,
        options.margin,
        options.largest_correction,
        options.largest_correction * options.largest_correction,
        options.largest_tool * options.largest_tool,
        largest_step_count(std::min(bounds.error, options.largest_correction), bounds.contraction),
        last_step * last_step,
        uncapped * uncapped,
        array(edges),
        array(tool),
        stepdiag::fingerprint(own, edges, tool, table, expansion_of(table, name)),
        check_fit(table, options, name),
        not_told(table, edges, name),
        check_verified(table, options, name)});
}

Compensator::Compensator(const ParameterTable& table, const std::string& name, const std::string& chain,
                         const CompensatorOptions& options)
    : tables_(make_tables(table, name, chain, options)) {}

Compensator::~Compensator() = default;
Compensator::Compensator(Compensator&&) noexcept = default;
Compensator& Compensator::operator=(Compensator&&) noexcept = default;

unsigned Compensator::error(const double* position, const double* tool, const double* temperature, double* error,
                            double* orientation) const noexcept {
    if (temperature && !tables_->scales.holds(temperature)) {
        write({0.0, 0.0, 0.0}, error);
        if (orientation) write({0.0, 0.0, 0.0}, orientation);
        return compensation_refused | compensation_temperature;
    }
    return answers(*tables_, temperature)
        .error(*tables_, position, tool ? tool : tables_->tool.data(), temperature, error, orientation);
}

unsigned Compensator::command(const double* target, const double* tool, const double* temperature,
                              double* command) const noexcept {
    if (temperature && !tables_->scales.holds(temperature))
        return write(read(target), command), compensation_refused | compensation_temperature;
    return answers(*tables_, temperature)
        .command(*tables_, target, tool ? tool : tables_->tool.data(), temperature, command);
}

unsigned Compensator::forward(const double* command, const double* tool, const double* temperature,
                              double* actual) const noexcept {
    if (temperature && !tables_->scales.holds(temperature))
        return write(read(command), actual), compensation_refused | compensation_temperature;
    return answers(*tables_, temperature)
        .forward(*tables_, command, tool ? tool : tables_->tool.data(), temperature, actual);
}

unsigned Compensator::errors(std::size_t count, const double* positions, const double* tool, const double* temperature,
                             double* errors, double* orientations, unsigned* statuses) const noexcept {
    if (temperature && !tables_->scales.holds(temperature)) {
        std::fill_n(errors, 3 * count, 0.0);
        if (orientations) std::fill_n(orientations, 3 * count, 0.0);
        if (statuses) std::fill_n(statuses, count, compensation_refused | compensation_temperature);
        return count ? compensation_refused | compensation_temperature : 0;
    }
    return answers(*tables_, temperature)
        .errors(*tables_, count, positions, tool ? tool : tables_->tool.data(), temperature, errors, orientations,
                statuses);
}

unsigned Compensator::commands(std::size_t count, const double* targets, const double* tool, const double* temperature,
                               double* commands, unsigned* statuses) const noexcept {
    if (temperature && !tables_->scales.holds(temperature)) {
        std::copy_n(targets, 3 * count, commands);
        if (statuses) std::fill_n(statuses, count, compensation_refused | compensation_temperature);
        return count ? compensation_refused | compensation_temperature : 0;
    }
    return answers(*tables_, temperature)
        .commands(*tables_, count, targets, tool ? tool : tables_->tool.data(), temperature, commands, statuses);
}

unsigned Compensator::error(const double* position, const double* tool, double* error,
                            double* orientation) const noexcept {
    return this->error(position, tool, nullptr, error, orientation);
}
unsigned Compensator::command(const double* target, const double* tool, double* command) const noexcept {
    return this->command(target, tool, nullptr, command);
}
unsigned Compensator::forward(const double* command, const double* tool, double* actual) const noexcept {
    return this->forward(command, tool, nullptr, actual);
}

MachineError Compensator::error(const std::array<double, 3>& position,
                                const std::array<double, 3>& tool) const noexcept {
    MachineError result;
    result.status = error(position.data(), tool.data(), result.position.data(), result.orientation.data());
    return result;
}
CompensatedPosition Compensator::command(const std::array<double, 3>& target,
                                         const std::array<double, 3>& tool) const noexcept {
    CompensatedPosition result;
    result.status = command(target.data(), tool.data(), result.position.data());
    return result;
}
CompensatedPosition Compensator::forward(const std::array<double, 3>& command,
                                         const std::array<double, 3>& tool) const noexcept {
    CompensatedPosition result;
    result.status = forward(command.data(), tool.data(), result.position.data());
    return result;
}
MachineError Compensator::error(const std::array<double, 3>& position, const std::array<double, 3>& tool,
                                const std::array<double, 3>& temperature) const noexcept {
    MachineError result;
    result.status =
        error(position.data(), tool.data(), temperature.data(), result.position.data(), result.orientation.data());
    return result;
}
CompensatedPosition Compensator::command(const std::array<double, 3>& target, const std::array<double, 3>& tool,
                                         const std::array<double, 3>& temperature) const noexcept {
    CompensatedPosition result;
    result.status = command(target.data(), tool.data(), temperature.data(), result.position.data());
    return result;
}
CompensatedPosition Compensator::forward(const std::array<double, 3>& command, const std::array<double, 3>& tool,
                                         const std::array<double, 3>& temperature) const noexcept {
    CompensatedPosition result;
    result.status = forward(command.data(), tool.data(), temperature.data(), result.position.data());
    return result;
}

std::uint64_t Compensator::fingerprint() const noexcept { return tables_->fingerprint; }
double Compensator::inverse_bound() const noexcept { return inverse_bound_mm; }
std::array<double, 3> Compensator::volume() const noexcept { return tables_->volume; }
std::array<double, 3> Compensator::tool() const noexcept { return tables_->tool; }
double Compensator::temperature_reference() const noexcept {
    return tables_->scales.is_empty() ? std::numeric_limits<double>::quiet_NaN() : tables_->scales.reference;
}
const std::string& Compensator::fit() const noexcept { return tables_->fit; }
bool Compensator::is_unverified() const noexcept { return tables_->unverified; }
const std::vector<std::string>& Compensator::uncompensated() const noexcept { return tables_->uncompensated; }

}  // namespace stepdiag
