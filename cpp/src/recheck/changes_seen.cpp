#include "stepdiag/recheck/changes_seen.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <utility>

#include "adjustment/bordered_band.hpp"
#include "recheck/prediction.hpp"
#include "recheck/same_machine.hpp"
#include "recheck/told_changes.hpp"
#include "recheck/wrong_readings.hpp"
#include "stepdiag/core/error.hpp"

namespace stepdiag {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// Of all set-ups below each other, a row for each reading.
struct ToldByReadings {
    MatrixXd in_common;  // by the calibration's covariance and other uncertain inputs: by the root, times its transpose
    MatrixXd tested;     // by slopes that the calibration does not determine, and by the changes
    VectorXd free_unknowns;  // by set-up: of those without a prior, how many the readings tell
};

// A set-up of one line: derivatives of its readings, all in units of standard uncertainties, and 1/u^2 of its priors.
using Rows = Prediction::Derivatives;

// M^1/2 with M = I - B (B^T B + W)^-1 B^T: readings less what the set-up takes of them.
MatrixXd without_setup(const MatrixXd& by_setup, const VectorXd& weight, const MatrixXd& of_readings) {
    constexpr double open = 1e-12;  // of an unknown scaled to 1: no reading tells it
    MatrixXd normal = by_setup.transpose() * by_setup;
    normal.diagonal() += weight;
    const VectorXd unit = normal.diagonal().unaryExpr([](double d) { return d > 0.0 ? 1.0 / std::sqrt(d) : 0.0; });
    const Eigen::SelfAdjointEigenSolver<MatrixXd> parts(unit.asDiagonal() * normal * unit.asDiagonal());
    const VectorXd root = parts.eigenvalues().unaryExpr([](double v) { return v > open ? 1.0 / std::sqrt(v) : 0.0; });
    const MatrixXd taken = by_setup * unit.asDiagonal() * parts.eigenvectors() * root.asDiagonal();
    const Eigen::SelfAdjointEigenSolver<MatrixXd> shares(taken.transpose() * taken);
    const VectorXd less = shares.eigenvalues().unaryExpr(
        [](double s) { return s > open ? (1.0 - std::sqrt(std::max(0.0, 1.0 - s))) / s : 0.5; });
    const MatrixXd along = taken * shares.eigenvectors();
    return of_readings - along * (less.asDiagonal() * (along.transpose() * of_readings));
}

double count_free(const Rows& rows, const VectorXd& weight) {
    MatrixXd normal = rows.by_setup.transpose() * rows.by_setup;
    normal.diagonal() += weight;
    const MatrixXd alone = normal.ldlt().solve(MatrixXd::Identity(weight.size(), weight.size()));
    double count = 0.0;
    for (Index j = 0; j < weight.size(); ++j)
        if (rows.is_free[std::size_t(j)]) count += 1.0 - weight[j] * alone(j, j);
    return count;
}

}  // namespace

struct ChangesSeen::State {
    std::vector<ChangeTerm> terms;
    VectorXd prior;  // by term
    MatrixXd shape;
    bool one_setup_per_line;
    Index first_tested, tested;  // columns of the root: open slopes, and the changes after them
    std::vector<Rows> setups;
    std::vector<Index> start;                                           // by set-up, and one beyond
    std::map<std::pair<std::string, bool>, std::vector<int>> of_lines;  // by name, and whether it is a scale line
    std::map<double, ToldByReadings> told;                              // by the share of the priors

    const ToldByReadings& told_with(double share_of_priors);
};

const ToldByReadings& ChangesSeen::State::told_with(double share_of_priors) {
    const auto [found, is_new] = told.try_emplace(share_of_priors);
    if (!is_new) return found->second;
    ToldByReadings& told = found->second;
    const Index after = setups.front().by_baseline.cols() - first_tested - tested;
    MatrixXd transposed(first_tested + after, start.back());
    told.tested.resize(start.back(), tested);
    told.free_unknowns.resize(Index(setups.size()));
    for (std::size_t k = 0; k < setups.size(); ++k) {
        const VectorXd weight = share_of_priors * setups[k].weight;
        const MatrixXd rows = without_setup(setups[k].by_setup, weight, setups[k].by_baseline);
        auto columns = transposed.middleCols(start[k], rows.rows());
        columns << rows.leftCols(first_tested).transpose(), rows.rightCols(after).transpose();
        told.tested.middleRows(start[k], rows.rows()) = rows.middleCols(first_tested, tested);
        told.free_unknowns[Index(k)] = count_free(setups[k], weight);
    }
    told.in_common.setZero(start.back(), start.back());
    add_square(transposed, told.in_common);
    return told;
}

ChangesSeen::ChangesSeen(const Calibration& baseline, const Measurement& run, const Plan& plan, const Chain& chain,
                         const Eigen::Vector3d& tool, const HeadCalibrations& heads, const AdjustmentOptions& options,
                         const ChangePriors& priors)
    : state_(std::make_shared<State>()) {
    const AdjustmentProblem problem = problem_of_known_machine(baseline, run, plan, chain, tool, heads, options);
    const Baseline changing(baseline, priors, read_positions(problem));
    State& state = *state_;
    state.terms = changing.changes();
    state.prior = priors_of(changing.changes());
    state.shape = changing.shape();
    state.one_setup_per_line = options.one_setup_per_line;
    state.first_tested = changing.own_columns();
    state.tested = changing.root().cols() - changing.own_columns();
    Prediction prediction(problem, changing);
    state.setups = prediction.derivatives();
    state.start.push_back(0);
    for (std::size_t k = 0; k < state.setups.size(); ++k) {
        const LineSetup& setup = problem.setups()[k];
        state.of_lines[{setup.line.name(), setup.is_scale_line}].push_back(int(k));
        state.start.push_back(state.start.back() + state.setups[k].by_setup.rows());
    }
}

const std::vector<ChangeTerm>& ChangesSeen::terms() const { return state_->terms; }
const Eigen::MatrixXd& ChangesSeen::shape() const { return state_->shape; }

// Repeated readings of the same set-up are as good as one of a smaller uncertainty; of different ones their information
// adds up.
SeenChanges ChangesSeen::by(const std::vector<ChosenLine>& lines, int repeats, double alpha, double power) {
    State& state = *state_;
    if (lines.empty()) throw InvalidArgument("lines: expected at least one");
    if (repeats < 1) throw InvalidArgument("repeats: expected at least 1, got " + std::to_string(repeats));
    const ToldByReadings& told = state.told_with(state.one_setup_per_line ? 1.0 / repeats : 1.0);
    std::vector<int> chosen;
    for (const ChosenLine& line : lines) {
        const auto found = state.of_lines.find({line.name, line.is_scale_line});
        if (found == state.of_lines.end()) throw InvalidArgument("lines: the run has no line \"" + line.name + "\"");
        chosen.insert(chosen.end(), found->second.begin(), found->second.end());
    }
    Index rows = 0;
    double free = 0.0;
    for (const int k : chosen) {
        rows += state.setups[std::size_t(k)].by_setup.rows();
        free += (state.one_setup_per_line ? 1 : repeats) * told.free_unknowns[k];
    }
    MatrixXd matrix(rows, rows), tested(rows, state.tested);
    Index row = 0;
    for (const int i : chosen) {
        const Index first = state.start[std::size_t(i)], height = state.start[std::size_t(i) + 1] - first;
        tested.middleRows(row, height) = told.tested.middleRows(first, height);
        Index column = 0;
        for (const int j : chosen) {
            const Index at = state.start[std::size_t(j)], width = state.start[std::size_t(j) + 1] - at;
            auto block = matrix.block(row, column, height, width);
            if (i >= j) block = told.in_common.block(first, at, height, width);
            else block = told.in_common.block(at, first, width, height).transpose();
            column += width;
        }
        row += height;
    }
    matrix *= double(repeats);
    matrix.diagonal().array() += 1.0;
    const BorderedFactor factor(dense_band(matrix, int(rows % BorderedBand::block_size)), 0.0);  // none is held
    MatrixXd information(state.tested, state.tested);
    for (Index begin = 0; begin < state.tested; begin += BorderedFactor::sides) {
        const Index count = std::min<Index>(BorderedFactor::sides, state.tested - begin);
        BorderedFactor::Sides weighted = BorderedFactor::Sides::Zero(rows, BorderedFactor::sides);
        weighted.leftCols(count) = tested.middleCols(begin, count);
        factor.solve(weighted);
        information.middleCols(begin, count) = double(repeats) * tested.transpose() * weighted.leftCols(count);
    }
    information = (0.5 * (information + information.transpose())).eval();
    const Eigen::SelfAdjointEigenSolver<MatrixXd> parts(information, Eigen::EigenvaluesOnly);
    const auto seen_at_all = (parts.eigenvalues().array() >= least_information).count();
    if (repeats * rows - std::lround(free) - seen_at_all < 1) refuse_few_readings();

    // Of the changes, the open slopes being estimated with them: they are the last ones of the factor.
    information.diagonal().array() += 1.0;
    const Eigen::LLT<MatrixXd> with_priors(information);
    const Index count = state.prior.size();
    const MatrixXd last = with_priors.matrixLLT().bottomRightCorner(count, count).triangularView<Eigen::Lower>();
    const ToldChanges seen(last * last.transpose() - MatrixXd::Identity(count, count));
    MatrixXd root = state.prior.asDiagonal();
    last.triangularView<Eigen::Lower>().solveInPlace(root);
    return {smallest_changes(seen.combinations(VectorXd::Zero(count)), state.prior, alpha, power),
            root.transpose() * root};
}

}  // namespace stepdiag
