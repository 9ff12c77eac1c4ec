#include "stepdiag/optics/scene.hpp"

#if STEPDIAG_EMBREE_MAJOR >= 4
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <new>
#include <stdexcept>
#include <string>
#include <type_traits>

#include "stepdiag/core/error.hpp"

namespace stepdiag {
namespace {

// One device for the process: making one takes milliseconds and starts a thread pool.
RTCDevice device() {
    static const RTCDevice device = [] {
        const RTCDevice made = rtcNewDevice("threads=1,verbose=0");
        if (!made)
            throw std::runtime_error("Embree gave no device (error " + std::to_string(rtcGetDeviceError(nullptr)) +
                                     ")");
        return made;
    }();
    return device;
}

// What Embree made; it makes nothing where memory runs out.
template <class Made>
Made* not_null(Made* object) {
    if (!object) throw std::bad_alloc();
    return object;
}

struct Release {
    void operator()(RTCGeometry geometry) const { rtcReleaseGeometry(geometry); }
};
using Geometry = std::unique_ptr<std::remove_pointer_t<RTCGeometry>, Release>;

void intersect(RTCScene scene, RTCRayHit& query) {
#if STEPDIAG_EMBREE_MAJOR >= 4
    rtcIntersect1(scene, &query);
#else
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcIntersect1(scene, &context, &query);
#endif
}

void check(const std::vector<Face>& faces) {
    for (std::size_t i = 0; i < faces.size(); ++i) {
        const Face& face = faces[i];
        const std::string name = "face " + std::to_string(i);
        if (face.outline.size() < 3)
            throw InvalidArgument(name + ": expected three corners or more, got " +
                                  std::to_string(face.outline.size()));
        if (!face.point.allFinite() || !(std::abs(face.normal.norm() - 1.0) < 1e-9))
            throw InvalidArgument(name + ": expected a finite point and a unit normal");
        const std::size_t n = face.outline.size();
        double turned = 0.0;  // +1 or -1: which way the corners run around the normal
        for (std::size_t k = 0; k < n; ++k) {
            const Eigen::Vector3d edge = face.outline[(k + 1) % n] - face.outline[k];
            const Eigen::Vector3d next = face.outline[(k + 2) % n] - face.outline[(k + 1) % n];
            if (!(std::abs((face.outline[k] - face.point).dot(face.normal)) < 1e-6 * (edge.norm() + 1.0)))
                throw InvalidArgument(name + ": corner " + std::to_string(k) + " is not on the face's plane");
            const double turn = edge.cross(next).dot(face.normal);
            if (turn == 0.0 || turn * turned < 0.0)
                throw InvalidArgument(name + ": the outline is not convex, or has three corners in line");
            turned = turn > 0.0 ? 1.0 : -1.0;
        }
    }
}

}  // namespace

Scene::Scene(std::vector<Face> faces) : faces_(std::move(faces)), centre_(Eigen::Vector3d::Zero()), gap_(0.0) {
    check(faces_);
    std::size_t corners = 0;
    for (const Face& face : faces_)
        for (const auto& corner : face.outline) centre_ += corner, ++corners;
    if (corners > 0) centre_ /= double(corners);

    embree_ = std::shared_ptr<void>(not_null(rtcNewScene(device())),
                                    [](void* scene) { rtcReleaseScene(static_cast<RTCScene>(scene)); });
    const auto scene = static_cast<RTCScene>(embree_.get());
    rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST);
    rtcSetSceneBuildQuality(scene, RTC_BUILD_QUALITY_LOW);  // a handful of faces needs no better tree
    double extent = 0.0;
    for (const Face& face : faces_) {
        const std::size_t n = face.outline.size();
        const Geometry geometry(not_null(rtcNewGeometry(device(), RTC_GEOMETRY_TYPE_TRIANGLE)));
        auto* vertex = static_cast<float*>(not_null(rtcSetNewGeometryBuffer(geometry.get(), RTC_BUFFER_TYPE_VERTEX, 0,
                                                                            RTC_FORMAT_FLOAT3, 3 * sizeof(float), n)));
        auto* triangle = static_cast<unsigned*>(not_null(rtcSetNewGeometryBuffer(
            geometry.get(), RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(unsigned), n - 2)));
        for (const auto& corner : face.outline)
            for (int c = 0; c < 3; ++c) {
                *vertex++ = float(corner[c] - centre_[c]);
                extent = std::max(extent, std::abs(corner[c] - centre_[c]));
            }
        for (unsigned i = 2; i < n; ++i) *triangle++ = 0, *triangle++ = i - 1, *triangle++ = i;
        rtcCommitGeometry(geometry.get());
        rtcAttachGeometry(scene, geometry.get());  // geometry ids count up from 0: the face's index
    }
    rtcCommitScene(scene);
    gap_ = 1e-6 * extent;  // some ten units of single precision's last place
}

std::optional<Hit> Scene::first_hit(const Ray& ray) const {
    RTCRayHit query{};
    const Eigen::Vector3f origin = (ray.origin - centre_).cast<float>();
    const Eigen::Vector3f direction = ray.direction.cast<float>();
    query.ray.org_x = origin.x(), query.ray.org_y = origin.y(), query.ray.org_z = origin.z();
    query.ray.dir_x = direction.x(), query.ray.dir_y = direction.y(), query.ray.dir_z = direction.z();
    query.ray.tnear = float(gap_);
    query.ray.tfar = std::numeric_limits<float>::infinity();
    query.ray.mask = ~0u;
    query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    intersect(static_cast<RTCScene>(embree_.get()), query);
    if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return std::nullopt;
    const Face& face = faces_[query.hit.geomID];
    const double distance = (face.point - ray.origin).dot(face.normal) / ray.direction.dot(face.normal);
    return Hit{int(query.hit.geomID), distance, ray.origin + distance * ray.direction};
}

}  // namespace stepdiag
