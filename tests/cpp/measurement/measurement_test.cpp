#include "stepdiag/measurement/measurement.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <limits>
#include <map>
#include <random>
#include <string>
#include <vector>

#include "support/refuses.hpp"
#include "support/spoil.hpp"

namespace {

using stepdiag::Channel;
using stepdiag::Direction;
using stepdiag::Line;
using stepdiag::Measurement;
using stepdiag::parse_measurement;
using stepdiag::Station;

std::uint64_t bits(double value) {
    std::uint64_t word;
    std::memcpy(&word, &value, sizeof word);
    return word;
}

struct AnyDouble {
    std::mt19937_64 engine{17};
    double operator()() {
        for (;;) {
            const std::uint64_t word = engine();
            double value;
            std::memcpy(&value, &word, sizeof value);
            if (std::isfinite(value)) return value;
        }
    }
    double uncertainty() {  // of every size that one may have
        for (;;)
            if (const double value = std::abs((*this)()); stepdiag::is_usable_uncertainty(value)) return value;
    }
};

Measurement random_measurement(const std::vector<std::string>& names, bool weighted, bool runs) {
    AnyDouble any;
    std::vector<Station> stations;
    std::vector<Channel> channels;
    for (const auto& name : names) channels.push_back({name, {}, {}});
    for (int i = 0; i < 60; ++i) {
        stations.push_back({runs ? i % 3 - 1 : 0,
                            Line::parse(i % 2 ? "npp" : "00p"),
                            i,
                            runs && i % 5 == 0 ? Direction::backward : Direction::forward,
                            {any(), i ? any() : -0.0, 1.0 / 3.0}});
        for (auto& channel : channels) {
            channel.value.push_back(i % 7 == 3 ? std::nullopt : std::optional<double>(any()));
            const bool has_unit = channel.name != "time" && channel.name != "temperature";
            if (weighted && has_unit)
                channel.standard_uncertainty.push_back(i % 11 == 2 ? std::nullopt
                                                                   : std::optional<double>(any.uncertainty()));
        }
    }
    return Measurement(stations, channels);
}

void expect_same_bits(const std::vector<std::optional<double>>& a, const std::vector<std::optional<double>>& b) {
    ASSERT_EQ(a.size(), b.size());
    for (std::size_t i = 0; i < a.size(); ++i) {
        ASSERT_EQ(a[i].has_value(), b[i].has_value());
        if (a[i]) {
            EXPECT_EQ(bits(*a[i]), bits(*b[i])) << *a[i];
        }
    }
}

void expect_same_bits(const Measurement& a, const Measurement& b) {
    ASSERT_EQ(a.size(), b.size());
    for (std::size_t i = 0; i < a.size(); ++i) {
        const Station &x = a.stations()[i], &y = b.stations()[i];
        EXPECT_TRUE(x.run == y.run && x.line == y.line && x.point == y.point && x.direction == y.direction);
        for (int c = 0; c < 3; ++c) EXPECT_EQ(bits(x.commanded[c]), bits(y.commanded[c]));
    }
    ASSERT_EQ(a.channels().size(), b.channels().size());
    for (const Channel& channel : a.channels()) {
        const Channel* other = b.find(channel.name);
        ASSERT_TRUE(other) << channel.name;
        expect_same_bits(channel.value, other->value);
        expect_same_bits(channel.standard_uncertainty, other->standard_uncertainty);
    }
}

const std::string header = "line,point,x_mm,y_mm,z_mm,distance_mm,alpha_urad,beta_urad\n";

Station station(int point, const char* line = "ppp", int run = 0) {
    return {run, Line::parse(line), point, Direction::forward, {0, 0, 0}};
}

}  // namespace

TEST(Measurement, PassApproachesItsPointsInTheDirectionOfItsOwnTravel) {
    using stepdiag::Approach;
    constexpr Approach plus = Approach::positive, minus = Approach::negative;
    const auto expect = [](const char* line, stepdiag::Direction direction, stepdiag::Approaches expected) {
        EXPECT_EQ(approaches(stepdiag::Line::parse(line), direction), expected) << line;
    };
    expect("ppp", stepdiag::Direction::forward, {plus, plus, plus});
    expect("ppp", stepdiag::Direction::backward, {minus, minus, minus});
    expect("npp", stepdiag::Direction::forward, {minus, plus, plus});
    expect("npp", stepdiag::Direction::backward, {plus, minus, minus});
    expect("0n0", stepdiag::Direction::forward, {plus, minus, plus});  // X and Z stand at home
    expect("0n0", stepdiag::Direction::backward, {plus, plus, plus});
    expect("p00", stepdiag::Direction::backward, {minus, plus, plus});
}

TEST(Measurement, TextIsReadBackToTheSameBits) {
    for (const auto& names :
         std::vector<std::vector<std::string>>{{"distance"},
                                               {"distance", "alpha", "beta"},
                                               {"distance", "spot_x", "spot_y", "time", "temperature"},
                                               {"d1", "d2", "d3", "d4", "d5", "d6", "d7", "d8", "d9", "d10", "time"}})
        for (const bool weighted : {false, true})
            for (const bool runs : {false, true}) {
                const Measurement measurement = random_measurement(names, weighted, runs);
                expect_same_bits(parse_measurement(format_measurement(measurement), "run.csv"), measurement);
            }
}

TEST(Measurement, FileIsReadBackToTheSameBits) {
    const std::string path = (std::filesystem::temp_directory_path() / "stepdiag_measurement_test.csv").string();
    const Measurement measurement = random_measurement({"distance", "alpha", "beta"}, true, true);
    write_measurement(measurement, path);
    expect_same_bits(stepdiag::read_measurement(path), measurement);
    std::filesystem::remove(path);
}

TEST(Measurement, EveryRunWithKnownTruthIsReadBackToTheSameText) {
    // The files were written by another program with the shortest digits, so equal values must be equal bits.
    for (const char* name :
         {"clean", "misaligned", "displaced_psd", "three_beams", "noisy", "reversed_order", "faces"}) {
        const auto path =
            std::string(STEPDIAG_TEST_DATA "/../../python/stepdiag/selftest/known/runs/") + name + "/measurement.csv";
        const Measurement measurement = stepdiag::read_measurement(path);
        expect_same_bits(parse_measurement(format_measurement(measurement), "again"), measurement);
        EXPECT_GT(measurement.size(), 100u) << name;
    }
}

TEST(Measurement, FieldsAreInNativeUnitsAndEmptyOnesAreLost) {
    const auto m = parse_measurement(
        "run,direction,line,point,x_mm,y_mm,z_mm,distance_mm,alpha_urad,beta_urad,u_distance_um,u_alpha_urad,u_beta_"
        "urad,time_s,temperature_c\n"
        "2,backward,npp,0,800,0,0,100.5,-700,,0.25,1.5,,12,20.5\n",
        "run.csv");
    ASSERT_EQ(m.size(), 1u);
    EXPECT_EQ(m.stations()[0].run, 2);
    EXPECT_EQ(m.stations()[0].direction, Direction::backward);
    EXPECT_EQ(m.find("distance")->value[0], 100.5);
    EXPECT_EQ(m.find("alpha")->value[0], -700e-6);
    EXPECT_FALSE(m.find("beta")->value[0]);
    EXPECT_EQ(m.find("distance")->standard_uncertainty[0], 0.25e-3);
    EXPECT_EQ(m.find("alpha")->standard_uncertainty[0], 1.5e-6);
    EXPECT_FALSE(m.find("beta")->standard_uncertainty[0]);
    EXPECT_EQ(m.find("time")->value[0], 12.0);
    EXPECT_EQ(m.find("temperature")->value[0], 20.5);
    EXPECT_EQ(m.find("spot_x"), nullptr);
}

TEST(Measurement, ByteOrderMarkWindowsLineEndsQuotesAndOtherOrdersAreRead) {
    const auto m = parse_measurement(
        "\xEF\xBB\xBFpoint,line,distance_mm,z_mm,y_mm,x_mm\r\n0,\"ppp\",1.5,3,2,1\r\n\r\n1,ppp,,6,5,4\r\n", "run.csv");
    ASSERT_EQ(m.size(), 2u);
    EXPECT_EQ(m.stations()[1].commanded, Eigen::Vector3d(4, 5, 6));
    EXPECT_FALSE(m.find("distance")->value[1]);
}

TEST(Measurement, MalformedTextIsRefusedWithFileAndLine) {
    const struct {
        std::string text, culprit;
    } cases[] = {
        {"", "run.csv"},
        {header, "no rows"},
        {"point,x_mm,y_mm,z_mm,distance_mm\n0,0,0,0,1\n", "\"line\""},
        {"line,x_mm,y_mm,z_mm,distance_mm\nppp,0,0,0,1\n", "\"point\""},
        {"line,point,x_mm,z_mm,distance_mm\nppp,0,0,0,1\n", "\"y_mm\""},
        {"line,point,x_mm,y_mm,z_mm\nppp,0,0,0,0\n", "channels"},
        {"line,point,x_mm,y_mm,z_mm,distance_mm,distance_mm\nppp,0,0,0,0,1,1\n", "\"distance_mm\" is given twice"},
        {"line,point,x_mm,y_mm,z_mm,distance_um\nppp,0,0,0,0,1\n", "\"distance_um\""},
        {"line,point,x_mm,y_mm,z_mm,distance\nppp,0,0,0,0,1\n", "\"distance\""},
        {"line,point,x_mm,y_mm,z_mm,distance_mm,alpha_mrad,beta_urad\nppp,0,0,0,0,1,1,1\n", "\"alpha_mrad\""},
        {"line,point,x_mm,y_mm,z_mm,distance_mm,humidity_pc\nppp,0,0,0,0,1,1\n", "\"humidity_pc\""},
        {"line,point,x_mm,y_mm,z_mm,distance_mm,alpha_urad\nppp,0,0,0,0,1,1\n", "channels"},
        {"line,point,x_mm,y_mm,z_mm,distance_mm,alpha_urad,beta_urad,spot_x_mm,spot_y_mm\nppp,0,0,0,0,1,1,1,1,1\n",
         "channels"},
        {"line,point,x_mm,y_mm,z_mm,d1_mm,d2_mm\nppp,0,0,0,0,1,1\n", "channels"},
        {"line,point,x_mm,y_mm,z_mm,d1_mm,d2_mm,d4_mm\nppp,0,0,0,0,1,1,1\n", "channels"},
        {"line,point,x_mm,y_mm,z_mm,d1_mm,d2_mm,d3_mm,distance_mm\nppp,0,0,0,0,1,1,1,1\n", "channels"},
        {"line,point,x_mm,y_mm,z_mm,distance_mm,u_alpha_urad\nppp,0,0,0,0,1,1\n", "\"u_alpha_urad\""},
        {header + "ppp,0,0,0,0,100,0\n", "line 2"},
        {header + "ppp,0,0,0,0,100,0,0,0\n", "line 2"},
        {header + "ppq,0,0,0,0,100,0,0\n", "line 2"},
        {header + "000,0,0,0,0,100,0,0\n", "line 2"},
        {header + "ppp,-1,0,0,0,100,0,0\n", "line 2: point"},
        {header + "ppp,1.5,0,0,0,100,0,0\n", "line 2: point"},
        {header + "ppp,,0,0,0,100,0,0\n", "line 2: point"},
        {header + "ppp,99999999999,0,0,0,100,0,0\n", "line 2: point"},
        {header + "ppp,0,,0,0,100,0,0\n", "line 2: x_mm"},
        {header + "ppp,0,0,nan,0,100,0,0\n", "line 2: y_mm"},
        {header + "ppp,0,0,0,inf,100,0,0\n", "line 2: z_mm"},
        {header + "ppp,0,0,0,0,nan,0,0\n", "line 2: distance_mm"},
        {header + "ppp,0,0,0,0,1e999,0,0\n", "line 2: distance_mm"},
        {header + "ppp,0,0,0,0,100,-inf,0\n", "line 2: alpha_urad"},
        {header + "ppp,0,0,0,0,\"100,5\",0,0\n", "line 2: distance_mm"},
        {header + "ppp,0,0,0,0,100,0,lost\n", "line 2: beta_urad"},
        {header + "ppp,0,0,0,0,100,0,0\n\nppp,0,0,0,0,100,0,0\n", "line 4"},
        {header + "ppp,0,0,0,0,\"100,0,0\n", "line 2"},
        {header + "ppp,0,0,0,0,100,0,0\nppp,1,40,0,0,12", "line 3"},  // truncated
        {"line,point,x_mm,y_mm,z_mm,distance_mm,u_distance_um\nppp,0,0,0,0,1,0\n", "line 2: u_distance_um"},
        {"line,point,x_mm,y_mm,z_mm,distance_mm,u_distance_um\nppp,0,0,0,0,1,-1\n", "line 2: u_distance_um"},
        {"line,point,x_mm,y_mm,z_mm,distance_mm,u_distance_um\nppp,0,0,0,0,1,1e-300\n", "line 2: u_distance_um"},
        {"line,point,x_mm,y_mm,z_mm,distance_mm,u_distance_um\nppp,0,0,0,0,1,1e300\n", "line 2: u_distance_um"},
        {"line,point,x_mm,y_mm,z_mm,distance_mm,run\nppp,0,0,0,0,1,first\n", "line 2: run"},
        {"line,point,x_mm,y_mm,z_mm,distance_mm,direction\nppp,0,0,0,0,1,up\n", "line 2: direction"},
    };
    for (const auto& [text, culprit] : cases) {
        SCOPED_TRACE(text);
        expect_refused([&, &text = text] { parse_measurement(text, "run.csv"); }, "run.csv");
        expect_refused([&, &text = text] { parse_measurement(text, "run.csv"); }, culprit);
    }
}

TEST(Measurement, SpoiledTextIsReadOrRefused) {
    const std::string good = format_measurement(random_measurement({"distance", "spot_x", "spot_y"}, true, true));
    Spoiler spoil(4);
    int read = 0;
    for (int i = 0; i < 3000; ++i) {
        const std::string text = spoil(good);
        try {
            read += parse_measurement(text, "run.csv").size() > 0;
        } catch (const stepdiag::InvalidArgument& refusal) {
            EXPECT_EQ(std::string(refusal.what()).rfind("run.csv", 0), 0u) << refusal.what();
        }
    }
    EXPECT_GT(read, 0);  // some changes do no harm
}

TEST(Measurement, ArraysThatMakeNoMeasurementAreRefused) {
    constexpr double undefined = std::numeric_limits<double>::quiet_NaN();
    const auto make = [](std::vector<Station> stations, std::vector<Channel> channels) {
        Measurement(std::move(stations), std::move(channels));
    };
    const Channel one{"distance", {1.0}, {}};
    expect_refused([&] { make({}, {{"distance", {}, {}}}); }, "measurement");
    expect_refused([&] { make({station(0)}, {}); }, "channels");
    expect_refused([&] { make({station(0)}, {{"distance", {1.0, 2.0}, {}}}); }, "\"distance\"");
    expect_refused([&] { make({station(0)}, {{"distance", {1.0}, {0.1, 0.1}}}); }, "\"distance\"");
    expect_refused([&] { make({station(0)}, {one, one}); }, "\"distance\"");
    expect_refused([&] { make({station(0)}, {one, {"gamma", {1.0}, {}}}); }, "\"gamma\"");
    expect_refused([&] { make({station(0)}, {{"d0", {1.0}, {}}}); }, "\"d0\"");
    expect_refused([&] { make({station(-1)}, {one}); }, "row 1");
    expect_refused([&] { make({station(0), station(0)}, {{"distance", {1.0, 1.0}, {}}}); }, "row 2");
    expect_refused([&] { make({station(0)}, {{"distance", {undefined}, {}}}); }, "row 1");
    expect_refused([&] { make({station(0)}, {{"distance", {INFINITY}, {}}}); }, "row 1");
    expect_refused([&] { make({station(0)}, {{"distance", {1.0}, {0.0}}}); }, "row 1");
    for (const double u : {undefined, double(INFINITY), 1e300, 1.1e6, 0.9e-12, 1e-300, -1.0})
        expect_refused([&] { make({station(0)}, {{"distance", {1.0}, {u}}}); }, "uncertainty of distance");
    Station astray = station(0);
    astray.commanded.y() = undefined;
    expect_refused([&] { make({astray}, {one}); }, "row 1");
}

TEST(Measurement, SamePointOfAnotherRunOrLineIsAnotherRow) {
    const Measurement m({station(0), station(0, "ppp", 1), station(0, "npp")}, {{"distance", {1.0, 2.0, 3.0}, {}}});
    EXPECT_EQ(m.size(), 3u);
}

// Rows of a run of 10 steps of 10 mm along X, with tilts; those of `fields` have other readings.
std::string marked(const std::map<int, std::string>& fields) {
    std::string text = "line,point,x_mm,y_mm,z_mm,distance_mm,alpha_urad,beta_urad\n";
    for (int k = 0; k <= 10; ++k) {
        const auto other = fields.find(k);
        text += "p00," + std::to_string(k) + "," + std::to_string(10 * k) + ",0,0," +
                (other != fields.end() ? other->second : std::to_string(100 + 10 * k) + ".25,1.5,-2.5") + "\n";
    }
    return text;
}

std::vector<int> lost(const Measurement& measurement, std::string_view channel) {
    std::vector<int> points;
    for (std::size_t i = 0; i < measurement.size(); ++i)
        if (!measurement.find(channel)->value[i]) points.push_back(measurement.stations()[i].point);
    return points;
}

TEST(Measurement, DistancesOfZeroThatAreNotWhereTheLineIsAreLostWithTheZerosOfTheirRow) {
    const Measurement some = parse_measurement(marked({{0, "0,0,0"}, {4, "0.0,0,-0.0"}, {7, "0,3,0"}}), "run.csv");
    EXPECT_EQ(lost(some, "distance"), (std::vector<int>{0, 4, 7}));
    EXPECT_EQ(lost(some, "alpha"), (std::vector<int>{0, 4}));
    EXPECT_EQ(lost(some, "beta"), (std::vector<int>{0, 4, 7}));
    std::map<int, std::string> dark;
    for (int k = 0; k <= 10; ++k) dark[k] = "0,0,0";
    // Without a neighbour nothing says where they should be: evaluations refuse distances that do not grow.
    EXPECT_TRUE(lost(parse_measurement(marked(dark), "run.csv"), "distance").empty());
    const std::string beams =
        "line,point,x_mm,y_mm,z_mm,d1_mm,d2_mm,d3_mm\np00,0,0,0,0,10,10.5,11\np00,1,50,0,0,60,0,61\n"
        "p00,2,100,0,0,110,110.5,111\n";
    EXPECT_EQ(lost(parse_measurement(beams, "run.csv"), "d2"), std::vector<int>{1});
    EXPECT_TRUE(lost(parse_measurement(beams, "run.csv"), "d3").empty());
    const std::string ends =
        "line,point,x_mm,y_mm,z_mm,distance_mm\n0p0,0,0,0,0,100\n0p0,1,0,600,0,0\np00,0,0,0,0,0\np00,1,800,0,0,800\n";
    EXPECT_EQ(lost(parse_measurement(ends, "run.csv"), "distance"), std::vector<int>{1});
}

TEST(Measurement, ZerosOfACounterThatIsZeroedAtTheFirstPointAndTiltsOfZeroAreReadings) {
    std::map<int, std::string> zeroed;
    for (int k = 0; k <= 10; ++k) zeroed[k] = std::to_string(10 * k) + ",0,0";
    for (const int first : {0, 10}) {
        if (first == 10)  // the head at the far end
            for (int k = 0; k <= 10; ++k) zeroed[k] = std::to_string(10 * k - 100) + ",0,0";
        const Measurement run = parse_measurement(marked(zeroed), "run.csv");
        for (const char* channel : {"distance", "alpha", "beta"}) EXPECT_TRUE(lost(run, channel).empty()) << channel;
    }
}

TEST(Measurement, OtherMarksOfALostBeamAreRefusedWithTheirRow) {
    for (const char* mark : {"9999.999,1,2", "999,1,2", "-9999,1,2", "5000,5000,5000", "65.535,65.535,65.535"}) {
        SCOPED_TRACE(mark);
        const std::string number = std::string(mark).substr(0, std::string(mark).find(','));
        expect_refused([&] { parse_measurement(marked({{4, mark}}), "run.csv"); },
                       "run.csv: row 5 (run 0, line p00, point 4): distance " + number + " mm is ");
    }
    expect_refused(
        [&] { parse_measurement(marked({{4, "500.5,1,2"}, {6, "500.5,3,4"}, {7, "500.5,3,4"}}), "run.csv"); },
        "row 5 (run 0, line p00, point 4): distance 500.5 mm is 360 mm from where its neighbours put it; if "
        "it marks a lost beam, leave the field empty");
    // Once, it may be a slip of a hand, and twice a point that was read twice: what the adjustment leaves out.
    for (const auto& few : {marked({{4, "500.5,1,2"}}), marked({{4, "500.5,1,2"}, {6, "500.5,3,4"}})})
        EXPECT_EQ(lost(parse_measurement(few, "run.csv"), "distance").size(), 0u);
    // Where the line is, a number is a reading.
    const std::string near =
        "line,point,x_mm,y_mm,z_mm,distance_mm\np00,0,0,0,0,989\np00,1,10,0,0,999\np00,2,20,0,0,1009\n";
    EXPECT_EQ(lost(parse_measurement(near, "run.csv"), "distance").size(), 0u);
}
