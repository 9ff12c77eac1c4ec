#include "head/assembly.hpp"

#include <Eigen/Geometry>
#include <algorithm>

#include "stepdiag/core/error.hpp"
#include "stepdiag/core/rotation.hpp"

namespace stepdiag {

Placement moved(const Placement& nominal, const PoseError& error) {
    return {nominal.position + error.shift, rotation_exp(error.rotation) * nominal.rotation};
}

PoseError error_of(const PoseErrors& errors, const std::string& component) {
    const auto found = errors.find(component);
    return found == errors.end() ? PoseError{} : found->second;
}

std::vector<std::string> component_names(const HeadDesign& design) {
    std::vector<std::string> names;
    for (const auto& body : design.bodies) names.push_back(body.name);
    for (const auto& beam : design.beams) names.push_back(beam.name);
    for (const auto& sensor : design.sensors) names.push_back(sensor.name);
    return names;
}

std::vector<Placement> component_placements(const HeadDesign& design) {
    std::vector<Placement> placements;
    for (const auto& body : design.bodies) placements.push_back(body.placement);
    for (const auto& beam : design.beams) placements.push_back(beam.placement);
    for (const auto& sensor : design.sensors) placements.push_back(sensor.placement);
    return placements;
}

bool is_transparent(const HeadBody& body) {
    return std::any_of(body.faces.begin(), body.faces.end(), [](const Face& face) {
        return face.surface == Surface::refracting || face.surface == Surface::splitting;
    });
}

double nominal_mirror(const HeadDesign& design) {
    double widest = 0.0;
    for (const HeadBeam& beam : design.beams) widest = std::max(widest, beam.placement.position.head<2>().norm());
    return 100.0 + 4.0 * widest;
}

std::size_t sensor_of(const HeadDesign& design, const HeadBeam& beam) {
    for (std::size_t s = 0; s < design.sensors.size(); ++s)
        if (design.sensors[s].name == beam.sensor) return s;
    throw InvalidArgument(beam.name + ": there is no sensor \"" + beam.sensor + "\"");
}

std::vector<int> signal_order(const HeadDesign& design) {
    std::vector<int> order;
    for (const bool interferometer : {true, false})
        for (std::size_t b = 0; b < design.beams.size(); ++b)
            if (design.beams[b].interferometer.has_value() == interferometer) order.push_back(int(b));
    return order;
}

Assembly assemble(const HeadDesign& design, const PoseErrors& errors, double wavelength) {
    Assembly assembly;
    int component = 0;
    const auto add = [&](Face face) {
        assembly.faces.push_back(std::move(face));
        assembly.component.push_back(component);
    };
    for (const HeadBody& body : design.bodies) {
        const Medium glass{refractive_index(body.material, wavelength)};
        for (Face face : placed(body.faces, moved(body.placement, error_of(errors, body.name)))) {
            face.behind = glass;
            if (face.before) face.before = glass;  // a face inside the body
            add(std::move(face));
        }
        ++component;
    }
    const auto add_square = [&](const Placement& place, const Eigen::Vector2d& size) {
        add(make_rectangle(place.position, place.rotation, size, Surface::absorbing));
        ++component;
        return int(assembly.faces.size()) - 1;
    };
    for (const HeadBeam& beam : design.beams) {
        const double edge = beam.interferometer ? beam.interferometer->aperture : beam.housing;
        assembly.beam_face.push_back(
            add_square(moved(beam.placement, error_of(errors, beam.name)), Eigen::Vector2d::Constant(edge)));
    }
    for (const SpotSensor& sensor : design.sensors)
        assembly.sensor_face.push_back(
            add_square(moved(sensor.placement, error_of(errors, sensor.name)), sensor.size()));
    return assembly;
}

}  // namespace stepdiag
