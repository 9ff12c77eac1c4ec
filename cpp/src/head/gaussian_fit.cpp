#include "head/gaussian_fit.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "head/spot_profile.hpp"

namespace stepdiag {
namespace {

using Vector5 = Eigen::Matrix<double, 5, 1>;
using Matrix5 = Eigen::Matrix<double, 5, 5>;

constexpr double window_radii = 2.5;     // 4e-6 of the light is outside the window
constexpr double smallest_radius = 0.3;  // pixels; for smaller spots the shares determine neither radius nor position

// Expected value of the pixels in a window and its derivatives, column by column.
class SpotModel {
public:
    SpotModel(const PixelWindow& window, const PixelSpot& spot)
        : spot_(spot), X_(pixel_shares_and_derivatives(spot.x, spot.radius, window.column, 1.0, window.columns)) {
        Y_.resize(window.rows, 4);
        Y_ << pixel_shares_and_derivatives(spot.y, spot.radius, window.row, 1.0, window.rows).matrix(),
            Eigen::VectorXd::Ones(window.rows);
    }

    Eigen::ArrayXd mean(int j) const { return spot_.electrons * X_(j, 0) * Y_.col(0).array() + spot_.background; }

    // The derivatives in a column are combinations of Y, its derivatives and 1. Sums of 4 x 4 products are sufficient.
    void add(int j, const Eigen::ArrayXd& weight, const Eigen::ArrayXd& residual, FisherScoring& sum) const {
        const double A = spot_.electrons, share = X_(j, 0);
        Eigen::Matrix<double, 5, 4> from_Y = Eigen::Matrix<double, 5, 4>::Zero();
        from_Y(0, 0) = A * X_(j, 1);
        from_Y(1, 1) = A * share;
        from_Y(2, 0) = A * X_(j, 2);
        from_Y(2, 2) = A * share;
        from_Y(3, 0) = share;
        from_Y(4, 3) = 1.0;
        const Basis weighted = Y_.array().colwise() * weight;
        const Eigen::Matrix4d products = weighted.transpose().lazyProduct(Y_);
        const Eigen::Vector4d residuals = weighted.transpose().lazyProduct(residual.matrix());
        sum.information += from_Y * products * from_Y.transpose();
        sum.score += from_Y * residuals;
    }

private:
    using Basis = Eigen::Matrix<double, Eigen::Dynamic, 4>;
    PixelSpot spot_;
    Eigen::ArrayX3d X_;
    Basis Y_;
};

PixelWindow window_around(const PixelSpot& spot, const Eigen::MatrixXd& image) {
    const double half = window_radii * spot.radius + 1.5;
    const auto part = [half](double centre, Eigen::Index size) {
        const double first = std::clamp(std::floor(centre - half), 0.0, double(size));
        const double end = std::clamp(std::ceil(centre + half), 0.0, double(size));
        return std::pair(int(first), int(end - first));
    };
    const auto [column, columns] = part(spot.x, image.cols());
    const auto [row, rows] = part(spot.y, image.rows());
    return {column, row, columns, rows};
}

// Share of the step that stays within the range of the linearisation: half a radius sideways, 0.3 of the radius in
// size.
double step_share(const PixelSpot& spot, const Vector5& step) {
    const double sideways = std::max(std::abs(step[0]), std::abs(step[1])) / (0.5 * spot.radius);
    return 1.0 / std::max({1.0, sideways, std::abs(step[2]) / (0.3 * spot.radius)});
}

PixelSpot moved(const PixelSpot& spot, const Vector5& step, const Eigen::MatrixXd& image) {
    const double largest_radius = 2.0 * double(std::max(image.rows(), image.cols()));
    return {spot.x + step[0], spot.y + step[1], std::clamp(spot.radius + step[2], smallest_radius, largest_radius),
            std::max(spot.electrons + step[3], 0.1 * spot.electrons), spot.background + step[4]};
}

bool inside(const PixelSpot& spot, const Eigen::MatrixXd& image) {
    return spot.x >= 0.0 && spot.x <= double(image.cols()) && spot.y >= 0.0 && spot.y <= double(image.rows());
}

// Iterates until a step is below a thousandth of the standard deviation caused by noise.
std::optional<PixelSpot> climb(const Eigen::MatrixXd& image, const PixelWindow& window, const PixelNoise& noise,
                               PixelSpot spot) {
    constexpr int most_steps = 50;
    constexpr double least_step = 1e-3;
    for (int i = 0; i < most_steps; ++i) {
        const FisherScoring at = score(image, window, noise, spot);
        const auto step = solve(at.information, at.score);
        if (!step) return std::nullopt;
        const double share = step_share(spot, *step);
        spot = moved(spot, share * *step, image);
        if (share == 1.0 && step->dot(at.score) < least_step * least_step) return spot;
    }
    return std::nullopt;
}

}  // namespace

FisherScoring score(const Eigen::MatrixXd& image, const PixelWindow& window, const PixelNoise& noise,
                    const PixelSpot& spot) {
    const SpotModel model(window, spot);
    FisherScoring sum;
    for (int j = 0; j < window.columns; ++j) {
        const auto electrons = image.col(window.column + j).segment(window.row, window.rows).array();
        const Eigen::ArrayXd mean = model.mean(j);
        Eigen::ArrayXd weight(window.rows);
        if (noise.shot) weight = 1.0 / (mean.max(0.0) + noise.variance);
        else weight.setConstant(1.0 / noise.variance);
        weight = (electrons < noise.saturation).select(weight, 0.0);
        model.add(j, weight, electrons - mean, sum);
    }
    return sum;
}

Matrix5 information(const PixelWindow& window, const PixelInformation& of_pixel, double saturation,
                    const PixelSpot& spot) {
    const SpotModel model(window, spot);
    FisherScoring sum;
    for (int j = 0; j < window.columns; ++j) {
        const Eigen::ArrayXd mean = model.mean(j);
        const Eigen::ArrayXd weight = mean.unaryExpr([&](double m) { return m < saturation ? of_pixel(m) : 0.0; });
        model.add(j, weight, Eigen::ArrayXd::Zero(window.rows), sum);
    }
    return sum.information;
}

std::optional<Vector5> solve(const Matrix5& information, const Vector5& b) {
    if (!(information.diagonal().minCoeff() > 0.0) || !information.allFinite()) return std::nullopt;
    const Vector5 scale = information.diagonal().cwiseSqrt().cwiseInverse();  // the units differ: electrons and pixels
    const Eigen::LLT<Matrix5> factor(scale.asDiagonal() * information * scale.asDiagonal());
    if (factor.info() != Eigen::Success) return std::nullopt;
    const Vector5 x = scale.asDiagonal() * factor.solve(scale.asDiagonal() * b);
    return x.allFinite() ? std::optional(x) : std::nullopt;
}

std::optional<PixelSpot> fit_gaussian(const Eigen::MatrixXd& image, const PixelNoise& noise, PixelSpot start) {
    constexpr int most_windows = 5;
    for (int i = 0; i < most_windows; ++i) {
        const auto spot = climb(image, window_around(start, image), noise, start);
        if (!spot || !inside(*spot, image)) return std::nullopt;
        // Keep the window if the spot differs by less than a tenth from the one it was made for.
        const double off =
            std::max({std::abs(spot->x - start.x), std::abs(spot->y - start.y), std::abs(spot->radius - start.radius)});
        start = *spot;
        if (off < 0.1 * start.radius) break;
    }
    return start;
}

}  // namespace stepdiag
