#include "batch/simd_adjustment.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "adjustment/gauss_newton.hpp"

namespace stepdiag {
namespace {

constexpr int most_steps = 30;
constexpr int accelerated_after = 4;  // steps; the first is too long to tell of later ones
// Limit of the square sum per reading. Above it, the solution may be another minimum than the one next to zero.
constexpr double gross_scatter = 100.0;

using Lanes = double[lane_group];

}  // namespace

SimdStart::SimdStart(const PreparedAdjustment& prepared, const std::vector<std::ptrdiff_t>& input,
                     const std::vector<double>& standard_uncertainty)
    : pattern(prepared),
      input(input),
      jacobian(pattern.solver.equations()),
      factor(pattern.solver.factor()),
      tilt_effects(pattern.problem, pattern.start) {
    for (const AdjustedReading& reading : pattern.problem.readings()) {
        weight.push_back(1.0 / reading.standard_uncertainty);
        value.push_back(reading.value);
    }
    for (const LineSetup& setup : pattern.problem.setups())
        for (const int column : setup.active)
            if (column < setup::laser + 2) angles.push_back(setup.unknown[column]);
    for (const double u : standard_uncertainty) one_over_uncertainty.push_back(u > 0.0 ? 1.0 / u : 0.0);
}

void SimdNumbers::fill(const Eigen::VectorXd& same) {
    for (Eigen::Index i = 0; i < same.size(); ++i) std::fill_n(at(i), lane_group, same[i]);
}

SimdAdjustment::SimdAdjustment(const SimdStart& start)
    : start_(start),
      model_(start.pattern.problem, start.input),
      x_(start.pattern.problem.size() + 1),
      dx_(start.pattern.problem.size() + 1),
      centre_(start.pattern.problem.size()),
      s_(Eigen::Index(start.input.size())),
      r_(Eigen::Index(start.input.size())),
      acceleration_(std::size_t(start.pattern.problem.size()), start.input.size()) {}

// Values are F x, and dx = N^-1 J^T (d reading/u). Computes lane_group rows of F N^-1 J^T at a time.
Eigen::MatrixXd simd_gain(const SimdStart& start, std::size_t readings) {
    const std::vector<LinearForm>& forms = start.pattern.forms;
    Eigen::MatrixXd gain = Eigen::MatrixXd::Zero(Eigen::Index(forms.size()), Eigen::Index(readings));
    const Eigen::Index unknowns = start.pattern.start.size();
    SimdNumbers column(unknowns), row{Eigen::Index(start.input.size())};
    const SimdNumbers none{Eigen::Index(start.input.size())};
    for (std::size_t first = 0; first < forms.size(); first += lane_group) {
        const std::size_t count = std::min(lane_group, forms.size() - first);
        column.fill(Eigen::VectorXd::Zero(unknowns));
        for (std::size_t lane = 0; lane < count; ++lane)
            for (int k = 0; k < forms[first + lane].size; ++k)
                column.at(forms[first + lane].unknown[k])[lane] += forms[first + lane].coefficient[k];
        start.factor.solve(column.data());
        start.jacobian.subtract_product(none.data(), column.data(), row.data());
        for (std::size_t r = 0; r < start.input.size(); ++r)
            for (std::size_t lane = 0; lane < count; ++lane)
                gain(Eigen::Index(first + lane), start.input[r]) = -start.weight[r] * row.at(Eigen::Index(r))[lane];
    }
    return gain;
}

// As long as steps are not combined, the last two changes predict the next ones: steps shrink alternately by more and
// by less, so only the ratio over two steps is steady.
void SimdAdjustment::Progress::add(double largest) {
    constexpr double diverges = 1e4, shrinks = 0.25;
    constexpr int early = 4, late = 12, most_steps_left = 16;
    constexpr double safety = 10.0;  // the first ratios still contain second-order effects
    const double first = change[0];
    change = {largest, change[0], change[1]};
    ++steps;
    if (!std::isfinite(largest) || (steps > 1 && largest > diverges * std::max(1.0, first))) {
        state = failed;
    } else if (largest < settled_tolerance) {
        state = settled;
    } else if (steps >= 3) {
        const double ratio = change[0] / change[2];
        const double left = (change[0] + change[1]) * ratio / (1.0 - ratio);
        if (steps <= accelerated_after && ratio < shrinks && safety * left < settled_tolerance) state = settled;
        // Decides by the mean rate since the early steps, because a full Gauss-Newton step costs more than a step here.
        if (steps == early) at_early = std::max(change[0], change[1]);
        const double rate = std::log(at_early / change[0]) / (steps - early + 1);
        if (state == goes_on && steps >= late && !(std::log(largest / settled_tolerance) < most_steps_left * rate))
            state = failed;
    }
    if (state == goes_on && steps >= most_steps) state = failed;
}

void SimdAdjustment::begin(const double* readings, std::size_t stride) {
    x_.fill(start_.pattern.start);
    std::fill_n(x_.at(start_.pattern.problem.size()), lane_group, 0.0);
    progress_.fill({});
    for (std::size_t lane = 0; lane < lane_group; ++lane)
        if (!has_all_readings(readings, stride, lane)) progress_[lane].state = Progress::lost;
}

// From the pattern's solution, where r differs from the pattern's residuals s by the readings only, and J0^T s = P x.
void SimdAdjustment::first_step(const double* readings, std::size_t stride) {
    s_.fill(start_.pattern.solver.equations().residuals());
    for (std::size_t r = 0; r < start_.input.size(); ++r) {
        const double* reading = readings + std::size_t(start_.input[r]) * stride;
        for (std::size_t i = 0; i < lane_group; ++i)
            r_.at(Eigen::Index(r))[i] = s_.at(Eigen::Index(r))[i] + start_.weight[r] * (reading[i] - start_.value[r]);
    }
    std::fill_n(dx_.data(), lane_group * std::size_t(start_.pattern.start.size() + 1), 0.0);
    start_.jacobian.add_transposed_difference(r_.data(), s_.data(), dx_.data());
    start_.factor.solve(dx_.data());
}

void SimdAdjustment::step(const double* readings, std::size_t stride) {
    const NormalEquations& equations = start_.pattern.solver.equations();
    bool is_valid[lane_group];
    model_.evaluate({x_.data(), readings, stride, s_.data(), r_.data(), dx_.data(), is_valid});
    for (std::size_t lane = 0; lane < lane_group; ++lane)
        if (!is_valid[lane] && progress_[lane].state == Progress::goes_on) progress_[lane].state = Progress::failed;
    for (Eigen::Index j = 0; j < start_.pattern.start.size(); ++j) {
        const double prior = equations.prior_weight()[j], usual = equations.usual_weight()[j];
        if (prior == 0.0 && usual == 0.0) continue;
        const double *x = x_.at(j), *centre = centre_.at(j);
        double* to = dx_.at(j);
        for (std::size_t i = 0; i < lane_group; ++i) to[i] -= prior * x[i] + usual * (x[i] - centre[i]);
    }
    for (const SmoothRow& row : equations.smooth_rows()) {
        Lanes value = {};
        for (int k = 0; k < 3; ++k)
            if (row.unknown[k] != no_unknown)
                for (std::size_t i = 0; i < lane_group; ++i) value[i] += row.coefficient[k] * x_.at(row.unknown[k])[i];
        for (int k = 0; k < 3; ++k)
            if (row.unknown[k] != no_unknown)
                for (std::size_t i = 0; i < lane_group; ++i) dx_.at(row.unknown[k])[i] -= row.coefficient[k] * value[i];
    }
    start_.tilt_effects.divide_transposed(x_.data(), dx_.data());
    start_.jacobian.add_transposed_difference(r_.data(), s_.data(), dx_.data());
    start_.factor.solve(dx_.data());
    start_.jacobian.subtract_product(r_.data(), dx_.data(), s_.data());
    start_.tilt_effects.divide(x_.data(), dx_.data());
}

// The square sum of the residuals before the last step.
void SimdAdjustment::find_square_sum(double* sum) const {
    std::fill_n(sum, lane_group, 0.0);
    for (std::size_t r = 0; r < start_.input.size(); ++r)
        for (std::size_t i = 0; i < lane_group; ++i) sum[i] += r_.at(Eigen::Index(r))[i] * r_.at(Eigen::Index(r))[i];
}

void SimdAdjustment::accelerate() {
    Lanes ready;
    for (std::size_t i = 0; i < lane_group; ++i)
        ready[i] = progress_[i].state == Progress::goes_on && progress_[i].steps >= accelerated_after ? 1.0 : 0.0;
    acceleration_.apply(ready, x_.data(), dx_.data(), s_.data());
}

void SimdAdjustment::move(const double* moves) {
    for (Eigen::Index j = 0; j < start_.pattern.start.size(); ++j) {
        double* x = x_.at(j);
        const double* dx = dx_.at(j);
        for (std::size_t i = 0; i < lane_group; ++i) x[i] = moves[i] != 0.0 ? x[i] + dx[i] : x[i];
    }
}

// Undetermined unknowns are first held at 0, then at the values that were found (solve_from_zero.cpp).
void SimdAdjustment::recentre(std::size_t lane) {
    for (Eigen::Index j = 0; j < start_.pattern.start.size(); ++j) centre_.at(j)[lane] = x_.at(j)[lane];
    progress_[lane] = {};
    progress_[lane].recentred = true;
}

void SimdAdjustment::begin_at_angles(const double* readings, std::size_t stride) {
    first_step(readings, stride);
    for (std::size_t lane = 0; lane < lane_group; ++lane) {
        if (progress_[lane].state != Progress::failed) continue;
        progress_[lane] = {};
        for (Eigen::Index j = 0; j < start_.pattern.start.size(); ++j) {
            x_.at(j)[lane] = start_.pattern.start[j];
            centre_.at(j)[lane] = 0.0;
        }
        for (const int j : start_.angles) x_.at(j)[lane] += dx_.at(j)[lane];
    }
}

void SimdAdjustment::take_steps(const double* readings, std::size_t stride, bool has_first) {
    const bool has_open = !start_.pattern.solver.dependent().empty();
    const auto goes_on = [](const Progress& p) { return p.state == Progress::goes_on; };
    const auto any_goes_on = [&] { return std::any_of(progress_.begin(), progress_.end(), goes_on); };
    for (bool is_first = has_first; any_goes_on(); is_first = false) {
        if (!is_first) step(readings, stride);
        Lanes largest, moves;
        find_largest(start_.pattern.forms, start_.one_over_uncertainty, dx_.data(), largest);
        for (std::size_t lane = 0; lane < lane_group; ++lane) {
            moves[lane] = goes_on(progress_[lane]) ? 1.0 : 0.0;
            if (goes_on(progress_[lane])) progress_[lane].add(largest[lane]), ++counts_[lane].steps;
        }
        if (!is_first && any_goes_on()) accelerate();
        move(moves);
        for (std::size_t lane = 0; has_open && lane < lane_group; ++lane)
            if (moves[lane] != 0.0 && progress_[lane].state == Progress::settled && !progress_[lane].recentred)
                recentre(lane);
    }
}

void SimdAdjustment::adjust(const double* readings, std::size_t stride, double* values, std::size_t value_stride) {
    begin(readings, stride);
    centre_.fill(Eigen::VectorXd::Zero(start_.pattern.start.size()));
    counts_.fill({0, false});
    first_step(readings, stride);
    start_.jacobian.subtract_product(r_.data(), dx_.data(), s_.data());
    take_steps(readings, stride, true);
    if (std::any_of(progress_.begin(), progress_.end(), [](const auto& p) { return p.state == Progress::failed; })) {
        begin_at_angles(readings, stride);
        take_steps(readings, stride, false);
    }
    Lanes square_sum;
    find_square_sum(square_sum);
    for (std::size_t lane = 0; lane < lane_group; ++lane) {
        const bool fits = square_sum[lane] < gross_scatter * double(start_.input.size());
        if (progress_[lane].state == Progress::lost) continue;
        if (progress_[lane].state == Progress::failed || !fits) adjust_in_full(readings, stride, lane);
    }
    put_values(values, value_stride);
}

void SimdAdjustment::adjust_in_one_step(const double* readings, std::size_t stride, double* values,
                                        std::size_t value_stride) {
    begin(readings, stride);
    first_step(readings, stride);
    Lanes all;
    std::fill_n(all, lane_group, 1.0);
    move(all);
    put_values(values, value_stride);
}

void SimdAdjustment::put_values(double* values, std::size_t value_stride) const {
    for (std::size_t e = 0; e < start_.pattern.forms.size(); ++e) {
        const LinearForm& form = start_.pattern.forms[e];
        Lanes value = {};
        for (int k = 0; k < form.size; ++k)
            for (std::size_t i = 0; i < lane_group; ++i) value[i] += form.coefficient[k] * x_.at(form.unknown[k])[i];
        for (std::size_t i = 0; i < lane_group; ++i)
            values[e * value_stride + i] =
                progress_[i].state == Progress::lost ? std::numeric_limits<double>::quiet_NaN() : value[i];
    }
}

bool SimdAdjustment::has_all_readings(const double* readings, std::size_t stride, std::size_t lane) const {
    return std::all_of(start_.input.begin(), start_.input.end(), [&](std::ptrdiff_t input) {
        return std::isfinite(readings[std::size_t(input) * stride + lane]);
    });
}

// Adjusts the set in the same way as a single run.
void SimdAdjustment::adjust_in_full(const double* readings, std::size_t stride, std::size_t lane) {
    if (!in_full_) in_full_ = std::make_unique<PreparedAdjustment>(start_.pattern);
    PreparedAdjustment& own = *in_full_;
    auto& list = own.problem.readings();
    for (std::size_t r = 0; r < list.size(); ++r)
        list[r].value = readings[std::size_t(start_.input[r]) * stride + lane];
    Eigen::VectorXd x = own.start;
    const std::optional<int> steps = solve_from_zero(own.solver, own.determined, x);
    counts_[lane].in_full = true;
    counts_[lane].steps += steps.value_or(0);
    progress_[lane].state = steps ? Progress::settled : Progress::lost;
    for (Eigen::Index j = 0; j < x.size(); ++j) x_.at(j)[lane] = x[j];
}

}  // namespace stepdiag
