#include "recheck/prediction.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <utility>

#include "core/block_product.hpp"
#include "stepdiag/core/error.hpp"

namespace stepdiag {
namespace {

// A free unknown: far beyond what it may be, but a number, so that what no reading tells stays at 0.
double usual_prior(PriorUncertainty prior, int column) {
    if (std::isfinite(prior)) return prior;
    return record(setup::component(column).quantity).unit == "mm" ? 1e9 : 0.1;  // mm; rad
}

Eigen::MatrixXd without_columns(const Eigen::MatrixXd& matrix, Eigen::Index begin, Eigen::Index count) {
    const Eigen::Index after = matrix.cols() - begin - count;
    Eigen::MatrixXd rest(matrix.rows(), begin + after);
    rest << matrix.leftCols(begin), matrix.rightCols(after);
    return rest;
}

constexpr int most_steps = 100;
constexpr double settled = 1e-8;   // decrease of the square sum, by reading or, where it is larger, by itself
constexpr double unmoved = 1e-12;  // decrease, by which a step is below a millionth of any standard uncertainty

// A whole step, or a part of it that makes the square sum smaller: angles that act at second order only, as those of a
// single axis do, have no step that is right. Returns the sum; with a share of 0 that of `before`.
template <class At>
double descend(const At& at, double before) {
    constexpr int most_halves = 12;
    double share = 1.0;
    for (int i = 0; i < most_halves; ++i, share *= 0.5)
        if (const double sum = at(share); sum <= before) return sum;
    return at(0.0);
}

}  // namespace

// By the kernel of products: Eigen's own takes the oldest instruction set.
void add_square(const Eigen::MatrixXd& a, Eigen::MatrixXd& sum) {
    constexpr Eigen::Index panel = 48, whole = 24;  // columns, in whole sixes and vectors
    constexpr Eigen::Index few = 96;                // rows: what is multiplied stays in the cache
    const Eigen::Index size = (a.cols() + whole - 1) / whole * whole;
    Eigen::MatrixXd transposed = Eigen::MatrixXd::Zero(size, std::min(few, a.rows()));
    Eigen::MatrixXd negative = Eigen::MatrixXd::Zero(size, size);
    for (Eigen::Index first = 0; first < a.rows(); first += few) {
        const Eigen::Index count = std::min(few, a.rows() - first);
        transposed.topLeftCorner(a.cols(), count) = a.middleRows(first, count).transpose();
        for (Eigen::Index j = 0; j < size; j += panel)
            subtract_product(size - j, std::min(panel, size - j), count, MatrixView{&transposed(j, 0), size},
                             {&transposed(j, 0), 1, size}, {&negative(j, j), size});
    }
    sum.triangularView<Eigen::Lower>() -= negative.topLeftCorner(a.cols(), a.cols());
}

Baseline::Positions read_positions(const AdjustmentProblem& problem) {
    Baseline::Positions read;
    for (const AdjustedPoint& point : problem.points())
        for (const Axis axis : all_axes) read[index(axis)].push_back(point.place.commanded[index(axis)]);
    return read;
}

Prediction::Prediction(const AdjustmentProblem& problem, const Baseline& baseline, MotorShifts sent)
    : problem_(problem), baseline_(baseline), sent_(std::move(sent)), root_(baseline.root()) {
    weigh_readings();
    collect_rows();
    z_.setZero(baseline.root().cols() + Eigen::Index(problem.coefficients().size() + problem.sensors().size()));
}

// What lies between the nodes of the calibration is a deviation of the functional point that no value has.
void Prediction::weigh_readings() {
    const std::optional<double> between = baseline_.calibration().between_nodes;
    sigma_.resize(problem_.readings().size());
    for (const AdjustedPoint& point : problem_.points()) {
        const bool at_nodes = std::all_of(all_axes.begin(), all_axes.end(), [&](Axis axis) {
            return baseline_.is_node(axis, point.place.commanded[index(axis)]);
        });
        if (!at_nodes && !between)
            throw InvalidArgument("calibration: readings at " + format_lengths(point.place.commanded) +
                                  " mm lie between its nodes, and it states no uncertainty for what is there "
                                  "(between_nodes_um): use steps that divide those of the calibration, or state it");
        for (int r = point.first_reading; r < point.end_reading; ++r) {
            const AdjustedReading& reading = problem_.readings()[r];
            const bool is_distance = problem_.channel_name(reading).front() == 'd';
            const double more = at_nodes || !is_distance ? 0.0 : *between;
            sigma_[r] = std::sqrt(reading.standard_uncertainty * reading.standard_uncertainty + more * more);
        }
    }
}

void Prediction::collect_rows() {
    setups_.resize(problem_.setups().size());
    place_.resize(sigma_.size());
    setup_of_.resize(sigma_.size());
    missed_.resize(sigma_.size());
    for (std::size_t p = 0; p < problem_.points().size(); ++p) {
        const AdjustedPoint& point = problem_.points()[p];
        SetupRows& rows = setups_[point.setup];
        rows.points.push_back(int(p));
        for (int r = point.first_reading; r < point.end_reading; ++r) {
            if (!problem_.readings()[r].used()) continue;
            ++used_;
            place_[r] = int(rows.readings.size());
            setup_of_[r] = point.setup;
            rows.readings.push_back(r);
        }
    }
    for (std::size_t k = 0; k < setups_.size(); ++k) {
        const LineSetup& setup = problem_.setups()[k];
        const auto size = Eigen::Index(setup.active.size());
        setups_[k].weight.resize(size);
        setups_[k].stiffness.resize(size);
        for (Eigen::Index j = 0; j < size; ++j) {
            const int column = setup.active[j];
            setups_[k].weight[j] = std::pow(usual_prior(setup.prior[column], column), -2);
            setups_[k].stiffness[j] =
                std::pow(std::min(setup.prior[column], record(setup::component(column).quantity).usual), -2);
        }
        setups_[k].value.setZero(size);
    }
}

namespace {

// By coefficient and sensor: what they add to axis a along itself, by z.
Eigen::VectorXd added_by_expansion(const AdjustmentProblem& problem, const AdjustedPoint& point, int a,
                                   Eigen::Index size) {
    Eigen::VectorXd added = Eigen::VectorXd::Zero(size);
    const auto& coefficients = problem.coefficients();
    const auto& expansion = problem.expansion();
    if (!expansion) return added;
    for (std::size_t c = 0; c < coefficients.size(); ++c)
        for (const int of : coefficients[c].axes)
            if (of == a) added[Eigen::Index(c)] = coefficients[c].prior * coefficients[c].effect(point.place, a);
    for (std::size_t s = 0; s < problem.sensors().size(); ++s)
        for (const int of : problem.sensors()[s])
            if (of == a)
                added[Eigen::Index(coefficients.size() + s)] =
                    expansion->expansion.coefficient[a] * expansion->sensor_uncertainty * point.place.from_fixed[a];
    return added;
}

}  // namespace

void Prediction::linearise(SetupRows& rows, const Eigen::VectorXd& z, bool derivatives) {
    const std::size_t k = std::size_t(&rows - setups_.data());
    const LineSetup& setup = problem_.setups()[k];
    ChannelModel model = setup.model;
    Eigen::VectorXd whole = Eigen::VectorXd::Zero(Eigen::Index(setup.prior.size()));
    for (std::size_t j = 0; j < setup.active.size(); ++j) whole[setup.active[j]] = rows.value[Eigen::Index(j)];
    model.set_up(whole);

    const Eigen::Index columns = root_.cols();
    const auto& expansion = problem_.expansion();
    const Eigen::VectorXd values = root_ * z.head(columns);
    Eigen::RowVectorXd row(z.size());
    const auto count = Eigen::Index(rows.readings.size());
    rows.residual.resize(count);
    if (derivatives) {
        rows.by_setup.resize(count, Eigen::Index(setup.active.size()));
        rows.by_baseline.resize(count, z.size());
    }
    Eigen::VectorXd reading(model.channels());
    ChannelDerivative derivative(model.channels(), 18 + model.setup_size());
    std::array<std::vector<Baseline::Share>, 3> shares;
    for (const int p : rows.points) {
        const AdjustedPoint& point = problem_.points()[p];
        MachineErrors errors;
        std::array<Eigen::VectorXd, 3> added;
        for (const Axis axis : all_axes) {
            const int a = index(axis);
            const double position = point.place.commanded[a];
            shares[a].clear();
            errors[a] = baseline_.errors(axis, position, point.negative[a], shares[a]);
            if (!sent_.empty() && point.first_reading < point.end_reading)
                errors[a][a] += sent_[problem_.readings()[point.first_reading].row][a];
            for (const Baseline::Share& share : shares[a])
                errors[a][share.component] += share.weight * values[share.entry];
            added[a] = added_by_expansion(problem_, point, a, z.size() - columns);
            if (!expansion) continue;
            errors[a][a] += expansion->expansion.coefficient[a] * point.place.stretch[a];
            errors[a][a] += added[a].dot(z.tail(added[a].size()));
        }
        const PoseDerivative pose =
            differentiate_pose(problem_.chain(), problem_.tool(), point.place.commanded, errors, derivatives);
        model.read(pose, point.place, reading, derivatives ? &derivative : nullptr);
        for (int r = point.first_reading; r < point.end_reading; ++r) {
            const int channel = problem_.readings()[r].channel;
            if (!problem_.readings()[r].used()) {
                missed_[r] = problem_.readings()[r].value - reading[channel];
                continue;
            }
            const double weight = 1.0 / sigma_[r];
            const int i = place_[r];
            rows.residual[i] = weight * (problem_.readings()[r].value - reading[channel]);
            if (!derivatives) continue;
            for (std::size_t j = 0; j < setup.active.size(); ++j)
                rows.by_setup(i, Eigen::Index(j)) = weight * derivative(channel, 18 + setup.active[j]);
            row.setZero();
            for (int a = 0; a < 3; ++a) {
                for (const Baseline::Share& share : shares[a])
                    row.head(columns) +=
                        weight * derivative(channel, 6 * a + share.component) * share.weight * root_.row(share.entry);
                row.tail(added[a].size()) += weight * derivative(channel, 7 * a) * added[a].transpose();
            }
            rows.by_baseline.row(i) = row;
        }
    }
}

double Prediction::objective(const SetupRows& rows) {
    return rows.residual.squaredNorm() + rows.value.cwiseAbs2().dot(rows.weight);
}

// Each set-up by itself, at the calibration's values: from there the steps of all are few. Readings count as much as
// the calibration and a change leave them certain; else a set-up would go far to explain what is the machine's.
void Prediction::settle_setups() {
    for (SetupRows& rows : setups_) {
        linearise(rows, z_, true);
        const Eigen::VectorXd weight = (1.0 + rows.by_baseline.rowwise().squaredNorm().array()).inverse();
        const auto sum = [&] {
            return rows.residual.cwiseAbs2().dot(weight) + rows.value.cwiseAbs2().dot(rows.weight);
        };
        for (int i = 0; i < most_steps; ++i) {
            Eigen::MatrixXd matrix = rows.by_setup.transpose() * weight.asDiagonal() * rows.by_setup;
            matrix.diagonal() += rows.weight;
            const Eigen::VectorXd change = matrix.ldlt().solve(
                rows.by_setup.transpose() * weight.cwiseProduct(rows.residual) - rows.weight.cwiseProduct(rows.value));
            const double before = sum();
            const Eigen::VectorXd value = rows.value;
            const double decrease = before - descend(
                                                 [&](double share) {
                                                     rows.value = value + share * change;
                                                     linearise(rows, z_, false);
                                                     return sum();
                                                 },
                                                 before);
            if (decrease < settled * double(rows.readings.size())) break;
            linearise(rows, z_, true);
        }
    }
}

void Prediction::linearise(bool derivatives) {
    for (SetupRows& rows : setups_) linearise(rows, z_, derivatives);
}

// What the second derivatives of the readings by the set-ups make of the residuals. Machines act at first order, but
// for their products with set-ups.
void Prediction::find_curvature() {
    constexpr double difference = 1e-6;  // rad, and of a metre
    for (SetupRows& rows : setups_) {
        const LineSetup& setup = problem_.setups()[std::size_t(&rows - setups_.data())];
        const Eigen::MatrixXd by_setup = rows.by_setup, by_baseline = rows.by_baseline;
        const Eigen::VectorXd residual = rows.residual, value = rows.value;
        rows.curvature.resize(value.size(), value.size());
        rows.curved_coupling.resize(value.size(), z_.size());
        for (Eigen::Index j = 0; j < value.size(); ++j) {
            const bool is_length = record(setup::component(setup.active[std::size_t(j)]).quantity).unit == "mm";
            const double change = is_length ? 1e3 * difference : difference;
            rows.value[j] += change;
            linearise(rows, z_, true);
            rows.curvature.col(j) = (by_setup - rows.by_setup).transpose() * residual / change;
            rows.curved_coupling.row(j) = residual.transpose() * (by_baseline - rows.by_baseline) / change;
            rows.value = value;
        }
        rows.by_setup = by_setup;
        rows.by_baseline = by_baseline;
        rows.residual = residual;
        rows.curvature = (0.5 * (rows.curvature + rows.curvature.transpose())).eval();
    }
}

bool Prediction::factorize(bool curved, double damping) {
    constexpr double open = 1e-12;  // by itself: what no reading of a set-up tells stays where it is
    const Eigen::Index size = z_.size();
    bool is_positive = true;
    matrix_.setIdentity(size, size);
    gradient_ = -z_;
    for (SetupRows& rows : setups_) {
        Eigen::MatrixXd corner = rows.by_setup.transpose() * rows.by_setup;
        Eigen::MatrixXd coupling = rows.by_setup.transpose() * rows.by_baseline;
        corner.diagonal() += open * corner.diagonal() + rows.weight + damping * rows.stiffness;
        if (curved) {
            corner += rows.curvature;
            coupling += rows.curved_coupling;
        }
        rows.factor.compute(corner);
        is_positive = is_positive && rows.factor.isPositive();
        rows.transfer = rows.factor.solve(coupling);
        rows.gradient = rows.by_setup.transpose() * rows.residual - rows.weight.cwiseProduct(rows.value);
        add_square(rows.by_baseline, matrix_);
        matrix_.triangularView<Eigen::Lower>() -= coupling.transpose() * rows.transfer;
        gradient_ += rows.by_baseline.transpose() * rows.residual - rows.transfer.transpose() * rows.gradient;
    }
    matrix_.triangularView<Eigen::StrictlyUpper>() = matrix_.transpose();
    factor_.compute(matrix_);
    return is_positive && factor_.info() == Eigen::Success;
}

double Prediction::decrement() const {
    double sum = gradient_.dot(factor_.solve(gradient_));
    for (const SetupRows& rows : setups_) sum += rows.gradient.dot(rows.factor.solve(rows.gradient));
    return sum;
}

// By the factors; stays where the square sum would not fall by so much.
bool Prediction::moves(double least_decrease) {
    const double before = chi_square();
    const Eigen::VectorXd z = z_, change = factor_.solve(gradient_);
    std::vector<Eigen::VectorXd> values;
    for (const SetupRows& rows : setups_) values.push_back(rows.value);
    z_ += change;
    for (SetupRows& rows : setups_) rows.value += rows.factor.solve(rows.gradient) - rows.transfer * change;
    linearise(false);
    if (chi_square() <= before - least_decrease) return true;
    z_ = z;
    for (std::size_t k = 0; k < setups_.size(); ++k) setups_[k].value = values[k];
    linearise(false);
    return false;
}

// Gauss and Newton's step where it does what it says. Readings that nothing near the calibration explains leave large
// residuals, and with them the second derivatives count: there it is Newton's, the set-ups being held by a part of what
// is usual, more of it until the square sum falls (K. Levenberg, Quart. Appl. Math. 2 (1944) 164).
double Prediction::step() {
    constexpr double good = 0.75;  // share of what a quadratic would fall by
    constexpr double first = 1e-2, least = 1e-4, climbs = 10.0, falls = 100.0, most = 1e12;
    linearise(true);
    const bool is_definite = factorize();
    const double decrement = this->decrement();
    is_factor_here_ = is_definite && decrement < unmoved;
    if (is_factor_here_) return decrement;
    if (is_definite && moves(good * decrement)) {
        damping_ = 0.0;
        return decrement;
    }
    find_curvature();
    for (; damping_ < most; damping_ = std::max(first, climbs * damping_)) {
        if (!factorize(true, damping_) || !moves(0.0)) continue;
        damping_ = damping_ < least ? 0.0 : damping_ / falls;
        return decrement;
    }
    return 0.0;
}

std::vector<Prediction::Derivatives> Prediction::derivatives() {
    settle_setups();
    linearise(true);
    std::vector<Derivatives> derivatives;
    for (std::size_t k = 0; k < setups_.size(); ++k) {
        const LineSetup& setup = problem_.setups()[k];
        derivatives.push_back({setups_[k].by_setup, setups_[k].by_baseline, setups_[k].weight, {}});
        for (const int column : setup.active) derivatives.back().is_free.push_back(!std::isfinite(setup.prior[column]));
    }
    return derivatives;
}

void Prediction::solve() {
    // Readings so far off, by reading and in units of variances, that nothing near the calibration explains them: along
    // a curved valley the square sum falls by little for as long as one likes.
    constexpr double gross = 1e4, little = 0.01;
    constexpr int in_a_row = 5;
    settle_setups();
    linearise(false);
    double before = chi_square();
    for (int i = 0, slow = 0; i < most_steps && slow < in_a_row; ++i) {
        const double decrement = step(), sum = chi_square();
        if (decrement < settled * std::max(double(used_), sum)) break;
        slow = sum > gross * used_ && before - sum < little * before ? slow + 1 : 0;
        before = sum;
    }
    if (!is_factor_here_) {
        linearise(true);
        factorize();
    }
    for (SetupRows& rows : setups_) {
        rows.spread = factor_.matrixL().solve(rows.transfer.transpose());
        linearise(rows, Eigen::VectorXd::Zero(z_.size()), false);
        stated_residual_.push_back(rows.residual);
        linearise(rows, z_, false);
    }
}

void Prediction::drop_changes() {
    const auto changes = Eigen::Index(baseline_.changes().size());
    const Eigen::Index begin = baseline_.root().cols() - changes;
    const Eigen::VectorXd dropped = z_.segment(begin, changes);
    const Eigen::MatrixXd rest = without_columns(matrix_.transpose(), begin, changes).transpose();  // of the rows
    matrix_ = without_columns(rest, begin, changes);
    factor_.compute(matrix_);
    // As the changes go from what was found to 0.
    gradient_ = without_columns(gradient_.transpose(), begin, changes).transpose();
    const Eigen::VectorXd step = factor_.solve(gradient_ + rest.middleCols(begin, changes) * dropped);
    Eigen::VectorXd whole(z_.size());
    whole << step.head(begin), -dropped, step.tail(step.size() - begin);
    z_ = without_columns((z_ + whole).transpose(), begin, changes).transpose();
    for (std::size_t k = 0; k < setups_.size(); ++k) {
        SetupRows& rows = setups_[k];
        const Eigen::VectorXd change = rows.factor.solve(rows.gradient) - rows.transfer * whole;
        rows.residual -= rows.by_baseline * whole + rows.by_setup * change;
        rows.value += change;
        rows.by_baseline = without_columns(rows.by_baseline, begin, changes);
        rows.transfer = without_columns(rows.transfer, begin, changes);
        rows.spread = factor_.matrixL().solve(rows.transfer.transpose());
        stated_residual_[k] = rows.residual + rows.by_baseline * z_;
    }
}

double Prediction::chi_square() const {
    double sum = z_.squaredNorm();
    for (const SetupRows& rows : setups_) sum += objective(rows);
    return sum;
}

Eigen::MatrixXd Prediction::information(Eigen::Index begin, Eigen::Index count) const {
    const Eigen::Index size = matrix_.rows(), after = size - begin - count;
    if (after == 0) {  // they are the last ones of the factor, too
        const Eigen::MatrixXd last = factor_.matrixLLT().bottomRightCorner(count, count).triangularView<Eigen::Lower>();
        return last * last.transpose() - Eigen::MatrixXd::Identity(count, count);
    }
    // Everything else: the columns before and after.
    Eigen::MatrixXd others(size - count, size - count), coupling(size - count, count);
    others << matrix_.topLeftCorner(begin, begin), matrix_.topRightCorner(begin, after),
        matrix_.bottomLeftCorner(after, begin), matrix_.bottomRightCorner(after, after);
    coupling << matrix_.block(0, begin, begin, count), matrix_.block(begin + count, begin, after, count);
    return matrix_.block(begin, begin, count, count) - Eigen::MatrixXd::Identity(count, count) -
           coupling.transpose() * others.llt().solve(coupling);
}

Eigen::MatrixXd Prediction::covariance_columns(Eigen::Index begin, Eigen::Index count) const {
    Eigen::MatrixXd columns = Eigen::MatrixXd::Zero(matrix_.rows(), count);
    columns.middleRows(begin, count).setIdentity();
    factor_.solveInPlace(columns);
    return columns;
}

ChiSquare Prediction::fit(Eigen::Index begin, Eigen::Index count) const {
    constexpr double near =
        20.0;  // priors, and 4 standard uncertainties: no change farther away is near the calibration
    ChiSquare test{chi_square(), used_};
    if (count > 0) {
        const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> parts(information(begin, count));
        const Eigen::VectorXd drawn = parts.eigenvectors().transpose() * z_.segment(begin, count);
        for (Eigen::Index k = 0; k < count; ++k)
            if (const double information = parts.eigenvalues()[k]; information >= least_information) {
                const double estimate = drawn[k] * (1.0 + information) / information;
                if (std::abs(estimate) > near + 4.0 / std::sqrt(information)) continue;
                test.square_sum -= estimate * drawn[k];
                --test.freedom;
            }
    }
    double free = 0.0;  // of the free unknowns, those that the readings tell
    for (std::size_t k = 0; k < setups_.size(); ++k) {
        const LineSetup& setup = problem_.setups()[k];
        const SetupRows& rows = setups_[k];
        const Eigen::Index size = rows.weight.size();
        const Eigen::MatrixXd alone = rows.factor.solve(Eigen::MatrixXd::Identity(size, size));
        for (Eigen::Index j = 0; j < size; ++j)
            if (!std::isfinite(setup.prior[setup.active[j]]))
                free += 1.0 - rows.weight[j] * (alone(j, j) + rows.spread.col(j).squaredNorm());
    }
    test.freedom -= int(std::lround(free));
    return test;
}

Prediction::Deviation Prediction::deviation(const std::vector<Term>& sum) const {
    const int k = setup_of_[sum.front().reading];
    const SetupRows& rows = setups_[k];
    Eigen::VectorXd by_setup = Eigen::VectorXd::Zero(rows.weight.size());
    Eigen::VectorXd by_baseline = Eigen::VectorXd::Zero(z_.size());
    double value = 0.0, variance = 0.0;
    for (const Term& term : sum) {
        const int i = place_[term.reading];
        const double scale = term.weight * sigma_[term.reading];
        value += scale * stated_residual_[k][i];
        variance += scale * scale;
        by_setup += scale * rows.by_setup.row(i).transpose();
        by_baseline += scale * rows.by_baseline.row(i).transpose();
    }
    variance += by_baseline.squaredNorm();
    const double told = by_setup.dot(rows.factor.solve(by_setup)) + (rows.spread * by_setup).squaredNorm();
    constexpr double rounding = 1e-9;
    return {value, variance - told > rounding * variance ? std::sqrt(variance - told) : 0.0};
}

Prediction::Deviation Prediction::misfit(int reading) const {
    const SetupRows& rows = setups_[setup_of_[reading]];
    const int i = place_[reading];
    const Eigen::VectorXd by_setup = rows.by_setup.row(i).transpose();
    const Eigen::VectorXd by_baseline = factor_.matrixL().solve(rows.by_baseline.row(i).transpose());
    const double told =
        by_setup.dot(rows.factor.solve(by_setup)) + (by_baseline - rows.spread * by_setup).squaredNorm();
    constexpr double rounding = 1e-9;
    return {sigma_[reading] * rows.residual[i], 1.0 - told > rounding ? sigma_[reading] * std::sqrt(1.0 - told) : 0.0};
}

}  // namespace stepdiag
