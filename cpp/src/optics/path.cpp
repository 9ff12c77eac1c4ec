#include "stepdiag/optics/path.hpp"

#include "optics/branches.hpp"

namespace stepdiag {

Path trace(const Scene& scene, const Medium& ambient, const Ray& ray, int most_hits) {
    Path path{{}, {}, ray.direction, PathEnd::too_many_hits, 0.0, 0.0, 0.0};
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
        path.reduced_length += hit->distance / index;
        const auto onward = branches(scene.face(hit->face), ambient, path.direction, index).onward.front();
        path.hits.push_back(*hit);
        path.events.push_back(onward ? onward->event : Event::absorbed);
        if (!onward) {
            path.end = PathEnd::absorbed;
            return path;
        }
        path.direction = onward->direction;
        index = onward->index;
        origin = hit->point;
    }
    return path;
}

}  // namespace stepdiag
