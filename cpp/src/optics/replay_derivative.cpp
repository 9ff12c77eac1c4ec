#include "optics/replay_derivative.hpp"

#include <Eigen/Geometry>

#include "optics/encounter-inl.hpp"

namespace stepdiag {
namespace {

struct DualFace {
    const DualEncounter& encounter;

    Dual rotation(int k) const { return encounter.frame.rotation[k]; }
    Dual translation(int k) const { return encounter.frame.translation[k]; }
    Dual index() const { return encounter.index_before; }
    Dual inverse_index() const { return Dual{1.0} / index(); }
    Dual index_ratio() const { return index() / encounter.index_after; }
    Dual one_less_ratio2() const { return Dual{1.0} - index_ratio() * index_ratio(); }
};

}  // namespace

DualFrame moving(const FaceFrame& frame, const RigidRate& rate) {
    const Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> rotation(frame.rotation.data());
    const Eigen::Vector3d translation_rate = rotation * (rate.rotation.cross(rate.about) - rate.shift);
    DualFrame moved;
    for (int row = 0; row < 3; ++row) {
        const Eigen::Vector3d axis = rotation.row(row).transpose();
        const Eigen::Vector3d axis_rate = rate.rotation.cross(axis);  // row of -R [w]x
        for (int k = 0; k < 3; ++k) moved.rotation[3 * row + k] = {axis[k], axis_rate[k]};
        moved.translation[row] = {frame.translation[row], translation_rate[row]};
    }
    return moved;
}

DualRay moving(const Ray& ray, const RigidRate& rate) {
    const Eigen::Vector3d point_rate = rate.rotation.cross(ray.origin - rate.about) + rate.shift;
    const Eigen::Vector3d direction_rate = rate.rotation.cross(ray.direction);
    DualRay moved;
    for (int k = 0; k < 3; ++k) {
        moved.point[k] = {ray.origin[k], point_rate[k]};
        moved.direction[k] = {ray.direction[k], direction_rate[k]};
    }
    return moved;
}

std::optional<DualRay> replay(const std::vector<DualEncounter>& route, const DualRay& ray, double gap) {
    using namespace STEPDIAG_NAMESPACE;
    Light<Dual> light{{ray.point[0], ray.point[1], ray.point[2]},
                      {ray.direction[0], ray.direction[1], ray.direction[2]},
                      ray.optical_length,
                      ray.reduced_length,
                      true};
    for (const DualEncounter& encounter : route) meet(encounter, DualFace{encounter}, Dual{gap}, light);
    check_end(light);
    if (!light.followed) return std::nullopt;
    return DualRay{{light.point[0], light.point[1], light.point[2]},
                   {light.direction[0], light.direction[1], light.direction[2]},
                   light.optical_length,
                   light.reduced_length};
}

}  // namespace stepdiag
