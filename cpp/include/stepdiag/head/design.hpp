// Design of a laser head: glass bodies, beams and detectors in their nominal places. All placements are in the head's
// frame. Its origin is in the reference plane (z = 0), where the beam of d1 or of the distance starts; the mirror is at
// +z. Lengths in mm, angles in rad.
#pragma once

#include <Eigen/Core>
#include <map>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "stepdiag/head/interferometer.hpp"
#include "stepdiag/head/spot_sensor.hpp"
#include "stepdiag/measurement/head_layout.hpp"
#include "stepdiag/optics/body.hpp"
#include "stepdiag/optics/medium.hpp"
#include "stepdiag/optics/ray_tree.hpp"

namespace stepdiag {

// A catalogue glass, with its index relative to air at 20 degrees Celsius and 101325 Pa, or a constant absolute index.
using Material = std::variant<double, Glass>;
double refractive_index(const Material& material, double wavelength);  // absolute

// A glass body. Its faces are in the component's own frame. The media of the faces are set for a trace at a given
// wavelength: refracting and splitting faces get the material's index behind them, a splitting face inside the body
// gets it on both sides.
struct HeadBody {
    std::string name;
    std::vector<Face> faces;
    Material material = 1.0;
    Placement placement;
};

// A light source that emits along +z of its own frame. For an interferometer, the x-y plane of this frame also receives
// the returned beam.
struct HeadBeam {
    std::string name;
    Placement placement;
    GaussianMode mode;
    std::optional<Interferometer> interferometer;  // either an interferometer,
    std::string sensor;                            // or the name of the sensor that the beam meets
    double housing = 10.0;  // spot beams: edge of the square around the source that absorbs light, mm
};

// A sensor in the x-y plane of its own frame. It detects light from both sides.
struct SpotSensor {
    std::string name;
    Placement placement;
    std::variant<LateralEffect, Camera> device;
    Eigen::Vector2d size() const;  // mm
};

struct HeadDesign {
    std::string name;
    HeadLayout layout;  // psd: one interferometer, one beam to one sensor; multi_beam: at least three interferometers
    std::vector<HeadBody> bodies;
    std::vector<HeadBeam> beams;
    std::vector<SpotSensor> sensors;
    TreeLimits limits;
};

// Deviation of a component from its nominal place: a rotation about its own origin, given as a rotation vector,
// followed by a shift. Both are along the head's axes.
struct PoseError {
    Eigen::Vector3d shift = Eigen::Vector3d::Zero();     // mm
    Eigen::Vector3d rotation = Eigen::Vector3d::Zero();  // rad
};
using PoseErrors = std::map<std::string, PoseError>;  // by component name

// Throws InvalidArgument if a name is empty or given twice, the layout lacks a beam or sensor, a beam refers to an
// unknown sensor, bodies, sources and sensors overlap or touch, or a value is out of range.
void check_design(const HeadDesign& design);

}  // namespace stepdiag
