#include "stepdiag/head/traced_reading.hpp"

#include "head/assembly.hpp"

namespace stepdiag {
namespace {

// Radius of the spot for a chief ray: so small that the edge of a sensor does not clip it.
constexpr double point_radius = 1e-9;  // mm

}  // namespace

TracedReader::TracedReader(const Head& head, const Eigen::Vector2d& mirror, const ReadingConditions& conditions)
    : traced_(*head.design, head.pose_errors, conditions.environment, mirror),
      nominal_(nominal_head(*head.design, head.standoff, conditions.assumed.value_or(conditions.environment))),
      conditions_(conditions) {}

void TracedReader::detect(int beam, const ArrivalTable::Row& arrivals, std::uint64_t row, SignalRow& signals) const {
    const HeadDesign& design = traced_.design();
    const HeadBeam& light = design.beams[beam];
    if (light.interferometer) {
        std::optional<double> distance;
        const double assumed =
            refractive_index(conditions_.assumed.value_or(conditions_.environment), light.mode.wavelength);
        if (!arrivals.empty())
            distance =
                read_distance(*light.interferometer, light.mode, arrivals[0].beam, traced_.air_index(beam), assumed);
        if (distance) *distance -= nominal_.calibration.head_constants[signals.size()];
        signals.push_back(distance);
        return;
    }
    const auto& device = design.sensors.front().device;
    const Camera* camera = std::get_if<Camera>(&device);
    const auto& interferometer = *design.beams[signal_order(design).front()].interferometer;
    const bool chief_ray = !camera && interferometer.model == ReadingModel::chief_ray;
    std::vector<BeamSpot> spots;
    for (const Arrival& arrival : arrivals) {
        if (chief_ray && !arrival.is_designed) break;
        const double radius = chief_ray ? point_radius : beam_radius(light.mode, arrival.beam.reduced_length);
        spots.push_back({arrival.beam.position, radius, arrival.power});
        if (chief_ray) break;
    }
    std::optional<Eigen::Vector2d> raw;
    if (!spots.empty()) {
        if (camera) raw = locate(*camera, expose(*camera, spots, conditions_.noise_seed, row));
        else raw = locate(std::get<LateralEffect>(device), spots, conditions_.noise_seed, row);
    }
    for (int axis = 0; axis < 2; ++axis)
        signals.push_back(raw ? std::optional((nominal_.spot_axes * (*raw - nominal_.spot_zero))[axis]) : std::nullopt);
}

std::vector<SignalRow> TracedReader::read(const std::vector<MirrorPose>& mirrors, std::uint64_t first_row,
                                          ReplayCount* count) const {
    std::vector<SignalRow> rows(mirrors.size());
    ReplayOptions options = conditions_.replay;
    options.line = first_row;
    for (const int beam : signal_order(traced_.design())) {
        const ArrivalTable arrivals = traced_.replay(beam, mirrors, options, count);
        for (std::size_t i = 0; i < mirrors.size(); ++i) detect(beam, arrivals[i], first_row + i, rows[i]);
    }
    return rows;
}

SignalRow TracedReader::trace(const MirrorPose& mirror) const {
    SignalRow row;
    for (const int beam : signal_order(traced_.design())) {
        const Arrivals arrivals = traced_.arrivals(beam, mirror);
        detect(beam, {arrivals.data(), arrivals.data() + arrivals.size()}, 0, row);
    }
    return row;
}

}  // namespace stepdiag
