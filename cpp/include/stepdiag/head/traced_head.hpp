// Ray-traced head: a design with pose errors of its components. It determines the light of each beam that returns from
// a mirror. There are two methods with the same result: the Embree trace of the whole ray tree of one pose, which finds
// the faces, and the replay of the recorded paths for many poses at once. All coordinates are in the sensor frame: beam
// along +z, reference plane z = 0. Lengths in mm, angles in rad.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <set>
#include <stdexcept>
#include <vector>

#include "stepdiag/core/air.hpp"
#include "stepdiag/head/design.hpp"
#include "stepdiag/optics/ray_tree.hpp"
#include "stepdiag/optics/replay.hpp"
#include "stepdiag/optics/scene.hpp"

namespace stepdiag {

// Centre (mm) and axes of the mirror. The third axis is its normal.
struct MirrorPose {
    Eigen::Vector3d point;
    Eigen::Matrix3d rotation;
};

// A mirror with this centre and the tilts alpha and beta (rad). Its normal is along (beta, -alpha, 1).
MirrorPose tilted_mirror(const Eigen::Vector3d& point, double alpha, double beta);

// Light of a beam at its detector (the collimator's plane or the sensor), in the frame of that component.
struct Arrival {
    ReturnedBeam beam;
    double power;      // share of the source's power
    bool is_designed;  // took the designed path, that of the strongest light from an aligned mirror; not a ghost
};
// All light of a beam at one pose: first the designed path, then ghosts that met the mirror, strongest first, then
// straylight. Empty if there is only straylight. An interferometer has at most the light of the designed path.
using Arrivals = std::vector<Arrival>;

// Arrivals of many poses, in the order of the poses.
class ArrivalTable {
public:
    struct Row {
        const Arrival* first;
        const Arrival* last;
        const Arrival* begin() const { return first; }
        const Arrival* end() const { return last; }
        std::size_t size() const { return std::size_t(last - first); }
        bool empty() const { return first == last; }
        const Arrival& operator[](std::size_t i) const { return first[i]; }
    };
    std::size_t size() const { return ends_.size(); }  // number of poses
    Row operator[](std::size_t pose) const {
        return {all_.data() + (pose > 0 ? ends_[pose - 1] : 0), all_.data() + ends_[pose]};
    }
    void reserve(std::size_t poses, std::size_t arrivals) {
        ends_.reserve(poses);
        all_.reserve(arrivals);
    }
    void add(const Arrival& arrival) { all_.push_back(arrival); }  // to the pose that the next end_pose() completes
    void end_pose() { ends_.push_back(all_.size()); }

private:
    std::vector<Arrival> all_;
    std::vector<std::size_t> ends_;
};

// One face on the path of light to a detector.
struct RecordedEncounter {
    int face;
    Event event;
    double index_before, index_after;
};
struct RecordedRoute {
    std::vector<RecordedEncounter> encounters;
    double power;  // at the end, as a share of the source's power
};

struct ReplayOptions {
    // Share of the replayed poses that are also traced and compared. 1: trace every pose; 0: compare none.
    double verified_share = 1e-3;
    std::uint64_t seed = 0;  // seed and line select the poses to verify
    std::uint64_t line = 0;
};

struct ReplayCount {
    long replayed = 0;  // poses of a beam
    long traced = 0;    // poses that do not follow the recorded paths
    long verified = 0;
};

// Thrown if a replayed pose differs from its trace, because another face is in the path of the beam.
class ReplayMismatch : public std::runtime_error {
    using std::runtime_error::runtime_error;
};

class TracedHead {
public:
    // `mirror`: width and height, mm. Throws InvalidArgument for an invalid design, pose errors that are not finite or
    // of unknown components, or an environment out of range.
    TracedHead(HeadDesign design, PoseErrors errors, const Environment& environment, const Eigen::Vector2d& mirror);

    const HeadDesign& design() const { return design_; }
    double air_index(int beam) const { return optics_[beam].air.index; }

    // Traces one pose with Embree.
    RayTree trace(int beam, const MirrorPose& mirror) const;
    Arrivals arrivals(int beam, const MirrorPose& mirror) const;
    int mirror_face() const;  // index of the mirror's face in the hits of the tree
    int detector_face(int beam) const { return optics_[beam].detector_face; }

    // Replays many poses along the paths of the first pose. The outermost poses, whose light ends farthest to each
    // side, are also traced. If they do not meet the same faces, or if another face is near their paths, all poses are
    // traced. A pose that does not follow the paths is traced, too. Throws ReplayMismatch, which names the pose, if a
    // verification differs by more than rounding (1e-9 mm + 1e-13 of the path).
    ArrivalTable replay(int beam, const std::vector<MirrorPose>& mirrors, const ReplayOptions& options = {},
                        ReplayCount* count = nullptr) const;

    // The scene of one beam. Each beam has its own, because the index of glass depends on the wavelength.
    struct BeamOptics {
        Medium air;
        Scene fixed;                    // without the mirror
        std::vector<FaceFrame> frames;  // of its faces
        std::vector<Outline> outlines;  // of its faces and of the mirror
        std::vector<int> component;     // of its faces: bodies, beams and sensors numbered in this order
        Ray source;
        int detector_face;
        Placement detector;           // of the beam's collimator or sensor
        RecordedRoute designed = {};  // empty if the nominal design has no light at the detector
    };
    const BeamOptics& optics(int beam) const { return optics_[beam]; }
    // Segments that end at the beam's detector, in the order of Arrivals.
    std::vector<int> wanted_segments(const RayTree& tree, int beam) const;

private:
    std::vector<RecordedRoute> record(int beam, const std::vector<MirrorPose>& mirrors) const;
    bool is_clear(int beam, const std::vector<MirrorPose>& mirrors, const std::vector<RecordedRoute>& routes,
                  const std::set<std::size_t>& outermost) const;
    Face mirror_at(const MirrorPose& pose) const;
    Arrival arrival(int beam, const Eigen::Vector3d& point, const Eigen::Vector3d& direction, double optical_length,
                    double reduced_length, double power, bool is_designed) const;
    bool is_designed(int beam, const RecordedRoute& route) const;

    HeadDesign design_;
    Eigen::Vector2d mirror_;
    std::vector<BeamOptics> optics_;
};

}  // namespace stepdiag
