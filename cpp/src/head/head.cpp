#include "stepdiag/head/head.hpp"

#include <cmath>

#include "head/assembly.hpp"
#include "measurement/reading-inl.hpp"
#include "stepdiag/core/error.hpp"
#include "stepdiag/head/nominal_head.hpp"

namespace stepdiag {
namespace {

// The rules of define_signals for the beam from `start` in the reference plane, which has a reading.
bool comes_back(const Reading& reading, const Eigen::Vector2d& start, const MirrorPose& mirror,
                const Eigen::Vector2d& size, double aperture) {
    const Eigen::Vector2d tilt(-reading.beta, reading.alpha);
    const double length = reading.beam_length() + tilt.dot(start);
    const Eigen::Vector3d from_centre = Eigen::Vector3d(start.x(), start.y(), length) - mirror.point;
    const Eigen::Vector2d met = mirror.rotation.leftCols<2>().transpose() * from_centre;
    const Eigen::Vector2d aside = 2.0 * length / (1.0 - reading.tan2_phi()) * tilt;
    return length > 0.0 && (2.0 * met.cwiseAbs() - size).maxCoeff() <= 0.0 &&
           2.0 * aside.lpNorm<Eigen::Infinity>() <= aperture;
}

}  // namespace

void check_head(const Head& head) {
    const auto require_length = [](double length, const char* key, double lowest) {
        if (!(std::isfinite(length) && length > lowest))
            throw InvalidArgument(std::string("head ") + key + ": expected a finite value above " +
                                  (lowest == 0.0 ? "0" : "minus the standoff"));
    };
    require_length(head.standoff, "standoff", 0.0);
    require_length(head.wavelength, "wavelength", 0.0);
    require_length(head.aperture, "aperture", 0.0);
    if (head.mirror && !(head.mirror->allFinite() && head.mirror->minCoeff() > 0.0))
        throw InvalidArgument("head mirror: expected two positive lengths in mm, width and height");
    if (head.layout == HeadLayout::psd) require_length(head.psd_distance, "psd_distance", -head.standoff);
    if (head.layout == HeadLayout::multi_beam) {
        for (const auto& offset : head.beam_offsets)
            if (!offset.allFinite()) throw InvalidArgument("head beam_offsets: expected finite pairs in mm");
        if (!reduce_beams(Eigen::VectorXd::Constant(Eigen::Index(head.beam_offsets.size()), head.standoff),
                          head.beam_offsets))
            throw InvalidArgument("head beam_offsets: expected three or more beams that are not on one line, got " +
                                  std::to_string(head.beam_offsets.size()) + " beam(s)");
    }
}

Head make_head(HeadDesign design, double standoff, const std::optional<Eigen::Vector2d>& mirror, PoseErrors pose_errors,
               std::optional<ReadingModel> reading_model) {
    check_design(design);
    for (HeadBeam& beam : design.beams)
        if (beam.interferometer && reading_model) beam.interferometer->model = *reading_model;
    Head head;
    head.layout = design.layout;
    head.standoff = standoff;
    head.mirror = mirror;
    head.wavelength = design.beams.front().mode.wavelength;
    head.nominal = nominal_head(design, standoff).calibration;
    head.psd_distance = head.nominal.psd_distance.value_or(0.0);
    head.beam_offsets = head.nominal.beam_offsets;
    head.pose_errors = std::move(pose_errors);
    head.design = std::make_shared<const HeadDesign>(std::move(design));
    check_head(head);
    TracedHead(*head.design, head.pose_errors, {}, {1.0, 1.0});  // checks the pose errors
    if (!head.pose_errors.empty()) check_gaps(*head.design, head.pose_errors);
    return head;
}

Environment usual_environment(const Head& head) { return head.design ? Environment{Air{}} : Environment{}; }

HeadSetup set_up(const Head& head, const Eigen::Matrix3d& machine_R_line, const Eigen::Vector3d& first_point,
                 const Eigen::Vector2d& mirror, const Misalignment& misalignment) {
    using namespace STEPDIAG_NAMESPACE;
    const auto pair = [](const Eigen::Vector2d& v) { return Vector3<double>{v.x(), v.y(), 0.0}; };
    const Eigen::Vector3d origin = first_point - head.standoff * machine_R_line.col(2);
    const Placed<double> placed = place_setup<double>(broadcast9<double>(machine_R_line), broadcast3<double>(origin),
                                                      {pair(misalignment.reflector),
                                                       pair(misalignment.laser),
                                                       {0.0, 0.0, misalignment.roll},
                                                       pair(misalignment.lateral)});
    return {to_eigen(placed.origin), to_eigen(placed.machine_R_sensor), to_eigen(placed.tool_R_mirror), mirror};
}

MirrorPose mirror_in_sensor_frame(const HeadSetup& setup, const Eigen::Vector3d& functional_point,
                                  const Eigen::Matrix3d& machine_R_tool) {
    const Eigen::Matrix3d sensor_R_machine = setup.machine_R_sensor.transpose();
    return {sensor_R_machine * (functional_point - setup.origin),
            sensor_R_machine * machine_R_tool * setup.tool_R_mirror};
}

std::vector<std::string> signal_names(const Head& head) {
    switch (head.layout) {
        case HeadLayout::ideal: return {"distance", "alpha", "beta"};
        case HeadLayout::psd: return {"distance", "spot_x", "spot_y"};
        case HeadLayout::multi_beam: break;
    }
    std::vector<std::string> names;
    for (std::size_t i = 1; i <= head.beam_offsets.size(); ++i) names.push_back("d" + std::to_string(i));
    return names;
}

bool is_distance(const std::string& signal) { return signal.front() == 'd'; }

Eigen::VectorXd signals(const Head& head, const Reading& reading) {
    switch (head.layout) {
        case HeadLayout::ideal: return Eigen::Vector3d(reading.distance, reading.alpha, reading.beta);
        case HeadLayout::psd: {
            const Eigen::Vector2d spot = spot_position(reading, head.psd_distance);
            return Eigen::Vector3d(reading.distance, spot.x(), spot.y());
        }
        case HeadLayout::multi_beam: break;
    }
    return beam_distances(reading, head.beam_offsets);
}

SignalRow define_signals(const Head& head, const MirrorPose& mirror, const Eigen::Vector2d& size) {
    const bool one_beam = head.layout != HeadLayout::multi_beam;
    SignalRow row(one_beam ? 3 : head.beam_offsets.size());
    const std::optional<Reading> reading = read_mirror(mirror.point, mirror.rotation.col(2));
    if (!reading) return row;
    const Eigen::VectorXd values = signals(head, *reading);
    for (std::size_t c = 0; c < row.size(); ++c) {
        const Eigen::Vector2d start = one_beam ? Eigen::Vector2d(0.0, 0.0) : head.beam_offsets[c];
        if (comes_back(*reading, start, mirror, size, head.aperture)) row[c] = values[Eigen::Index(c)];
    }
    return row;
}

}  // namespace stepdiag
