// The adjustment linearised: weighted residuals, their derivatives, and the normal equations
//   (J^T J + P) dx = J^T w - P x,  w = (read - model(x))/u, P the priors and the smoothness. Internal: not installed.
#pragma once

#include <Eigen/Core>
#include <array>
#include <functional>
#include <vector>

#include "adjustment/adjustment_problem.hpp"
#include "adjustment/bordered_band.hpp"

namespace stepdiag {

// Below this part of a reading or a fault, what the others do not explain of it is rounding.
inline constexpr double controlled_share = 1e-8;

// An entry on the matrix' pattern, in either order.
double& element(BorderedBand& matrix, int i, int j);
double element(const BorderedBand& matrix, int i, int j);

// A weighted condition on neighbouring nodes: sum coefficient x = 0, with standard deviation 1. A part without unknown
// is 0.
struct SmoothRow {
    int function;  // FunctionId::index
    std::array<int, 3> unknown;
    std::array<double, 3> coefficient;

    double value(const Eigen::VectorXd& x) const;
};

// Second differences of each function's neighbouring nodes, by the standard deviation of each function (0: none).
std::vector<SmoothRow> second_differences(const AdjustmentProblem& problem,
                                          const std::array<double, function_count>& deviation);

class NormalEquations {
public:
    explicit NormalEquations(const AdjustmentProblem& problem);

    const AdjustmentProblem& problem() const { return *problem_; }
    void make_smooth(const std::array<double, function_count>& deviation) {
        smooth_ = second_differences(*problem_, deviation);
    }
    const std::vector<SmoothRow>& smooth_rows() const { return smooth_; }
    // Takes the unknowns that the readings leave open as known to be at `centre` as well as is usual for such a thing,
    // or to this part of it.
    void assume_usual(const std::vector<bool>& determined, const Eigen::VectorXd& centre, double part = 1.0);

    // By unknown: 1/u^2 of its prior, 1/u^2 of what is usual, and where that is.
    const Eigen::VectorXd& prior_weight() const { return prior_weight_; }
    const Eigen::VectorXd& usual_weight() const { return usual_weight_; }
    const Eigen::VectorXd& centre() const { return centre_; }

    // Residuals and, if asked for, derivatives at x. Values that are not finite come out as such.
    void linearise(const Eigen::VectorXd& x, bool derivatives = true);
    // Takes derivatives that are roundings of 0 for 0, so that a column of nothing but them does not count.
    void drop_roundings();
    // Weighted residual of each reading, used or not, at the last linearise.
    const Eigen::VectorXd& residuals() const { return residuals_; }
    double square_sum(const Eigen::VectorXd& x) const;  // of residuals, priors and smoothness, not of what is usual
    double square_sum(const Eigen::VectorXd& residuals, const Eigen::VectorXd& x) const;  // of these residuals

    BorderedBand matrix() const;
    void assemble(BorderedBand& matrix) const;  // J^T J + P
    // Adds what the readings' second derivatives by the set-ups make of the residuals at x, the last linearise.
    void add_curvature(const Eigen::VectorXd& x, BorderedBand& matrix);
    Eigen::VectorXd gradient(const Eigen::VectorXd& x) const;  // J^T w - P x
    // J^T of what the readings, used or not, change by, in units of their standard uncertainties.
    Eigen::VectorXd gradient_of(const Eigen::VectorXd& change) const {
        return transposed(change, Eigen::VectorXd::Zero(problem_->size()));
    }
    // The same of what they change by where each axis stands further along itself by shift(point), mm. Of a problem
    // with expansion.
    Eigen::VectorXd gradient_of_shifts(const std::function<Eigen::Vector3d(const AdjustedPoint&)>& shift) const;
    Eigen::VectorXd image(const Eigen::VectorXd& v) const;  // J v, of all readings
    // The same of vectors beside each other, with rows beyond the last reading.
    BorderedFactor::Sides images(const BorderedFactor::Sides& v) const;
    BorderedFactor::Sides products(const BorderedFactor::Sides& v) const;  // (J^T J + P) v

    using Side =
        Eigen::Ref<Eigen::VectorXd, 0, Eigen::InnerStride<>>;  // a vector, or a column of BorderedFactor::Sides
    // The derivative of a reading, weighted: unknowns of its point (no_unknown where there is none), and its row.
    struct Row {
        const int* unknown;
        const double* derivative;
        int size;

        double product(const Eigen::VectorXd& v) const;
        void add_to(Side v, double times) const;
        void add_to(BorderedFactor::Sides& v, const BorderedFactor::OfSides& times) const;
    };
    Row row(const AdjustedPoint& point, int reading) const;
    Row row(int reading) const { return row(point(reading), reading); }
    const AdjustedPoint& point(int reading) const { return problem_->points()[point_of_reading_[reading]]; }
    // The part of an inverse that belongs to a point's unknowns; 0 where there is none.
    using Square = Eigen::MatrixXd;
    void gather(const AdjustedPoint& point, const BorderedBand& inverse, Square& covariance) const;
    // Of what the model says of each reading, used or not, in units of the reading's own.
    Eigen::VectorXd reading_variances(const BorderedBand& inverse) const;
    // The part of each reading's redundancy that it owes to what values with priors may scatter. The residuals are
    // (1 - H) w; were those values all where their priors say, the mean square of such a residual would be that of
    // noise alone, the diagonal of (1 - H)^2 and not of 1 - H: less by the sum of (N^-1 a)^2/u^2, a the reading's
    // derivative and N the normal equations, over all priors. Taken are those of unknowns that the reading depends on.
    // Others reach it through the machine alone; of three runs that is a tenth of a degree of freedom a line.
    Eigen::VectorXd prior_shares(const BorderedBand& inverse) const;

private:
    // function(reading, row, what its unknowns and its model have in common)
    template <class Function>
    void for_each_covariance(const BorderedBand& inverse, const Function& function) const;
    Eigen::VectorXd transposed(const Eigen::VectorXd& w, const Eigen::VectorXd& x) const;
    void assemble_point(const AdjustedPoint& point, int number, BorderedBand& matrix) const;

    const AdjustmentProblem* problem_;
    std::vector<ChannelModel> models_;       // by set-up
    std::vector<int> first_unknown_;         // by point, into unknowns_
    std::vector<int> unknowns_;              // by point: 18, active columns of the set-up, coefficients, faults
    std::vector<std::size_t> first_weight_;  // by reading, into derivatives_
    std::vector<int> point_of_reading_;
    std::vector<double> derivatives_;
    std::vector<Eigen::Vector3d> by_shift_;  // by reading, weighted: by the axes' shifts along themselves
    Eigen::VectorXd residuals_;
    std::vector<SmoothRow> smooth_;
    Eigen::VectorXd prior_weight_, usual_weight_, centre_;  // of each unknown
};

}  // namespace stepdiag
