#include "adjustment/bordered_band.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cassert>
#include <cmath>
#include <numeric>

namespace stepdiag {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::OuterStride;
using Eigen::VectorXd;
using Matrix6 = Eigen::Matrix<double, 6, 6>;
using Vector6 = Eigen::Matrix<double, 6, 1>;

constexpr std::ptrdiff_t six = BorderedBand::block_size;
constexpr std::ptrdiff_t lanes = widest_vector;  // what holds a block's six rows
constexpr int tile_blocks = 4;                   // 24 rows: whole vectors of any width
constexpr std::ptrdiff_t panel = 48;             // columns of the corner, again whole vectors
constexpr int chunk = 16;                        // block columns that the corner learns of at once: 18 kB of a tile

std::ptrdiff_t round_up(std::ptrdiff_t n, std::ptrdiff_t step) { return (n + step - 1) / step * step; }

int half_bandwidth(const std::vector<int>& reach) {
    int blocks = 0;
    for (std::size_t j = 0; j < reach.size(); ++j) {
        assert(reach[j] >= int(j) && reach[j] < int(reach.size()) && (j == 0 || reach[j] >= reach[j - 1]));
        blocks = std::max(blocks, reach[j] - int(j));
    }
    return blocks;
}

// In place, with reciprocals on the diagonal: 0 of unknowns that are held, so that whatever is divided by them is 0.
void factorize_block(BorderedBand::Block l, const Vector6& smallest_pivots, int first, std::vector<int>& held) {
    for (int j = 0; j < six; ++j) {
        double pivot = l(j, j);
        for (int k = 0; k < j; ++k) pivot -= l(j, k) * l(j, k);
        const bool determined = pivot > smallest_pivots[j];
        if (!determined) held.push_back(first + j);
        l(j, j) = determined ? 1.0 / std::sqrt(pivot) : 0.0;
        for (int i = j + 1; i < six; ++i) {
            double sum = l(i, j);
            for (int k = 0; k < j; ++k) sum -= l(i, k) * l(j, k);
            l(i, j) = sum * l(j, j);
        }
    }
}

Matrix6 inverse_of_factor(const BorderedBand::ConstBlock& l) {
    Matrix6 inverse = Matrix6::Zero();
    for (int j = 0; j < six; ++j) {
        inverse(j, j) = l(j, j);
        for (int i = j + 1; i < six; ++i) {
            double sum = 0.0;
            for (int k = j; k < i; ++k) sum -= l(i, k) * inverse(k, j);
            inverse(i, j) = sum * l(i, i);
        }
    }
    return inverse;
}

}  // namespace

// A band's columns are followed by zeros for as many rows as a tile may go beyond them, then by what the upper triangle
// of the next diagonal blocks may hold.
BorderedBand::BorderedBand(std::vector<int> reach, int border)
    : reach_(std::move(reach)),
      border_(border),
      band_step_(six * (half_bandwidth(reach_) + tile_blocks) + six),
      border_step_(round_up(border, lanes)),
      band_(six * blocks() * (band_step_ + 1) + band_step_),
      border_rows_(six * blocks() * border_step_ + lanes),
      corner_(MatrixXd::Zero(border, border)) {}

void BorderedBand::set_zero() {
    band_.set_zero();
    border_rows_.set_zero();
    corner_.setZero();
}

VectorXd BorderedBand::diagonal() const {
    VectorXd all(size());
    for (int j = 0; j < blocks(); ++j) all.segment<6>(6 * j) = block(j, j).diagonal();
    all.tail(border_) = corner_.diagonal();
    return all;
}

BorderedFactor::BorderedFactor(const BorderedBand& matrix, double threshold)
    : threshold_(threshold), l_(matrix), schur_(matrix.border_step_ * round_up(matrix.border_, six)) {
    factorize();
}

BorderedFactor::Corner BorderedFactor::schur() {
    return Corner(schur_.data(), l_.border_, l_.border_, OuterStride<>(l_.border_step_));
}

BorderedFactor::ConstCorner BorderedFactor::corner_factor() const {
    return ConstCorner(schur_.data(), corner_rank_, corner_rank_, OuterStride<>(l_.border_step_));
}

void BorderedFactor::factorize(const BorderedBand& matrix) {
    assert(matrix.reach_ == l_.reach_ && matrix.border_ == l_.border_);
    l_ = matrix;
    factorize();
}

void BorderedFactor::factorize(BorderedBand&& matrix) {
    assert(matrix.reach_ == l_.reach_ && matrix.border_ == l_.border_);
    std::swap(l_, matrix);
    factorize();
}

void BorderedFactor::factorize() {
    held_.clear();
    schur() = l_.corner_;
    int first = 0;  // block column that reaches down to `column`
    for (int column = 0; column < l_.blocks(); ++column) {
        while (l_.reach(first) < column) ++first;
        eliminate(column, first);
        const int done = column % chunk + 1;
        if (done == chunk || column + 1 == l_.blocks()) reduce_corner(column + 1 - done, done);
    }
    factorize_corner();
    std::sort(held_.begin(), held_.end());
}

// What the block columns before it do to this one, then its own factor.
void BorderedFactor::eliminate(int column, int first) {
    const Vector6 smallest_pivots = threshold_ * l_.block(column, column).diagonal();
    const int reach = l_.reach(column);
    const auto columns_before = [&](int from) { return six * (column - from); };
    for (int row = column, from = first; row <= reach; row += tile_blocks) {
        while (l_.reach(from) < row) ++from;
        if (from >= column) break;
        subtract_product(six * std::min(tile_blocks, reach - row + 1), six, columns_before(from), l_.view(row, from),
                         {l_.at(column, from), 1, l_.band_step_}, l_.view(row, column));
    }
    subtract_product(l_.border_, six, columns_before(first), l_.border_view(first),
                     {l_.at(column, first), 1, l_.band_step_}, l_.border_view(column));
    factorize_block(l_.block(column, column), smallest_pivots, int(six) * column, held_);
    divide_by_transpose(six * (reach - column), l_.view(column, column), l_.view(column + 1, column));
    divide_by_transpose(l_.border_, l_.view(column, column), l_.border_view(column));
}

// The corner's lower triangle less what these block columns explain of it: D - C C^T.
void BorderedFactor::reduce_corner(int first, int count) {
    const Index border = l_.border_, step = l_.border_step_;
    const double* c = l_.border_at(first);
    for (Index column = 0; column < border; column += six) {
        const Index row = column / lanes * lanes;
        subtract_product(border - row, six, six * count, {c + row, step}, {c + column, 1, step},
                         {schur_.data() + row + column * step, step});
    }
}

// With the largest pivots first; rank is decided where nothing better is left.
void BorderedFactor::factorize_corner() {
    const Index border = l_.border_, step = l_.border_step_;
    auto s = schur();
    for (Index i = 0; i < border; ++i) s.row(i).tail(border - i) = s.col(i).tail(border - i).transpose();
    order_.resize(border);
    std::iota(order_.begin(), order_.end(), 0);
    VectorXd pivots = s.diagonal();
    VectorXd weights = l_.corner_.diagonal().unaryExpr([](double d) { return d > 0.0 ? 1.0 / d : 0.0; });
    Index k = 0, first = 0;  // first column of the panel; the columns behind it do not know of the panel yet
    for (; k < border; ++k) {
        Index best;
        const Index left = border - k - 1;
        if (!(pivots.tail(left + 1).cwiseProduct(weights.tail(left + 1)).maxCoeff(&best) > threshold_)) break;
        best += k;
        s.row(k).swap(s.row(best));
        s.col(k).swap(s.col(best));
        std::swap(order_[k], order_[best]);
        std::swap(pivots[k], pivots[best]);
        std::swap(weights[k], weights[best]);

        s(k, k) = std::sqrt(pivots[k]);
        auto below = s.col(k).tail(left);
        below.noalias() -= s.block(k + 1, first, left, k - first) * s.row(k).segment(first, k - first).transpose();
        below /= s(k, k);
        pivots.tail(left) -= below.cwiseAbs2();
        if (k + 1 - first < panel || left == 0) continue;
        double* rest = schur_.data() + (k + 1) * step + k + 1;
        const double* done = schur_.data() + first * step + k + 1;
        subtract_product(left, round_up(left, six), panel, {done, step}, {done, 1, step}, {rest, step});
        first = k + 1;
    }
    corner_rank_ = int(k);
    for (; k < border; ++k) held_.push_back(int(six) * l_.blocks() + order_[k]);
}

// L^-1 of a right side: its band in place, what belongs to the border returned.
VectorXd BorderedFactor::divide(double* x, double* border_part) const {
    const Index border = l_.border_;
    for (int column = 0; column < l_.blocks(); ++column) {
        const auto l = l_.block(column, column);
        double* own = x + six * column;
        for (int i = 0; i < six; ++i) {
            for (int k = 0; k < i; ++k) own[i] -= l(i, k) * own[k];
            own[i] = l(i, i) == 0.0 ? 0.0 : own[i] * l(i, i);
        }
        subtract_columns(six * (l_.reach(column) - column), l_.view(column + 1, column), own, own + six);
        subtract_columns(border, l_.border_view(column), own, border_part);
    }
    VectorXd determined(corner_rank_);
    for (int i = 0; i < corner_rank_; ++i) determined[i] = border_part[order_[i]];
    corner_factor().triangularView<Eigen::Lower>().solveInPlace(determined);
    return determined;
}

double BorderedFactor::inverse_square(const VectorXd& v) const {
    const Index unknowns = six * l_.blocks(), border = l_.border_;
    AlignedNumbers band(unknowns + lanes), rest(border);
    std::copy_n(v.data(), unknowns, band.data());
    std::copy_n(v.data() + unknowns, border, rest.data());
    const VectorXd determined = divide(band.data(), rest.data());
    return determined.squaredNorm() + Eigen::Map<const VectorXd>(band.data(), unknowns).squaredNorm();
}

void BorderedFactor::solve(Eigen::Ref<VectorXd> right_hand_side) const {
    const Index unknowns = six * l_.blocks(), border = l_.border_;
    AlignedNumbers band(unknowns + lanes), rest(border);
    double* x = band.data();
    Eigen::Map<VectorXd> y(rest.data(), border);
    std::copy_n(right_hand_side.data(), unknowns, x);
    y = right_hand_side.tail(border);
    VectorXd determined = divide(x, y.data());
    corner_factor().transpose().triangularView<Eigen::Upper>().solveInPlace(determined);
    y.setZero();
    for (int i = 0; i < corner_rank_; ++i) y[order_[i]] = determined[i];

    for (int column = l_.blocks() - 1; column >= 0; --column) {
        const auto l = l_.block(column, column);
        double* own = x + six * column;
        subtract_sums(six * (l_.reach(column) - column), l_.view(column + 1, column), own + six, own);
        subtract_sums(border, l_.border_view(column), y.data(), own);
        for (int i = six - 1; i >= 0; --i) {
            for (int k = i + 1; k < six; ++k) own[i] -= l(k, i) * own[k];
            own[i] *= l(i, i);
        }
    }
    std::copy_n(x, unknowns, right_hand_side.data());
    right_hand_side.tail(border) = y;
}

BorderedBand BorderedFactor::selected_inverse() const {
    BorderedBand inverse(l_.reach_, l_.border_);
    selected_inverse(inverse);
    return inverse;
}

// With Y = L_Sj L_jj^-1, S the rows below block j that it is coupled with:
//   Z_jS = -Y^T Z_SS,    Z_jj = L_jj^-T L_jj^-1 - Y^T Z_Sj,
// calculated in rows of Y^T and Z_jS that fill one vector, so that Z_SS is read from its lower triangle.
void BorderedFactor::selected_inverse(BorderedBand& z) const {
    const Index border = l_.border_, border_step = l_.border_step_, border_columns = round_up(border, six);
    AlignedNumbers corner(border_step * border_columns);
    invert_corner(z.corner_);
    Eigen::Map<MatrixXd, 0, OuterStride<>>(corner.data(), border, border, OuterStride<>(border_step)) = z.corner_;

    const Index most = l_.band_step_ + border_columns;
    AlignedNumbers y_rows(lanes * most), z_rows(lanes * most);
    Eigen::Matrix<double, lanes, six> a, own;
    a.setZero(), own.setZero();
    for (int j = l_.blocks() - 1; j >= 0; --j) {
        const int coupled = l_.reach(j) - j;
        const Index band = six * coupled;
        const MatrixView y{y_rows.data(), lanes}, y_border{y.from + lanes * band, lanes};
        const MatrixView zj{z_rows.data(), lanes}, zj_border{zj.from + lanes * band, lanes};
        std::fill_n(y.from, lanes * (band + border_columns), 0.0);
        std::fill_n(zj.from, lanes * (band + border_columns), 0.0);

        const Matrix6 inverse = inverse_of_factor(l_.block(j, j));
        a.topRows<six>() = -inverse.transpose();
        own.topRows<six>() = inverse.transpose() * inverse;
        subtract_product(six, band, six, {a.data(), lanes}, {l_.at(j + 1, j), 1, l_.band_step_}, y);
        subtract_product(six, border_columns, six, {a.data(), lanes}, {l_.border_at(j), 1, border_step}, y_border);

        for (int c = 0; c < coupled; ++c) {  // right and left of the diagonal block
            const MatrixView to{zj.from + lanes * six * c, lanes};
            subtract_product(six, six, six * c, y, {z.at(j + 1 + c, j + 1), 1, z.band_step_}, to);
            subtract_product(six, six, band - six * c, {y.from + lanes * six * c, lanes},
                             {z.at(j + 1 + c, j + 1 + c), z.band_step_, 1}, to);
        }
        subtract_product(six, band, border, y_border, {z.border_at(j + 1), border_step, 1}, zj);
        subtract_product(six, border_columns, band, y, {z.border_at(j + 1), 1, border_step}, zj_border);
        subtract_product(six, border_columns, border, y_border, {corner.data(), border_step, 1}, zj_border);
        subtract_product(six, six, band, y, {zj.from, 1, lanes}, {own.data(), lanes});
        subtract_product(six, six, border, y_border, {zj_border.from, 1, lanes}, {own.data(), lanes});

        z.block(j, j) = own.topRows<six>().selfadjointView<Eigen::Lower>();
        Eigen::Map<const Eigen::Matrix<double, lanes, Eigen::Dynamic>> rows(zj.from, lanes, band + border_columns);
        Eigen::Map<MatrixXd, 0, OuterStride<>>(z.at(j + 1, j), band, six, OuterStride<>(z.band_step_)) =
            rows.topLeftCorner(six, band).transpose();
        z.border_rows(j) = rows.block(0, band, six, border).transpose();
    }
}

void BorderedFactor::invert_corner(MatrixXd& inverse) const {
    const Index rank = corner_rank_;
    MatrixXd inverse_of_l = MatrixXd::Identity(rank, rank);
    corner_factor().triangularView<Eigen::Lower>().solveInPlace(inverse_of_l);
    const MatrixXd determined = inverse_of_l.transpose() * inverse_of_l;
    inverse.setZero();
    for (Index i = 0; i < rank; ++i)
        for (Index k = 0; k < rank; ++k) inverse(order_[i], order_[k]) = determined(i, k);
}

}  // namespace stepdiag
