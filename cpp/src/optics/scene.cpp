#include "stepdiag/optics/scene.hpp"

#if STEPDIAG_EMBREE_MAJOR >= 4
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <memory>
#include <new>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>

#include "stepdiag/core/error.hpp"

namespace stepdiag {
namespace {

// One device for the whole process, because creating a device takes milliseconds and starts a thread pool.
RTCDevice device() {
    static const RTCDevice device = [] {
        const RTCDevice made = rtcNewDevice("threads=1,verbose=0");
        if (!made)
            throw std::runtime_error("Embree did not create a device (error " +
                                     std::to_string(rtcGetDeviceError(nullptr)) + ")");
        return made;
    }();
    return device;
}

// Checks an object created by Embree, which returns null if memory is insufficient.
template <class Made>
Made* not_null(Made* object) {
    if (!object) throw std::bad_alloc();
    return object;
}

struct Release {
    void operator()(RTCScene scene) const { rtcReleaseScene(scene); }
    void operator()(RTCGeometry geometry) const { rtcReleaseGeometry(geometry); }
};
using EmbreeScene = std::unique_ptr<std::remove_pointer_t<RTCScene>, Release>;
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

void check_power(const Face& face, const std::string& name) {
    if (!(face.reflectance >= 0.0 && face.reflectance <= 1.0 && face.absorptance >= 0.0 && face.absorptance <= 1.0))
        throw InvalidArgument(name + ": expected a reflectance and an absorptance of 0 to 1");
    // The tolerance accepts shares whose sum exceeds 1 by rounding only.
    if (face.surface == Surface::splitting && face.reflectance + face.absorptance > 1.0 + 1e-12)
        throw InvalidArgument(name + ": reflectance and absorptance are together more than 1");
    for (const double index : {face.behind.index, face.before ? face.before->index : 1.0})
        if (!(std::isfinite(index) && index >= 1.0)) throw InvalidArgument(name + ": expected an index of at least 1");
}

void check_outline(const Face& face, const std::string& name) {
    const std::size_t n = face.outline.size();
    if (n < 3) throw InvalidArgument(name + ": expected three corners or more, got " + std::to_string(n));
    double turned = 0.0;  // +1 or -1: orientation of the corners about the normal
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

void check(const std::vector<Face>& faces, std::size_t first_number) {
    for (std::size_t i = 0; i < faces.size(); ++i) {
        const std::string name = "face " + std::to_string(first_number + i);
        if (!faces[i].point.allFinite() || !(std::abs(faces[i].normal.norm() - 1.0) < 1e-9))
            throw InvalidArgument(name + ": expected a finite point and a unit normal");
        check_outline(faces[i], name);
        check_power(faces[i], name);
    }
}

std::size_t count_corners(const std::vector<Face>& faces) {
    std::size_t corners = 0;
    for (const Face& face : faces) corners += face.outline.size();
    return corners;
}

Eigen::Vector3d mean_corner(const std::vector<Face>& faces) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (const Face& face : faces)
        for (const auto& corner : face.outline) sum += corner;
    return sum / std::max(1.0, double(count_corners(faces)));
}

double largest_coordinate(const std::vector<Face>& faces, const Eigen::Vector3d& centre) {
    double largest = 0.0;
    for (const Face& face : faces)
        for (const auto& corner : face.outline)
            largest = std::max(largest, (corner - centre).lpNorm<Eigen::Infinity>());
    return largest;
}

Hit hit_on_plane(const Face& face, int index, const Ray& ray) {
    const double distance = (face.point - ray.origin).dot(face.normal) / ray.direction.dot(face.normal);
    return {index, distance, ray.origin + distance * ray.direction};
}

// A small margin outside the edges counts as inside, so that no ray passes between two faces with a common edge.
bool is_inside(const Face& face, const Eigen::Vector3d& point) {
    const std::size_t n = face.outline.size();
    bool left = false, right = false;
    for (std::size_t k = 0; k < n; ++k) {
        const Eigen::Vector3d edge = face.outline[(k + 1) % n] - face.outline[k];
        const double side = edge.cross(point - face.outline[k]).dot(face.normal);
        const double breadth = 1e-12 * edge.squaredNorm();
        left |= !(side <= breadth);  // a NaN is outside
        right |= !(side >= -breadth);
    }
    return !(left && right);
}

}  // namespace

// Shared by copies of a scene: the faces, and Embree's tree of their triangles (n - 2 for a face of n corners).
struct Scene::Tree {
    std::vector<Face> faces;
    Eigen::Vector3d centre;  // Embree's origin; small coordinates lose less in single precision
    double gap;
    std::vector<int> face_of_triangle;
    EmbreeScene embree;

    explicit Tree(std::vector<Face> all)
        : faces(std::move(all)),
          centre(mean_corner(faces)),
          gap(1e-6 * largest_coordinate(faces, centre)),  // about ten units in the last place of single precision
          embree(not_null(rtcNewScene(device()))) {
        rtcSetSceneFlags(embree.get(), RTC_SCENE_FLAG_ROBUST);
        rtcSetSceneBuildQuality(embree.get(), RTC_BUILD_QUALITY_LOW);  // sufficient for few faces
        if (!faces.empty()) add_triangles();
        rtcCommitScene(embree.get());
        if (rtcGetDeviceError(device()) != RTC_ERROR_NONE) throw std::bad_alloc();
    }

    void add_triangles() {
        const std::size_t corners = count_corners(faces);
        const Geometry geometry(not_null(rtcNewGeometry(device(), RTC_GEOMETRY_TYPE_TRIANGLE)));
        auto* vertex = static_cast<float*>(not_null(rtcSetNewGeometryBuffer(
            geometry.get(), RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), corners)));
        auto* triangle = static_cast<unsigned*>(
            not_null(rtcSetNewGeometryBuffer(geometry.get(), RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                             3 * sizeof(unsigned), corners - 2 * faces.size())));
        face_of_triangle.reserve(corners - 2 * faces.size());
        unsigned first = 0;
        for (std::size_t f = 0; f < faces.size(); ++f) {
            const auto n = unsigned(faces[f].outline.size());
            for (const auto& corner : faces[f].outline)
                for (int c = 0; c < 3; ++c) *vertex++ = float(corner[c] - centre[c]);
            for (unsigned i = 2; i < n; ++i) {
                *triangle++ = first, *triangle++ = first + i - 1, *triangle++ = first + i;
                face_of_triangle.push_back(int(f));
            }
            first += n;
        }
        rtcCommitGeometry(geometry.get());
        rtcAttachGeometry(embree.get(), geometry.get());
    }

    std::optional<Hit> first_hit(const Ray& ray) const {
        RTCRayHit query{};
        const Eigen::Vector3f origin = (ray.origin - centre).cast<float>();
        const Eigen::Vector3f direction = ray.direction.cast<float>();
        query.ray.org_x = origin.x(), query.ray.org_y = origin.y(), query.ray.org_z = origin.z();
        query.ray.dir_x = direction.x(), query.ray.dir_y = direction.y(), query.ray.dir_z = direction.z();
        query.ray.tnear = float(gap);
        query.ray.tfar = std::numeric_limits<float>::infinity();
        query.ray.mask = ~0u;
        query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
        intersect(embree.get(), query);
        if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return std::nullopt;
        const int face = face_of_triangle[query.hit.primID];
        return hit_on_plane(faces[face], face, ray);
    }
};

Scene::Scene(std::vector<Face> faces) {
    check(faces, 0);
    const std::size_t count = faces.size(), triangles = count_corners(faces) - 2 * count;
    try {
        tree_ = std::make_shared<const Tree>(std::move(faces));
    } catch (const std::bad_alloc&) {
        const double need = 150.0 * double(triangles) / 1e6;  // measured with 1e5, 1e6 and 4e6 faces of four corners
        throw InvalidArgument("scene: " + std::to_string(count) + " faces need about " +
                              std::to_string(std::lround(need) + 1) +
                              " MB of memory in addition to their own, more than is available");
    }
    gap_ = tree_->gap;
}

Scene Scene::with(std::vector<Face> more) const {
    check(more, std::size_t(face_count()));
    Scene scene = *this;
    // Added faces are tested in double precision, so the gap only has to cover rounding.
    scene.gap_ = std::max(gap_, 1e-10 * largest_coordinate(more, tree_->centre));
    scene.added_.insert(scene.added_.end(), std::make_move_iterator(more.begin()), std::make_move_iterator(more.end()));
    return scene;
}

const std::vector<Face>& Scene::faces() const { return tree_->faces; }

int Scene::face_count() const { return int(tree_->faces.size() + added_.size()); }

const Face& Scene::face(int index) const {
    const auto own = int(tree_->faces.size());
    return index < own ? tree_->faces[index] : added_[index - own];
}

std::optional<Hit> Scene::first_hit(const Ray& ray) const {
    std::optional<Hit> nearest = tree_->first_hit(ray);
    for (std::size_t i = 0; i < added_.size(); ++i) {
        const Hit hit = hit_on_plane(added_[i], int(tree_->faces.size() + i), ray);
        if (hit.distance > gap_ && (!nearest || hit.distance < nearest->distance) && is_inside(added_[i], hit.point))
            nearest = hit;
    }
    return nearest;
}

}  // namespace stepdiag
