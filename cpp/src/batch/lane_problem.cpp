// The adjustment's problem, derivatives and factor as plain numbers in the order in which lanes go through them.
#include <algorithm>

#include "batch/simd_model.hpp"
#include "batch/simd_solver.hpp"

namespace stepdiag {

LaneProblem::LaneProblem(const AdjustmentProblem& problem, const std::vector<std::ptrdiff_t>& input)
    : kind(ChannelKind::ideal), unknowns(problem.size()), channels(0), tool(problem.tool()), setup_size(0) {
    const auto place = [&](int unknown) { return unknown == no_unknown ? unknowns : unknown; };
    for (const LineSetup& setup : problem.setups()) {
        const ChannelModel& model = setup.model;
        kind = model.kind();
        channels = std::max(channels, model.channels());
        setup_size = std::max(setup_size, model.setup_size());
        Setup& to = setups.emplace_back(Setup{{}, model.machine_R_line(), model.origin(), &model.head()});
        for (const int unknown : setup.unknown) to.unknown.push_back(place(unknown));
    }
    for (const AxisNode& node : problem.nodes()) {
        Node& to = nodes.emplace_back();
        for (int c = 0; c < 6; ++c) to.unknown[c] = place(node.unknown[c]);
        to.position = {};
        to.position[index(node.axis)] = node.position;
    }
    nodes.push_back({{unknowns, unknowns, unknowns, unknowns, unknowns, unknowns}, {}});  // home
    const auto& order = problem.chain().order();
    for (int p = 0; p < 3; ++p) carries_workpiece[p] = problem.chain().carries_workpiece(order[p]);
    for (const AdjustedPoint& point : problem.points()) {
        Point& to = points.emplace_back();
        to = {point.setup, {}, point.place.travel, point.place.time, int(of_points.size())};
        for (int p = 0; p < 3; ++p) {
            const int node = point.node[index(order[p])];
            to.node[p] = node == no_unknown ? int(nodes.size()) - 1 : node;
        }
        of_points.resize(of_points.size() + channels, {no_reading, 0, 0.0});
        for (int r = point.first_reading; r < point.end_reading; ++r) {
            const AdjustedReading& reading = problem.readings()[r];
            of_points[to.first_channel + reading.channel] = {r, input[r], 1.0 / reading.standard_uncertainty};
        }
    }
}

LaneJacobian::LaneJacobian(const NormalEquations& equations) {
    for (const AdjustedPoint& point : equations.problem().points())
        for (int first = point.first_reading; first < point.end_reading; first += most_rows) {
            const int rows = std::min(most_rows, point.end_reading - first);
            Bundle bundle{first, rows, 0, numbers_.unknown.size(), numbers_.derivative.size()};
            const auto common = equations.row(point, first);
            for (int k = 0; k < common.size; ++k) {
                if (common.unknown[k] == no_unknown) continue;
                numbers_.unknown.push_back(common.unknown[k]);
                for (int i = 0; i < rows; ++i)
                    numbers_.derivative.push_back(equations.row(point, first + i).derivative[k]);
                ++bundle.unknowns;
            }
            numbers_.bundles.push_back(bundle);
        }
}

LaneFactor::LaneFactor(const BorderedFactor& factor) {
    constexpr int six = BorderedBand::block_size;
    const BorderedBand& l = factor.band();
    numbers_.border = l.border();
    for (int column = 0; column < l.blocks(); ++column) {
        numbers_.rows.push_back(six * (l.reach(column) - column));
        for (int row = column; row <= l.reach(column); ++row)
            for (int i = 0; i < six; ++i)
                for (int k = 0; k < six; ++k) numbers_.column.push_back(l.block(row, column)(i, k));
        for (int i = 0; i < l.border(); ++i)
            for (int k = 0; k < six; ++k) numbers_.column.push_back(l.border_rows(column)(i, k));
    }
    const auto corner = factor.corner_factor();
    numbers_.corner_order.assign(factor.corner_order().begin(), factor.corner_order().begin() + corner.cols());
    for (int k = 0; k < corner.cols(); ++k)
        for (int i = 0; i < corner.rows(); ++i) numbers_.corner.push_back(i == k ? 1.0 / corner(i, k) : corner(i, k));
}

}  // namespace stepdiag
