// Largest values of functions that are linear, or parabolas, between points. Internal.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace stepdiag {

// The corners of the upper convex hull of the points (x_k, y_k), x ascending.
class UpperHull {
public:
    UpperHull(const std::vector<double>& x, const Eigen::VectorXd& y) {
        for (std::size_t k = 0; k < x.size(); ++k) {
            while (x_.size() >= 2 && (y_.back() - y_[y_.size() - 2]) * (x[k] - x_.back()) <=
                                         (y[Eigen::Index(k)] - y_.back()) * (x_.back() - x_[x_.size() - 2])) {
                x_.pop_back();
                y_.pop_back();
            }
            x_.push_back(x[k]);
            y_.push_back(y[Eigen::Index(k)]);
        }
    }
    // The largest y + slope x. `corner`: where it was last time, a good start for a slope that is much the same.
    double support(double slope, std::size_t& corner) const {
        const auto rises = [&](std::size_t k) { return y_[k + 1] - y_[k] + slope * (x_[k + 1] - x_[k]) > 0.0; };
        while (corner + 1 < x_.size() && rises(corner)) ++corner;
        while (corner > 0 && !rises(corner - 1)) --corner;
        return y_[corner] + slope * x_[corner];
    }

private:
    std::vector<double> x_;
    std::vector<double> y_;
};

// The largest value of a parabola between its ends that rises by `sag` above the middle of their chord.
inline double top_of_arc(double begin, double end, double sag) {
    const double slope = (end - begin) / (4.0 * sag);
    if (!(sag > 0.0 && std::abs(slope) < 1.0)) return std::max(begin, end);
    return (begin + end) / 2.0 + sag * (1.0 + slope * slope);
}

}  // namespace stepdiag
