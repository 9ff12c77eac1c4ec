// Data of a loaded compensator, and the functions for the requests of a controller.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "controller/error_model.hpp"
#include "controller/vector3.hpp"
#include "stepdiag/controller/compensator.hpp"

namespace stepdiag {

// Largest residual of the inverse. The rest of Compensator::inverse_bound covers rounding: the errors of t + k and c +
// e are each below 1.5e-11 mm for position and origin within 100 m.
inline constexpr double iteration_bound = 4e-11;  // mm

struct CompensatorTables;

// Functions for one order of the axes and one instruction set, selected when loading, without or with temperatures.
struct Answers {
    using Tables = CompensatorTables;
    unsigned (*error)(const Tables&, const double* position, const double* tool, const double* temperature,
                      double* error, double* orientation) noexcept;
    unsigned (*command)(const Tables&, const double* target, const double* tool, const double* temperature,
                        double* command) noexcept;
    unsigned (*forward)(const Tables&, const double* command, const double* tool, const double* temperature,
                        double* actual) noexcept;
    unsigned (*errors)(const Tables&, std::size_t count, const double* positions, const double* tool,
                       const double* temperature, double* errors, double* orientations, unsigned* statuses) noexcept;
    unsigned (*commands)(const Tables&, std::size_t count, const double* targets, const double* tool,
                         const double* temperature, double* commands, unsigned* statuses) noexcept;
};

// Temperatures that calls may state. Without any, `lowest` exceeds `highest`.
struct ScaleRange {
    double lowest = 1.0, highest = 0.0, reference = 0.0;  // degrees Celsius
    Vector3 coefficient = {0.0, 0.0, 0.0};                // 1/K
    Vector3 fixed_point = {0.0, 0.0, 0.0};                // mm, in the volume's coordinates

    bool is_empty() const noexcept { return lowest > highest; }
    STEPDIAG_INLINED bool holds(const double* temperature) const noexcept {
        const auto inside = [this](double t) { return lowest <= t && t <= highest; };
        return are_moderate<3>(temperature) && inside(temperature[0]) && inside(temperature[1]) &&
               inside(temperature[2]);
    }
    STEPDIAG_INLINED ExpandedScales at(const double* temperature) const noexcept {
        return {{coefficient.x * (temperature[0] - reference), coefficient.y * (temperature[1] - reference),
                 coefficient.z * (temperature[2] - reference)},
                fixed_point};
    }
    // Largest rates over the range; 0 without one.
    ExpandedScales largest() const noexcept {
        const double warmth = is_empty() ? 0.0 : std::max(std::abs(lowest - reference), std::abs(highest - reference));
        const auto rate = [&](double c) { return std::abs(c) * warmth; };
        return {{rate(coefficient.x), rate(coefficient.y), rate(coefficient.z)}, fixed_point};
    }
};

struct CompensatorTables {
    ErrorModel model;
    Answers answers, answers_at_temperature;
    ScaleRange scales;
    Vector3 origin;
    Box within;                     // the volume; positions in it are their own nearest point and have status 0
    Box known;                      // the model is evaluated here; positions outside use the nearest point
    Box everywhere;                 // range of valid positions
    Box inside, inside_of_results;  // the volume with its tolerance, for requested positions and for results
    Outside outside;
    double margin, largest_correction, largest_correction2, largest_tool2;
    int step_count;     // of the inverse
    double last_step2;  // square of the largest residual from which a step within a cell meets iteration_bound, mm^2
    double uncapped2;   // square of a correction that is shorter than largest_correction by the length of such a step
    std::array<double, 3> volume, tool;
    std::uint64_t fingerprint;
    std::string fit;
    std::vector<std::string> uncompensated;
    bool unverified;

    // The correction for e. Shortening vectors and clamping positions never increase a distance, so the iteration of a
    // contracting table remains contracting.
    STEPDIAG_INLINED Vector3 capped(const Vector3& e, unsigned& status) const noexcept {
        const double length2 = dot(e, e);
        if (length2 <= largest_correction2) return e;
        status |= compensation_capped;
        return largest_correction / std::sqrt(length2) * e;
    }

    // Of moderate numbers, as all below.
    STEPDIAG_INLINED bool is_usable(const Vector3& p, const Vector3& tool_offset) const noexcept {
        return everywhere.holds(p) && dot(tool_offset, tool_offset) <= largest_tool2;
    }
    // Status of a position outside `inside`, in the volume's coordinates.
    unsigned status_outside(const Vector3& p, const Box& inside) const noexcept {
        const bool refused =
            outside == Outside::refuse || (outside == Outside::linear && !inside.grown(margin).holds(p));
        return refused ? compensation_outside | compensation_refused : unsigned(compensation_outside);
    }
    // Whether a position in the volume is requested, for a tool of the permitted length. Such a position is its own
    // nearest point, and its status is 0. Most are, so this test comes first.
    STEPDIAG_INLINED bool is_usual(const Vector3& p, const Vector3& tool_offset) const noexcept {
        return within.holds(p) && dot(tool_offset, tool_offset) <= largest_tool2;
    }
    STEPDIAG_INLINED bool are_usual(const Vector3Of<Four>& p, const Vector3& tool_offset) const noexcept {
        return within.holds(p) && dot(tool_offset, tool_offset) <= largest_tool2;
    }
    // Status of any requested tool position, or of an axis position.
    unsigned status(const Vector3& p, const Vector3& tool_offset) const noexcept {
        if (!is_usable(p, tool_offset)) return compensation_refused;
        return inside.holds(p) ? 0 : status_outside(p, inside);
    }
};

template <class Order, class Scales>
STEPDIAG_INLINED unsigned answer_error(Order order, const Scales& scales, const CompensatorTables& t,
                                       const double* position, const double* tool, double* error,
                                       double* orientation) noexcept {
    const auto refuse = [&](unsigned status) {
        write({0.0, 0.0, 0.0}, error);
        if (orientation) write({0.0, 0.0, 0.0}, orientation);
        return status;
    };
    if (!are_moderate<3>(position) || !are_moderate<3>(tool)) return refuse(compensation_refused);
    const Vector3 offset = read(tool);
    Vector3 p = read(position) - t.origin;
    unsigned status = 0;
    if (!t.is_usual(p, offset)) {
        status = t.status(p, offset);
        if (status & compensation_refused) return refuse(status);
        p = t.known.nearest(p);
    }
    const ErrorModel::Cell cell = t.model.cell(p);
    const Vector3 e = t.model.error(order, scales, p, offset, cell);
    write(e, error);
    if (orientation) write(t.model.orientation(order, p, cell), orientation);
    return dot(e, e) > t.largest_correction2 ? status | compensation_capped : status;
}

// The correction k with k + e(p + k) = 0, by Newton's method with the constant slope S of the target:
//   k <- k - (r - S r),   r <- k + e(p + k)
// It begins with k = 0 and the estimate of e(p) for r. The errors at two positions differ by at most q times their
// distance, and |S| <= q. Each further step therefore reduces the residual to at most (2 q + q^2) |r|, for any number
// of nodes between the positions, and to (b + q^2) |r| in the cell of the target, where slopes differ from S by at most
// b. The residual r is the error of the subsequent forward. It is computed, except after a step in that cell from a
// residual so small that this bound suffices: usually the second.
template <class Order, class Scales>
STEPDIAG_INLINED unsigned answer_command(Order order, const Scales& scales, const CompensatorTables& t,
                                         const double* target, const double* tool, double* command) noexcept {
    if (!are_moderate<3>(target) || !are_moderate<3>(tool)) return write(read(target), command), compensation_refused;
    const Vector3 asked = read(target), offset = read(tool), p = asked - t.origin;
    Vector3 nearest = p;
    unsigned status = 0;
    if (!t.is_usual(p, offset)) {
        status = t.status(p, offset);
        if (status & compensation_refused) return write(asked, command), status;
        nearest = t.known.nearest(p);
    }
    const ErrorModel::Cell cell = t.model.cell(nearest);
    const auto [estimate, slope] = t.model.estimate(order, scales, nearest, offset, cell);
    unsigned capped = 0;
    Vector3 k = {0.0, 0.0, 0.0}, r = t.capped(estimate, capped);
    bool is_in_cell = false;
    int steps_left = t.step_count;
    do {
        const double residual2 = dot(r, r);
        k = k - (r - slope * r);
        if (is_in_cell && residual2 <= t.last_step2 && dot(k, k) <= t.uncapped2) break;
        is_in_cell = cell.holds(p + k);
        const Vector3 at = is_in_cell ? p + k : t.known.nearest(p + k);
        capped = 0;
        r = k + t.capped(t.model.error(order, scales, at, offset, is_in_cell ? cell : t.model.cell(at)), capped);
    } while (--steps_left > 0 && dot(r, r) > iteration_bound * iteration_bound);
    write(asked + k, command);
    return status | capped;
}

template <class Order, class Scales>
STEPDIAG_INLINED unsigned answer_forward(Order order, const Scales& scales, const CompensatorTables& t,
                                         const double* command, const double* tool, double* actual) noexcept {
    if (!are_moderate<3>(command) || !are_moderate<3>(tool)) return write(read(command), actual), compensation_refused;
    const Vector3 asked = read(command), offset = read(tool), p = asked - t.origin;
    if (!t.is_usable(p, offset)) return write(asked, actual), compensation_refused;
    const Vector3 nearest = t.known.nearest(p);
    unsigned capped = 0;
    const Vector3 result =
        asked + t.capped(t.model.error(order, scales, nearest, offset, t.model.cell(nearest)), capped);
    const Vector3 at = result - t.origin;
    const unsigned status = t.inside_of_results.holds(at) ? 0 : t.status_outside(at, t.inside_of_results);
    if (status & compensation_refused) return write(asked, actual), status;
    return write(result, actual), status | capped;
}

// Answers for many positions, rows (count, 3), four at once. `one(i)` answers row i by itself: rows that are left over,
// and those that are not usual. Both return the flags of all statuses.
template <class Order, class Scales, class One>
STEPDIAG_INLINED unsigned answer_errors(Order order, const Scales& scales, const CompensatorTables& t,
                                        std::size_t count, const double* positions, const double* tool, double* errors,
                                        double* orientations, unsigned* statuses, One&& one) noexcept {
    const Vector3 offset = read(tool);
    const bool is_tool_moderate = are_moderate<3>(tool);
    unsigned flags = 0;
    std::size_t i = 0;
    const auto one_by_one = [&] {
        for (std::size_t j = i; j < i + 4; ++j) flags |= one(j);
    };
    for (; i + 4 <= count; i += 4) {
        if (!is_tool_moderate || !are_moderate<12>(positions + 3 * i)) {
            one_by_one();
            continue;
        }
        const Vector3Of<Four> p = read_four(positions + 3 * i) - broadcast<Four>(t.origin);
        if (!t.are_usual(p, offset)) {
            one_by_one();
            continue;
        }
        const auto cell = t.model.cell(p);
        const Vector3Of<Four> e = t.model.error(order, scales, p, offset, cell);
        write_four(e, errors + 3 * i);
        if (orientations) write_four(t.model.orientation(order, p, cell), orientations + 3 * i);
        const FourTruths capped = dot(e, e) > t.largest_correction2;
        for (std::size_t j = 0; j < 4; ++j) {
            const unsigned status = capped[j] ? unsigned(compensation_capped) : 0;
            flags |= status;
            if (statuses) statuses[i + j] = status;
        }
    }
    for (; i < count; ++i) flags |= one(i);
    return flags;
}

// Four at once take the two usual steps of answer_command, whose bounds decide whether these suffice.
template <class Order, class Scales, class One>
STEPDIAG_INLINED unsigned answer_commands(Order order, const Scales& scales, const CompensatorTables& t,
                                          std::size_t count, const double* targets, const double* tool,
                                          double* commands, unsigned* statuses, One&& one) noexcept {
    const Vector3 offset = read(tool);
    const bool is_tool_moderate = are_moderate<3>(tool);
    unsigned flags = 0;
    std::size_t i = 0;
    const auto one_by_one = [&] {
        for (std::size_t j = i; j < i + 4; ++j) flags |= one(j);
    };
    for (; i + 4 <= count; i += 4) {
        if (!is_tool_moderate || !are_moderate<12>(targets + 3 * i)) {
            one_by_one();
            continue;
        }
        const Vector3Of<Four> asked = read_four(targets + 3 * i), p = asked - broadcast<Four>(t.origin);
        if (!t.are_usual(p, offset)) {
            one_by_one();
            continue;
        }
        const auto cell = t.model.cell(p);
        const auto [estimate, slope] = t.model.estimate(order, scales, p, offset, cell);
        const Vector3Of<Four> first = slope * estimate - estimate, at = p + first;
        const Vector3Of<Four> r = first + t.model.error(order, scales, at, offset, cell);
        const Vector3Of<Four> k = first - (r - slope * r), command = asked + k;
        const FourTruths suffice = cell.holds(at) & (dot(r, r) <= t.last_step2) & (dot(k, k) <= t.uncapped2);
        for (std::size_t j = 0; j < 4; ++j) {
            if (!suffice[j]) {
                flags |= one(i + j);
                continue;
            }
            write(lane(command, j), commands + 3 * (i + j));
            if (statuses) statuses[i + j] = 0;
        }
    }
    for (; i < count; ++i) flags |= one(i);
    return flags;
}

// `fused`: with AVX2 and FMA. This is a quarter faster and changes the last digits of an error (1e-16 relative).
Answers answers_for(const Chain& chain, bool fused, bool at_temperature);
bool are_fused_answers_known();  // whether this processor has AVX2 and FMA

std::unique_ptr<CompensatorTables> make_tables(const ParameterTable& table, const std::string& name,
                                               const std::string& chain, const CompensatorOptions& options);

}  // namespace stepdiag
