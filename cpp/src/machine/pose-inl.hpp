// The chain of a machine (stepdiag/machine/machine.hpp) from the tool to the workpiece: how each axis moves what it
// carries. An axis that carries the workpiece turns after it has moved, another one before.
#if defined(STEPDIAG_POSE_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef STEPDIAG_POSE_INL
#undef STEPDIAG_POSE_INL
#else
#define STEPDIAG_POSE_INL
#endif

#include "core/rotation-inl.hpp"

STEPDIAG_BEFORE_NAMESPACE();
namespace stepdiag {
namespace STEPDIAG_NAMESPACE {

// One axis where it stands.
template <class N>
struct AxisMotion {
    Matrix3<N> rotation;  // Exp theta_a
    Vector3<N> shift;     // p e_a + delta_a
    bool carries_workpiece;
};

// A point in the frame before the axis; `arm` reaches there from the place about which theta_a turns.
template <class N>
struct MovedPoint {
    Vector3<N> arm, point;
};
template <class N>
STEPDIAG_INLINE MovedPoint<N> move_point(const AxisMotion<N>& axis, const Vector3<N>& point) {
    if (axis.carries_workpiece) {
        const Vector3<N> arm = axis.rotation * (point + axis.shift);
        return {arm, arm};
    }
    const Vector3<N> arm = axis.rotation * point;
    return {arm, arm + axis.shift};
}

// The pose of the tool, with the arm of each axis to the functional point, in the frame before the axis.
template <class N>
struct ChainPose {
    Matrix3<N> rotation;
    Vector3<N> position;
    Vector3<N> arm[3];
};
// `axes` from the workpiece to the tool.
template <class N>
STEPDIAG_INLINE ChainPose<N> chain_pose(const AxisMotion<N> (&axes)[3], const Vector3<N>& tool) {
    const MovedPoint<N> third = move_point(axes[2], tool), second = move_point(axes[1], third.point),
                        first = move_point(axes[0], second.point);
    return {axes[0].rotation * (axes[1].rotation * axes[2].rotation), first.point, {first.arm, second.arm, third.arm}};
}

}  // namespace STEPDIAG_NAMESPACE
}  // namespace stepdiag
STEPDIAG_AFTER_NAMESPACE();

#endif
