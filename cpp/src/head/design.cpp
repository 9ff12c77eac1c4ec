#include "stepdiag/head/design.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <set>
#include <sstream>

#include "head/assembly.hpp"
#include "optics/separation.hpp"
#include "stepdiag/core/error.hpp"
#include "stepdiag/head/nominal_head.hpp"

namespace stepdiag {
namespace {

void check_placement(const Placement& placement, const std::string& name) {
    const Eigen::Matrix3d& R = placement.rotation;
    if (!placement.position.allFinite() || !R.allFinite() ||
        !((R.transpose() * R - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() < 1e-9) || !(R.determinant() > 0.0))
        throw InvalidArgument(name + ": expected a finite position and a rotation");
}

// Prefixes the messages about a component's parts with its name.
template <class Check>
void check_part(const std::string& name, const Check& check) {
    try {
        check();
    } catch (const InvalidArgument& error) {
        throw InvalidArgument(name + ": " + error.what());
    }
}

void check_beam(const HeadDesign& design, const HeadBeam& beam) {
    check_placement(beam.placement, beam.name);
    check_part(beam.name, [&] {
        check_gaussian_mode(beam.mode);
        if (beam.interferometer) check_interferometer(*beam.interferometer);
    });
    if (beam.interferometer) return;
    if (!(std::isfinite(beam.housing) && beam.housing > 0.0))
        throw InvalidArgument(beam.name + ": housing: expected a finite value above 0");
    sensor_of(design, beam);
}

void check_layout(const HeadDesign& design) {
    const auto is_interferometer = [](const HeadBeam& beam) { return beam.interferometer.has_value(); };
    const auto interferometers = std::count_if(design.beams.begin(), design.beams.end(), is_interferometer);
    const auto others = std::ptrdiff_t(design.beams.size()) - interferometers;
    const std::string found = ", got " + std::to_string(interferometers) + " interferometer beam(s), " +
                              std::to_string(others) + " other beam(s) and " + std::to_string(design.sensors.size()) +
                              " sensor(s)";
    if (design.layout == HeadLayout::multi_beam && (interferometers < 3 || others > 0 || !design.sensors.empty()))
        throw InvalidArgument("layout multi_beam: expected three or more interferometer beams and nothing else" +
                              found);
    if (design.layout == HeadLayout::psd && (interferometers != 1 || others != 1 || design.sensors.size() != 1))
        throw InvalidArgument("layout psd: expected one interferometer beam, one beam to a sensor, and that sensor" +
                              found);
    if (design.layout == HeadLayout::ideal)
        throw InvalidArgument("layout: a head of bodies and beams is \"psd\" or \"multi_beam\", got \"ideal\"");
}

// A component and its bounding box.
struct Piece {
    std::string name;
    std::vector<Face> faces = {};
    Eigen::Vector3d low = Eigen::Vector3d::Constant(INFINITY), high = -low;
};

// Smallest permitted distance between components. Only scenes of metres need this much (Scene::smallest_separation).
constexpr double smallest_gap = 0.01;  // mm

// Distance between the bounding boxes: cheap, and never larger than the distance between the components.
double box_separation(const Piece& a, const Piece& b) {
    return (a.low - b.high).cwiseMax(b.low - a.high).cwiseMax(0.0).norm();
}

// Making a head builds one scene for each beam. Each face takes 1.7 kB and 18 us (measured).
void check_size(const HeadDesign& design) {
    constexpr std::size_t most_faces = 200000;
    std::size_t faces = 0;
    for (const HeadBody& body : design.bodies) faces += body.faces.size();
    if (faces <= most_faces) return;
    const double all = double(faces) * double(design.beams.size());
    std::ostringstream text;
    text << "head: has " << faces << " faces; expected at most " << most_faces << ". They need about "
         << std::ceil(1.7e-6 * all) << " GB and " << std::ceil(18e-6 * all) << " s whenever the head is assembled";
    throw InvalidArgument(text.str());
}

// Rejects a body that is too thin for the tracer to separate its faces.
void check_thickness(const HeadBody& body, double least) {
    if (!is_transparent(body)) return;
    for (const Face& face : body.faces) {
        if (face.before) continue;  // inside the body
        double thickness = 0.0;
        for (const Face& other : body.faces)
            for (const Eigen::Vector3d& corner : other.outline)
                thickness = std::max(thickness, (face.point - corner).dot(face.normal));
        if (thickness >= least) continue;
        std::ostringstream text;
        text << body.name << ": too thin; expected at least " << least << " mm, got " << thickness << " mm";
        throw InvalidArgument(text.str());
    }
}

}  // namespace

double refractive_index(const Material& material, double wavelength) {
    if (const Glass* glass = std::get_if<Glass>(&material)) return refractive_index(*glass, wavelength);
    const double index = std::get<double>(material);
    if (!(std::isfinite(index) && index >= 1.0))
        throw InvalidArgument("material: expected a glass or an index of at least 1");
    return index;
}

Eigen::Vector2d SpotSensor::size() const {
    if (const Camera* camera = std::get_if<Camera>(&device))
        return camera->pixel * Eigen::Vector2d(camera->columns, camera->rows);
    return std::get<LateralEffect>(device).size;
}

double reach(const HeadDesign& design) {
    double highest = 0.0;
    for (const HeadBeam& beam : design.beams)
        for (const Face& face : assemble(design, {}, beam.mode.wavelength).faces)
            for (const auto& corner : face.outline) highest = std::max(highest, corner.z());
    return highest;
}

void check_gaps(const HeadDesign& design, const PoseErrors& errors) {
    const Assembly assembly = assemble(design, errors, design.beams.front().mode.wavelength);
    std::vector<Piece> pieces;
    for (const std::string& name : component_names(design)) pieces.push_back({name});
    for (std::size_t f = 0; f < assembly.faces.size(); ++f) {
        Piece& piece = pieces[assembly.component[f]];
        piece.faces.push_back(assembly.faces[f]);
        for (const Eigen::Vector3d& corner : assembly.faces[f].outline) {
            piece.low = piece.low.cwiseMin(corner);
            piece.high = piece.high.cwiseMax(corner);
        }
    }
    const double least = std::max(smallest_gap, Scene(assembly.faces).smallest_separation());
    for (const HeadBody& body : design.bodies) check_thickness(body, least);
    for (std::size_t i = 0; i < pieces.size(); ++i)
        for (std::size_t j = i + 1; j < pieces.size(); ++j) {
            if (box_separation(pieces[i], pieces[j]) >= least) continue;
            const double gap = separation(pieces[i].faces, pieces[j].faces);
            if (gap >= least) continue;
            std::ostringstream text;
            text << pieces[i].name << " and " << pieces[j].name << ": overlap or touch"
                 << (errors.empty() ? "" : ", with their pose errors") << "; expected a gap of at least " << least
                 << " mm, got " << gap << " mm";
            throw InvalidArgument(text.str());
        }
}

void check_design(const HeadDesign& design) {
    check_size(design);
    std::set<std::string> names;
    for (const std::string& name : component_names(design)) {
        const auto is_control = [](unsigned char c) { return c < 0x20 || c == 0x7f; };
        if (name.empty() || std::any_of(name.begin(), name.end(), is_control))
            throw InvalidArgument("component: expected a name without control characters");
        if (!names.insert(name).second) throw InvalidArgument("component " + name + ": given twice");
    }
    check_layout(design);
    for (const HeadBody& body : design.bodies) check_placement(body.placement, body.name);
    for (const HeadBeam& beam : design.beams) check_beam(design, beam);
    for (const SpotSensor& sensor : design.sensors) {
        check_placement(sensor.placement, sensor.name);
        if (const Camera* camera = std::get_if<Camera>(&sensor.device)) check_camera(*camera);
        else check_lateral_effect(std::get<LateralEffect>(sensor.device));
    }

    check_gaps(design, {});
    nominal_head(design, reach(design) + 100.0);
}

}  // namespace stepdiag
