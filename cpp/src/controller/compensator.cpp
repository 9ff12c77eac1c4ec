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

// Half of it is for the iteration, the rest for rounding: p = t - origin, t + k and c + e are each rounded to 0.7e-11
// mm and better up to farthest_position.
constexpr double inverse_bound_mm = 1e-10, iteration_bound = 5e-11;
constexpr double steepest_contraction = 0.1;  // machine tools are a hundred times flatter

// A position this little outside counts as inside, so that rounding never decides. Of a result twice as much: what
// command takes, forward gives back.
constexpr double edge_slack = 1e-6;  // mm

// Steps after which the residual of the inverse, |e| at first, is small enough whatever the table does: see `command`.
int largest_step_count(double error, double contraction) {
    const double factor = contraction * (2.0 + contraction);
    int count = 0;
    for (double left = error; left > iteration_bound; left *= factor) ++count;
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
    Vector3 origin, volume, tool;
    Vector3 lowest,
        highest;  // of the positions that the model is asked for; the errors beyond are those of the nearest
    double largest_correction2, largest_tool2;
    int step_count;
    std::uint64_t fingerprint;
    std::vector<std::string> uncompensated;

    // The correction for e. Shortening never takes two vectors farther apart, as clamping never takes two positions: a
    // table that contracts does so with both.
    Vector3 capped(const Vector3& e, unsigned& status) const noexcept {
        const double length2 = dot(e, e);
        if (length2 <= largest_correction2) return e;
        status |= compensation_capped;
        return options.largest_correction / std::sqrt(length2) * e;
    }

    // Of a place in the volume's coordinates: where a tool shall be, or is, or where axes stand.
    unsigned status(const Vector3& p, double slack) const noexcept {
        const Vector3 above = p - volume;
        const double beyond = std::max({-p.x, -p.y, -p.z, above.x, above.y, above.z});
        if (beyond <= slack) return 0;
        const bool refused = options.outside == Outside::refuse ||
                             (options.outside == Outside::linear && beyond > options.margin + slack);
        return refused ? compensation_outside | compensation_refused : unsigned(compensation_outside);
    }

    // NaN compares false.
    bool is_usable(const Vector3& p, const Vector3& tool_offset) const noexcept {
        return std::abs(p.x) <= farthest_position && std::abs(p.y) <= farthest_position &&
               std::abs(p.z) <= farthest_position && dot(tool_offset, tool_offset) <= largest_tool2;
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
    const Eigen::Vector3d volume = lengths_of(table, "volume_mm", name), tool = lengths_of(table, "tool_mm", name);
    check_volume(volume, options, name);
    check_tool(tool, options, name);
    check_nodes(table, volume, name);
    const ErrorModel model = named(name, [&] {
        return ErrorModel(own, ErrorMap(table), {volume.x(), volume.y(), volume.z()}, options.margin, options.approach);
    });
    const ErrorModel::Bounds bounds = named(name, [&] { return model.bounds(options.largest_tool); });
    if (!(bounds.contraction < steepest_contraction))
        throw InvalidArgument(name + ": expected errors that change by less than " +
                              std::to_string(steepest_contraction) + " mm/mm, got up to " +
                              std::to_string(bounds.contraction) + "; are the values in um and urad?");
    const Vector3 margin = {options.margin, options.margin, options.margin};
    tables_ = std::make_unique<const Tables>(
        Tables{model, options, vector3(options.origin), vector3(volume), vector3(tool), -1.0 * margin,
               vector3(volume) + margin, options.largest_correction * options.largest_correction,
               options.largest_tool * options.largest_tool,
               largest_step_count(std::min(bounds.error, options.largest_correction), bounds.contraction),
               stepdiag::fingerprint(own, volume, tool, table), not_told(table, volume, name)});
}

Compensator::~Compensator() = default;
Compensator::Compensator(Compensator&&) noexcept = default;
Compensator& Compensator::operator=(Compensator&&) noexcept = default;

MachineError Compensator::error(const std::array<double, 3>& position,
                                const std::array<double, 3>& tool) const noexcept {
    const Tables& t = *tables_;
    const Vector3 asked = vector3(position), offset = vector3(tool), p = asked - t.origin;
    unsigned status = t.is_usable(asked, offset) ? t.status(p, edge_slack) : unsigned(compensation_refused);
    if (status & compensation_refused) return {{0.0, 0.0, 0.0}, {0.0, 0.0, 0.0}, status};
    const Vector3 inside = clamp(p, t.lowest, t.highest);
    const ErrorModel::Cell cell = t.model.cell(inside);
    const Vector3 e = t.model.in_order([&](auto order) { return t.model.error(order, inside, offset, cell); });
    if (dot(e, e) > t.largest_correction2) status |= compensation_capped;
    return {array(e), array(t.model.orientation(inside, cell)), status};
}

// The correction k with k + e(p + k) = 0 by Newton's method with one slope S, that at the target:
//   r <- k + e(p + k),   k <- k - (r - S r)
// Errors at two places differ by q times their distance at most, and |S| <= q, so each step leaves (2 q + q^2) |r| at
// most, over any number of kinks; within a cell of the table it leaves q^2 |r|, and two steps do. The residual r is
// what forward will be off by.
CompensatedPosition Compensator::command(const std::array<double, 3>& target,
                                         const std::array<double, 3>& tool) const noexcept {
    const Tables& t = *tables_;
    const Vector3 asked = vector3(target), offset = vector3(tool), p = asked - t.origin;
    unsigned status = t.is_usable(asked, offset) ? t.status(p, edge_slack) : unsigned(compensation_refused);
    if (status & compensation_refused) return {target, status};
    return t.model.in_order([&](auto order) -> CompensatedPosition {
        Vector3 inside = clamp(p, t.lowest, t.highest);
        ErrorModel::Cell cell = t.model.cell(inside);
        const Matrix3 slope = t.model.slope(order, inside, offset, cell);
        unsigned capped = 0;
        Vector3 k = {0.0, 0.0, 0.0}, r = t.capped(t.model.error(order, inside, offset, cell), capped);
        for (int step = 0; step < t.step_count && dot(r, r) > iteration_bound * iteration_bound; ++step) {
            k = k - (r - slope * r);
            inside = clamp(p + k, t.lowest, t.highest);
            if (!cell.holds(inside)) cell = t.model.cell(inside);
            capped = 0;
            r = k + t.capped(t.model.error(order, inside, offset, cell), capped);
        }
        return {array(asked + k), status | capped};
    });
}

CompensatedPosition Compensator::forward(const std::array<double, 3>& command,
                                         const std::array<double, 3>& tool) const noexcept {
    const Tables& t = *tables_;
    const Vector3 asked = vector3(command), offset = vector3(tool);
    if (!t.is_usable(asked, offset)) return {command, compensation_refused};
    const Vector3 inside = clamp(asked - t.origin, t.lowest, t.highest);
    const ErrorModel::Cell cell = t.model.cell(inside);
    const Vector3 e = t.model.in_order([&](auto order) { return t.model.error(order, inside, offset, cell); });
    unsigned capped = 0;
    const Vector3 actual = asked + t.capped(e, capped);
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
