#include "stepdiag/uncertainty/volume_draws.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "stepdiag/uncertainty/derived.hpp"
#include "uncertainty/normal_draws.hpp"
#include "uncertainty/volume_field.hpp"

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;
using namespace stepdiag;

const Vector3d volume(800, 600, 500);
const Vector3d tool(20, -30, -150);
constexpr const char* chains[] = {"[w X' b Y Z t]", "[w b X Y Z t]", "[w Y' X' b Z t]", "[w Z' Y' X' b t]"};

// A random machine with noise of this standard deviation in mm (rotations: in mrad).
Calibration make_calibration(const char* chain, unsigned seed, double noise) {
    RandomErrorMap options;
    options.seed = seed;
    options.intervals = 5;
    const ParameterTable table = make_random_error_map(volume, options).table();
    Calibration calibration{"test", Chain::parse(chain), volume, tool, {}, {}, {}, {}};
    for (int i = 0; i < function_count; ++i)
        calibration.functions[i] =
            CalibratedFunction{table.functions[i]->position, table.functions[i]->value, std::vector<double>(6, 0.0)};
    for (int i = 0; i < squareness_count; ++i)
        calibration.squarenesses[i] = CalibratedSquareness{table.squarenesses[i]->value, 0.0};
    const std::vector<CalibrationEntry> entries = calibration_entries(calibration);
    std::mt19937 engine(seed);
    std::normal_distribution<double> normal;
    MatrixXd root(Index(entries.size()), Index(entries.size()) / 2);
    for (Index i = 0; i < root.rows(); ++i) {
        const std::string& name = entries[std::size_t(i)].parameter;
        const bool is_angle = name[0] != 'E' || (name[1] >= 'A' && name[1] <= 'C');
        for (Index j = 0; j < root.cols(); ++j)
            root(i, j) = (is_angle ? 1e-3 : 1.0) * noise / std::sqrt(double(root.cols())) * normal(engine);
    }
    calibration.covariance = root * root.transpose();
    return calibration;
}

// A machine whose functions are the rows of a table.
Machine machine_of(const Chain& chain, const VolumeGrid& grid, const VectorXd& table) {
    ParameterTable parameters;
    for (std::size_t r = 0; r < 3; ++r)
        for (int c = 0; c < 6; ++c) {
            const VectorXd value = grid.functions(table.data(), r).col(c);
            const auto& p = grid.position(r);
            parameters.functions[std::size_t(FunctionId{grid.axis(r), Component(c)}.index())] =
                FunctionTable{{p.begin(), p.end()},
                              {value.begin(), value.end()},
                              std::vector<std::optional<double>>(std::size_t(p.size()))};
        }
    return Machine(chain, ErrorMap(std::move(parameters)), tool);
}

}  // namespace

// By brute force over all points, where noise is far below the errors, comparable to them, and far above.
TEST(VolumeDraws, FiguresAreThoseOfEveryPoint) {
    const GridPositions positions = {
        {{0, 100, 160, 320, 480, 640, 700, 800}, {0, 120, 360, 600}, {0, 50, 100, 300, 500}}};
    for (const char* chain : chains)
        for (const double noise : {1e-4, 1e-2, 1.0}) {
            const Calibration calibration = make_calibration(chain, 3, noise);
            const VolumeDraws draws(calibration, positions, tool, 5);
            const auto found = draws.draw(0, 60);
            const VolumeGrid grid(calibration, positions, tool);
            const NormalDraws normal(grid.covariance(calibration.covariance), 5);
            MatrixXd rest;
            for (Index draw = 0; draw < 60; ++draw) {
                if (draw % NormalDraws::together == 0) normal.draw(std::uint64_t(draw), rest);
                const VectorXd table =
                    grid.table(calibration_values(calibration)) + rest.col(draw % NormalDraws::together);
                const Machine machine = machine_of(calibration.chain, grid, table);
                Vector3d low = Vector3d::Constant(1e9), high = -low;
                double largest = 0.0, mean2 = 0.0;
                Vector3d worst, there = Vector3d::Zero();  // for a compiler that sees no loop
                std::array<std::vector<double>, 3> weights;
                for (std::size_t a = 0; a < 3; ++a) weights[a] = trapezoidal_weights(positions[a]);
                for (std::size_t i = 0; i < positions[0].size(); ++i)
                    for (std::size_t j = 0; j < positions[1].size(); ++j)
                        for (std::size_t k = 0; k < positions[2].size(); ++k) {
                            const Vector3d e =
                                machine.first_order_error({positions[0][i], positions[1][j], positions[2][k]});
                            if (e.norm() > largest) {
                                largest = e.norm();
                                worst = {positions[0][i], positions[1][j], positions[2][k]};
                                there = e;
                            }
                            mean2 += weights[0][i] * weights[1][j] * weights[2][k] * e.squaredNorm();
                            low = low.cwiseMin(e);
                            high = high.cwiseMax(e);
                        }
                // Sums of the same numbers in another order.
                const double close = 1e-12 * largest;
                EXPECT_NEAR(found(draw, 0), largest, close) << chain << noise;
                EXPECT_NEAR(found(draw, 1), std::sqrt(mean2), close) << chain << noise;
                for (int c = 0; c < 3; ++c) EXPECT_NEAR(found(draw, 2 + c), high[c] - low[c], close) << chain << noise;
                const Machine own = machine_of(calibration.chain, grid, grid.table(calibration_values(calibration)));
                const Vector3d e = own.first_order_error(worst);
                const Vector3d along = there / largest;
                EXPECT_NEAR(found(draw, found_at_largest), along.dot(e), close);
                EXPECT_NEAR(found(draw, opposite_at_largest), (2.0 * e - there).norm(), close);
                const Eigen::Matrix3d covariance =
                    error_at_point(calibration, worst, tool).covariance.topLeftCorner<3, 3>();
                const double variance = covariance.trace();
                EXPECT_NEAR(std::pow(found(draw, uncertainty_at_largest), 2), along.dot(covariance * along),
                            1e-12 * variance);
                EXPECT_NEAR(found(draw, variance_at_largest), variance, 1e-12 * variance);
                EXPECT_NEAR(found(draw, variance2_at_largest), covariance.squaredNorm(), 1e-12 * variance * variance);
            }
        }
}

// Means and products of many draws are those of the distribution.
TEST(NormalDraws, HaveTheCovariance) {
    MatrixXd root(7, 4);
    std::mt19937 engine(2);
    std::normal_distribution<double> normal;
    for (Index i = 0; i < root.size(); ++i) root.data()[i] = normal(engine);
    root.row(3).setZero();  // known exactly
    root.row(5) *= 1e-6;    // another unit
    const MatrixXd covariance = root * root.transpose();
    const NormalDraws draws(covariance, 9);
    const Index count = 400 * NormalDraws::together;
    MatrixXd sum = MatrixXd::Zero(7, 7), columns;
    for (Index first = 0; first < count; first += NormalDraws::together) {
        draws.draw(std::uint64_t(first), columns);
        sum += columns * columns.transpose();
    }
    for (Index i = 0; i < 7; ++i)
        for (Index j = 0; j < 7; ++j) {
            const double scale = std::sqrt(covariance(i, i) * covariance(j, j));
            // Five standard deviations of a mean of products of 19,200 draws.
            EXPECT_NEAR(sum(i, j) / double(count), covariance(i, j), 5.0 * std::sqrt(2.0 / double(count)) * scale);
        }
}
