// A head's design put together: every component in its place, or out of it.
#pragma once

#include <string>
#include <vector>

#include "stepdiag/head/design.hpp"

namespace stepdiag {

// Where a component stands with its pose error.
Placement moved(const Placement& nominal, const PoseError& error);
PoseError error_of(const PoseErrors& errors, const std::string& component);

// Components in one order: bodies, beams, sensors.
std::vector<std::string> component_names(const HeadDesign& design);
std::vector<Placement> component_placements(const HeadDesign& design);
bool is_transparent(const HeadBody& body);
// Beams in the order of the signals: interferometers, then the beam to the sensor.
std::vector<int> signal_order(const HeadDesign& design);
// Edge of a mirror that no beam of the design misses by its place, mm.
double nominal_mirror(const HeadDesign& design);
std::size_t sensor_of(const HeadDesign& design, const HeadBeam& beam);  // its index

// All faces in the head's frame for light of one wavelength: the bodies', then a square around each source that stops
// the light that comes back to it, then the sensors.
struct Assembly {
    std::vector<Face> faces;
    std::vector<int> component;    // of each face: bodies, beams, sensors counted through
    std::vector<int> beam_face;    // by beam: the square around the source
    std::vector<int> sensor_face;  // by sensor
};

// Throws InvalidArgument for components that overlap or touch.
void check_gaps(const HeadDesign& design, const PoseErrors& errors);

Assembly assemble(const HeadDesign& design, const PoseErrors& errors, double wavelength);

}  // namespace stepdiag
