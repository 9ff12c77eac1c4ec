// Readings that do not fit. Internal: not installed.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "adjustment/adjustment_result.hpp"

namespace stepdiag {

// Of readings, priors and smoothness over unknowns.
int degrees_of_freedom(const GaussNewton& solver);

// Adjusts, and leaves out readings that do not fit, the worst first (W. Baarda's data snooping, each reading against
// what the others say of it), and adjusts again; puts them back where they are too many.
class OutlierSearch {
public:
    OutlierSearch(AdjustmentProblem& problem, GaussNewton& solver, const AdjustmentOptions& options);

    // From zero. A reading that is a thousand uncertainties off may keep Gauss-Newton from settling, or settle it far
    // away: where readings scatter that much, the worst is left out by what the first step says, which is linear, and
    // the adjustment begins anew. Returns the number of steps of the one that settled. Throws InvalidArgument where
    // none does.
    int solve_without_gross(const std::vector<bool>& determined, Eigen::VectorXd& x);
    // All that remain, after the adjustment without the gross ones.
    void run(const std::vector<bool>& determined, Eigen::VectorXd& x);

    // Residuals and the inverse at x, and the equations linearised there.
    void look(const Eigen::VectorXd& x);
    const std::vector<ReadingResidual>& residuals() const { return residuals_; }
    const BorderedBand& inverse() const { return inverse_; }

private:
    std::vector<std::size_t> worst_readings(const Eigen::VectorXd& x, double alike);
    std::size_t roughest(const std::vector<std::size_t>& candidates, const Eigen::VectorXd& x);
    bool leave_out(const std::vector<std::size_t>& worst, const Eigen::VectorXd& x);
    void put_back(int kept);

    AdjustmentProblem& problem_;
    GaussNewton& solver_;
    double limit_;
    int most_, found_ = 0;
    std::vector<SmoothRow> roughness_;
    std::vector<ReadingResidual> residuals_;
    BorderedBand inverse_;
    std::optional<Eigen::VectorXd> looked_at_;
};

}  // namespace stepdiag
