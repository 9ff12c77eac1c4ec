// A head as its design says, with its components out of their places: which light of its beams comes back from a
// mirror. Two ways to the same answer: the Embree trace of a pose's whole ray tree, which finds the faces, and the
// replay of the paths it found, for many poses at once. Everything is in the sensor frame: beam along +z, reference
// plane z = 0.
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

// The mirror's centre and axes; its normal is the third.
struct MirrorPose {
    Eigen::Vector3d point;
    Eigen::Matrix3d rotation;
};

// The mirror with this centre and the tilts alpha and beta: its normal is along (beta, -alpha, 1).
MirrorPose tilted_mirror(const Eigen::Vector3d& point, double alpha, double beta);

// Light of a beam where it belongs: on its collimator's plane, or on its sensor; in the frame of that component.
struct Arrival {
    ReturnedBeam beam;
    double power;      // share of the source's
    bool is_designed;  // came the way that the design's strongest light comes from an aligned mirror: no ghost
};
// A beam's light at one pose: that of the designed way, then ghosts that saw the mirror, strongest first, then
// straylight; none where nothing but straylight came. Of an interferometer that of the designed way at most.
using Arrivals = std::vector<Arrival>;

// The same of many poses, one after the other.
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
    std::size_t size() const { return ends_.size(); }  // poses
    Row operator[](std::size_t pose) const {
        return {all_.data() + (pose > 0 ? ends_[pose - 1] : 0), all_.data() + ends_[pose]};
    }
    void reserve(std::size_t poses, std::size_t arrivals) {
        ends_.reserve(poses);
        all_.reserve(arrivals);
    }
    void add(const Arrival& arrival) { all_.push_back(arrival); }  // to the pose that end_pose closes
    void end_pose() { ends_.push_back(all_.size()); }

private:
    std::vector<Arrival> all_;
    std::vector<std::size_t> ends_;
};

// The faces that light meets on its way to a detector.
struct RecordedEncounter {
    int face;
    Event event;
    double index_before, index_after;
};
struct RecordedRoute {
    std::vector<RecordedEncounter> encounters;
    double power;  // at the end, share of the source's
};

struct ReplayOptions {
    // Of the poses that were replayed, traced as well and compared; 1: nothing is replayed, 0: nothing compared.
    double verified_share = 1e-3;
    std::uint64_t seed = 0;  // decides which, together with
    std::uint64_t line = 0;  // what is replayed: another number, other poses
};

struct ReplayCount {
    long replayed = 0;  // poses of a beam
    long traced = 0;    // poses that the recorded paths did not fit
    long verified = 0;
};

// A replayed pose that differs from its trace: another face came into the beam's way.
class ReplayMismatch : public std::runtime_error {
    using std::runtime_error::runtime_error;
};

class TracedHead {
public:
    // Throws InvalidArgument for a design that makes no sense, pose errors of components that it does not have or not
    // finite, an environment out of range.
    TracedHead(HeadDesign design, PoseErrors errors, const Environment& environment, const Eigen::Vector2d& mirror);

    const HeadDesign& design() const { return design_; }
    double air_index(int beam) const { return optics_[beam].air.index; }

    // One pose by Embree.
    RayTree trace(int beam, const MirrorPose& mirror) const;
    Arrivals arrivals(int beam, const MirrorPose& mirror) const;
    int mirror_face() const;  // its index in the tree's hits
    int detector_face(int beam) const { return optics_[beam].detector_face; }

    // Many poses by replay of the paths that the first pose has. The outermost of the poses that follow them, whose
    // light ends farthest to each side, are traced: where these do not meet the same faces, or where another face is
    // near them, all poses are traced. So is each pose that does not follow the paths. Throws ReplayMismatch naming the
    // pose where a verification differs by more than rounding (1e-9 mm + 1e-13 of
    // the path).
    ArrivalTable replay(int beam, const std::vector<MirrorPose>& mirrors, const ReplayOptions& options = {},
                        ReplayCount* count = nullptr) const;

    // A beam's own scene: glass has another index at another wavelength.
    struct BeamOptics {
        Medium air;
        Scene fixed;                    // without the mirror
        std::vector<FaceFrame> frames;  // of its faces
        std::vector<Outline> outlines;  // of its faces, and the mirror
        std::vector<int> component;     // of its faces: bodies, beams, sensors counted through
        Ray source;
        int detector_face;
        Placement detector;           // where the light is wanted
        RecordedRoute designed = {};  // none where the design gets no light there
    };
    const BeamOptics& optics(int beam) const { return optics_[beam]; }
    // Segments that end where the beam's light is wanted, in the order of Arrivals.
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
