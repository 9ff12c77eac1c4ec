// A traced path as a route to replay, and its lanes.
#pragma once

#include <deque>
#include <vector>

#include "stepdiag/optics/path.hpp"
#include "stepdiag/optics/replay.hpp"

// Faces, indices and events of a path, the same for all lanes until a test puts arrays in their place.
struct RecordedRoute {
    std::deque<stepdiag::FaceFrame> frames;  // a deque: its elements stay where they are
    std::deque<stepdiag::Outline> outlines;
    std::deque<double> indices;
    std::vector<stepdiag::Encounter> route;

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

// Rays by lane, with places for their results.
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
