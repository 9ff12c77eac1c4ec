#include "head/spot_search.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "stepdiag/head/spot_sensor.hpp"

namespace stepdiag {
namespace {

// Sums of 2 x 2 cells. An odd last row or column is summed by itself.
Eigen::MatrixXd halve(const Eigen::MatrixXd& cells) {
    Eigen::MatrixXd sums = Eigen::MatrixXd::Zero((cells.rows() + 1) / 2, (cells.cols() + 1) / 2);
    for (Eigen::Index column = 0; column < cells.cols(); ++column)
        for (Eigen::Index row = 0; row < cells.rows(); ++row) sums(row / 2, column / 2) += cells(row, column);
    return sums;
}

// The brightest square of 2 x 2 cells. Squares overlap, so that one of them contains a spot at the corner of cells.
FoundSpot brightest_square(const Eigen::MatrixXd& cells, double cell) {
    FoundSpot best{0.0, 0.0, 2.0 * cell, -1.0};
    for (Eigen::Index column = 0; column + 1 < cells.cols(); ++column)
        for (Eigen::Index row = 0; row + 1 < cells.rows(); ++row) {
            const double sum =
                cells(row, column) + cells(row + 1, column) + cells(row, column + 1) + cells(row + 1, column + 1);
            if (sum > best.electrons) best = {cell * double(column + 1), cell * double(row + 1), 2.0 * cell, sum};
        }
    return best;
}

}  // namespace

std::optional<FoundSpot> find_spot(const Eigen::MatrixXd& excess, double read_variance, double background,
                                   bool shot_noise) {
    const double dark_variance = read_variance + background;
    const auto significance = [&](const FoundSpot& square, bool with_shot_noise) {
        if (square.electrons <= 0.0) return 0.0;
        const double variance = square.size * square.size * dark_variance + (with_shot_noise ? square.electrons : 0.0);
        return square.electrons / std::sqrt(variance);  // infinite without noise
    };

    // Scales of 2, 4, 8 ... pixels. The search always includes the shot noise of the light, even if the camera has
    // none. Otherwise the best scale would contain only the brightest pixels instead of the whole spot.
    std::vector<FoundSpot> squares;
    double best = 0.0;
    Eigen::MatrixXd cells = excess;
    for (double cell = 1.0; cells.rows() > 1 && cells.cols() > 1; cell *= 2.0) {
        squares.push_back(brightest_square(cells, cell));
        best = std::max(best, significance(squares.back(), true));
        cells = halve(cells);
    }
    for (const FoundSpot& square : squares) {
        if (significance(square, true) < 0.7 * best) continue;  // take the finest with at least half of the light
        if (square.electrons < least_electrons || significance(square, shot_noise) < least_significance) continue;
        return square;
    }
    return std::nullopt;
}

}  // namespace stepdiag
