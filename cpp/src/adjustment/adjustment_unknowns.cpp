// The order and the weight of an adjustment's unknowns.
#include <algorithm>
#include <cmath>
#include <tuple>

#include "adjustment/adjustment_problem.hpp"
#include "adjustment/setup_priors.hpp"
#include "stepdiag/core/error.hpp"

namespace stepdiag {
namespace {

constexpr int largest_border = 10'000;  // a dense matrix of them: 800 MB, minutes

// The frame choice: straightnesses that are 0 at the end of travel and have no squareness to take their slope.
bool is_zero_at_end(Axis axis, int component) {
    const FunctionId id{axis, Component(component)};
    if (!id.is_straightness()) return false;
    return std::none_of(all_squarenesses.begin(), all_squarenesses.end(), [&](Squareness s) {
        return squareness_term(s).axis == axis && squareness_term(s).component == component;
    });
}

}  // namespace

void AdjustmentProblem::number_unknowns(const AdjustmentOptions& options) {
    const int steps = plan_.steps();
    std::vector<int> banded;
    for (std::size_t i = 0; i < nodes_.size(); ++i)
        if (nodes_[i].node > 0 && nodes_[i].node < steps) banded.push_back(int(i));
    const auto fold = [&](int i) {
        const AxisNode& n = nodes_[i];
        return std::tuple(std::min(n.node, steps - n.node), index(n.axis), n.node, n.negative);
    };
    std::sort(banded.begin(), banded.end(), [&](int i, int j) { return fold(i) < fold(j); });
    for (std::size_t b = 0; b < banded.size(); ++b) {
        AxisNode& node = nodes_[banded[b]];
        node.block = int(b);
        for (int c = 0; c < 6; ++c)
            if (c < 3 || options.rotations) node.unknown[c] = int(6 * b) + c;
    }
    const int banded_unknowns = int(6 * banded.size());
    for (AxisNode& node : nodes_) {
        if (node.block != no_unknown) continue;
        for (int c = 0; c < 6; ++c)
            if ((c < 3 || options.rotations) && (node.negative || !is_zero_at_end(node.axis, c)))
                node.unknown[c] = banded_unknowns + border_++;
    }
    for (LineSetup& setup : setups_)
        for (int c = 0; c < int(setup.prior.size()); ++c)
            if (setup.prior[c] != fixed_unknown) {
                setup.unknown[c] = banded_unknowns + border_++;
                setup.active.push_back(c);
            }

    if (border_ > largest_border)
        throw InvalidArgument("adjustment: " + std::to_string(setups_.size()) + " set-ups have more than " +
                              std::to_string(largest_border) +
                              " unknowns; where runs of a line have one set-up in common, say so (one_setup_per_line)");

    reach_.resize(banded.size());
    for (std::size_t b = 0; b < banded.size(); ++b) reach_[b] = int(b);
    const auto couple = [&](int i, int j) {
        if (i == no_unknown || j == no_unknown) return;
        const int a = nodes_[i].block, b = nodes_[j].block;
        if (a != no_unknown && b != no_unknown)
            reach_[std::min(a, b)] = std::max(reach_[std::min(a, b)], std::max(a, b));
    };
    for (const AdjustedPoint& point : points_)
        for (int a = 0; a < 3; ++a) couple(point.node[a], point.node[(a + 1) % 3]);
    for (const Axis axis : all_axes) {
        const auto &both = node_at_[2 * index(axis)], &negative = node_at_[2 * index(axis) + 1];
        for (int k = 0; k <= steps; ++k) couple(both[k], negative[k]);
    }
    if (options.smoothness)
        for (const auto& chain : node_chains())
            for (std::size_t k = 0; k + 1 < chain.size(); ++k) {
                couple(chain[k], chain[k + 1]);
                if (k + 2 < chain.size()) couple(chain[k], chain[k + 2]);
            }
    for (std::size_t b = 1; b < reach_.size(); ++b) reach_[b] = std::max(reach_[b], reach_[b - 1]);

    sort_points();

    weigh_unknowns();
}

void AdjustmentProblem::weigh_unknowns() {
    constexpr double metre = 1e3;                                 // mm
    constexpr double usual_translation = 0.1, usual_turn = 3e-4;  // of an axis, mm and rad
    constexpr double usual_angle = 2e-3, usual_psd_zero = 10.0;   // of a set-up, rad and mm
    prior_.assign(size(), free_unknown);
    usual_.assign(size(), usual_translation);
    change_scale_.assign(size(), 1.0 / metre);
    for (const AxisNode& node : nodes_)
        for (int c = 3; c < 6; ++c)
            if (node.unknown[c] != no_unknown) {
                usual_[node.unknown[c]] = usual_turn;
                change_scale_[node.unknown[c]] = 1.0;
            }
    for (const LineSetup& setup : setups_)
        for (const int c : setup.active) {
            const int j = setup.unknown[c];
            prior_[j] = setup.prior[c];
            const bool angle = c < setup::distance_constant;
            const bool psd_zero = c == setup::psd_zero || c == setup::psd_zero + 1;
            usual_[j] = angle ? usual_angle : psd_zero ? usual_psd_zero : free_unknown;
            if (angle || c == setup::roll || c == setup::gain || c == setup::cosine) change_scale_[j] = 1.0;
        }
}

int AdjustmentProblem::informative_priors() const {
    int count = 0;
    for (const LineSetup& setup : setups_)
        for (const int c : setup.active) {
            const auto of = setup_column_name(c);
            count += setup.prior[c] < (of ? broadest_prior(of->quantity) : free_unknown);
        }
    return count;
}

// In the order of the band, so that who goes through the points goes through the matrix once.
void AdjustmentProblem::sort_points() {
    const auto first_block = [&](const AdjustedPoint& point) {
        int first = blocks();
        for (const int node : point.node)
            if (node != no_unknown && nodes_[node].block != no_unknown) first = std::min(first, nodes_[node].block);
        return first;
    };
    std::stable_sort(points_.begin(), points_.end(),
                     [&](const AdjustedPoint& a, const AdjustedPoint& b) { return first_block(a) < first_block(b); });
    std::vector<AdjustedReading> sorted;
    sorted.reserve(readings_.size());
    for (AdjustedPoint& point : points_) {
        const int first = int(sorted.size());
        for (int r = point.first_reading; r < point.end_reading; ++r) sorted.push_back(readings_[r]);
        point.first_reading = first;
        point.end_reading = int(sorted.size());
    }
    readings_ = std::move(sorted);
}

}  // namespace stepdiag
