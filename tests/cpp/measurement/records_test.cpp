#include "measurement/records.hpp"

#include <gtest/gtest.h>

#include "support/refuses.hpp"

namespace {

using stepdiag::has_one_sensor;
using stepdiag::mean_scale_temperatures;
using stepdiag::parse_measurement;
using stepdiag::scale_temperatures;

const char* const three_sensors =
    "line,point,x_mm,y_mm,z_mm,distance_mm,time_s,temperature_x_c,temperature_y_c,temperature_z_c\n"
    "p00,0,0,0,0,100,0,20,,25\n"
    "p00,1,1,0,0,101,10,,21,25\n"
    "p00,2,2,0,0,102,30,23,22,25\n"
    "0p0,0,0,0,0,100,40,30,,25\n";

TEST(Records, EmptyTemperaturesAreInterpolatedInTimeWithinTheirPass) {
    const auto run = parse_measurement(three_sensors, "run.csv");
    const auto found = scale_temperatures(run, Eigen::Vector3d(18.0, 18.5, 19.0));
    EXPECT_DOUBLE_EQ(found[1].x(), 21.0);  // a third of the time
    EXPECT_DOUBLE_EQ(found[0].y(), 21.0);  // the nearest
    EXPECT_DOUBLE_EQ(found[3].x(), 30.0);
    EXPECT_DOUBLE_EQ(found[3].y(), 18.5);  // a pass without any
    EXPECT_DOUBLE_EQ(found[2].z(), 25.0);
    EXPECT_FALSE(has_one_sensor(run));
}

TEST(Records, APassWithoutTemperaturesIsRefusedWhereNothingElseIsKnown) {
    const auto run = parse_measurement(three_sensors, "run.csv");
    expect_refused([&] { scale_temperatures(run, std::nullopt); }, "run 0, line 0p0");
}

TEST(Records, OneSensorServesAllAxes) {
    const auto run = parse_measurement(
        "line,point,x_mm,y_mm,z_mm,distance_mm,temperature_c\np00,0,0,0,0,100,20\np00,1,1,0,0,101,\n"
        "p00,2,2,0,0,102,23\n",
        "run.csv");
    EXPECT_TRUE(has_one_sensor(run));
    const auto found = scale_temperatures(run, std::nullopt);
    EXPECT_EQ(found[1], Eigen::Vector3d::Constant(21.5));  // without times in the order of rows
    EXPECT_EQ(*mean_scale_temperatures(run), Eigen::Vector3d::Constant(21.5));
}

}  // namespace
