#include "stepdiag/head/traced_head.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <sstream>

#include "head/assembly.hpp"
#include "head/recorded_route.hpp"
#include "stepdiag/core/error.hpp"
#include "stepdiag/core/random.hpp"
#include "stepdiag/head/nominal_head.hpp"

namespace stepdiag {
namespace {

// Limit for rounding: far above the rounding of a path of metres, far below the effect of another face.
double rounding(double path) { return 1e-9 + 1e-13 * path; }  // mm

void check_errors(const HeadDesign& design, const PoseErrors& errors) {
    const std::vector<std::string> names = component_names(design);
    for (const auto& [component, error] : errors) {
        if (std::find(names.begin(), names.end(), component) == names.end()) {
            std::string known;
            for (const auto& name : names) known += (known.empty() ? "" : ", ") + name;
            throw InvalidArgument("pose error: the head has no component \"" + component + "\"; it has " + known);
        }
        if (!error.shift.allFinite() || !(error.rotation.cwiseAbs().maxCoeff() < 1.0))
            throw InvalidArgument("pose error of " + component + ": expected a finite shift and angles below 1 rad");
    }
}

// Whether two results for the same pose differ by more than rounding.
bool differ(const ArrivalTable::Row& a, const Arrivals& b) {
    const auto same = [](const Arrival& x, const Arrival& y) {
        const double limit = rounding(x.beam.optical_length);
        return (x.beam.position - y.beam.position).norm() <= limit &&
               std::abs(x.beam.optical_length - y.beam.optical_length) <= limit;
    };
    return !std::equal(a.begin(), a.end(), b.begin(), b.end(), same);
}

// Of the poses that followed the paths: the first, the last, and those whose light ends farthest to each side.
std::set<std::size_t> outermost(const std::vector<RouteReplay>& replayed, const std::vector<std::uint8_t>& followed) {
    std::set<std::size_t> poses;
    std::vector<std::size_t> members;
    for (std::size_t i = 0; i < followed.size(); ++i)
        if (followed[i]) members.push_back(i);
    if (members.empty()) return poses;
    poses = {members.front(), members.back()};
    for (const RouteReplay& route : replayed)
        for (int axis = 0; axis < 3; ++axis) {
            const auto less = [&](std::size_t a, std::size_t b) { return route.point(a)[axis] < route.point(b)[axis]; };
            const auto ends = std::minmax_element(members.begin(), members.end(), less);
            poses.insert({*ends.first, *ends.second});
        }
    return poses;
}

// Selects the poses to verify, each with the probability `share`. It draws the gaps between them, so that most poses
// need no random number.
class Verified {
public:
    Verified(double share, std::uint64_t seed, std::uint64_t line) : share_(share), seed_(seed), draw_(line << 32) {
        advance();
    }
    bool take(std::size_t pose) {
        if (share_ <= 0.0 || double(pose) < next_) return false;
        advance();
        return true;
    }

private:
    void advance() {
        if (share_ > 0.0)
            next_ += 1.0 + std::floor(std::log(uniform_pair(seed_, RandomStream::verification, draw_++)[0]) /
                                      std::log1p(-share_));
    }
    double share_;
    std::uint64_t seed_;
    std::uint64_t draw_;
    double next_ = -1.0;
};

bool meets(const RayTree& tree, int segment, int face) {
    for (; segment >= 0; segment = tree.segments[segment].parent)
        if (tree.segments[segment].hit && tree.segments[segment].hit->face == face) return true;
    return false;
}

// Path of the strongest light that an aligned mirror sends to the beam's detector in the nominal design; empty if there
// is none.
RecordedRoute designed_way(const HeadDesign& design, const HeadBeam& beam, const Scene& nominal, const Medium& air,
                           int detector_face) {
    const int mirror_face = int(nominal.faces().size());
    const Face mirror = make_rectangle({0.0, 0.0, reach(design) + 100.0}, Eigen::Matrix3d::Identity(),
                                       Eigen::Vector2d::Constant(nominal_mirror(design)), Surface::reflecting);
    const RayTree tree = trace_tree(nominal.with({mirror}), air,
                                    {beam.placement.position, beam.placement.rotation.col(2)}, design.limits);
    for (const int segment : tree.arrivals(detector_face))
        if (meets(tree, segment, mirror_face)) return record_route(tree, segment);
    return {};
}

}  // namespace

MirrorPose tilted_mirror(const Eigen::Vector3d& point, double alpha, double beta) {
    const Eigen::Vector3d normal = Eigen::Vector3d(beta, -alpha, 1.0).normalized();
    MirrorPose pose{point, {}};
    pose.rotation.col(2) = normal;
    pose.rotation.col(0) = (Eigen::Vector3d::UnitX() - normal.x() * normal).normalized();
    pose.rotation.col(1) = normal.cross(pose.rotation.col(0));
    return pose;
}

TracedHead::TracedHead(HeadDesign design, PoseErrors errors, const Environment& environment,
                       const Eigen::Vector2d& mirror)
    : design_(std::move(design)), mirror_(mirror) {
    check_errors(design_, errors);
    for (std::size_t b = 0; b < design_.beams.size(); ++b) {
        const HeadBeam& beam = design_.beams[b];
        const Assembly assembly = assemble(design_, errors, beam.mode.wavelength);
        const Placement source = moved(beam.placement, error_of(errors, beam.name));
        BeamOptics optics{{refractive_index(environment, beam.mode.wavelength)},
                          Scene(assembly.faces),
                          {},
                          {},
                          assembly.component,
                          {source.position, source.rotation.col(2)},
                          assembly.beam_face[b],
                          source};
        if (!beam.interferometer) {
            const std::size_t s = sensor_of(design_, beam);
            optics.detector_face = assembly.sensor_face[s];
            optics.detector = moved(design_.sensors[s].placement, error_of(errors, design_.sensors[s].name));
        }
        for (const Face& face : assembly.faces) {
            optics.frames.push_back(frame_of(face));
            optics.outlines.push_back(outline_of(face, optics.frames.back()));
        }
        const Face mirror_face = mirror_at({Eigen::Vector3d::Zero(), Eigen::Matrix3d::Identity()});
        optics.outlines.push_back(outline_of(mirror_face, {{1, 0, 0, 0, 1, 0, 0, 0, 1}, {0, 0, 0}}));
        const Scene nominal = errors.empty() ? optics.fixed : Scene(assemble(design_, {}, beam.mode.wavelength).faces);
        optics.designed = designed_way(design_, beam, nominal, optics.air, optics.detector_face);
        optics_.push_back(std::move(optics));
    }
}

Face TracedHead::mirror_at(const MirrorPose& pose) const {
    return make_rectangle(pose.point, pose.rotation, mirror_, Surface::reflecting);
}

int TracedHead::mirror_face() const { return int(optics_.front().fixed.faces().size()); }

RayTree TracedHead::trace(int beam, const MirrorPose& mirror) const {
    const BeamOptics& optics = optics_[beam];
    return trace_tree(optics.fixed.with({mirror_at(mirror)}), optics.air, optics.source, design_.limits);
}

bool TracedHead::is_designed(int beam, const RecordedRoute& route) const {
    return !route.encounters.empty() && same_faces(route, optics_[beam].designed);
}

Arrival TracedHead::arrival(int beam, const Eigen::Vector3d& point, const Eigen::Vector3d& direction,
                            double optical_length, double reduced_length, double power, bool is_designed) const {
    const Placement& detector = optics_[beam].detector;
    const Eigen::Vector3d position = detector.rotation.transpose() * (point - detector.position);
    return {{position.head<2>(), detector.rotation.transpose() * direction, optical_length, reduced_length},
            power,
            is_designed};
}

Arrivals TracedHead::arrivals(int beam, const MirrorPose& mirror) const {
    const RayTree tree = trace(beam, mirror);
    Arrivals arrivals;
    for (const int segment : wanted_segments(tree, beam)) {
        const Path path = tree.path_to(segment);
        arrivals.push_back(arrival(beam, path.hits.back().point, path.direction, path.optical_length,
                                   path.reduced_length, tree.segments[segment].power,
                                   is_designed(beam, record_route(tree, segment))));
    }
    return arrivals;
}

std::vector<int> TracedHead::wanted_segments(const RayTree& tree, int beam) const {
    std::vector<int> segments = tree.arrivals(optics_[beam].detector_face);
    const auto straylight = std::stable_partition(segments.begin(), segments.end(),
                                                  [&](int segment) { return meets(tree, segment, mirror_face()); });
    if (straylight == segments.begin()) return {};
    const auto ghosts = std::stable_partition(
        segments.begin(), straylight, [&](int segment) { return is_designed(beam, record_route(tree, segment)); });
    if (design_.beams[beam].interferometer) segments.erase(ghosts, segments.end());
    return segments;
}

// The paths of the first pose that has any.
std::vector<RecordedRoute> TracedHead::record(int beam, const std::vector<MirrorPose>& mirrors) const {
    const std::size_t last = mirrors.size() - 1;
    for (const std::size_t pose : {std::size_t(0), last / 2, last, last / 4, last - last / 4}) {
        const RayTree tree = trace(beam, mirrors[pose]);
        std::vector<RecordedRoute> routes;
        for (const int segment : wanted_segments(tree, beam)) routes.push_back(record_route(tree, segment));
        if (!routes.empty()) return routes;
    }
    return {};
}

// Whether the traces of the outermost poses meet the same faces, with no other face near their paths.
bool TracedHead::is_clear(int beam, const std::vector<MirrorPose>& mirrors, const std::vector<RecordedRoute>& routes,
                          const std::set<std::size_t>& outermost) const {
    std::vector<std::vector<std::vector<Segment>>> paths(routes.size());  // [route][pose]
    for (const std::size_t pose : outermost) {
        const RayTree tree = trace(beam, mirrors[pose]);
        std::vector<RecordedRoute> found;
        for (const int segment : wanted_segments(tree, beam)) {
            if (found.size() < routes.size()) paths[found.size()].push_back(path_segments(tree, segment));
            found.push_back(record_route(tree, segment));
        }
        if (!same_faces(routes, found)) return false;
    }
    const int source = int(design_.bodies.size()) + beam;
    return std::all_of(paths.begin(), paths.end(), [&](const auto& of_route) {
        return of_route.empty() || pass_clear(of_route, optics_[beam].fixed, optics_[beam].component, source);
    });
}

ArrivalTable TracedHead::replay(int beam, const std::vector<MirrorPose>& mirrors, const ReplayOptions& options,
                                ReplayCount* count) const {
    const BeamOptics& optics = optics_[beam];
    const std::size_t n = mirrors.size();
    ArrivalTable table;
    if (n == 0) return table;

    std::vector<RecordedRoute> routes;
    if (options.verified_share < 1.0) routes = record(beam, mirrors);
    std::vector<RouteReplay> replayed;
    std::vector<std::uint8_t> followed(n, !routes.empty());
    for (const RecordedRoute& route : routes) {
        replayed.push_back(replay_route(route, optics.frames, optics.outlines, optics.source, mirrors,
                                        optics.fixed.self_intersection_gap()));
        for (std::size_t i = 0; i < n; ++i) followed[i] = followed[i] && replayed.back().followed[i];
    }
    if (!routes.empty() && !is_clear(beam, mirrors, routes, outermost(replayed, followed)))
        std::fill(followed.begin(), followed.end(), 0);

    table.reserve(n, n * std::max<std::size_t>(1, routes.size()));
    Verified verified(options.verified_share, options.seed, (options.line << 8) + std::uint64_t(beam));
    ReplayCount counted;
    for (std::size_t i = 0; i < n; ++i) {
        if (!followed[i]) {
            for (const Arrival& traced : arrivals(beam, mirrors[i])) table.add(traced);
            table.end_pose();
            ++counted.traced;
            continue;
        }
        for (std::size_t r = 0; r < routes.size(); ++r)
            table.add(arrival(beam, replayed[r].point(i), replayed[r].direction(i), replayed[r].optical_length[i],
                              replayed[r].reduced_length[i], routes[r].power, is_designed(beam, routes[r])));
        table.end_pose();
        ++counted.replayed;
        if (!verified.take(i)) continue;
        ++counted.verified;
        if (differ(table[i], arrivals(beam, mirrors[i]))) {
            std::ostringstream text;
            text << "replay: beam " << design_.beams[beam].name << " at pose " << i << " (mirror at "
                 << mirrors[i].point.transpose()
                 << " mm in the sensor frame) differs from its trace: another face is in "
                 << "the path of the beam; a verified share of 1 traces every pose instead";
            throw ReplayMismatch(text.str());
        }
    }
    if (count) {
        count->replayed += counted.replayed;
        count->traced += counted.traced;
        count->verified += counted.verified;
    }
    return table;
}

}  // namespace stepdiag
