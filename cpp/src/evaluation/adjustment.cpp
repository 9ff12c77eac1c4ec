#include "stepdiag/evaluation/adjustment.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>
#include <unsupported/Eigen/SpecialFunctions>

#include "evaluation/adjustment_result.hpp"
#include "evaluation/smoothness.hpp"
#include "stepdiag/core/error.hpp"
#include "stepdiag/core/units.hpp"

namespace stepdiag {
namespace {

void check_options(const AdjustmentOptions& options, const Plan& plan) {
    if (!(options.outlier_probability >= 0.0 && options.outlier_probability <= 0.5))
        throw InvalidArgument("adjustment outlier_probability: expected a probability from 0 to 0.5");
    if (const auto& s = options.smoothness)
        for (const auto& [key, value] : {std::pair("translation", s->translation), std::pair("rotation", s->rotation)})
            if (!(value == 0.0 || (value >= 1e-9 && value <= 1e6)))
                throw InvalidArgument(std::string("smoothness ") + key +
                                      ": expected 0 or a deviation of 1e-9 to 1e6 mm or rad");
    for (const auto& entry : options.setup_by_line)
        if (!plan.contains(Line::parse(entry.first)))
            throw InvalidArgument("adjustment: line \"" + entry.first + "\" is not in the plan");
}

std::array<double, function_count> smoothness_at_start(const AdjustmentOptions& options) {
    if (!options.smoothness || options.smoothness->cross_validated) return {};
    return given_deviations(*options.smoothness);
}

int degrees_of_freedom(const AdjustmentSolver& solver) {
    const AdjustmentProblem& problem = solver.equations().problem();
    int count = int(solver.equations().smooth_rows().size()) - problem.unknowns() + int(solver.dependent().size());
    for (const AdjustedReading& reading : problem.readings()) count += reading.used();
    count += problem.informative_priors();
    return count;
}

// Leaves out readings that do not fit, the worst first (W. Baarda's data snooping, each reading against what the others
// say of it), and adjusts again; puts them back where they are too many.
class OutlierSearch {
public:
    OutlierSearch(AdjustmentProblem& problem, AdjustmentSolver& solver, const AdjustmentOptions& options)
        : problem_(problem), solver_(solver), inverse_(solver.equations().matrix()) {
        const double count = double(problem.readings().size());
        limit_ = options.outlier_probability > 0.0 ? -Eigen::numext::ndtri(options.outlier_probability / (2.0 * count))
                                                   : std::numeric_limits<double>::infinity();
        most_ = std::max(10, int(problem.readings().size() / 50));
        roughness_ = second_differences(
            problem, given_deviations({options.uncertainty.distance, options.uncertainty.tilt, false}));
    }

    // From zero. A reading that is a thousand uncertainties off may keep Gauss-Newton from settling, or settle it far
    // away: where readings scatter that much, the worst is left out by what the first step says, which is linear, and
    // the adjustment begins anew. Returns the number of steps of the one that settled.
    int solve_without_gross(const std::vector<bool>& determined, Eigen::VectorXd& x) {
        constexpr double gross_scatter = 25.0;  // of the square sum a reading
        constexpr double gross_likeness = 0.9;  // the first step is not exact
        // More are no slips of single readings, but a head that lost count, or a wrong plan.
        constexpr int most_gross = 5;
        for (bool search = true;;) {
            const std::optional<int> count = solve_from_zero(determined, x);
            const double scatter = solver_.equations().square_sum(x) / double(problem_.readings().size());
            if (count && (scatter < gross_scatter || !search)) return *count;
            Eigen::VectorXd first = Eigen::VectorXd::Zero(x.size());
            if (search) solver_.try_solve(first, 1);
            if (search && found_ < most_gross && leave_out(worst_readings(first, gross_likeness), first)) continue;
            if (!search)
                throw InvalidArgument(
                    "adjustment: finds no machine and set-up that explain the readings; check the plan, the head, and "
                    "units and signs of the readings");
            // It is not a few readings that do not fit: all stay, and chi-square tells.
            search = false;
            for (AdjustedReading& reading : problem_.readings()) reading.outlier = reading.suspect = 0;
            found_ = 0;
            looked_at_.reset();
        }
    }

    // All that remain, after the adjustment without the gross ones.
    void run(Eigen::VectorXd& x) {
        constexpr double likeness = 0.99;
        const int gross = found_;
        const Eigen::VectorXd before = x;
        for (;;) {
            const std::vector<std::size_t> worst = worst_readings(x, likeness);
            if (worst.empty()) return;
            if (!leave_out(worst, x) || !solver_.try_solve(x)) break;
        }
        for (AdjustedReading& reading : problem_.readings()) {
            if (reading.outlier > gross) reading.outlier = 0;
            if (reading.suspect > gross) reading.suspect = 0;
        }
        x = before;
        looked_at_.reset();
    }

    // Residuals and the inverse at x, and the equations linearised there.
    void look(const Eigen::VectorXd& x) {
        if (looked_at_ && *looked_at_ == x) return;
        solver_.refresh(x);
        solver_.factor().selected_inverse(inverse_);
        looked_at_ = x;
        residuals_ = reading_residuals(solver_.equations(), inverse_);
    }
    const std::vector<ReadingResidual>& residuals() const { return residuals_; }
    const BorderedBand& inverse() const { return inverse_; }

private:
    // What is open is assumed to be at 0 first, and then, because that pulls at what is determined by its square, where
    // it came out.
    std::optional<int> solve_from_zero(const std::vector<bool>& determined, Eigen::VectorXd& x) {
        x.setZero();
        solver_.equations().assume_usual(determined, x);
        std::optional<int> count = solver_.try_solve(x);
        if (solver_.dependent().empty()) return count;
        if (!count) {
            // Its second order may lead astray: then it is held.
            constexpr double hold = 1e-4;
            x.setZero();
            solver_.equations().assume_usual(determined, x, hold);
            return solver_.try_solve(x);
        }
        Eigen::VectorXd again = x;
        solver_.equations().assume_usual(determined, x);
        const std::optional<int> more = solver_.try_solve(again);
        if (!more) return count;
        x = again;
        return *count + *more;
    }

    bool leave_out(const std::vector<std::size_t>& worst, const Eigen::VectorXd& x) {
        if (worst.empty() || found_ == most_) return false;
        ++found_;
        looked_at_.reset();
        for (const std::size_t r : worst) problem_.readings()[r].suspect = found_;
        AdjustedReading& reading = problem_.readings()[roughest(worst, x)];
        reading.suspect = 0;
        reading.outlier = found_;
        return true;
    }

    // Of readings that no other tells apart, the one without which the error functions are smoothest.
    std::size_t roughest(const std::vector<std::size_t>& candidates, const Eigen::VectorXd& x) {
        if (candidates.size() == 1) return candidates.front();
        double least = std::numeric_limits<double>::infinity();
        std::size_t chosen = candidates.front();
        for (const std::size_t r : candidates) {
            problem_.readings()[r].outlier = 1;
            solver_.factorize(x);
            Eigen::VectorXd without = solver_.equations().gradient(x);
            problem_.readings()[r].outlier = 0;
            solver_.factor().solve(without);
            without += x;
            double roughness = 0.0;
            for (const SmoothRow& row : roughness_) roughness += std::pow(row.value(without), 2);
            if (roughness >= least) continue;
            least = roughness;
            chosen = r;
        }
        return chosen;
    }

    // The reading that fits worst, if it is an outlier, and those that no other reading tells from it.
    std::vector<std::size_t> worst_readings(const Eigen::VectorXd& x, double alike) {
        look(x);
        const auto& residuals = residuals_;
        const double square_sum = solver_.equations().square_sum(x);
        const int freedom = degrees_of_freedom(solver_);
        double worst = 0.0;
        for (const ReadingResidual& residual : residuals) worst = std::max(worst, size(residual));
        // Where all readings scatter more than was said, the worst is measured against that.
        const double others = freedom > 1 ? std::max(1.0, (square_sum - worst * worst) / (freedom - 1)) : 1.0;
        std::vector<std::size_t> found;
        if (worst > limit_ * std::sqrt(others))
            for (std::size_t r = 0; r < residuals.size(); ++r)
                if (size(residuals[r]) >= alike * worst) found.push_back(r);
        return found;
    }
    static double size(const ReadingResidual& residual) {
        return residual.used() ? std::abs(residual.normalised) : 0.0;
    }

    AdjustmentProblem& problem_;
    AdjustmentSolver& solver_;
    double limit_;
    int most_, found_ = 0;
    std::vector<ReadingResidual> residuals_;
    BorderedBand inverse_;
    std::optional<Eigen::VectorXd> looked_at_;
    std::vector<SmoothRow> roughness_;
};

// No machine is off by a hundredth of its travel: then it is not the machine that the readings tell of.
void refuse_absurd(const Calibration& calibration) {
    for (int i = 0; i < function_count; ++i) {
        const FunctionId id = FunctionId::at(i);
        if (!calibration.functions[i] || id.is_rotation()) continue;
        for (const double value : calibration.functions[i]->value)
            if (std::abs(value) > 1e-2 * calibration.volume[index(id.axis)])
                throw InvalidArgument(
                    "adjustment: " + id.name() + " comes out as " + std::to_string(value) +
                    " mm, more than a hundredth of the travel; expected distances in mm that grow along "
                    "the line, half of the way to the mirror and back");
    }
}

std::vector<std::string> describe(const Observability& observability, const Eigen::VectorXd& x,
                                  const BorderedBand& inverse) {
    std::vector<std::string> sentences;
    for (const KnownCombination& combination : observability.combinations()) {
        std::ostringstream text;
        text.precision(4);
        text << combination.text << " = " << combination.form.value(x) / microradian << " +- "
             << std::sqrt(std::max(0.0, combination.form.variance(inverse))) / microradian
             << (combination.is_angle ? " urad" : " um/m");
        sentences.push_back(text.str());
    }
    return sentences;
}

}  // namespace

double Adjustment::variance_factor() const {
    return degrees_of_freedom > 0 ? weighted_square_sum / degrees_of_freedom : 1.0;
}

std::vector<std::size_t> Adjustment::outliers() const {
    std::vector<std::size_t> list;
    for (std::size_t r = 0; r < residuals.size(); ++r)
        if (!residuals[r].used()) list.push_back(r);
    std::stable_sort(list.begin(), list.end(),
                     [&](std::size_t i, std::size_t j) { return residuals[i].outlier < residuals[j].outlier; });
    return list;
}

Adjustment adjust(const Measurement& measurement, const Plan& plan, const Chain& chain, const Eigen::Vector3d& tool,
                  const HeadCalibrations& heads, const AdjustmentOptions& options) {
    check_options(options, plan);
    AdjustmentProblem problem(measurement, plan, chain, tool, heads, options);
    if (problem.readings().empty())
        throw InvalidArgument("adjustment: nothing can be determined: the run has no readings that count");
    AdjustmentSolver solver(problem, smoothness_at_start(options));
    AdjustmentTables tables(problem);
    const Observability observability(solver, tables);
    const CalibratedForms forms = choose_forms(tables);
    solver.assume_usual(observability.determined());

    Eigen::VectorXd x = Eigen::VectorXd::Zero(problem.size());
    Adjustment result{
        {"", chain, {}, {}, {}, {}, {}, {}, {}}, {}, {}, 0.0, 0, 1.0, 0, {}, smoothness_at_start(options)};
    OutlierSearch outliers(problem, solver, options);
    result.iterations = outliers.solve_without_gross(observability.determined(), x);
    if (options.outlier_probability > 0.0) outliers.run(x);
    if (options.smoothness && options.smoothness->cross_validated) {
        result.smoothness = cross_validate(solver, x, options);
        solver.solve(x);
    }

    outliers.look(x);
    const BorderedBand& inverse = outliers.inverse();
    result.calibration = make_calibration(problem, tables, forms, x, inverse);
    const std::vector<bool> known = known_unknowns(problem, observability.determined(), inverse);
    result.calibration.undetermined = observability.sentences(known);
    if (!is_anything_determined(result.calibration))
        throw InvalidArgument(
            "adjustment: nothing can be determined. " +
            (result.calibration.undetermined.empty() ? std::string() : result.calibration.undetermined.front()));
    refuse_absurd(result.calibration);
    if (options.full_covariance) result.calibration.covariance = full_covariance(problem, forms, solver.factor());
    result.setup = setup_estimates(problem, known, x, inverse);
    result.residuals = outliers.residuals();
    std::stable_sort(result.residuals.begin(), result.residuals.end(),
                     [](const ReadingResidual& a, const ReadingResidual& b) { return a.row < b.row; });
    result.combinations = describe(observability, x, inverse);
    result.weighted_square_sum = solver.equations().square_sum(x);
    result.degrees_of_freedom = degrees_of_freedom(solver);
    if (result.degrees_of_freedom > 0)
        result.chi_square_probability =
            Eigen::numext::igammac(0.5 * result.degrees_of_freedom, 0.5 * result.weighted_square_sum);
    return result;
}

struct Adjuster::State {
    AdjustmentProblem problem;
    Eigen::Index rows;
    std::vector<std::string> channels;
    AdjustmentSolver solver;
    std::vector<LinearForm> forms;
    Eigen::VectorXd start;

    State(const Measurement& measurement, const Plan& plan, const Chain& chain, const Eigen::Vector3d& tool,
          const HeadCalibrations& heads, const AdjustmentOptions& options)
        : problem(measurement, plan, chain, tool, heads, options),
          rows(Eigen::Index(measurement.size())),
          solver(problem, smoothness_at_start(options)) {
        check_options(options, plan);
        AdjustmentTables tables(problem);
        const Observability observability(solver, tables);
        const CalibratedForms chosen = choose_forms(tables);
        for (const LinearForm* form : chosen.in_order()) forms.push_back(*form);
        solver.assume_usual(observability.determined());
        start.setZero(problem.size());
        solver.solve(start);
        solver.equations().assume_usual(observability.determined(), start);
        solver.solve(start);
        solver.factorize(start);
        for (const Channel& channel : measurement.channels()) channels.push_back(channel.name);
        channel_of_reading.reserve(problem.readings().size());
        for (const AdjustedReading& reading : problem.readings())
            channel_of_reading.push_back(
                int(std::find(channels.begin(), channels.end(), problem.channel_name(reading)) - channels.begin()));
    }
    std::vector<int> channel_of_reading;
};

Adjuster::Adjuster(const Measurement& measurement, const Plan& plan, const Chain& chain, const Eigen::Vector3d& tool,
                   const HeadCalibrations& heads, const AdjustmentOptions& options)
    : state_(std::make_unique<State>(measurement, plan, chain, tool, heads, options)) {}
Adjuster::~Adjuster() = default;
Adjuster::Adjuster(Adjuster&&) noexcept = default;

Eigen::VectorXd Adjuster::evaluate(const Eigen::MatrixXd& readings) {
    State& s = *state_;
    if (readings.rows() != Eigen::Index(s.channels.size()) || readings.cols() != s.rows)
        throw InvalidArgument("readings: expected " + std::to_string(s.channels.size()) + " rows, one a channel, and " +
                              std::to_string(s.rows) + " columns, one a row of the measurement, got " +
                              std::to_string(readings.rows()) + " x " + std::to_string(readings.cols()));
    auto& list = s.problem.readings();
    for (std::size_t r = 0; r < list.size(); ++r) {
        list[r].value = readings(s.channel_of_reading[r], Eigen::Index(list[r].row));
        if (!std::isfinite(list[r].value))
            throw InvalidArgument("readings: " + s.channels[s.channel_of_reading[r]] + " of row " +
                                  std::to_string(list[r].row) + " was read at first, and is not finite now");
    }
    Eigen::VectorXd x = s.start;
    s.solver.solve_nearby(x);
    Eigen::VectorXd values(s.forms.size());
    for (std::size_t i = 0; i < s.forms.size(); ++i) values[Eigen::Index(i)] = s.forms[i].value(x);
    return values;
}

}  // namespace stepdiag
