#include "stepdiag/head/sensitivity.hpp"

#include <algorithm>
#include <cmath>

#include "head/assembly.hpp"
#include "optics/replay_derivative.hpp"
#include "stepdiag/core/error.hpp"
#include "stepdiag/head/nominal_head.hpp"
#include "stepdiag/head/traced_reading.hpp"
#include "stepdiag/measurement/reading.hpp"

namespace stepdiag {
namespace {

// Changes per unit of one parameter.
struct Change {
    int component = -1;  // the component that moves
    RigidRate motion;
    int body = -1;  // the body whose index changes by 1 per unit
    double air = 0.0;
};

// Path of a beam at one mirror pose, with its derivative with respect to any change.
class DerivedPath {
public:
    DerivedPath(const TracedHead& head, int beam, const MirrorPose& mirror)
        : head_(head), optics_(head.optics(beam)), beam_(beam) {
        const RayTree tree = head.trace(beam, mirror);
        const std::vector<int> wanted = head.wanted_segments(tree, beam);
        if (wanted.empty())
            throw InvalidArgument("beam " + head.design().beams[beam].name + ": is lost at this mirror pose");
        for (int s = wanted.front(); s >= 0; s = tree.segments[s].parent) segments_.push_back(tree.segments[s]);
        std::reverse(segments_.begin(), segments_.end());
        mirror_frame_ = frame_of_placement(mirror.rotation, mirror.point);
    }

    struct Rates {
        Eigen::Vector2d position;  // in the detector's frame
        double optical_length;
    };
    Rates derive(const Change& change) const {
        std::vector<DualEncounter> route;
        for (std::size_t k = 0; k < segments_.size(); ++k) route.push_back(encounter(k, change));
        const HeadDesign& design = head_.design();
        const int source = int(design.bodies.size()) + beam_;
        const auto end =
            replay(route, moving(optics_.source, rate(source, change)), optics_.fixed.self_intersection_gap());
        if (!end) throw InvalidArgument("beam " + design.beams[beam_].name + ": meets the edge of a face");

        const int detector = optics_.component[optics_.detector_face];
        const DualFrame frame =
            moving(frame_of_placement(optics_.detector.rotation, optics_.detector.position), rate(detector, change));
        Rates rates{{}, end->optical_length.slope};
        for (int axis = 0; axis < 2; ++axis) {
            Dual local = frame.translation[axis];
            for (int k = 0; k < 3; ++k) local = local + frame.rotation[3 * axis + k] * end->point[k];
            rates.position[axis] = local.slope;
        }
        return rates;
    }

private:
    static FaceFrame frame_of_placement(const Eigen::Matrix3d& rotation, const Eigen::Vector3d& position) {
        FaceFrame frame;
        for (int row = 0; row < 3; ++row)
            for (int k = 0; k < 3; ++k) frame.rotation[3 * row + k] = rotation(k, row);
        for (int row = 0; row < 3; ++row) frame.translation[row] = -rotation.col(row).dot(position);
        return frame;
    }

    static RigidRate rate(int component, const Change& change) {
        return component == change.component ? change.motion : RigidRate{};
    }

    // Index of air, or of the glass of the body that the face belongs to.
    Dual index(double value, bool in_glass, int body, const Change& change) const {
        return {value, in_glass ? double(body == change.body) : change.air};
    }

    DualEncounter encounter(std::size_t k, const Change& change) const {
        const Segment& segment = segments_[k];
        const int face = segment.hit->face;
        const bool is_last = k + 1 == segments_.size();
        const bool is_mirror = face == head_.mirror_face();
        const int component = is_mirror ? int(component_names(head_.design()).size()) : optics_.component[face];
        DualEncounter met;
        met.event = is_last ? Event::absorbed : *segments_[k + 1].event;
        met.outline = &optics_.outlines[face];
        met.frame = moving(is_mirror ? mirror_frame_ : optics_.frames[face], rate(component, change));

        const bool is_glass = !is_mirror && component < int(head_.design().bodies.size()) &&
                              optics_.fixed.face(face).surface != Surface::absorbing &&
                              optics_.fixed.face(face).surface != Surface::reflecting;
        const double after = is_last ? segment.index : segments_[k + 1].index;
        met.deflects = segment.index != after;
        if (!is_glass) {
            met.index_before = met.index_after = index(segment.index, false, component, change);
            return met;
        }
        const Face& glass = optics_.fixed.face(face);
        const bool enters = segment.ray.direction.dot(glass.normal) < 0.0;
        const bool in_glass_before = !enters || glass.before.has_value();
        const bool in_glass_beyond = enters || glass.before.has_value();
        met.index_before = index(segment.index, in_glass_before, component, change);
        const double beyond = met.event == Event::refracted ? after
                              : enters                      ? glass.behind.index
                                                            : glass.before.value_or(optics_.air).index;
        met.index_after = index(beyond, in_glass_beyond, component, change);
        return met;
    }

    const TracedHead& head_;
    const TracedHead::BeamOptics& optics_;
    int beam_;
    std::vector<Segment> segments_;
    FaceFrame mirror_frame_;
};

struct Parameter {
    std::string component, quantity, unit;
    Change change;
};

void add_motions(std::vector<Parameter>& parameters, const std::string& name, int component,
                 const Eigen::Vector3d& origin) {
    for (const char* quantity : {"shift", "rotation"})
        for (int axis = 0; axis < 3; ++axis) {
            const bool turns = quantity[0] == 'r';
            Change change;
            change.component = component;
            change.motion.about = origin;
            (turns ? change.motion.rotation : change.motion.shift) = Eigen::Vector3d::Unit(axis);
            parameters.push_back({name, std::string(quantity) + " " + "xyz"[axis], turns ? "rad" : "mm", change});
        }
}

// Derivatives of the air's index at one wavelength; empty for a constant index.
std::vector<std::pair<Parameter, double Air::*>> air_parameters(const Environment& environment) {
    if (!std::holds_alternative<Air>(environment.air)) return {};
    return {{{"air", "temperature", "K", {}}, &Air::temperature},
            {{"air", "pressure", "Pa", {}}, &Air::pressure},
            {{"air", "humidity", "1", {}}, &Air::relative_humidity}};
}

double index_slope(const Environment& environment, double Air::* quantity, double wavelength) {
    const double value = std::get<Air>(environment.air).*quantity;
    const double h = 1e-3 * std::max(1.0, std::abs(value));  // third-order terms are relatively below 1e-6
    const auto at = [&](double changed) {
        Environment other = environment;
        std::get<Air>(other.air).*quantity = changed;
        return refractive_index(other, wavelength);
    };
    const double low = quantity == &Air::relative_humidity ? std::max(0.0, value - h) : value - h;
    const double high = quantity == &Air::relative_humidity ? std::min(1.0, value + h) : value + h;
    return (at(high) - at(low)) / (high - low);
}

}  // namespace

std::vector<Sensitivity> head_sensitivities(const Head& head, const MirrorPose& mirror, const Eigen::Vector2d& size,
                                            const Environment& environment) {
    if (!head.design) throw InvalidArgument("head: expected one with a design");
    const HeadDesign& design = *head.design;
    const TracedHead traced(design, head.pose_errors, environment, size);
    const NominalHead nominal = nominal_head(design, head.standoff, environment);
    const std::vector<int> order = signal_order(design);
    std::vector<DerivedPath> paths;
    for (const int beam : order) paths.emplace_back(traced, beam, mirror);

    // The reduction's derivatives depend on the signals.
    Head linear = head;
    auto plain = std::make_shared<HeadDesign>(design);
    for (HeadBeam& beam : plain->beams)
        if (beam.interferometer) beam.interferometer = Interferometer{beam.interferometer->aperture};
    linear.design = plain;
    ReadingConditions conditions;
    conditions.environment = environment;
    const SignalRow row = TracedReader(linear, size, conditions).trace(mirror);
    Eigen::VectorXd signals(row.size());
    for (std::size_t c = 0; c < row.size(); ++c) {
        if (!row[c]) throw InvalidArgument("signal " + signal_names(head)[c] + ": is lost at this mirror pose");
        signals[Eigen::Index(c)] = *row[c];
    }
    const auto reduced = design.layout == HeadLayout::psd
                             ? reduce_spot(signals[0], signals.tail<2>(), *nominal.calibration.psd_distance,
                                           nominal.calibration.spot_beam)
                             : reduce_beams(signals, nominal.calibration.beam_offsets);
    if (!reduced) throw InvalidArgument("mirror: its readings do not determine a tilt");

    // Change of each signal. `air`: for each beam, because the air's index depends on the wavelength.
    const auto derive = [&](Change change, const std::vector<double>& air) {
        Eigen::VectorXd rates(signals.size());
        Eigen::Index c = 0;
        for (std::size_t k = 0; k < order.size(); ++k) {
            const HeadBeam& beam = design.beams[order[k]];
            change.air = air[k];
            const auto rate = paths[k].derive(change);
            const double index = traced.air_index(order[k]);
            if (beam.interferometer)
                rates[c++] = 0.5 * rate.optical_length / index + beam.interferometer->dead_path * air[k] / index;
            else
                for (const double slope : Eigen::Vector2d(nominal.spot_axes * rate.position)) rates[c++] = slope;
        }
        return rates;
    };
    std::vector<Sensitivity> result;
    const auto add = [&](const Parameter& parameter, const Eigen::VectorXd& rates) {
        result.push_back({parameter.component, parameter.quantity, parameter.unit, rates, reduced->jacobian * rates});
    };

    const std::vector<double> still(order.size(), 0.0);
    std::vector<Parameter> parameters;
    const std::vector<std::string> names = component_names(design);
    const std::vector<Placement> placements = component_placements(design);
    for (std::size_t c = 0; c < names.size(); ++c) {
        const Eigen::Vector3d origin = moved(placements[c], error_of(head.pose_errors, names[c])).position;
        add_motions(parameters, names[c], int(c), origin);
        if (c < design.bodies.size() && is_transparent(design.bodies[c])) {
            Change change;
            change.body = int(c);
            parameters.push_back({names[c], "index", "1", change});
        }
    }
    add_motions(parameters, "mirror", int(names.size()), mirror.point);
    for (const Parameter& parameter : parameters) add(parameter, derive(parameter.change, still));

    add({"air", "index", "1", {}}, derive({}, std::vector<double>(order.size(), 1.0)));
    for (const auto& [parameter, quantity] : air_parameters(environment)) {
        std::vector<double> slopes;
        for (const int beam : order)
            slopes.push_back(index_slope(environment, quantity, design.beams[beam].mode.wavelength));
        add(parameter, derive({}, slopes));
    }
    Eigen::VectorXd by_index_error = Eigen::VectorXd::Zero(signals.size());
    for (std::size_t k = 0; k < order.size(); ++k)
        if (const auto& interferometer =
                design.beams[order[k]].interferometer)  // it divides the whole path, including the dead path
            by_index_error[Eigen::Index(k)] =
                -(signals[Eigen::Index(k)] + nominal.calibration.head_constants[k] + interferometer->dead_path);
    add({"all interferometers", "index error", "1", {}}, by_index_error);
    return result;
}

}  // namespace stepdiag
