// Upper convex hull of a function at grid points. Internal.
#pragma once

#include <cstddef>
#include <vector>

namespace stepdiag {

// Upper convex hull of the points (x_k, y_k), x ascending.
class UpperHull {
public:
    template <class X, class Y>
    UpperHull(const X& x, const Y& y) {
        for (std::ptrdiff_t k = 0; k < std::ptrdiff_t(x.size()); ++k) {
            const double x_k = *(x.begin() + k), y_k = y[k];
            while (x_.size() >= 2 && (y_.back() - y_[y_.size() - 2]) * (x_k - x_.back()) <=
                                         (y_k - y_.back()) * (x_.back() - x_[x_.size() - 2])) {
                x_.pop_back();
                y_.pop_back();
            }
            x_.push_back(x_k);
            y_.push_back(y_k);
        }
    }
    // Largest y + slope x. `corner`: start of the search, and its result; the last result is a good start for a similar
    // slope.
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

}  // namespace stepdiag
