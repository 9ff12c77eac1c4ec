#include "controller/axis_table.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "stepdiag/core/error.hpp"

namespace stepdiag {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

// A linear piece of a function: value and slope at its start.
struct Piece {
    double value, slope;
};

// The piece of `interpolate` from `start` to the next boundary. The slope follows from the function's own nodes,
// because two boundaries can be almost equal.
Piece piece_of(const FunctionTable& table, double start) {
    const auto after = std::upper_bound(table.position.begin(), table.position.end(), start);
    if (after == table.position.begin()) return {table.value.front(), 0.0};
    if (after == table.position.end()) return {table.value.back(), 0.0};
    const auto j = after - table.position.begin();
    const double slope = (table.value[j] - table.value[j - 1]) / (table.position[j] - table.position[j - 1]);
    return {table.value[j - 1] + slope * (start - table.position[j - 1]), slope};
}

// Tables whose mean a compensator for `approach` uses.
std::vector<const FunctionTable*> tables_of(const ErrorMap& errors, FunctionId id, CompensatedApproach approach) {
    const auto& positive = errors.table().functions[id.index()];
    const auto& negative = errors.table().negative_functions[id.index()];
    if (!positive) return {};
    if (!negative || approach == CompensatedApproach::positive) return {&*positive};
    if (approach == CompensatedApproach::negative) return {&*negative};
    return {&*positive, &*negative};
}

std::array<std::vector<const FunctionTable*>, 6> tables_of(const ErrorMap& errors, Axis axis,
                                                           CompensatedApproach approach) {
    std::array<std::vector<const FunctionTable*>, 6> tables;
    for (int c = 0; c < 6; ++c) tables[c] = tables_of(errors, {axis, Component(c)}, approach);
    return tables;
}

std::vector<double> boundaries(const std::array<std::vector<const FunctionTable*>, 6>& functions, double edge) {
    std::vector<double> all = {0.0, edge};
    for (const auto& tables : functions)
        for (const FunctionTable* table : tables)
            for (const double node : table->position)
                if (0.0 < node && node < edge) all.push_back(node);
    std::sort(all.begin(), all.end());
    all.erase(std::unique(all.begin(), all.end()), all.end());
    return all;
}

// Sets the coefficients of 1 - |theta|^2 / 6. The next term of sin|theta| / |theta| is small enough: see add_turn.
void set_sine(AxisInterval& interval) {
    const Four value2 = interval.theta * interval.theta, product = interval.theta * interval.theta_slope,
               slope2 = interval.theta_slope * interval.theta_slope;
    interval.theta[3] = 1.0 - (value2[0] + value2[1] + value2[2]) / 6.0;
    interval.delta[3] = -(product[0] + product[1] + product[2]) / 3.0;
    interval.delta_slope[3] = -(slope2[0] + slope2[1] + slope2[2]) / 6.0;
}

// The interval from the boundary `start` on, with its functions continued to the position 0.
AxisInterval interval_of(const std::array<std::vector<const FunctionTable*>, 6>& functions, const ErrorMap& errors,
                         Axis axis, double start) {
    std::array<Piece, 6> sum = {};
    for (int c = 0; c < 6; ++c)
        for (const FunctionTable* table : functions[c]) {
            const double share = 1.0 / double(functions[c].size());
            const Piece piece = piece_of(*table, start);
            sum[c].value += share * (piece.value - piece.slope * start);
            sum[c].slope += share * piece.slope;
        }
    for (const Squareness s : all_squarenesses) {
        const SquarenessTerm term = squareness_term(s);
        if (term.axis != axis) continue;
        const double slope = term.sign * errors.squareness(s);
        sum[term.component].slope += slope;
    }
    AxisInterval interval;
    for (int c = 0; c < 3; ++c) {
        interval.delta[c] = sum[c].value, interval.delta_slope[c] = sum[c].slope;
        interval.theta[c] = sum[c + 3].value, interval.theta_slope[c] = sum[c + 3].slope;
    }
    set_sine(interval);
    return interval;
}

}  // namespace

AxisTable::AxisTable(const ErrorMap& errors, Axis axis, double edge, double margin, CompensatedApproach approach) {
    const auto functions = tables_of(errors, axis, approach);
    const std::vector<double> bounds = boundaries(functions, edge);
    if (bounds.size() > largest_node_count)
        throw InvalidArgument(std::string("axis ") + letter(axis) + ": expected at most " +
                              std::to_string(largest_node_count) + " different nodes, got " +
                              std::to_string(bounds.size()));
    const std::size_t count = bounds.size() - 1;
    for (std::size_t i = 0; i < count; ++i) intervals_.push_back(interval_of(functions, errors, axis, bounds[i]));
    start_ = bounds;
    start_.front() = -margin, start_.back() = std::nextafter(edge + margin, infinity);
    // Aims at no more than one boundary per bucket, with at most this many buckets per interval.
    constexpr std::size_t buckets_per_interval = 8;
    std::size_t most = 2;
    for (std::size_t factor = 1; factor <= buckets_per_interval && most > 1; factor *= 2)
        most = make_buckets(factor * count, edge, margin);
    for (largest_step_ = 1; 2 * largest_step_ <= most;) largest_step_ *= 2;
    start_.resize(start_.size() + 2 * largest_step_, infinity);
}

std::size_t AxisTable::make_buckets(std::size_t count, double edge, double margin) {
    // Buckets are slightly wider than the interval. Equidistant boundaries are then at the end of a bucket for any
    // rounding, and `find` has one answer throughout a bucket.
    constexpr double wider = 1.0 + 1e-14;
    buckets_per_mm_ = double(count) / (edge * wider);
    bucket_of_home_ = std::ceil(margin * buckets_per_mm_);
    first_.assign(bucket_of(edge + margin) + 2, 0);       // one more, because the rounding of `find` may differ
    std::vector<std::uint32_t> inside(first_.size(), 0);  // boundaries in each bucket
    for (std::size_t i = 1; i < intervals_.size(); ++i) ++inside[bucket_of(start_[i])];
    for (std::size_t bucket = 1; bucket < first_.size(); ++bucket)
        first_[bucket] = first_[bucket - 1] + inside[bucket - 1];
    // One boundary per bucket is not sufficient. It must be at the end of the bucket; otherwise the bucket contains
    // parts of two intervals.
    is_regular_ = margin == 0.0 && count == intervals_.size();
    for (std::size_t i = 1; i < count && is_regular_; ++i)
        is_regular_ = first_[i] == i && std::abs(start_[i] - edge * double(i) / double(count)) <= 1e-14 * edge;
    return *std::max_element(inside.begin(), inside.end());
}

}  // namespace stepdiag
