#include "optics/separation.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>

#include "stepdiag/core/error.hpp"

namespace stepdiag {
namespace {

using Eigen::Vector3d;
using Corners = Eigen::Matrix3Xd;

Corners corners_of(const std::vector<Face>& body) {
    Eigen::Index count = 0;
    for (const Face& face : body) count += Eigen::Index(face.outline.size());
    Corners corners(3, count);
    Eigen::Index i = 0;
    for (const Face& face : body)
        for (const auto& corner : face.outline) corners.col(i++) = corner;
    if (count == 0 || !corners.allFinite()) throw InvalidArgument("separation: expected bodies with finite corners");
    return corners;
}

// The difference a - b with the smallest component along x.
Vector3d least_along(const Vector3d& x, const Corners& a, const Corners& b) {
    Eigen::Index i, k;
    (x.transpose() * a).minCoeff(&i);
    (x.transpose() * b).maxCoeff(&k);
    return a.col(i) - b.col(k);
}

// A simplex of one to four affinely independent differences. Its nearest point to 0 is given by positive weights that
// add up to 1.
class Simplex {
public:
    explicit Simplex(const Vector3d& point) : points_(point), weights_(Eigen::VectorXd::Ones(1)) {}

    // Orthogonalise to the simplex twice more: near 0, rounding spoils both length and direction of the point.
    Vector3d nearest() const {
        Vector3d nearest = points_ * weights_;
        if (points_.cols() == 1) return nearest;
        const Edges across = edges();
        const Eigen::ColPivHouseholderQR<Edges> solver(across);
        for (int i = 0; i < 2; ++i) nearest -= across * solver.solve(nearest);
        return nearest;
    }
    bool has(const Vector3d& point) const {
        return ((points_.colwise() - point).colwise().norm().array() == 0.0).any();
    }

    void add(const Vector3d& point) {
        points_.conservativeResize(3, points_.cols() + 1);
        points_.rightCols<1>() = point;
        weights_.conservativeResize(weights_.size() + 1);
        weights_.tail<1>().setZero();
        // Move towards the nearest point of the plane through all points. If it is outside the simplex, stop at the
        // first face and remove the opposite corner.
        for (;;) {
            const Weights aim = nearest_of_plane();
            if ((aim.array() > 0.0).all() || points_.cols() == 1) {
                weights_ = aim;
                return;
            }
            Eigen::Index dropped = 0;
            double step = std::numeric_limits<double>::infinity();
            for (Eigen::Index i = 0; i < aim.size(); ++i) {
                if (aim[i] > 0.0) continue;
                const double to_face = weights_[i] > 0.0 ? weights_[i] / (weights_[i] - aim[i]) : 0.0;
                if (to_face < step) step = to_face, dropped = i;
            }
            weights_ += step * (aim - weights_);
            drop(dropped);
        }
    }

private:
    using Points = Eigen::Matrix<double, 3, Eigen::Dynamic, 0, 3, 4>;
    using Weights = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 4, 1>;

    using Edges = Eigen::Matrix<double, 3, Eigen::Dynamic, 0, 3, 3>;

    Edges edges() const { return points_.rightCols(points_.cols() - 1).colwise() - points_.col(0); }

    Weights nearest_of_plane() const {
        const Eigen::Index n = points_.cols();
        Weights weights = Weights::Ones(n);
        if (n == 1) return weights;
        weights.tail(n - 1) = edges().colPivHouseholderQr().solve(-points_.col(0));
        weights[0] = 1.0 - weights.tail(n - 1).sum();
        return weights;
    }

    void drop(Eigen::Index i) {
        const Eigen::Index last = points_.cols() - 1;
        points_.col(i) = points_.col(last).eval();
        weights_[i] = weights_[last];
        points_.conservativeResize(3, last);
        weights_.conservativeResize(last);
        weights_ /= weights_.sum();
    }

    Points points_;
    Weights weights_;
};

}  // namespace

double separation(const std::vector<Face>& body_a, const std::vector<Face>& body_b) {
    const Corners a = corners_of(body_a), b = corners_of(body_b);
    const double scale =
        (a.colwise() - b.col(0)).colwise().norm().maxCoeff() + (b.colwise() - b.col(0)).colwise().norm().maxCoeff();
    Simplex simplex(a.col(0) - b.col(0));
    double bound = 0.0;
    for (int i = 0; i < 200; ++i) {  // about ten suffice; the bound is valid after any number
        const Vector3d nearest = simplex.nearest();
        const double distance = nearest.norm();
        if (distance <= 1e-14 * scale) return bound;
        const Vector3d extreme = least_along(nearest, a, b);
        bound = std::max(bound, extreme.dot(nearest) / distance);  // distance from the separating plane
        if (distance - bound <= 1e-13 * scale || simplex.has(extreme)) return bound;
        simplex.add(extreme);
    }
    return bound;
}

}  // namespace stepdiag
