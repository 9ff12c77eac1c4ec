#include "stepdiag/controller/compensator.hpp"

#include <algorithm>
#include <cmath>

#include "controller/checks.hpp"
#include "controller/error_model.hpp"
#include "controller/fingerprint.hpp"
#include "machine/table_header.hpp"
#include "stepdiag/core/error.hpp"

namespace stepdiag {
namespace {

using Eigen::Vector3d;

// What may be left of inverse_bound after the iteration; the rest is for rounding: c = t - e, c - origin and c + e are
// each rounded to 0.7e-11 mm and better up to farthest_position.
constexpr double inverse_bound_mm = 1e-10, iteration_bound = 5e-11;
constexpr double steepest_contraction = 0.1;  // no machine tool comes near a hundredth of it

// A position this little outside counts as inside, so that rounding never decides. Of a result twice as much: what
// command takes, forward gives back.
constexpr double edge_slack = 1e-6;  // mm

Vector3d vector(const std::array<double, 3>& v) { return {v[0], v[1], v[2]}; }
std::array<double, 3> array(const Vector3d& v) { return {v.x(), v.y(), v.z()}; }

// Evaluations of e after which |forward(command(t)) - t| = |e(c_n) - e(c_n-1)| <= q^n |e(t)| is small enough.
int evaluations_for(double error, double contraction) {
    int count = 1;
    for (double left = contraction * error; left > iteration_bound; left *= contraction) ++count;
    return count;
}

// What `make` makes of a table; what it refuses, said with the table's name.
template <class Make>
auto named(const std::string& name, Make&& make) {
    try {
        return make();
    } catch (const InvalidArgument& error) {
        throw InvalidArgument(name + ": " + error.what());
    }
}

}  // namespace

struct Compensator::Tables {
    ErrorModel model;
    CompensatorOptions options;
    Vector3d origin, volume, tool;
    Vector3d lowest, highest;  // of the positions for which the table is asked; errors beyond are those of the nearest
    double largest_correction2, largest_tool2;
    int evaluations;
    std::uint64_t fingerprint;
    std::vector<std::string> uncompensated;

    Vector3d clamped(const Vector3d& p) const noexcept { return p.cwiseMax(lowest).cwiseMin(highest); }

    // The correction for e. Shortening never takes two vectors farther apart, nor does clamping two positions: the
    // iteration contracts with both.
    Vector3d capped(const Vector3d& e, unsigned& status) const noexcept {
        const double length2 = e.squaredNorm();
        if (length2 <= largest_correction2) return e;
        status |= compensation_capped;
        return options.largest_correction / std::sqrt(length2) * e;
    }

    // Of a place in the volume's coordinates: where a commanded tool shall be, is, or where axes stand.
    unsigned status(const Vector3d& p, double slack) const noexcept {
        const double beyond = std::max((-p).maxCoeff(), (p - volume).maxCoeff());
        if (beyond <= slack) return 0;
        const bool refused = options.outside == Outside::refuse ||
                             (options.outside == Outside::linear && beyond > options.margin + slack);
        return refused ? compensation_outside | compensation_refused : unsigned(compensation_outside);
    }
    // NaN compares false.
    bool is_usable(const Vector3d& p, const Vector3d& tool_offset) const noexcept {
        return std::abs(p.x()) <= farthest_position && std::abs(p.y()) <= farthest_position &&
               std::abs(p.z()) <= farthest_position && tool_offset.squaredNorm() <= largest_tool2;
    }
};

Compensator Compensator::load(const std::string& path, const std::string& chain, const CompensatorOptions& options) {
    return Compensator(read_parameter_table(path), path, chain, options);
}

Compensator::Compensator(const ParameterTable& table, const std::string& name, const std::string& chain,
                         const CompensatorOptions& options) {
    check(options);
    const Chain controllers = Chain::parse(chain), own = chain_of(table, name);
    if (!(own == controllers))
        throw InvalidArgument(name + ": chain: expected the controller's " + controllers.name() + ", got " +
                              own.name());
    const Vector3d volume = lengths_of(table, "volume_mm", name), tool = lengths_of(table, "tool_mm", name);
    check_volume(volume, options, name);
    check_tool(tool, options, name);
    check_nodes(table, volume, name);
    const ErrorModel model = named(name, [&] { return ErrorModel(own, ErrorMap(table), volume, options.approach); });
    const ErrorModel::Bounds bounds = named(name, [&] { return model.bounds(options.margin, options.largest_tool); });
    if (!(bounds.contraction < steepest_contraction))
        throw InvalidArgument(name + ": expected errors that change by less than " +
                              std::to_string(steepest_contraction) + " mm/mm, got up to " +
                              std::to_string(bounds.contraction) + "; are the values in um and urad?");
    const Vector3d margin = Vector3d::Constant(options.margin);
    tables_ = std::make_unique<const Tables>(
        Tables{model, options, vector(options.origin), volume, tool, -margin, volume + margin,
               options.largest_correction * options.largest_correction, options.largest_tool * options.largest_tool,
               evaluations_for(std::min(bounds.error, options.largest_correction), bounds.contraction),
               stepdiag::fingerprint(own, volume, tool, table), not_told(table, volume, name)});
}

Compensator::~Compensator() = default;
Compensator::Compensator(Compensator&&) noexcept = default;
Compensator& Compensator::operator=(Compensator&&) noexcept = default;

MachineError Compensator::error(const std::array<double, 3>& position,
                                const std::array<double, 3>& tool) const noexcept {
    const Tables& t = *tables_;
    const Vector3d asked = vector(position), tool_offset = vector(tool), p = asked - t.origin;
    unsigned status = t.is_usable(asked, tool_offset) ? t.status(p, edge_slack) : unsigned(compensation_refused);
    if (status & compensation_refused) return {{0.0, 0.0, 0.0}, {0.0, 0.0, 0.0}, status};
    const Vector3d inside = t.clamped(p);
    const ErrorModel::Cell cell = t.model.cell(inside);
    const Vector3d e = t.model.error(inside, tool_offset, cell);
    if (e.squaredNorm() > t.largest_correction2) status |= compensation_capped;
    return {array(e), array(t.model.orientation(inside, cell)), status};
}

CompensatedPosition Compensator::command(const std::array<double, 3>& target,
                                         const std::array<double, 3>& tool) const noexcept {
    const Tables& t = *tables_;
    const Vector3d asked = vector(target), tool_offset = vector(tool), p = asked - t.origin;
    unsigned status = t.is_usable(asked, tool_offset) ? t.status(p, edge_slack) : unsigned(compensation_refused);
    if (status & compensation_refused) return {target, status};
    Vector3d inside = t.clamped(p);
    ErrorModel::Cell cell = t.model.cell(inside);
    Vector3d e = t.capped(t.model.error(inside, tool_offset, cell), status);
    for (int i = 1; i < t.evaluations; ++i) {
        inside = t.clamped(p - e);
        cell = t.model.cell(inside, cell);
        status &= ~unsigned(compensation_capped);  // said of the last one
        e = t.capped(t.model.error(inside, tool_offset, cell), status);
    }
    return {array(asked - e), status};
}

CompensatedPosition Compensator::forward(const std::array<double, 3>& command,
                                         const std::array<double, 3>& tool) const noexcept {
    const Tables& t = *tables_;
    const Vector3d asked = vector(command), tool_offset = vector(tool);
    if (!t.is_usable(asked, tool_offset)) return {command, compensation_refused};
    const Vector3d inside = t.clamped(asked - t.origin);
    unsigned capped = 0;
    const Vector3d actual = asked + t.capped(t.model.error(inside, tool_offset, t.model.cell(inside)), capped);
    const unsigned status = t.status(actual - t.origin, 2.0 * edge_slack);
    if (status & compensation_refused) return {command, status};
    return {array(actual), status | capped};
}

std::uint64_t Compensator::fingerprint() const noexcept { return tables_->fingerprint; }
double Compensator::inverse_bound() const noexcept { return inverse_bound_mm; }
std::array<double, 3> Compensator::volume() const noexcept { return array(tables_->volume); }
std::array<double, 3> Compensator::tool() const noexcept { return array(tables_->tool); }
const std::vector<std::string>& Compensator::uncompensated() const noexcept { return tables_->uncompensated; }

}  // namespace stepdiag
