// Optical bench of glass and mirrors for tests of the replay: its traced path as a route, and SIMD lanes of rays.
#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <deque>
#include <random>
#include <vector>

#include "stepdiag/core/rotation.hpp"
#include "stepdiag/core/units.hpp"
#include "stepdiag/optics/path.hpp"
#include "stepdiag/optics/replay.hpp"

inline constexpr double gap = 1e-3;  // mm

// Faces, indices and events of a path. They are common to all lanes unless a test replaces them by arrays.
struct RecordedRoute {
    std::deque<stepdiag::FaceFrame> frames;  // a deque, because its elements do not move
    std::deque<stepdiag::Outline> outlines;
    std::deque<double> indices;
    std::vector<stepdiag::Encounter> route;
    std::vector<int> faces;  // indices in the scene

    RecordedRoute() = default;
    RecordedRoute(const RecordedRoute&) = delete;  // the route has pointers into this object
    RecordedRoute(const stepdiag::Scene& scene, const stepdiag::Medium& ambient, const stepdiag::Ray& ray,
                  const stepdiag::Path& path) {
        Eigen::Vector3d from = ray.origin;
        double index = ambient.index;
        for (std::size_t i = 0; i < path.hits.size(); ++i) {
            const stepdiag::Face& face = scene.faces()[path.hits[i].face];
            const double outside = face.before ? face.before->index : ambient.index;
            const bool enters = (path.hits[i].point - from).dot(face.normal) < 0.0;
            const bool refracts = face.surface == stepdiag::Surface::refracting;
            const double beyond = refracts ? (enters ? face.behind.index : outside) : index;
            meet(path.events[i], face, index, beyond);
            faces.push_back(path.hits[i].face);
            if (path.events[i] == stepdiag::Event::refracted) index = beyond;
            from = path.hits[i].point;
        }
    }

    void meet(stepdiag::Event event, const stepdiag::Face& face, double index_before, double index_after) {
        frames.push_back(frame_of(face));
        outlines.push_back(outline_of(face, frames.back()));
        stepdiag::Encounter encounter{event, true, {}, {}, &outlines.back(), {}, {}};
        encounter.deflects = index_before != index_after;
        for (int k = 0; k < 9; ++k) encounter.rotation[k] = {&frames.back().rotation[k]};
        for (int k = 0; k < 3; ++k) encounter.translation[k] = {&frames.back().translation[k]};
        indices.push_back(index_before);
        encounter.index_before = {&indices.back()};
        indices.push_back(index_after);
        encounter.index_after = {&indices.back()};
        route.push_back(encounter);
    }
};

// Rays for each lane, with memory for their results.
struct RayLanes {
    std::vector<double> start[8];  // origin, direction, optical and reduced length
    std::vector<double> end[8];
    std::vector<std::uint8_t> followed;

    RayLanes(std::size_t lanes, const stepdiag::Ray& ray) : followed(lanes, 9) {
        for (int k = 0; k < 8; ++k) {
            start[k].assign(lanes, k < 3 ? ray.origin[k] : k < 6 ? ray.direction[k - 3] : 0.0);
            end[k].assign(lanes, -1.0);
        }
    }
    std::size_t lanes() const { return followed.size(); }
    stepdiag::LaneRays rays() const {
        const auto lane_value = [&](int k) { return stepdiag::LaneValue{start[k].data(), 1}; };
        return {{lane_value(0), lane_value(1), lane_value(2)},
                {lane_value(3), lane_value(4), lane_value(5)},
                lane_value(6),
                lane_value(7)};
    }
    stepdiag::LaneResults results() {
        return {{end[0].data(), end[1].data(), end[2].data()},
                {end[3].data(), end[4].data(), end[5].data()},
                end[6].data(),
                end[7].data(),
                followed.data()};
    }
    void follow(const std::vector<stepdiag::Encounter>& route, double gap) {
        stepdiag::replay(route, rays(), lanes(), gap, results());
    }
    Eigen::Vector3d point(std::size_t lane) const { return {end[0][lane], end[1][lane], end[2][lane]}; }
    Eigen::Vector3d direction(std::size_t lane) const { return {end[3][lane], end[4][lane], end[5][lane]}; }
};

// The beam goes through a plate and a wedge, over a right-angle prism to a mirror, and back along the same path. All
// components are slightly misaligned.
struct Bench {
    static constexpr int plate = 0, wedge = 6, prism = 12, mirror = 17, screen = 18, faces = 19;  // index of first face
    stepdiag::Medium air{1.00027}, glass{1.5009};
    stepdiag::Ray ray{{0, 0, 0}, {0, 0, 1}};
    stepdiag::Scene scene;

    explicit Bench(unsigned seed = 1) : scene(made(seed)) {}

    stepdiag::Path path() const { return trace(scene, air, ray); }
    RecordedRoute record() const { return RecordedRoute(scene, air, ray, path()); }

private:
    std::vector<stepdiag::Face> made(unsigned seed) const {
        std::mt19937 random(seed);
        std::uniform_real_distribution<double> turn(-0.01, 0.01);
        const auto rotation = [&](double about_y) {
            const double x = turn(random), y = turn(random), z = turn(random);
            return Eigen::Matrix3d(stepdiag::rotation_exp({x, y, z}) * stepdiag::rotation_exp({0, about_y, 0}));
        };
        std::vector<stepdiag::Face> faces;
        const auto add = [&](const std::vector<stepdiag::Face>& body) {
            faces.insert(faces.end(), body.begin(), body.end());
        };
        constexpr double pi = stepdiag::pi;
        add(stepdiag::make_plate(40, 40, 6, glass, {{0, 0, 60}, rotation(0)}));
        add(stepdiag::make_wedge(40, 40, 8, 0.01, glass, {{0, 0, 120}, rotation(0)}));
        // The legs are perpendicular to z and x; the hypotenuse reflects z to x.
        add(stepdiag::make_prism(60, 60, 0.5 * pi, glass, {{-1, 0, 201}, rotation(0.75 * pi)}));
        faces.push_back(make_rectangle({700, 0, 200}, rotation(0.5 * pi), {200, 200}, stepdiag::Surface::reflecting));
        faces.push_back(make_rectangle({0, 0, -50}, rotation(0), {500, 500}, stepdiag::Surface::absorbing));
        return faces;
    }
};

// All numbers that the event of an encounter uses.
inline std::vector<stepdiag::LaneValue*> numbers(stepdiag::Encounter& encounter) {
    std::vector<stepdiag::LaneValue*> all{&encounter.index_before};
    for (auto& value : encounter.rotation) all.push_back(&value);
    for (auto& value : encounter.translation) all.push_back(&value);
    if (encounter.event == stepdiag::Event::totally_reflected ||
        (encounter.event == stepdiag::Event::refracted && encounter.deflects))
        all.push_back(&encounter.index_after);
    return all;
}

// Replaces every number of a route by an array of lanes.
struct ByLane {
    std::deque<std::vector<double>> arrays;

    void spread(std::vector<stepdiag::Encounter>& route, std::size_t lanes) {
        for (stepdiag::Encounter& encounter : route)
            for (stepdiag::LaneValue* value : numbers(encounter)) {
                arrays.emplace_back(lanes, *value->value);
                *value = {arrays.back().data(), 1};
            }
    }
};

// Rays with slightly different starts.
inline RayLanes fan(const Bench& bench, std::size_t lanes) {
    RayLanes fan(lanes, bench.ray);
    for (std::size_t i = 0; i < lanes; ++i) {
        fan.start[0][i] = 0.01 * double(i % 17);
        fan.start[1][i] = 0.013 * double(i % 13);
        fan.start[6][i] = double(i);
    }
    return fan;
}
