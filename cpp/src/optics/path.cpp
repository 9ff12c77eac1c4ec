#include "stepdiag/optics/path.hpp"

namespace stepdiag {

Path trace(const Scene& scene, const Medium& ambient, const Ray& ray, int most_hits) {
    Path path{{}, ray.direction, PathEnd::too_many_hits, 0.0, 0.0};
    Eigen::Vector3d origin = ray.origin;
    while (int(path.hits.size()) < most_hits) {
        const auto hit = scene.first_hit({origin, path.direction});
        if (!hit) {
            path.end = PathEnd::missed;
            return path;
        }
        path.hits.push_back(*hit);
        path.geometric_length += hit->distance;
        path.optical_length += ambient.index * hit->distance;
        const Face& face = scene.faces()[hit->face];
        if (face.surface == Surface::absorbing) {
            path.end = PathEnd::absorbed;
            return path;
        }
        path.direction = reflect(path.direction, face.normal);
        origin = hit->point;
    }
    return path;
}

}  // namespace stepdiag
