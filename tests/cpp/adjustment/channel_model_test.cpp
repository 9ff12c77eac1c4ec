// The adjustment's model of a reading: its values against the machine's own pose and the definitions of the readings,
// its derivatives against the text of the physics in dual numbers.
#include "adjustment/channel_model.hpp"

#include <gtest/gtest.h>

#include <random>

#include "stepdiag/core/rotation.hpp"
#include "stepdiag/measurement/reading.hpp"
#include "stepdiag/plan/line.hpp"
#include "support/model_text.hpp"

namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::VectorXd;
using stepdiag::Chain;
using stepdiag::ChannelDerivative;
using stepdiag::ChannelKind;
using stepdiag::ChannelModel;
using stepdiag::HeadCalibration;
using stepdiag::MachineErrors;
using stepdiag::ReadingPlace;

const Vector3d volume(800.0, 600.0, 500.0), tool(30.0, -20.0, 120.0), commanded(320.0, 420.0, 150.0);
const char* const chains[] = {"[w X' b Y Z t]", "[w b Z X Y t]", "[w Y' Z' X' b t]"};
const char* const lines[] = {"ppp", "npn", "0p0", "00n"};

struct Case {
    ChannelKind kind;
    HeadCalibration head;
};

std::vector<Case> cases() {
    HeadCalibration psd, beams;
    psd.psd_distance = 70.0;
    psd.spot_beam = {25.0, -3.0};
    beams.beam_offsets = {{0.0, 0.0}, {20.0, 1.0}, {-2.0, 20.0}, {-9.0, -9.0}};
    return {{ChannelKind::ideal, {}}, {ChannelKind::psd, psd}, {ChannelKind::multi_beam, beams}};
}

// Everything that a reading depends on, as one vector: 18 errors of the axes, then the set-up.
struct Point {
    Chain chain;
    Case head;
    Eigen::Matrix3d frame;
    VectorXd parameters;

    static constexpr double time = 700.0;
    double travel() const { return frame.col(2).dot(commanded); }
    Vector3d origin() const { return commanded + tool - 400.0 * frame.col(2); }
    MachineErrors errors() const {
        return {parameters.segment<6>(0), parameters.segment<6>(6), parameters.segment<6>(12)};
    }

    ReadingPlace place() const { return {commanded, travel(), time}; }
    ChannelModel unset_model() const { return {head.kind, head.head, frame, origin()}; }
    VectorXd read(ChannelDerivative* derivative = nullptr) const {
        ChannelModel model = unset_model();
        model.set_up(parameters.tail(model.setup_size()));
        VectorXd reading(model.channels());
        if (derivative) derivative->resize(model.channels(), 18 + model.setup_size());
        model.read(differentiate_pose(chain, tool, commanded, errors()), place(), reading, derivative);
        return reading;
    }

    // The pose of a machine that has these errors where it stands.
    stepdiag::Pose pose() const {
        stepdiag::ParameterTable table;
        for (int axis = 0; axis < 3; ++axis)
            for (int c = 0; c < 6; ++c)
                table.functions[6 * axis + c] = stepdiag::FunctionTable{
                    {0.0, commanded[axis]}, {0.0, parameters[6 * axis + c]}, {std::nullopt, std::nullopt}};
        return stepdiag::Machine(chain, stepdiag::ErrorMap(table), tool).pose(commanded);
    }
};

std::vector<Point> random_points() {
    std::mt19937 generator(7);
    std::normal_distribution<double> normal;
    std::vector<Point> points;
    for (const Case& head : cases())
        for (const char* chain : chains)
            for (const char* line : lines) {
                const int setup = ChannelModel::setup_size(head.kind, head.head);
                VectorXd parameters(18 + setup);
                for (double& p : parameters) p = normal(generator);
                for (int a = 0; a < 3; ++a) {
                    parameters.segment<3>(6 * a) *= 0.05;      // mm
                    parameters.segment<3>(6 * a + 3) *= 2e-3;  // rad
                }
                auto of_line = parameters.tail(setup);
                of_line.segment<4>(stepdiag::setup::reflector) *= 2e-3;
                of_line[stepdiag::setup::roll] *= 0.02;
                of_line[stepdiag::setup::gain] *= 0.01;
                of_line[stepdiag::setup::drift] *= 1e-6;
                of_line[stepdiag::setup::cosine] *= 1e-6;
                points.push_back(
                    {Chain::parse(chain), head, stepdiag::line_frame(stepdiag::Line::parse(line), volume), parameters});
            }
    return points;
}

TEST(ChannelModel, ReadsWhatTheDefinitionsSay) {
    for (const Point& point : random_points()) {
        const stepdiag::Pose pose = point.pose();
        const auto at = [&](int column) { return point.parameters[18 + column]; };
        const auto pair = [&](int column) { return Vector2d(at(column), at(column + 1)); };
        const auto turned = [&](int column) {
            return Eigen::Matrix3d(point.frame * stepdiag::rotation_exp({at(column), at(column + 1), 0.0}));
        };
        const Vector2d lateral = pair(stepdiag::setup::lateral);
        const Vector3d origin = point.origin() + point.frame.leftCols<2>() * lateral;
        const Eigen::Matrix3d sensor =
            turned(stepdiag::setup::laser) * stepdiag::rotation_exp({0.0, 0.0, at(stepdiag::setup::roll)});
        const Vector3d normal = pose.rotation * turned(stepdiag::setup::reflector).col(2);
        const auto exact =
            stepdiag::read_mirror(sensor.transpose() * (pose.position - origin), sensor.transpose() * normal);
        ASSERT_TRUE(exact);
        const double scale = 1.0 + at(stepdiag::setup::gain);
        const double constant = at(stepdiag::setup::distance_constant) + Point::time * at(stepdiag::setup::drift) -
                                point.travel() * at(stepdiag::setup::cosine);
        VectorXd expected(3);
        expected << exact->distance + constant, scale * exact->alpha, scale * exact->beta;
        if (point.head.kind == ChannelKind::psd)
            expected.tail<2>() =
                scale * stepdiag::spot_position(*exact, *point.head.head.psd_distance, point.head.head.spot_beam) +
                pair(stepdiag::setup::psd_zero);
        if (point.head.kind == ChannelKind::multi_beam) {
            auto offsets = point.head.head.beam_offsets;
            for (Vector2d& offset : offsets) offset *= scale;
            expected = stepdiag::beam_distances(*exact, offsets).array() + constant;
            expected.tail(3) += point.parameters.tail(3);
        }
        // A metre, rounded a few times; spots are distances times tilts.
        EXPECT_LE((point.read() - expected).cwiseAbs().maxCoeff(), 2e-12);
    }
}

TEST(ChannelModel, DerivativesAreThoseOfTheTextInDualNumbers) {
    for (const Point& point : random_points()) {
        ChannelDerivative found;
        point.read(&found);
        const stepdiag::KnownPoint known{point.chain, tool, point.unset_model(), point.place()};
        for (Eigen::Index j = 0; j < point.parameters.size(); ++j) {
            // Sums of a few terms of up to a metre a radian, in another order; drift and cosine multiply 700 s and a
            // metre.
            const VectorXd expected = derivative(known, point.parameters, j);
            EXPECT_LE((found.col(j) - expected).cwiseAbs().maxCoeff(), 1e-12 * (1.0 + expected.cwiseAbs().maxCoeff()))
                << "parameter " << j;
        }
    }
}

}  // namespace
