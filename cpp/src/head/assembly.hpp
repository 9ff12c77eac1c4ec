// Assembly of a head's design: places every component, with or without its pose error.
#pragma once

#include <string>
#include <vector>

#include "stepdiag/head/design.hpp"

namespace stepdiag {

// Placement of a component with its pose error.
Placement moved(const Placement& nominal, const PoseError& error);
PoseError error_of(const PoseErrors& errors, const std::string& component);

// Names of all components in the order bodies, beams, sensors.
std::vector<std::string> component_names(const HeadDesign& design);
std::vector<Placement> component_placements(const HeadDesign& design);
bool is_transparent(const HeadBody& body);
// Indices of the beams in the order of the signals: interferometers, then the beam to the sensor.
std::vector<int> signal_order(const HeadDesign& design);
// Edge of a square mirror that is large enough for the places of all beams of the design, mm.
double nominal_mirror(const HeadDesign& design);
std::size_t sensor_of(const HeadDesign& design, const HeadBeam& beam);  // index of the beam's sensor

// All faces in the head's frame for light of one wavelength. The order is: faces of the bodies, a square around each
// source that absorbs the light that returns to it, sensors.
struct Assembly {
    std::vector<Face> faces;
    std::vector<int> component;    // of each face: bodies, beams and sensors numbered in this order
    std::vector<int> beam_face;    // for each beam: the square around its source
    std::vector<int> sensor_face;  // for each sensor
};

// Throws InvalidArgument if components overlap or touch.
void check_gaps(const HeadDesign& design, const PoseErrors& errors);

Assembly assemble(const HeadDesign& design, const PoseErrors& errors, double wavelength);

}  // namespace stepdiag
