// Linear trends of a run: sums of length increments over the travel of an axis determine scales, squarenesses and laser
// angles. To first order, at lateral travel (x, y) and axis positions p, the length of line d changes by
//   n_d . sum_a delta_a(p_a)  -  a_d y + b_d x,      where (a_d, b_d) are the line's laser angles,
// with delta_X(end) = (EXX, 0, 0), delta_Y(end) = (-C0Y Y, EYY, 0), delta_Z(end) = (B0Z Z, -A0Z Z, EZZ). The three
// slopes that are 0 are the choice of frame. There is one equation for each line and axis, and one for each scale line.
// The angles of a line's lasers are in its own equations, but where lines that lost readings borrow from others. Of
// many passes they are eliminated pass by pass, so that the rest has few unknowns. Internal.
#pragma once

#include <map>
#include <vector>

#include "evaluation/linear_evaluation.hpp"

namespace stepdiag {

class SlopeSystem {
public:
    static constexpr int first_laser_angle = 6;
    static int scale(Axis axis) { return index(axis); }                      // EXX(X), EYY(Y), EZZ(Z)
    static int squareness(Squareness s) { return 3 + static_cast<int>(s); }  // C0Y, B0Z, A0Z
    static int laser_angle(int pass, int which) { return first_laser_angle + 2 * pass + which; }

    bool determines_scale(Axis axis) const { return determined_[scale(axis)]; }
    bool determines(Squareness s) const { return determined_[squareness(s)]; }

    // Combinations of unknowns that remain undetermined: each column solves the equations with 0 on the right-hand
    // side.
    const Eigen::MatrixXd& null_space() const { return null_space_; }

    template <class Number>
    std::vector<Number> solve(const std::vector<Number>& lengths) const {
        const std::vector<Number> sums = right_sides(lengths), reduced = reduced_sides(sums);
        std::vector<Number> slopes(unknowns_, Number::Zero());
        for (Eigen::Index j = 0; j < inverse_.rows(); ++j) {
            Number& slope = slopes[std::size_t(kept_[std::size_t(j)])];
            for (Eigen::Index i = 0; i < inverse_.cols(); ++i) slope += inverse_(j, i) * reduced[std::size_t(i)];
        }
        for (const Eliminated& pass : eliminated_)
            for (int k = 0; k < 2; ++k) {
                Number& angle = slopes[std::size_t(pass.first_angle + k)];
                for (Eigen::Index i = 0; i < pass.inverse.cols(); ++i)
                    angle += pass.inverse(k, i) * sums[std::size_t(pass.first_equation + i)];
                for (Eigen::Index j = 0; j < pass.by_kept.cols(); ++j)
                    if (pass.by_kept(k, j) != 0.0)
                        angle -= pass.by_kept(k, j) * slopes[std::size_t(kept_[std::size_t(j)])];
            }
        return slopes;
    }

    template <class Number>
    void add_contradictions(const std::vector<Number>& lengths, Thinning& thinning, std::vector<Number>& out) const {
        stepdiag::add_contradictions<Number>(
            contradictions_, [&] { return reduced_sides(right_sides(lengths)); }, thinning, out);
    }

    template <class Number>
    void correct_for_laser_angles(const std::vector<Number>& slopes, const std::vector<Pass>& passes,
                                  std::vector<Number>& lengths) const {
        for (std::size_t v = 0; v < passes.size(); ++v)
            for (std::size_t k = 0; k < passes[v].points.size(); ++k) {
                const Eigen::Vector2d lateral = passes[v].points[k].lateral;
                Number& length = lengths[passes[v].first_reading + k];
                length += lateral.y() * slopes[laser_angle(int(v), 0)] - lateral.x() * slopes[laser_angle(int(v), 1)];
            }
    }

private:
    friend SlopeSystem make_slope_system(const std::vector<Pass>&, const Plan&, const AxisSystems&,
                                         const std::vector<bool>&);

    struct Term {
        int reading;
        double coefficient;
    };
    struct Equation {
        int pass;
        std::map<int, double> coefficient;  // by unknown
        double standard_uncertainty;
    };
    // The system of the unknowns that are kept, while it is made: its rows, and the angles that nothing determines.
    struct Reduced {
        std::vector<bool> is_eliminated;  // by pass: its angles
        std::vector<int> place;           // of each unknown among those that are kept; -1: it is not
        std::vector<Eigen::RowVectorXd> rows;
        std::vector<double> standard_uncertainty;
        std::vector<std::pair<int, Eigen::Vector2d>> open;  // first angle of a pass, and a direction
    };
    void solve_equations(const std::vector<Equation>& equations, const std::vector<Pass>& passes, const Plan& plan);
    Reduced choose_kept(const std::vector<Equation>& equations, const std::vector<Pass>& passes);
    Eigen::RowVectorXd row_of(const Equation& equation, const Reduced& reduced) const;
    Eigen::Matrix2d eliminate_angles(const std::vector<Equation>& equations, std::size_t first, std::size_t end,
                                     Reduced& reduced);
    void solve_kept(const Reduced& reduced);
    template <class Number>
    std::vector<Number> right_sides(const std::vector<Number>& lengths) const {
        std::vector<Number> sums;
        for (const auto& terms : sums_) {
            Number sum = Number::Zero();
            for (const auto& [reading, coefficient] : terms) sum += coefficient * lengths[reading];
            sums.push_back(sum);
        }
        return sums;
    }

    // The angles of one pass, from its equations and the unknowns that are kept; and the combinations of its equations
    // that do not have them, a row each.
    struct Eliminated {
        int first_angle, first_equation;
        Eigen::MatrixXd inverse, by_kept, without;
    };
    template <class Number>
    std::vector<Number> reduced_sides(const std::vector<Number>& sums) const {
        std::vector<Number> reduced;
        for (const int equation : direct_) reduced.push_back(sums[std::size_t(equation)]);
        for (const Eliminated& pass : eliminated_)
            for (Eigen::Index row = 0; row < pass.without.rows(); ++row) {
                Number sum = Number::Zero();
                for (Eigen::Index i = 0; i < pass.without.cols(); ++i)
                    sum += pass.without(row, i) * sums[std::size_t(pass.first_equation + i)];
                reduced.push_back(sum);
            }
        return reduced;
    }

    std::vector<std::vector<Term>> sums_;  // a sum of lengths for each equation
    std::size_t unknowns_ = 0;
    std::vector<int> kept_;    // unknowns that are not eliminated
    std::vector<int> direct_;  // equations without eliminated ones
    std::vector<Eliminated> eliminated_;
    Eigen::MatrixXd inverse_;  // of the kept unknowns, from the reduced sides
    Contradictions contradictions_;
    Eigen::MatrixXd null_space_;
    std::vector<bool> determined_;  // of the kept unknowns
};

// A step that a line has lost is taken from the solution of the other lines. A sum that cannot be completed gives no
// equation.
SlopeSystem make_slope_system(const std::vector<Pass>& passes, const Plan& plan, const AxisSystems& lengths,
                              const std::vector<bool>& usable);

}  // namespace stepdiag
