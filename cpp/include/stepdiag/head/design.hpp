// The design of a laser head: bodies of glass, beams and detectors, as drawn. Everything stands in the head's frame:
// origin in the reference plane (z = 0), where the beam of d1 or of the distance starts, the mirror at +z.
#pragma once

#include <Eigen/Core>
#include <map>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "stepdiag/measurement/head_layout.hpp"
#include "stepdiag/head/interferometer.hpp"
#include "stepdiag/head/spot_sensor.hpp"
#include "stepdiag/optics/body.hpp"
#include "stepdiag/optics/medium.hpp"
#include "stepdiag/optics/ray_tree.hpp"

namespace stepdiag {

// A catalogue glass, whose index is relative to air of 20 degrees Celsius and 101325 Pa, or a constant absolute index.
using Material = std::variant<double, Glass>;
double refractive_index(const Material& material, double wavelength);  // absolute

// Faces stand in the component's own frame; refracting and splitting faces get the material's index behind them (a
// splitting face inside the body on both sides) when a trace at some wavelength is made.
struct HeadBody {
    std::string name;
    std::vector<Face> faces;
    Material material = 1.0;
    Placement placement;
};

// Light source and, for an interferometer, the plane that takes the beam back: x-y of its own frame, beam along +z.
struct HeadBeam {
    std::string name;
    Placement placement;
    GaussianMode mode;
    std::optional<Interferometer> interferometer;  // or
    std::string sensor;                            // the sensor that the beam comes to
    double housing = 10.0;  // edge of the square around the source that stops light, mm; spot beams
};

// Sensor in the x-y plane of its own frame, light from either side.
struct SpotSensor {
    std::string name;
    Placement placement;
    std::variant<LateralEffect, Camera> device;
    Eigen::Vector2d size() const;  // mm
};

struct HeadDesign {
    std::string name;
    HeadLayout layout;  // psd: one interferometer and one beam to one sensor; multi_beam: three or more interferometers
    std::vector<HeadBody> bodies;
    std::vector<HeadBeam> beams;
    std::vector<SpotSensor> sensors;
    TreeLimits limits;
};

// How a component stands out of its place: turned about its own origin by a rotation vector, then shifted, both along
// the head's axes.
struct PoseError {
    Eigen::Vector3d shift = Eigen::Vector3d::Zero();     // mm
    Eigen::Vector3d rotation = Eigen::Vector3d::Zero();  // rad
};
using PoseErrors = std::map<std::string, PoseError>;  // by component name

// Throws InvalidArgument for names that are empty or given twice, a layout without its beams or sensor, a beam to an
// unknown sensor, bodies, sources and sensors that overlap or touch, values out of range.
void check_design(const HeadDesign& design);

}  // namespace stepdiag
