#include "stepdiag/optics/body.hpp"

namespace stepdiag {

Face make_rectangle(const Eigen::Vector3d& centre, const Eigen::Matrix3d& scene_R_face, const Eigen::Vector2d& size,
                    Surface surface) {
    const Eigen::Vector3d x = 0.5 * size.x() * scene_R_face.col(0);
    const Eigen::Vector3d y = 0.5 * size.y() * scene_R_face.col(1);
    return {centre, scene_R_face.col(2), {centre - x - y, centre + x - y, centre + x + y, centre - x + y}, surface};
}

}  // namespace stepdiag
