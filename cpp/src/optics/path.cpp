#include "stepdiag/optics/path.hpp"

namespace stepdiag {
namespace {

// Light that has met a face: what happened, where it goes on, and in which medium.
struct Departure {
    Event event;
    Eigen::Vector3d direction;
    double index;
};

Departure depart(const Face& face, const Medium& ambient, const Eigen::Vector3d& direction, double index) {
    if (face.surface == Surface::absorbing) return {Event::absorbed, direction, index};
    if (face.surface == Surface::reflecting) return {Event::reflected, reflect(direction, face.normal), index};
    const bool enters = direction.dot(face.normal) < 0.0;
    const double before = enters ? ambient.index : face.behind.index;
    const double after = enters ? face.behind.index : ambient.index;
    if (const auto refracted = refract(direction, face.normal, before / after))
        return {Event::refracted, *refracted, after};
    return {Event::totally_reflected, reflect(direction, face.normal), index};
}

}  // namespace

Path trace(const Scene& scene, const Medium& ambient, const Ray& ray, int most_hits) {
    Path path{{}, {}, ray.direction, PathEnd::too_many_hits, 0.0, 0.0};
    Eigen::Vector3d origin = ray.origin;
    double index = ambient.index;
    while (int(path.hits.size()) < most_hits) {
        const auto hit = scene.first_hit({origin, path.direction});
        if (!hit) {
            path.end = PathEnd::missed;
            return path;
        }
        path.geometric_length += hit->distance;
        path.optical_length += index * hit->distance;
        const Departure departure = depart(scene.faces()[hit->face], ambient, path.direction, index);
        path.hits.push_back(*hit);
        path.events.push_back(departure.event);
        if (departure.event == Event::absorbed) {
            path.end = PathEnd::absorbed;
            return path;
        }
        path.direction = departure.direction;
        index = departure.index;
        origin = hit->point;
    }
    return path;
}

}  // namespace stepdiag
