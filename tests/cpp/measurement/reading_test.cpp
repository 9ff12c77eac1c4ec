#include "stepdiag/measurement/reading.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <random>

namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using stepdiag::Reading;

// The readings from the conventions' own words, by vectors: L = ((p-o).n)/(n.d), r = d - 2(n.d)n, cos 2phi = -r.d.
// Extended precision, so that the comparison shows the library's roundings only.
using Long3 = Eigen::Matrix<long double, 3, 1>;

struct Mirror {
    Vector3d point, normal;
};

long double beam_length(const Mirror& m, const Long3& origin) {
    const Long3 d(0, 0, 1), n = m.normal.cast<long double>();
    return (m.point.cast<long double>() - origin).dot(n) / n.dot(d);
}

long double half_round_trip(const Mirror& m, const Long3& origin) {
    const Long3 d(0, 0, 1), n = m.normal.cast<long double>().normalized();
    const Long3 r = d - 2.0L * n.dot(d) * n;
    const long double length = beam_length(m, origin);
    return 0.5L * (length + length / -r.dot(d));
}

Eigen::Matrix<long double, 2, 1> spot(const Mirror& m, long double psd_distance) {
    const Long3 d(0, 0, 1), n = m.normal.cast<long double>().normalized();
    const Long3 r = d - 2.0L * n.dot(d) * n;
    return (beam_length(m, Long3::Zero()) + psd_distance) * r.head<2>() / -r.z();
}

std::vector<Mirror> mirrors(double largest_tilt) {
    std::mt19937_64 engine(1);
    std::uniform_real_distribution<double> unit(-1.0, 1.0);
    std::vector<Mirror> list;
    for (int i = 0; i < 500; ++i) {
        const double tilt = largest_tilt * std::abs(unit(engine)), around = 3.2 * unit(engine);
        list.push_back({{20.0 * unit(engine), 20.0 * unit(engine), 700.0 + 600.0 * unit(engine)},
                        {std::sin(tilt) * std::cos(around), std::sin(tilt) * std::sin(around), std::cos(tilt)}});
    }
    return list;
}

const std::vector<Vector2d> three_beams = {{0.0, 0.0}, {20.0, 0.0}, {0.0, 20.0}};
const std::vector<Vector2d> five_beams = {{10.0, 0.0}, {0.0, 10.0}, {-10.0, 0.0}, {0.0, -10.0}, {3.0, 4.0}};

}  // namespace

TEST(Reading, DistanceAndTiltsAreThoseOfTheVectorGeometry) {
    for (const double tilt : {1e-6, 1e-3, 0.1, 0.5})
        for (const Mirror& m : mirrors(tilt)) {
            const auto reading = stepdiag::read_mirror(m.point, m.normal);
            ASSERT_TRUE(reading);
            const auto expected = static_cast<double>(half_round_trip(m, Long3::Zero()));
            // 1e-15 for the few roundings; at large tilts 1/(1 - t) passes on those of t.
            EXPECT_NEAR(reading->distance, expected, 1e-15 * expected * (1.0 + 4.0 * std::tan(tilt))) << tilt;
            EXPECT_NEAR(reading->alpha, -m.normal.y() / m.normal.z(), 1e-15 * std::abs(reading->alpha));
            EXPECT_NEAR(reading->beta, m.normal.x() / m.normal.z(), 1e-15 * std::abs(reading->beta));
            EXPECT_NEAR(reading->beam_length(), static_cast<double>(beam_length(m, Long3::Zero())),
                        1e-15 * expected * (1.0 + 4.0 * std::tan(tilt)));
        }
}

TEST(Reading, BeamsAndSpotAreThoseOfTheVectorGeometry) {
    for (const double tilt : {1e-6, 1e-3, 0.1})
        for (const Mirror& m : mirrors(tilt)) {
            const auto reading = stepdiag::read_mirror(m.point, m.normal);
            ASSERT_TRUE(reading);
            const auto beams = stepdiag::beam_distances(*reading, five_beams);
            for (int i = 0; i < 5; ++i) {
                const auto expected =
                    static_cast<double>(half_round_trip(m, {five_beams[i].x(), five_beams[i].y(), 0.0L}));
                EXPECT_NEAR(beams[i], expected, 2e-15 * 1400.0);
            }
            for (const double psd_distance : {0.0, 50.0, -40.0}) {
                const Vector2d expected = spot(m, psd_distance).cast<double>();
                EXPECT_LE((stepdiag::spot_position(*reading, psd_distance) - expected).norm(),
                          2e-15 * expected.norm() + 1e-18);
            }
        }
}

TEST(Reading, SpotToFirstOrderIsTwiceTheTiltTimesTheWay) {
    const Reading reading{1000.0, 1e-6, 2e-6};
    const Vector2d spot = stepdiag::spot_position(reading, 50.0);
    EXPECT_NEAR(spot.x(), -2.0 * 1050.0 * 2e-6, 1e-13);  // third order: (2e-6)^2 relative
    EXPECT_NEAR(spot.y(), +2.0 * 1050.0 * 1e-6, 1e-13);
}

TEST(Reading, ReductionsInvertTheDefinitionsExactly) {
    for (const double tilt : {1e-9, 1e-6, 1e-3, 0.1, 0.4})
        for (const Mirror& m : mirrors(tilt)) {
            const auto reading = *stepdiag::read_mirror(m.point, m.normal);
            const double size = std::hypot(reading.alpha, reading.beta);
            for (const double psd_distance : {0.0, 50.0}) {
                const auto back = stepdiag::reduce_spot(reading.distance,
                                                        stepdiag::spot_position(reading, psd_distance), psd_distance);
                ASSERT_TRUE(back);
                EXPECT_EQ(back->reading.distance, reading.distance);
                EXPECT_NEAR(back->reading.alpha, reading.alpha, 1e-14 * size);
                EXPECT_NEAR(back->reading.beta, reading.beta, 1e-14 * size);
            }
            for (const auto& offsets : {three_beams, five_beams}) {
                const auto back = stepdiag::reduce_beams(stepdiag::beam_distances(reading, offsets), offsets);
                ASSERT_TRUE(back);
                EXPECT_NEAR(back->reading.distance, reading.distance, 1e-14 * reading.distance);
                // A difference of two distances, rounded to 2e-13 mm, over a base of 10 or 20 mm.
                EXPECT_NEAR(back->reading.alpha, reading.alpha, 1e-13 + 1e-14 * size);
                EXPECT_NEAR(back->reading.beta, reading.beta, 1e-13 + 1e-14 * size);
            }
        }
}

TEST(Reading, JacobiansOfReductionsAreTheirDifferenceQuotients) {
    const auto as_vector = [](const Reading& r) { return Vector3d(r.distance, r.alpha, r.beta); };
    for (const Mirror& m : mirrors(0.2)) {
        const auto reading = *stepdiag::read_mirror(m.point, m.normal);
        const auto check = [&](const Eigen::VectorXd& channels, const auto& reduce) {
            const auto analytic = reduce(channels)->jacobian;
            for (Eigen::Index c = 0; c < channels.size(); ++c) {
                const double h = 1e-3;  // mm: truncation h^2/d^2 ~ 1e-10 or less, rounding 1e-13/h = 1e-10
                Eigen::VectorXd up = channels, down = channels;
                up[c] += h, down[c] -= h;
                const Vector3d numeric =
                    (as_vector(reduce(up)->reading) - as_vector(reduce(down)->reading)) / (2.0 * h);
                EXPECT_LE((analytic.col(c) - numeric).norm(), 1e-8) << "channel " << c;
            }
        };
        const Vector2d s = stepdiag::spot_position(reading, 50.0);
        check(Vector3d(reading.distance, s.x(), s.y()),
              [](const Eigen::VectorXd& v) { return stepdiag::reduce_spot(v[0], v.tail<2>(), 50.0); });
        for (const auto& offsets : {three_beams, five_beams})
            check(stepdiag::beam_distances(reading, offsets),
                  [&](const Eigen::VectorXd& v) { return stepdiag::reduce_beams(v, offsets); });
    }
}

TEST(Reading, JacobianOfTheSpotIsFiniteAtZero) {
    const auto reduced = stepdiag::reduce_spot(500.0, Vector2d::Zero(), 50.0);
    ASSERT_TRUE(reduced);
    EXPECT_EQ(reduced->reading.alpha, 0.0);
    EXPECT_NEAR(reduced->jacobian(1, 2), 1.0 / 1100.0, 1e-18);   // alpha by spot_y
    EXPECT_NEAR(reduced->jacobian(2, 1), -1.0 / 1100.0, 1e-18);  // beta by spot_x
}

TEST(Reading, MirrorThatCannotSendTheBeamBackGivesNone) {
    EXPECT_FALSE(stepdiag::read_mirror({0, 0, 500}, {0, 0, -1}));                         // facing away
    EXPECT_FALSE(stepdiag::read_mirror({0, 0, 500}, Vector3d(1, 0, 0)));                  // edge on
    EXPECT_FALSE(stepdiag::read_mirror({0, 0, 500}, Vector3d(1.01, 0, 1).normalized()));  // beyond 45 degrees
    EXPECT_FALSE(stepdiag::read_mirror({0, 0, -500}, {0, 0, 1}));                         // behind the head
    EXPECT_FALSE(stepdiag::read_mirror({0, 0, std::nan("")}, {0, 0, 1}));
    EXPECT_FALSE(stepdiag::read_mirror({0, 0, 500}, {0, 0, std::nan("")}));
    EXPECT_TRUE(stepdiag::read_mirror({0, 0, 500}, Vector3d(0.99, 0, 1).normalized()));
}

TEST(Reading, ChannelsThatNoMirrorGivesAreNone) {
    EXPECT_FALSE(stepdiag::reduce_spot(-1.0, {0, 0}, 50.0));
    EXPECT_FALSE(stepdiag::reduce_spot(100.0, {0, 0}, -200.0));
    EXPECT_FALSE(stepdiag::reduce_spot(std::nan(""), {0, 0}, 50.0));
    EXPECT_FALSE(stepdiag::reduce_spot(100.0, {std::nan(""), 0}, 50.0));
    EXPECT_FALSE(stepdiag::reduce_spot(100.0, {1e9, 0}, 50.0).has_value() &&
                 stepdiag::reduce_spot(100.0, {1e9, 0}, 50.0)->reading.tan2_phi() >= 1.0);
    EXPECT_FALSE(stepdiag::reduce_beams(Eigen::Vector3d(1, 1, 1), {{0, 0}, {10, 0}, {20, 0}}));  // on one line
    EXPECT_FALSE(stepdiag::reduce_beams(Eigen::Vector3d(1, 1, 1), {{5, 5}, {5, 5}, {5, 5}}));    // at one point
    EXPECT_FALSE(stepdiag::reduce_beams(Eigen::Vector2d(1, 1), {{0, 0}, {10, 0}}));
}
