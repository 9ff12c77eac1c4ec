// The paths of a head's beams as the run with every input at its expectation has them, recorded once for all samples.
// A head without a design has none: it reads by definition.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "head/recorded_route.hpp"
#include "stepdiag/head/nominal_head.hpp"
#include "uncertainty/plates.hpp"
#include "uncertainty/run_model.hpp"

namespace stepdiag {

// A component of a design that inputs move.
struct MovedComponent {
    int component;  // bodies, beams, sensors counted through
    Placement designed;
    PoseError nominal;
    Placement expected;                       // where the paths were recorded
    std::vector<std::pair<int, int>> inputs;  // number (MovedPart), input

    Placement at(const std::vector<double>& deviations) const;
};

struct BeamPath {
    int beam;
    int channel;
    double wavelength;
    Ray source;
    Placement detector;
    double air_index;
    RecordedRoute route;
    std::size_t mirror_at;  // encounter with the mirror
    std::vector<FaceFrame> frames;
    std::vector<Outline> outlines;
    std::vector<int> component;  // of each face
    int source_component, detector_component;
    std::optional<Plates> plates = {};

    // Whether light meets this face by itself: it is neither the mirror nor among the plates.
    bool is_alone(std::size_t encounter) const {
        return encounter < mirror_at || encounter > mirror_at + (plates ? plates->faces : 0);
    }
    Unfolding unfolding(std::size_t encounter) const {
        return plates && encounter > mirror_at ? plates->unfolding : Unfolding();
    }
};

struct HeadPaths {
    const Head* head;
    Outline mirror;  // as small as a mirror that turns with the tool is at least
    // Of a design:
    double gap;
    std::vector<BeamPath> beams;
    NominalHead nominal;
    std::vector<MovedComponent> moved;
};

// None where samples of this head cannot be replayed: its detectors see more than the axis of one beam (cameras,
// coupled modes, ghosts), draw numbers or round, its nominal light does not arrive as designed, or another face is
// near.
std::optional<HeadPaths> record_paths(const RunModel& model, const Head& head);

}  // namespace stepdiag
