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
BorderedBand::BorderedBand(std::vector<int> reach, int border, const Leaves& leaves)
    : reach_(std::move(reach)),
      border_(border),
      first_leaf_(leaves.first),
      leaf_start_(1, 0),
      corner_start_(1, 0),
      band_step_(six * (half_bandwidth(reach_) + tile_blocks) + six),
      border_step_(round_up(border, lanes)),
      leaf_border_(round_up(six * blocks(), lanes) + lanes),
      leaf_step_(leaf_border_ + border_step_ + lanes),
      band_(six * blocks() * (band_step_ + 1) + band_step_),
      border_rows_(six * blocks() * border_step_ + lanes),
      leaf_columns_(leaves.size.empty() ? 0 : leaf_step_ * (std::reduce(leaves.size.begin(), leaves.size.end()) + six)),
      corner_(MatrixXd::Zero(border, border)) {
    assert(leaves.size.empty() || reach_.empty() || reach_.front() + 1 == blocks());
    for (const int size : leaves.size) {
        leaf_at_.insert(leaf_at_.end(), size, this->leaves());
        leaf_start_.push_back(leaf_start_.back() + size);
        corner_start_.push_back(corner_start_.back() + size * size);
    }
    leaf_corners_.assign(corner_start_.back(), 0.0);
}

void BorderedBand::set_zero() {
    band_.set_zero();
    border_rows_.set_zero();
    leaf_columns_.set_zero();
    std::fill(leaf_corners_.begin(), leaf_corners_.end(), 0.0);
    corner_.setZero();
}

VectorXd BorderedBand::diagonal() const {
    VectorXd all(size());
    for (int j = 0; j < blocks(); ++j) all.segment<6>(6 * j) = block(j, j).diagonal();
    const Index before = first_leaf_, after = border_ - before;
    all.segment(six * blocks(), before) = corner_.diagonal().head(before);
    all.tail(after) = corner_.diagonal().tail(after);
    for (int l = 0; l < leaves(); ++l)
        all.segment(first_leaf_unknown() + leaf_start_[l], leaf_size(l)) = leaf(l).diagonal();
    return all;
}

BorderedFactor::BorderedFactor(const BorderedBand& matrix, double threshold)
    : threshold_(threshold),
      l_(matrix),
      leaf_order_(matrix.leaf_unknowns()),
      schur_(matrix.border_step_ * round_up(matrix.border_, six)) {
    factorize();
}

BorderedFactor::Corner BorderedFactor::schur() {
    return Corner(schur_.data(), l_.border_, l_.border_, OuterStride<>(l_.border_step_));
}

BorderedBand dense_band(const MatrixXd& matrix, int border) {
    const int blocks = (int(matrix.rows()) - border) / six;
    BorderedBand band(std::vector<int>(std::size_t(blocks), blocks - 1), border);
    for (int column = 0; column < blocks; ++column) {
        for (int row = column; row < blocks; ++row)
            band.block(row, column) = matrix.block<six, six>(six * row, six * column);
        band.border_rows(column) = matrix.block(six * blocks, six * column, border, six);
    }
    band.corner() = matrix.bottomRightCorner(border, border);
    return band;
}

BorderedFactor::ConstCorner BorderedFactor::corner_factor() const {
    return ConstCorner(schur_.data(), corner_rank_, corner_rank_, OuterStride<>(l_.border_step_));
}

void BorderedFactor::factorize(const BorderedBand& matrix) {
    assert(matrix.reach_ == l_.reach_ && matrix.border_ == l_.border_ && matrix.leaf_start_ == l_.leaf_start_);
    l_ = matrix;
    factorize();
}

void BorderedFactor::factorize(BorderedBand&& matrix) {
    assert(matrix.reach_ == l_.reach_ && matrix.border_ == l_.border_ && matrix.leaf_start_ == l_.leaf_start_);
    std::swap(l_, matrix);
    factorize();
}

void BorderedFactor::factorize() {
    held_.clear();
    schur() = l_.corner_;
    smallest_pivots_.resize(six * l_.blocks());
    for (int j = 0; j < l_.blocks(); ++j) smallest_pivots_.segment<6>(6 * j) = threshold_ * l_.block(j, j).diagonal();
    eliminate_leaves();
    int first = 0;  // block column that reaches down to `column`
    for (int column = 0; column < l_.blocks(); ++column) {
        while (l_.reach(first) < column) ++first;
        eliminate(column, first);
        const int done = column % chunk + 1;
        if (done == chunk || column + 1 == l_.blocks()) reduce_corner(l_.border_view(column + 1 - done), six * done);
    }
    factorize_corner();
    std::sort(held_.begin(), held_.end());
}

// The factor of one leaf, the largest pivots first (each divided by its diagonal entry of N), and its columns of L.
void BorderedFactor::factorize_leaf(int leaf) {
    const int size = l_.leaf_size(leaf), start = l_.leaf_start(leaf);
    auto l = l_.leaf(leaf);
    for (int j = 0; j < size; ++j)
        for (int i = 0; i < j; ++i) l(i, j) = l(j, i);
    Eigen::Map<MatrixXd> columns(l_.leaf_column(start), l_.leaf_step_, size);
    int* order = leaf_order_.data() + start;
    std::iota(order, order + size, 0);
    const VectorXd diagonal = l.diagonal();
    for (int k = 0; k < size; ++k) {
        const auto part = [&](int p) { return diagonal[p] > 0.0 ? l(p, p) / diagonal[p] : 0.0; };
        std::swap(order[k],
                  *std::max_element(order + k, order + size, [&](int a, int b) { return part(a) < part(b); }));
        const int own = order[k];
        const bool determined = part(own) > threshold_;
        if (!determined) held_.push_back(l_.first_leaf_unknown() + start + own);
        l(own, own) = determined ? 1.0 / std::sqrt(l(own, own)) : 0.0;
        columns.col(own) *= l(own, own);
        for (int i = k + 1; i < size; ++i) l(order[i], own) *= l(own, own);
        for (int j = k + 1; j < size; ++j) {
            columns.col(order[j]) -= l(order[j], own) * columns.col(own);
            for (int i = k + 1; i < size; ++i) l(order[i], order[j]) -= l(order[i], own) * l(order[j], own);
        }
    }
}

// Leaf by leaf, and what they explain of band and corner: N - W W^T.
void BorderedFactor::eliminate_leaves() {
    for (int leaf = 0; leaf < l_.leaves(); ++leaf) factorize_leaf(leaf);
    const std::ptrdiff_t step = l_.leaf_step_;
    for (int first = 0; first < l_.leaf_unknowns(); first += panel) {
        const std::ptrdiff_t count = std::min<std::ptrdiff_t>(panel, l_.leaf_unknowns() - first);
        const double *w = l_.leaf_column(first), *of_border = w + l_.leaf_border_;
        for (int column = 0; column < l_.blocks(); ++column) {
            const double* own = w + six * column;
            subtract_product(six * (l_.blocks() - column), six, count, {own, step}, {own, 1, step},
                             l_.view(column, column));
            subtract_product(l_.border_, six, count, {of_border, step}, {own, 1, step}, l_.border_view(column));
        }
        reduce_corner({of_border, step}, count);
    }
}

// What the block columns before it do to this one, then its own factor.
void BorderedFactor::eliminate(int column, int first) {
    const Vector6 smallest_pivots = smallest_pivots_.segment<6>(six * column);
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

// The corner's lower triangle less what these columns of the border's rows explain of it: D - C C^T.
void BorderedFactor::reduce_corner(ConstMatrixView c, std::ptrdiff_t count) {
    const Index border = l_.border_, step = l_.border_step_;
    for (Index column = 0; column < border; column += six) {
        const Index row = column / lanes * lanes;
        subtract_product(border - row, six, count, {c.from + row, c.step}, {c.from + column, 1, c.step},
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
    for (; k < border; ++k)
        held_.push_back(int(six) * l_.blocks() + order_[k] + (order_[k] < l_.first_leaf_ ? 0 : l_.leaf_unknowns()));
}

namespace {

// Y -= A X and X -= A^T Y for six rows X of `Count` right sides beside each other.
template <int Count>
void subtract_columns_beside(Index rows, ConstMatrixView a, const double* x, double* y) {
    if constexpr (Count == 1) subtract_columns(rows, a, x, y);
    else subtract_product(Count, round_up(rows, six), six, {x, Count}, {a.from, 1, a.step}, {y, Count});
}

template <int Count>
void subtract_sums_beside(Index rows, ConstMatrixView a, const double* y, double* x) {
    if constexpr (Count == 1) subtract_sums(rows, a, y, x);
    else subtract_product(Count, six, rows, {y, Count}, {a.from, a.step, 1}, {x, Count});
}

}  // namespace

// Right sides without their leaves. Both parts are followed by zeros for as many rows as kernels go beyond them.
template <int Count>
struct BorderedFactor::Split {
    Beside<Count> band_rows, border_rows;
    Index before;  // rows of the border before the leaves

    Split(const BorderedBand& l, const double* from)
        : band_rows(six * l.blocks() + lanes, Count), border_rows(l.border_ + lanes, Count), before(l.first_leaf_) {
        const Eigen::Map<const Beside<Count>> all(from, l.size(), Count);
        band() = all.topRows(band().rows());
        border().topRows(before) = all.middleRows(band().rows(), before);
        border().bottomRows(l.border_ - before) = all.bottomRows(l.border_ - before);
        band_rows.bottomRows(lanes).setZero();
        border_rows.bottomRows(lanes).setZero();
    }
    void copy_to(double* to, Index size) {
        Eigen::Map<Beside<Count>> all(to, size, Count);
        all.topRows(band().rows()) = band();
        all.middleRows(band().rows(), before) = border().topRows(before);
        all.bottomRows(border().rows() - before) = border().bottomRows(border().rows() - before);
    }
    auto band() { return band_rows.topRows(band_rows.rows() - lanes); }
    auto border() { return border_rows.topRows(border_rows.rows() - lanes); }
};

// L^-1 of right sides: their band in place, what belongs to the border returned.
template <int Count>
BorderedFactor::Beside<Count> BorderedFactor::divide(Split<Count>& x) const {
    double* own = x.band_rows.data();
    for (int column = 0; column < l_.blocks(); ++column, own += six * Count) {
        if constexpr (Count == 1) {
            const auto l = l_.block(column, column);
            for (int i = 0; i < six; ++i) {
                for (int k = 0; k < i; ++k) own[i] -= l(i, k) * own[k];
                own[i] = l(i, i) == 0.0 ? 0.0 : own[i] * l(i, i);
            }
        } else {
            divide_by_transpose(Count, l_.view(column, column), {own, Count});
        }
        subtract_columns_beside<Count>(six * (l_.reach(column) - column), l_.view(column + 1, column), own,
                                       own + six * Count);
        subtract_columns_beside<Count>(l_.border_, l_.border_view(column), own, x.border_rows.data());
    }
    Beside<Count> determined(corner_rank_, Count);
    for (int i = 0; i < corner_rank_; ++i) determined.row(i) = x.border().row(order_[i]);
    corner_factor().triangularView<Eigen::Lower>().solveInPlace(determined);
    return determined;
}

// L^-1 of what belongs to a leaf, in place, its part taken off the rest; its square sums.
template <int Count>
Eigen::Matrix<double, 1, Count> BorderedFactor::divide_leaf(int leaf, double* own_numbers, Split<Count>& x) const {
    const int size = l_.leaf_size(leaf), start = l_.leaf_start(leaf);
    const auto l = l_.leaf(leaf);
    const int* order = leaf_order_.data() + start;
    Eigen::Map<Beside<Count>> own(own_numbers, size, Count);
    Eigen::Matrix<double, 1, Count> square = Eigen::Matrix<double, 1, Count>::Zero();
    for (int k = 0; k < size; ++k) {
        const int column = order[k];
        own.row(column) *= l(column, column);
        if (own.row(column).isZero(0.0)) continue;
        square += own.row(column).cwiseAbs2();
        for (int i = k + 1; i < size; ++i) own.row(order[i]) -= l(order[i], column) * own.row(column);
        const double* w = l_.leaf_column(start + column);
        x.band().noalias() -= Eigen::Map<const VectorXd>(w, six * l_.blocks()) * own.row(column);
        x.border().noalias() -= Eigen::Map<const VectorXd>(w + l_.leaf_border_, l_.border_) * own.row(column);
    }
    return square;
}

BorderedFactor::OfSides BorderedFactor::inverse_squares(const Sides& v) const {
    Split<sides> x(l_, v.data());
    OfSides squares = OfSides::Zero();
    for (int leaf = 0; leaf < l_.leaves(); ++leaf) {
        Sides own = v.middleRows(l_.first_leaf_unknown() + l_.leaf_start(leaf), l_.leaf_size(leaf));
        squares += divide_leaf<sides>(leaf, own.data(), x);
    }
    squares += divide(x).colwise().squaredNorm();
    return squares + x.band().colwise().squaredNorm();
}

void BorderedFactor::solve(Eigen::Ref<VectorXd> right_hand_side) const { solve_beside<1>(right_hand_side.data()); }

void BorderedFactor::solve(Sides& right_hand_sides) const { solve_beside<sides>(right_hand_sides.data()); }

template <int Count>
void BorderedFactor::solve_beside(double* right_hand_sides) const {
    Split<Count> x(l_, right_hand_sides);
    double* of_leaves = right_hand_sides + Count * l_.first_leaf_unknown();
    for (int leaf = 0; leaf < l_.leaves(); ++leaf) divide_leaf<Count>(leaf, of_leaves + Count * l_.leaf_start(leaf), x);
    Beside<Count> determined = divide(x);
    corner_factor().transpose().triangularView<Eigen::Upper>().solveInPlace(determined);
    x.border().setZero();
    for (int i = 0; i < corner_rank_; ++i) x.border().row(order_[i]) = determined.row(i);

    for (int column = l_.blocks() - 1; column >= 0; --column) {
        const auto l = l_.block(column, column);
        double* own_numbers = x.band_rows.data() + six * Count * column;
        subtract_sums_beside<Count>(six * (l_.reach(column) - column), l_.view(column + 1, column),
                                    own_numbers + six * Count, own_numbers);
        subtract_sums_beside<Count>(l_.border_, l_.border_view(column), x.border_rows.data(), own_numbers);
        Eigen::Map<Eigen::Matrix<double, six, Count, Count == 1 ? Eigen::ColMajor : Eigen::RowMajor>> own(own_numbers);
        for (int i = six - 1; i >= 0; --i) {
            for (int k = i + 1; k < six; ++k) own.row(i) -= l(k, i) * own.row(k);
            own.row(i) *= l(i, i);
        }
    }
    for (int leaf = 0; leaf < l_.leaves(); ++leaf) {
        const auto l = l_.leaf(leaf);
        const int start = l_.leaf_start(leaf), *order = leaf_order_.data() + start;
        Eigen::Map<Beside<Count>> own(of_leaves + Count * start, l_.leaf_size(leaf), Count);
        for (int k = l_.leaf_size(leaf) - 1; k >= 0; --k) {
            const int column = order[k];
            const double* w = l_.leaf_column(start + column);
            own.row(column) -= Eigen::Map<const Eigen::RowVectorXd>(w, six * l_.blocks()) * x.band() +
                               Eigen::Map<const Eigen::RowVectorXd>(w + l_.leaf_border_, l_.border_) * x.border();
            for (int i = k + 1; i < l_.leaf_size(leaf); ++i) own.row(column) -= l(order[i], column) * own.row(order[i]);
            own.row(column) *= l(column, column);
        }
    }
    x.copy_to(right_hand_sides, l_.size());
}

BorderedBand BorderedFactor::selected_inverse() const {
    BorderedBand inverse = l_;
    inverse.set_zero();
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
    if (l_.leaves() > 0) invert_leaves(z);
}

// With Z of band and border, which is dense here, and the columns W of a leaf:
//   Z_rl = -Z W L^-1,    Z_ll = L^-T (L^-1 - W^T Z_rl).
void BorderedFactor::invert_leaves(BorderedBand& z) const {
    const Index step = l_.leaf_step_, border = l_.border_, at = l_.leaf_border_;
    AlignedNumbers numbers(step * step);
    Eigen::Map<MatrixXd> dense(numbers.data(), step, step);
    for (int j = 0; j < l_.blocks(); ++j) {
        for (int i = j; i < l_.blocks(); ++i) dense.block<6, 6>(6 * i, 6 * j) = z.block(i, j);
        dense.block(at, six * j, border, six) = z.border_rows(j);
    }
    dense.block(at, at, border, border) = z.corner_;
    for (Index j = 0; j < step; ++j)
        for (Index i = 0; i < j; ++i) dense(i, j) = dense(j, i);
    const Index used = at + border;
    for (int first = 0; first < l_.leaves();) {
        int end = first + 1;
        while (end < l_.leaves() && l_.leaf_start(end + 1) - l_.leaf_start(first) <= panel) ++end;
        const int start = l_.leaf_start(first), count = l_.leaf_start(end) - start;
        std::fill_n(z.leaf_column(start), step * count, 0.0);
        // Whole groups of six columns: those beyond are calculated again.
        subtract_product(used, round_up(count, six), used, {dense.data(), step}, {l_.leaf_column(start), step, 1},
                         {z.leaf_column(start), step});
        for (int leaf = first; leaf < end; ++leaf) {
            const int size = l_.leaf_size(leaf), *order = leaf_order_.data() + l_.leaf_start(leaf);
            const auto l = l_.leaf(leaf);
            Eigen::Map<const MatrixXd> w(l_.leaf_column(l_.leaf_start(leaf)), step, size);
            Eigen::Map<MatrixXd> columns(z.leaf_column(l_.leaf_start(leaf)), step, size);
            MatrixXd inverse_of_l = MatrixXd::Zero(size, size);
            for (int k = size - 1; k >= 0; --k) {
                for (int i = k + 1; i < size; ++i)
                    columns.col(order[k]) -= l(order[i], order[k]) * columns.col(order[i]);
                columns.col(order[k]) *= l(order[k], order[k]);
            }
            for (int j = 0; j < size; ++j)
                for (int i = j; i < size; ++i) {
                    double sum = i == j ? 1.0 : 0.0;
                    for (int k = j; k < i; ++k) sum -= l(order[i], order[k]) * inverse_of_l(order[k], order[j]);
                    inverse_of_l(order[i], order[j]) = sum * l(order[i], order[i]);
                }
            MatrixXd own = inverse_of_l;
            own.noalias() -= w.transpose() * columns;
            z.leaf(leaf).noalias() = inverse_of_l.transpose() * own;
        }
        first = end;
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
