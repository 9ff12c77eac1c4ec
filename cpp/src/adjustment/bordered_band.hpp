// Symmetric positive semi-definite matrices N = [A C^T; C D] of the adjustment: A block-banded, six unknowns a block, C
// a dense border of scalar rows, D its corner. Cholesky factor, solutions and the inverse on the matrix' own pattern,
// all in time proportional to the number of blocks. Only lower triangles count. Internal.
//
// A part of the border may be leaves: groups of a few unknowns (the set-ups of the lines) of which none is coupled with
// another one, but each with all of the rest. Their time is proportional to their number, because they are eliminated
// first; what that leaves is dense, so the band then reaches from every block to the last.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <vector>

#include "core/block_product.hpp"

namespace stepdiag {

// Column-major numbers that start at a cache line's.
class AlignedNumbers {
public:
    explicit AlignedNumbers(std::ptrdiff_t count) : lines_(count / 8 + 2) {}
    double* data() { return lines_.data()->numbers; }
    const double* data() const { return lines_.data()->numbers; }
    void set_zero() { std::fill(lines_.begin(), lines_.end(), Line{}); }

private:
    struct alignas(64) Line {
        double numbers[8] = {};
    };
    std::vector<Line> lines_;
};

// Unknowns of the border from `first` on, by leaf.
struct Leaves {
    int first = 0;
    std::vector<int> size = {};
};

class BorderedBand {
public:
    static constexpr int block_size = 6;
    using Block = Eigen::Map<Eigen::Matrix<double, 6, 6>, 0, Eigen::OuterStride<>>;
    using ConstBlock = Eigen::Map<const Eigen::Matrix<double, 6, 6>, 0, Eigen::OuterStride<>>;
    using BorderBlock = Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, 6>, 0, Eigen::OuterStride<>>;
    using ConstBorderBlock = Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, 6>, 0, Eigen::OuterStride<>>;

    // All zero. Block column j is coupled with block rows j ... reach[j]; reach does not decrease. `border`: without
    // the leaves; where there are any, all reach to the last block.
    BorderedBand(std::vector<int> reach, int border, const Leaves& leaves = {});
    void set_zero();

    int blocks() const { return int(reach_.size()); }
    int border() const { return border_; }
    int size() const { return block_size * blocks() + border_ + leaf_unknowns(); }
    int reach(int column) const { return reach_[column]; }

    int leaves() const { return int(leaf_start_.size()) - 1; }
    int leaf_unknowns() const { return leaf_start_.back(); }
    int leaf_start(int leaf) const { return leaf_start_[leaf]; }  // of all leaves: its unknowns, and one beyond
    int leaf_size(int leaf) const { return leaf_start_[leaf + 1] - leaf_start_[leaf]; }
    int first_leaf_unknown() const { return block_size * blocks() + first_leaf_; }  // among all unknowns
    // Where an unknown is: among those of the leaves, or among the border's rows; otherwise negative.
    int leaf_place(int unknown) const {
        const int place = unknown - first_leaf_unknown();
        return place < leaf_unknowns() ? place : -1;
    }
    int border_place(int unknown) const {
        const int place = unknown - block_size * blocks();
        if (place < first_leaf_) return place;
        return place < first_leaf_ + leaf_unknowns() ? -1 : place - leaf_unknowns();
    }
    // A leaf's own lower triangle, and how one of its unknowns is coupled with one of the band or the border.
    using Leaf = Eigen::Map<Eigen::MatrixXd>;
    using ConstLeaf = Eigen::Map<const Eigen::MatrixXd>;
    Leaf leaf(int l) { return {leaf_corners_.data() + corner_start_[l], leaf_size(l), leaf_size(l)}; }
    ConstLeaf leaf(int l) const { return {leaf_corners_.data() + corner_start_[l], leaf_size(l), leaf_size(l)}; }
    int leaf_of(int place) const { return leaf_at_[place]; }
    double* leaf_column(int place) { return leaf_columns_.data() + leaf_step_ * place; }
    const double* leaf_column(int place) const { return leaf_columns_.data() + leaf_step_ * place; }
    int leaf_row(int unknown) const {  // of the band or the border
        return unknown < block_size * blocks() ? unknown : int(leaf_border_) + border_place(unknown);
    }
    std::ptrdiff_t leaf_border() const { return leaf_border_; }  // row of the border's first unknown

    // column <= row <= reach(column)
    Block block(int row, int column) { return Block(at(row, column), Eigen::OuterStride<>(band_step_)); }
    ConstBlock block(int row, int column) const {
        return ConstBlock(at(row, column), Eigen::OuterStride<>(band_step_));
    }
    // The border's rows of a block column.
    BorderBlock border_rows(int column) {
        return BorderBlock(border_at(column), border_, block_size, Eigen::OuterStride<>(border_step_));
    }
    ConstBorderBlock border_rows(int column) const {
        return ConstBorderBlock(border_at(column), border_, block_size, Eigen::OuterStride<>(border_step_));
    }
    Eigen::MatrixXd& corner() { return corner_; }
    const Eigen::MatrixXd& corner() const { return corner_; }
    Eigen::VectorXd diagonal() const;

private:
    friend class BorderedFactor;

    double* at(int row, int column) { return band_.data() + block_size * (row + band_step_ * column); }
    const double* at(int row, int column) const { return band_.data() + block_size * (row + band_step_ * column); }
    double* border_at(int column) { return border_rows_.data() + block_size * border_step_ * column; }
    const double* border_at(int column) const { return border_rows_.data() + block_size * border_step_ * column; }
    MatrixView view(int row, int column) { return {at(row, column), band_step_}; }
    ConstMatrixView view(int row, int column) const { return {at(row, column), band_step_}; }
    MatrixView border_view(int column) { return {border_at(column), border_step_}; }
    ConstMatrixView border_view(int column) const { return {border_at(column), border_step_}; }

    std::vector<int> reach_;
    int border_;
    int first_leaf_;
    std::vector<int> leaf_start_, corner_start_, leaf_at_;
    // Element (i, j) of A is at i + j * band_step_ as in a dense matrix, so that rows have a constant step too; columns
    // that are shorter than the matrix overlap only where A is zero.
    std::ptrdiff_t band_step_, border_step_;
    // A leaf's column: rows of the band, from leaf_border_ on rows of the border, each followed by zeros.
    std::ptrdiff_t leaf_border_, leaf_step_;
    AlignedNumbers band_, border_rows_, leaf_columns_;
    std::vector<double> leaf_corners_;
    Eigen::MatrixXd corner_;
};

// A matrix without zeros, of which the lower triangle counts: its last rows are the border.
BorderedBand dense_band(const Eigen::MatrixXd& matrix, int border);

// L of N = L L^T. An unknown whose pivot is at or below `threshold` times its diagonal entry of N depends on those
// before it, or was never observed: it is held at 0. The border comes last, the corner in the order of falling pivots
// (each divided by its diagonal entry of N).
class BorderedFactor {
public:
    BorderedFactor(const BorderedBand& matrix, double threshold);

    // Again, of a matrix of the same pattern. One that is moved here gets other numbers of that pattern in exchange, so
    // that nothing is copied.
    void factorize(const BorderedBand& matrix);
    void factorize(BorderedBand&& matrix);

    // Ascending, 0 ... size - 1.
    const std::vector<int>& held() const { return held_; }

    // Right-hand sides beside each other: one way through the factor serves all of them, in little more time than one.
    // Two vectors of them: each element of the factor that is loaded then serves two products.
    static constexpr int sides = 2 * widest_vector;
    using Sides = Eigen::Matrix<double, Eigen::Dynamic, sides, Eigen::RowMajor>;
    using OfSides = Eigen::Matrix<double, 1, sides>;

    // In place. Held unknowns are 0, whatever is on the right.
    void solve(Eigen::Ref<Eigen::VectorXd> right_hand_side) const;
    void solve(Sides& right_hand_sides) const;
    // v^T N^-1 v = |L^-1 v|^2 without the held unknowns, in half the time of a solution.
    OfSides inverse_squares(const Sides& v) const;

    // L itself, of a matrix without leaves: the band with the reciprocals of its pivots, 0 of held ones, and below it
    // the border's rows; the corner as far as it has rank, its rows and columns being these of the border, in this
    // order.
    const BorderedBand& band() const { return l_; }
    using ConstCorner = Eigen::Map<const Eigen::MatrixXd, 0, Eigen::OuterStride<>>;
    ConstCorner corner_factor() const;
    const std::vector<int>& corner_order() const { return order_; }

    // The inverse of N without the held unknowns, whose rows and columns are 0, on the pattern of N; by Takahashi's
    // recurrence.
    BorderedBand selected_inverse() const;
    void selected_inverse(BorderedBand& inverse) const;  // into a matrix of the same pattern

private:
    using Corner = Eigen::Map<Eigen::MatrixXd, 0, Eigen::OuterStride<>>;
    Corner schur();  // all of it

    // Of one side, or of `sides`.
    template <int Count>
    using Beside = Eigen::Matrix<double, Eigen::Dynamic, Count, Count == 1 ? Eigen::ColMajor : Eigen::RowMajor>;
    template <int Count>
    struct Split;  // by band and border
    template <int Count>
    Beside<Count> divide(Split<Count>& x) const;
    template <int Count>
    Eigen::Matrix<double, 1, Count> divide_leaf(int leaf, double* own, Split<Count>& x) const;
    template <int Count>
    void solve_beside(double* right_hand_sides) const;
    void factorize();
    void factorize_leaf(int leaf);
    void eliminate_leaves();
    void invert_leaves(BorderedBand& inverse) const;
    void eliminate(int column, int first);
    void reduce_corner(ConstMatrixView rows, std::ptrdiff_t count);
    void factorize_corner();
    void invert_corner(Eigen::MatrixXd& inverse) const;

    double threshold_;
    BorderedBand l_;                   // with the reciprocals of the pivots of leaves and band, 0 of held ones
    std::vector<int> leaf_order_;      // of elimination: by place, into its leaf
    Eigen::VectorXd smallest_pivots_;  // of the band
    AlignedNumbers schur_;             // the corner's factor, rows and columns in the order of elimination
    std::vector<int> order_;           // of the border
    int corner_rank_ = 0;
    std::vector<int> held_;
};

}  // namespace stepdiag
