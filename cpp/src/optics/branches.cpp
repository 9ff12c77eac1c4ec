#include "optics/branches.hpp"

namespace stepdiag {
namespace {

// Snell's law first: in the case of total internal reflection there is no transmitted branch to split off.
Branches at_boundary(const Face& face, const Medium& ambient, const Eigen::Vector3d& direction, double index,
                     double reflectance, double absorptance) {
    const bool enters = direction.dot(face.normal) < 0.0;
    const double front = face.before.value_or(ambient).index;
    const double before = enters ? front : face.behind.index;
    const double after = enters ? face.behind.index : front;
    const auto refracted = refract(direction, face.normal, before / after);
    if (!refracted)
        return {{Branch{Event::totally_reflected, reflect(direction, face.normal), index, 1.0 - absorptance}, {}},
                absorptance};
    Branches result{{Branch{Event::refracted, *refracted, after, 1.0 - reflectance - absorptance}, {}}, absorptance};
    if (reflectance > 0.0)
        result.onward[1] = Branch{Event::reflected, reflect(direction, face.normal), index, reflectance};
    return result;
}

}  // namespace

Branches branches(const Face& face, const Medium& ambient, const Eigen::Vector3d& direction, double index) {
    switch (face.surface) {
        case Surface::reflecting:
            return {{Branch{Event::reflected, reflect(direction, face.normal), index, face.reflectance}, {}},
                    1.0 - face.reflectance};
        case Surface::refracting: return at_boundary(face, ambient, direction, index, 0.0, 0.0);
        case Surface::splitting:
            return at_boundary(face, ambient, direction, index, face.reflectance, face.absorptance);
        default: return {{}, 1.0};
    }
}

}  // namespace stepdiag
