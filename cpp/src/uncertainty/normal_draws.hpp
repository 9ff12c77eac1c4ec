// Draws from a joint normal distribution with expectation 0, such as that of the errors of a calibration's values.
// Internal.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace stepdiag {

class NormalDraws {
public:
    // The covariance may be singular, because exactly known values (0 at home) have no variance.
    NormalDraws(const Eigen::MatrixXd& covariance, std::uint64_t seed);

    static constexpr Eigen::Index together = 48;  // draws of one product
    // The draws first ... first + together - 1 as columns. The bits of a draw depend on its number alone, and on the
    // instruction set.
    void draw(std::uint64_t first, Eigen::MatrixXd& columns) const;

private:
    std::uint64_t seed_;
    Eigen::Index rank_;
    Eigen::MatrixXd root_;             // lower triangle in the order of `place_`, negative; with spare rows
    std::vector<Eigen::Index> place_;  // of each row of the root in a draw
    Eigen::VectorXd scale_;            // of each row of the root
};

}  // namespace stepdiag
