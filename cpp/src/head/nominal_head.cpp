#include "stepdiag/head/nominal_head.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <sstream>

#include "head/assembly.hpp"
#include "stepdiag/core/error.hpp"
#include "stepdiag/head/traced_head.hpp"

namespace stepdiag {
namespace {

// Large enough for rounding of a path (1e-13 mm), small enough to neglect third-order terms in glass.
constexpr double distance_tilt = 1e-3;
constexpr double spot_tilt = 1e-5;
constexpr double square = 1e-8;           // mm in 10 mm: rounding, which must not be extrapolated as an angle
constexpr double smallest_offset = 1e-3;  // mm: 1 nm of distance at 1 mrad

// Throws InvalidArgument with the reason why a beam of the nominal head does not reach its detector.
[[noreturn]] void refuse(const TracedHead& head, int beam, double distance, const MirrorPose& mirror) {
    const RayTree tree = head.trace(beam, mirror);
    const bool saw_mirror = std::any_of(tree.segments.begin(), tree.segments.end(), [&](const Segment& segment) {
        return segment.hit && segment.hit->face == head.mirror_face();
    });
    const HeadBeam& design = head.design().beams[beam];
    std::ostringstream text;
    text << "beam " << design.name << ": " << (saw_mirror ? "does not come back from" : "does not meet")
         << " a mirror square to the beam at " << distance << " mm";
    if (saw_mirror) text << (design.interferometer ? " to its collimator" : " to its sensor " + design.sensor);
    if (tree.cut > 0.0) text << " (light was cut by the limits on hits, power or segments)";
    throw InvalidArgument(text.str());
}

// Readings of the nominal head for one mirror pose.
class NominalReader {
public:
    NominalReader(const HeadDesign& design, const Environment& environment, const Eigen::Vector2d& mirror)
        : head_(design, {}, environment, mirror) {}

    ReturnedBeam read(int beam, double distance, double alpha, double beta) const {
        const MirrorPose mirror = tilted_mirror({0.0, 0.0, distance}, alpha, beta);
        const Arrivals arrivals = head_.arrivals(beam, mirror);
        if (arrivals.empty()) refuse(head_, beam, distance, mirror);
        return arrivals.front().beam;
    }
    double half_path(int beam, double distance, double alpha, double beta) const {
        return read(beam, distance, alpha, beta).optical_length / (2.0 * head_.air_index(beam));
    }
    // Point at which a beam meets a mirror perpendicular to the head's axis.
    Eigen::Vector2d outgoing(int beam, double distance) const {
        const RayTree tree = head_.trace(beam, tilted_mirror({0.0, 0.0, distance}, 0.0, 0.0));
        for (const Segment& segment : tree.segments)
            if (segment.hit && segment.hit->face == head_.mirror_face()) return segment.hit->point.head<2>();
        return Eigen::Vector2d::Zero();
    }

private:
    TracedHead head_;
};

Eigen::Vector2d beam_offset(const NominalReader& reader, int beam, double distance) {
    const double h = distance_tilt;
    const auto slope = [&](double alpha, double beta) {  // odd part in the tilt, so that (1 - t) cancels exactly
        return (reader.half_path(beam, distance, alpha, beta) - reader.half_path(beam, distance, -alpha, -beta)) *
               (1.0 - h * h) / (2.0 * h);
    };
    return {-slope(0.0, h), slope(h, 0.0)};
}

// d(raw spot)/d(-beta, alpha) at zero tilt. The factor 1/(1 - t) cancels.
Eigen::Matrix2d spot_slopes(const NominalReader& reader, int beam, double distance) {
    const double h = spot_tilt;
    Eigen::Matrix2d slopes;
    slopes.col(0) = reader.read(beam, distance, 0.0, -h).position - reader.read(beam, distance, 0.0, h).position;
    slopes.col(1) = reader.read(beam, distance, h, 0.0).position - reader.read(beam, distance, -h, 0.0).position;
    return slopes * (1.0 - h * h) / (2.0 * h);
}

}  // namespace

NominalHead nominal_head(const HeadDesign& design, double distance, const Environment& environment) {
    if (!(distance > reach(design))) {
        std::ostringstream text;
        text << "standoff: the head reaches " << reach(design) << " mm beyond its reference plane; expected more, got "
             << distance << " mm";
        throw InvalidArgument(text.str());
    }
    const NominalReader reader(design, environment, Eigen::Vector2d::Constant(nominal_mirror(design)));

    // A beam that is not parallel to the axis changes its offset with distance. This is a tilt of the head, so the
    // offset is extrapolated to the reference plane. The distance is short, so that no beam misses the mirror.
    const double beyond = distance + 10.0, farther = distance + 1000.0;
    const auto at_plane = [&](const Eigen::Vector2d& here, const Eigen::Vector2d& there) -> Eigen::Vector2d {
        if ((there - here).norm() < square) return here;
        return here - distance / (beyond - distance) * (there - here);
    };

    NominalHead nominal;
    for (int b = 0; b < int(design.beams.size()); ++b) {
        if (design.beams[b].interferometer) {
            nominal.calibration.head_constants.push_back(reader.half_path(b, distance, 0.0, 0.0) - distance);
            const Eigen::Vector2d offset = at_plane(beam_offset(reader, b, distance), beam_offset(reader, b, beyond));
            if (design.layout == HeadLayout::multi_beam) nominal.calibration.beam_offsets.push_back(offset);
            if (design.layout == HeadLayout::psd && !(offset.norm() < smallest_offset)) {
                std::ostringstream text;
                text << "beam " << design.beams[b].name << ": a psd head measures its distance at x = 0, y = 0, got "
                     << offset.x() << ", " << offset.y() << " mm; move the beam by " << 0.0 - offset.x() << ", "
                     << 0.0 - offset.y() << " mm (position_mm)";
                throw InvalidArgument(text.str());
            }
            continue;
        }
        const Eigen::Matrix2d near_slopes = spot_slopes(reader, b, distance);
        const Eigen::Matrix2d gained = (spot_slopes(reader, b, farther) - near_slopes) / (2.0 * (farther - distance));
        if (!(std::abs(gained.determinant()) > 1e-6))
            throw InvalidArgument("beam " + design.beams[b].name + ": its spot does not depend on the mirror's tilts");
        nominal.spot_axes = gained.inverse();
        const double psd_distance = 0.25 * (nominal.spot_axes * near_slopes).trace() - distance;
        nominal.calibration.psd_distance = psd_distance;
        // If the beam is not parallel to the axis, the spot moves with the mirror's distance, as for a tilt.
        // Subtracting this motion gives the zero.
        const Eigen::Vector2d spot = reader.read(b, distance, 0.0, 0.0).position;
        const Eigen::Vector2d drift = (reader.read(b, farther, 0.0, 0.0).position - spot) / (farther - distance);
        nominal.spot_zero = spot - (distance + psd_distance) * drift;
        nominal.calibration.spot_beam = at_plane(reader.outgoing(b, distance), reader.outgoing(b, beyond));
    }
    return nominal;
}

}  // namespace stepdiag
