#include "adjustment/normal_equations.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace stepdiag {
double& element(BorderedBand& matrix, int i, int j) {
    if (i < j) std::swap(i, j);
    const int banded = 6 * matrix.blocks();
    const int leaf_i = matrix.leaf_place(i), leaf_j = matrix.leaf_place(j);
    if (leaf_i >= 0 && leaf_j >= 0) {
        const int leaf = matrix.leaf_of(leaf_i), start = matrix.leaf_start(leaf);
        assert(matrix.leaf_of(leaf_j) == leaf);
        return matrix.leaf(leaf).coeffRef(leaf_i - start, leaf_j - start);
    }
    if (leaf_i >= 0) return matrix.leaf_column(leaf_i)[matrix.leaf_row(j)];
    if (leaf_j >= 0) return matrix.leaf_column(leaf_j)[matrix.leaf_row(i)];
    if (j >= banded) return matrix.corner()(matrix.border_place(i), matrix.border_place(j));
    if (i >= banded) return matrix.border_rows(j / 6).coeffRef(matrix.border_place(i), j % 6);
    return matrix.block(i / 6, j / 6).coeffRef(i % 6, j % 6);
}

double element(const BorderedBand& matrix, int i, int j) { return element(const_cast<BorderedBand&>(matrix), i, j); }

double SmoothRow::value(const Eigen::VectorXd& x) const {
    double value = 0.0;
    for (int i = 0; i < 3; ++i)
        if (unknown[i] != no_unknown) value += coefficient[i] * x[unknown[i]];
    return value;
}

double NormalEquations::Row::product(const Eigen::VectorXd& v) const {
    double sum = 0.0;
    for (int i = 0; i < size; ++i)
        if (unknown[i] != no_unknown) sum += derivative[i] * v[unknown[i]];
    return sum;
}

void NormalEquations::Row::add_to(Side v, double times) const {
    for (int i = 0; i < size; ++i)
        if (unknown[i] != no_unknown) v[unknown[i]] += times * derivative[i];
}

void NormalEquations::Row::add_to(BorderedFactor::Sides& v, const BorderedFactor::OfSides& times) const {
    for (int i = 0; i < size; ++i)
        if (unknown[i] != no_unknown) v.row(unknown[i]) += times * derivative[i];
}

NormalEquations::NormalEquations(const AdjustmentProblem& problem) : problem_(&problem) {
    for (const LineSetup& setup : problem.setups()) models_.push_back(setup.model);
    std::size_t weights = 0, most = 0;
    first_weight_.resize(problem.readings().size());
    point_of_reading_.resize(problem.readings().size());
    std::vector<std::vector<std::pair<int, double>>> faults(problem.readings().size());  // unknown, share
    for (const EstimatedFault& fault : problem.faults())
        for (std::size_t k = 0; k < fault.pattern.readings.size(); ++k)
            faults[fault.pattern.readings[k]].emplace_back(fault.unknown, fault.pattern.share[k]);
    std::vector<std::pair<std::size_t, double>> of_faults;  // into derivatives_: they are the same everywhere
    for (std::size_t p = 0; p < problem.points().size(); ++p) {
        const AdjustedPoint& point = problem.points()[p];
        first_unknown_.push_back(int(unknowns_.size()));
        for (const int node : point.node)
            for (int c = 0; c < 6; ++c)
                unknowns_.push_back(node == no_unknown ? no_unknown : problem.nodes()[node].unknown[c]);
        const LineSetup& setup = problem.setups()[point.setup];
        for (const int c : setup.active) unknowns_.push_back(setup.unknown[c]);
        for (const CoefficientUnknown& of : problem.coefficients()) unknowns_.push_back(of.unknown);
        const std::size_t known = 18 + setup.active.size() + problem.coefficients().size();
        std::size_t count = known;
        for (int r = point.first_reading; r < point.end_reading; ++r)
            for (const auto& [unknown, share] : faults[r]) {
                const auto begin = unknowns_.end() - std::ptrdiff_t(count - known);
                if (std::find(begin, unknowns_.end(), unknown) != unknowns_.end()) continue;
                unknowns_.push_back(unknown);
                ++count;
            }
        for (int r = point.first_reading; r < point.end_reading; ++r) {
            first_weight_[r] = weights;
            point_of_reading_[r] = int(p);
            for (const auto& [unknown, share] : faults[r]) {
                const auto begin = unknowns_.end() - std::ptrdiff_t(count - known);
                const auto place = std::find(begin, unknowns_.end(), unknown) - begin;
                of_faults.emplace_back(weights + known + std::size_t(place),
                                       share / problem.readings()[r].standard_uncertainty);
            }
            weights += count;
        }
        most = std::max(most, count);
    }
    first_unknown_.push_back(int(unknowns_.size()));
    // Vectors reach beyond the last one, and whole groups of columns.
    derivatives_.assign(weights + widest_vector + BorderedBand::block_size * most, 0.0);
    for (const auto& [place, derivative] : of_faults) derivatives_[place] = derivative;
    residuals_.setZero(Eigen::Index(problem.readings().size()));
    if (problem.moves_axes()) by_shift_.resize(problem.readings().size());
    prior_weight_.resize(problem.size());
    for (int j = 0; j < problem.size(); ++j) prior_weight_[j] = std::pow(problem.prior()[j], -2);
    usual_weight_ = centre_ = Eigen::VectorXd::Zero(problem.size());
}

void NormalEquations::assume_usual(const std::vector<bool>& determined, const Eigen::VectorXd& centre, double part) {
    for (int j = 0; j < problem_->size(); ++j)
        usual_weight_[j] = determined[j] ? 0.0 : std::pow(part * problem_->usual()[j], -2);
    centre_ = centre;
}

std::vector<SmoothRow> second_differences(const AdjustmentProblem& problem,
                                          const std::array<double, function_count>& deviation) {
    std::vector<SmoothRow> rows;
    const auto& nodes = problem.nodes();
    for (std::vector<int> chain : problem.node_chains()) {
        if (chain.empty()) continue;
        const AxisNode& first = nodes[chain.front()];
        if (first.node > 0 && !first.negative) chain.insert(chain.begin(), no_unknown);  // home
        for (std::size_t k = 1; k + 1 < chain.size(); ++k) {
            const auto position = [&](int i) { return i == no_unknown ? 0.0 : nodes[i].position; };
            const double before = position(chain[k]) - position(chain[k - 1]);
            const double after = position(chain[k + 1]) - position(chain[k]);
            const double step = 0.5 * (before + after);
            for (int c = 0; c < 6; ++c) {
                const int function = FunctionId{first.axis, Component(c)}.index();
                if (deviation[function] <= 0.0) continue;
                const double weight = 1.0 / deviation[function];
                SmoothRow row{function, {}, {}};
                row.coefficient = {weight * step / before, -weight * step * (1.0 / before + 1.0 / after),
                                   weight * step / after};
                for (int i = 0; i < 3; ++i) {
                    const int node = chain[k - 1 + i];
                    row.unknown[i] = node == no_unknown ? no_unknown : nodes[node].unknown[c];
                }
                rows.push_back(row);
            }
        }
    }
    return rows;
}

void NormalEquations::linearise(const Eigen::VectorXd& x, bool derivatives) {
    const AdjustmentProblem& problem = *problem_;
    for (std::size_t s = 0; s < models_.size(); ++s) models_[s].set_up(problem.setup_values(problem.setups()[s], x));
    Eigen::VectorXd value;
    ChannelDerivative derivative;
    for (const AdjustedPoint& point : problem.points()) {
        const LineSetup& setup = problem.setups()[point.setup];
        const ChannelModel& model = models_[point.setup];
        value.resize(model.channels());
        if (derivatives) derivative.resize(model.channels(), 18 + model.setup_size());
        const PoseDerivative pose = differentiate_pose(problem.chain(), problem.tool(), point.place.commanded,
                                                       problem.errors(point, x), derivatives);
        model.read(pose, point.place, value, derivatives ? &derivative : nullptr);
        for (int r = point.first_reading; r < point.end_reading; ++r) {
            const AdjustedReading& reading = problem.readings()[r];
            const double weight = 1.0 / reading.standard_uncertainty;
            residuals_[r] = weight * (reading.value - value[reading.channel]);
            const int p = point_of_reading_[r];
            double* row = derivatives_.data() + first_weight_[r];
            const int* unknown = unknowns_.data() + first_unknown_[p];
            const int first_fault = 18 + int(setup.active.size() + problem.coefficients().size());
            for (int c = first_fault; c < first_unknown_[p + 1] - first_unknown_[p]; ++c)
                residuals_[r] -= row[c] * x[unknown[c]];
            if (!derivatives) continue;
            for (int c = 0; c < 18; ++c)
                row[c] = unknown[c] == no_unknown ? 0.0 : weight * derivative(reading.channel, c);
            for (std::size_t c = 0; c < setup.active.size(); ++c)
                row[18 + c] = weight * derivative(reading.channel, 18 + setup.active[c]);
            if (!problem.moves_axes()) continue;
            for (int a = 0; a < 3; ++a) by_shift_[r][a] = weight * derivative(reading.channel, 7 * a);
            for (std::size_t k = 0; k < problem.coefficients().size(); ++k) {
                double& by_coefficient = row[18 + setup.active.size() + k] = 0.0;
                for (const int a : problem.coefficients()[k].axes)
                    by_coefficient += by_shift_[r][a] * problem.coefficients()[k].effect(point.place, a);
            }
        }
    }
}

void NormalEquations::drop_roundings() {
    constexpr double rounding = 1e-13;  // of what a metre or a radian of the largest does to the reading
    for (const AdjustedPoint& point : problem_->points())
        for (int r = point.first_reading; r < point.end_reading; ++r) {
            const Row row = this->row(point, r);
            double* derivative = derivatives_.data() + first_weight_[r];
            const auto size = [&](int i) {
                return row.unknown[i] == no_unknown
                           ? 0.0
                           : std::abs(derivative[i]) / problem_->change_scale()[row.unknown[i]];
            };
            double largest = 0.0;
            for (int i = 0; i < row.size; ++i) largest = std::max(largest, size(i));
            for (int i = 0; i < row.size; ++i)
                if (size(i) < rounding * largest) derivative[i] = 0.0;
        }
}

NormalEquations::Row NormalEquations::row(const AdjustedPoint& point, int reading) const {
    const std::size_t p = std::size_t(&point - problem_->points().data());
    return {unknowns_.data() + first_unknown_[p], derivatives_.data() + first_weight_[reading],
            first_unknown_[p + 1] - first_unknown_[p]};
}

double NormalEquations::square_sum(const Eigen::VectorXd& x) const { return square_sum(residuals_, x); }

double NormalEquations::square_sum(const Eigen::VectorXd& residuals, const Eigen::VectorXd& x) const {
    double sum = 0.0;
    for (Eigen::Index r = 0; r < residuals.size(); ++r)
        if (problem_->readings()[r].used()) sum += residuals[r] * residuals[r];
    for (int j = 0; j < x.size(); ++j)
        if (std::isfinite(problem_->prior()[j])) sum += std::pow(x[j] / problem_->prior()[j], 2);
    for (const SmoothRow& row : smooth_) sum += std::pow(row.value(x), 2);
    return sum;
}

// The covariance of one point's unknowns, rows and columns of those without being 0.
void NormalEquations::gather(const AdjustedPoint& point, const BorderedBand& inverse, Square& covariance) const {
    const Row all = row(point, point.first_reading);
    covariance.setZero(all.size, all.size);
    const int banded = 6 * inverse.blocks();
    std::array<int, 3> block;
    for (int a = 0; a < 3; ++a) block[a] = problem_->block_of(point.node[a]);
    for (int a = 0; a < 3; ++a) {
        if (block[a] == no_unknown) continue;
        for (int b = 0; b < 3; ++b) {
            if (block[b] == no_unknown || block[b] > block[a]) continue;
            const auto part = inverse.block(block[a], block[b]);
            if (a == b) {
                covariance.block<6, 6>(6 * a, 6 * a) = part.selfadjointView<Eigen::Lower>();
            } else {
                covariance.block<6, 6>(6 * a, 6 * b) = part;
                covariance.block<6, 6>(6 * b, 6 * a) = part.transpose();
            }
        }
        const auto border = inverse.border_rows(block[a]);
        for (int i = 0; i < all.size; ++i) {
            const int place = inverse.border_place(all.unknown[i]), leaf = inverse.leaf_place(all.unknown[i]);
            if (all.unknown[i] < banded) continue;
            if (leaf >= 0) {
                const Eigen::Map<const Eigen::Matrix<double, 6, 1>> column(inverse.leaf_column(leaf) + 6 * block[a]);
                covariance.block<6, 1>(6 * a, i) = column;
                covariance.block<1, 6>(i, 6 * a) = column.transpose();
                continue;
            }
            covariance.block<1, 6>(i, 6 * a) = border.row(place);
            covariance.block<6, 1>(6 * a, i) = border.row(place).transpose();
        }
    }
    for (int i = 0; i < all.size; ++i)
        for (int j = 0; j < all.size; ++j)
            if (all.unknown[i] >= banded && all.unknown[j] >= banded)
                covariance(i, j) = element(inverse, all.unknown[i], all.unknown[j]);
}

template <class Function>
void NormalEquations::for_each_covariance(const BorderedBand& inverse, const Function& function) const {
    Eigen::VectorXd image;
    Square covariance;
    for (const AdjustedPoint& point : problem_->points()) {
        gather(point, inverse, covariance);
        for (int r = point.first_reading; r < point.end_reading; ++r) {
            const Row row = this->row(point, r);
            const Eigen::Map<const Eigen::VectorXd> derivative(row.derivative, row.size);
            image.noalias() = covariance * derivative;
            function(r, row, image);
        }
    }
}

Eigen::VectorXd NormalEquations::reading_variances(const BorderedBand& inverse) const {
    Eigen::VectorXd variances(residuals_.size());
    for_each_covariance(inverse, [&](int r, const Row& row, const Eigen::VectorXd& covariance) {
        variances[r] = Eigen::Map<const Eigen::VectorXd>(row.derivative, row.size).dot(covariance);
    });
    return variances;
}

Eigen::VectorXd NormalEquations::prior_shares(const BorderedBand& inverse) const {
    Eigen::VectorXd shares = Eigen::VectorXd::Zero(residuals_.size());
    for_each_covariance(inverse, [&](int r, const Row& row, const Eigen::VectorXd& covariance) {
        for (int i = 0; i < row.size; ++i)
            if (const int j = row.unknown[i]; j != no_unknown)
                shares[r] += prior_weight_[j] * covariance[i] * covariance[i];
    });
    return shares;
}

BorderedBand NormalEquations::matrix() const {
    return BorderedBand(problem_->reach(), problem_->dense_border(), problem_->leaves());
}

void NormalEquations::assemble(BorderedBand& matrix) const {
    matrix.set_zero();
    for (std::size_t p = 0; p < problem_->points().size(); ++p) assemble_point(problem_->points()[p], int(p), matrix);
    for (int j = 0; j < problem_->size(); ++j) element(matrix, j, j) += prior_weight_[j] + usual_weight_[j];
    for (const SmoothRow& row : smooth_)
        for (int i = 0; i < 3; ++i)
            for (int j = 0; j <= i; ++j)
                if (row.unknown[i] != no_unknown && row.unknown[j] != no_unknown)
                    element(matrix, row.unknown[i], row.unknown[j]) += row.coefficient[i] * row.coefficient[j];
}

void NormalEquations::add_curvature(const Eigen::VectorXd& x, BorderedBand& matrix) {
    constexpr double difference = 1e-6;  // rad, and of a metre
    // All else is added to a reading.
    constexpr int curved[] = {setup::reflector, setup::reflector + 1, setup::laser, setup::laser + 1,
                              setup::lateral,   setup::lateral + 1,   setup::roll,  setup::gain};
    const std::vector<double> derivatives = derivatives_;
    const Eigen::VectorXd residuals = residuals_;
    const auto is_unknown = [&](int c) {
        return std::any_of(problem_->setups().begin(), problem_->setups().end(),
                           [&](const LineSetup& setup) { return setup.unknown[c] != no_unknown; });
    };
    for (const int c : curved) {
        if (!is_unknown(c)) continue;
        Eigen::VectorXd shifted = x;  // of all set-ups at once: none has readings of another
        for (const LineSetup& setup : problem_->setups())
            if (const int j = setup.unknown[c]; j != no_unknown) shifted[j] += difference / problem_->change_scale()[j];
        linearise(shifted);
        for (const AdjustedPoint& point : problem_->points()) {
            const int j = problem_->setups()[point.setup].unknown[c];
            if (j == no_unknown) continue;
            const double per_change = problem_->change_scale()[j] / difference;
            for (int r = point.first_reading; r < point.end_reading; ++r) {
                if (!problem_->readings()[r].used()) continue;
                const Row row = this->row(point, r);
                for (int i = 0; i < row.size && row.unknown[i] <= j; ++i)
                    if (row.unknown[i] != no_unknown)
                        element(matrix, row.unknown[i], j) -=
                            residuals[r] * per_change *
                            (row.derivative[i] - derivatives[first_weight_[r] + std::size_t(i)]);
            }
        }
    }
    derivatives_ = derivatives;
    residuals_ = residuals;
}

// J^T J of one point is dense over the nodes of three axes and the set-up: blocks of six where both nodes are in the
// band, single rows and entries in the border.
void NormalEquations::assemble_point(const AdjustedPoint& point, int number, BorderedBand& matrix) const {
    const int* unknown = unknowns_.data() + first_unknown_[number];
    const int size = first_unknown_[number + 1] - first_unknown_[number];
    const auto rounded_up = [&](int step) { return (size + step - 1) / step * step; };
    thread_local Eigen::MatrixXd square;  // -J^T J
    square.setZero(rounded_up(widest_vector), rounded_up(BorderedBand::block_size));
    for (int r = point.first_reading, end; r < point.end_reading; r = end + 1) {
        for (end = r; end < point.end_reading && problem_->readings()[end].used();) ++end;
        const double* rows = derivatives_.data() + first_weight_[r];
        subtract_product(size, square.cols(), end - r, {rows, size}, {rows, 1, size}, {square.data(), square.rows()});
    }

    const int banded = 6 * matrix.blocks();
    std::array<int, 3> block;
    for (int a = 0; a < 3; ++a) block[a] = problem_->block_of(point.node[a]);
    thread_local std::vector<std::pair<int, int>> of_border;  // into the point's unknowns, and into the border
    of_border.clear();
    for (int i = 0; i < size; ++i)
        if (unknown[i] >= banded)
            if (const int place = matrix.border_place(unknown[i]); place >= 0) of_border.emplace_back(i, place);
    for (int a = 0; a < 3; ++a) {
        if (block[a] == no_unknown) continue;
        for (int b = 0; b <= a; ++b) {
            if (block[b] == no_unknown) continue;
            const int first = block[b] <= block[a] ? a : b, second = a + b - first;
            matrix.block(block[first], block[second]) -= square.block<6, 6>(6 * first, 6 * second);
        }
        auto border = matrix.border_rows(block[a]);
        for (const auto& [i, place] : of_border)
            for (int c = 0; c < 6; ++c) border(place, c) -= square(i, 6 * a + c);
    }
    for (const auto& [i, place_i] : of_border)
        for (const auto& [j, place_j] : of_border)
            if (place_j <= place_i) matrix.corner()(place_i, place_j) -= square(i, j);
    for (int i = 0; i < size && matrix.leaf_unknowns() > 0; ++i) {
        const int leaf_i = matrix.leaf_place(unknown[i]);
        if (leaf_i < 0) continue;
        const int leaf = matrix.leaf_of(leaf_i), start = matrix.leaf_start(leaf);
        double* column = matrix.leaf_column(leaf_i);
        for (int j = 0; j < size; ++j) {
            if (unknown[j] == no_unknown) continue;
            const int leaf_j = matrix.leaf_place(unknown[j]);
            if (leaf_j < 0) column[matrix.leaf_row(unknown[j])] -= square(i, j);
            else if (leaf_j <= leaf_i) matrix.leaf(leaf)(leaf_i - start, leaf_j - start) -= square(i, j);
        }
    }
}

Eigen::VectorXd NormalEquations::gradient(const Eigen::VectorXd& x) const {
    return transposed(residuals_, x) - usual_weight_.cwiseProduct(x - centre_);
}

// J^T w - P x
Eigen::VectorXd NormalEquations::transposed(const Eigen::VectorXd& w, const Eigen::VectorXd& x) const {
    Eigen::VectorXd gradient = Eigen::VectorXd::Zero(problem_->size());
    for (const AdjustedPoint& point : problem_->points())
        for (int r = point.first_reading; r < point.end_reading; ++r) {
            if (!problem_->readings()[r].used()) continue;
            row(point, r).add_to(gradient, w[r]);
        }
    gradient -= prior_weight_.cwiseProduct(x);
    for (const SmoothRow& row : smooth_) {
        const double value = row.value(x);
        for (int i = 0; i < 3; ++i)
            if (row.unknown[i] != no_unknown) gradient[row.unknown[i]] -= row.coefficient[i] * value;
    }
    return gradient;
}

Eigen::VectorXd NormalEquations::gradient_of_shifts(
    const std::function<Eigen::Vector3d(const AdjustedPoint&)>& shift) const {
    Eigen::VectorXd change(residuals_.size());
    for (const AdjustedPoint& point : problem_->points()) {
        const Eigen::Vector3d here = shift(point);
        for (int r = point.first_reading; r < point.end_reading; ++r) change[r] = by_shift_[r].dot(here);
    }
    return gradient_of(change);
}

Eigen::VectorXd NormalEquations::image(const Eigen::VectorXd& v) const {
    Eigen::VectorXd image(residuals_.size());
    for (const AdjustedPoint& point : problem_->points())
        for (int r = point.first_reading; r < point.end_reading; ++r) image[r] = row(point, r).product(v);
    return image;
}

BorderedFactor::Sides NormalEquations::images(const BorderedFactor::Sides& v) const {
    constexpr int sides = BorderedFactor::sides, six = BorderedBand::block_size;
    BorderedFactor::Sides images(residuals_.size() + six, sides), own;
    for (const AdjustedPoint& point : problem_->points()) {
        const int count = point.end_reading - point.first_reading;
        const Row any = row(point, point.first_reading);
        own.resize(any.size, sides);
        for (int i = 0; i < any.size; ++i) {
            if (any.unknown[i] == no_unknown) own.row(i).setZero();
            else own.row(i) = -v.row(any.unknown[i]);
        }
        images.middleRows(point.first_reading, count).setZero();
        // Whole groups of six readings: those beyond are calculated again.
        subtract_product(sides, (count + six - 1) / six * six, any.size, {own.data(), sides},
                         {any.derivative, any.size, 1}, {images.row(point.first_reading).data(), sides});
    }
    return images;
}

BorderedFactor::Sides NormalEquations::products(const BorderedFactor::Sides& v) const {
    const BorderedFactor::Sides images = this->images(v);
    BorderedFactor::Sides products = prior_weight_.asDiagonal() * v;
    for (const AdjustedPoint& point : problem_->points())
        for (int r = point.first_reading; r < point.end_reading; ++r) {
            if (!problem_->readings()[r].used()) continue;
            const Row row = this->row(point, r);
            for (int i = 0; i < row.size; ++i)
                if (row.unknown[i] != no_unknown) products.row(row.unknown[i]) += row.derivative[i] * images.row(r);
        }
    for (const SmoothRow& row : smooth_) {
        BorderedFactor::OfSides value = BorderedFactor::OfSides::Zero();
        for (int i = 0; i < 3; ++i)
            if (row.unknown[i] != no_unknown) value += row.coefficient[i] * v.row(row.unknown[i]);
        for (int i = 0; i < 3; ++i)
            if (row.unknown[i] != no_unknown) products.row(row.unknown[i]) += row.coefficient[i] * value;
    }
    return products;
}

}  // namespace stepdiag
