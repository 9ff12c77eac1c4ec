#include "head/assembly.hpp"

#include <Eigen/Geometry>

#include "stepdiag/core/rotation.hpp"

namespace stepdiag {

Placement moved(const Placement& nominal, const PoseError& error) {
    return {nominal.position + error.shift, rotation_exp(error.rotation) * nominal.rotation};
}

PoseError error_of(const PoseErrors& errors, const std::string& component) {
    const auto found = errors.find(component);
    return found == errors.end() ? PoseError{} : found->second;
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
            if (face.before) face.before = glass;  // inside the body
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
