// Benchmarks of one beam of a head with a position sensing device, with 12 interactions per pose: through cube splitter
// and window to the mirror, and back over the splitting face to the sensor. The scene has 40 triangles; the mirror is
// at 0.3 to 1.5 m with tilts up to 1 mrad. Times are per interaction. They include:
//   replay  recorded faces in double precision; Snell's law, outlines, events and NaN checked in each SIMD lane; no
//   search embree  search for each face (single precision), hits in double precision; a moving mirror is added to the
//   scene closed  distance and spot of the ideal head without glass: the formulas of reading.hpp, without faces
#include "stepdiag/optics/replay.hpp"

#include <benchmark/benchmark.h>

#include <cmath>
#include <deque>
#include <optional>
#include <random>
#include <string>

#include "expect.hpp"
#include "stepdiag/core/instruction_set.hpp"
#include "stepdiag/core/rotation.hpp"
#include "stepdiag/measurement/reading.hpp"
#include "stepdiag/optics/scene.hpp"

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using stepdiag::Event;
using stepdiag::Face;
using stepdiag::Surface;

constexpr int poses = 604, interactions = 12;
constexpr double air = 1.000268, glass = 1.500902;
constexpr double cube = 20.0, window = 6.0, source_z = -60.0, cube_z = -25.0, sensor_x = 40.0;

Matrix3d about_y(double angle) { return stepdiag::rotation_exp({0.0, angle, 0.0}); }

struct Step {
    Event event;
    bool deflects;
    int face;
};

// End of a beam, and its path lengths.
struct Arrival {
    Vector3d point;
    double optical_length;
};

struct Bench {
    std::vector<Face> faces;  // the mirror last
    std::vector<Vector3d> point;
    std::vector<Matrix3d> rotation;
    std::optional<stepdiag::Scene> without_mirror;
    stepdiag::Ray ray{{0.0, 0.0, source_z}, {0.0, 0.0, 1.0}};
    std::vector<Step> steps;
    std::vector<Arrival> truth;  // from Embree

    Bench() {
        std::mt19937 random(1);
        std::uniform_real_distribution<double> tilt(-0.7e-3, 0.7e-3);
        for (int i = 0; i < poses; ++i) {
            const double x = tilt(random), y = tilt(random);
            point.emplace_back(2e3 * x, -3e3 * y, 300.0 + 1200.0 * i / (poses - 1));
            rotation.push_back(stepdiag::rotation_exp({x, y, 0.0}));
        }
        const auto add = [this](const std::vector<Face>& body) { faces.insert(faces.end(), body.begin(), body.end()); };
        add(stepdiag::make_plate(cube, cube, cube, {glass}, {{0.0, 0.0, cube_z}, Matrix3d::Identity()}));
        add(stepdiag::make_plate(60.0, 60.0, window, {glass}, {{0.0, 0.0, 20.0}, Matrix3d::Identity()}));
        const double quarter = std::acos(-1.0) / 4.0;
        const auto screen = [this](Vector3d centre, double turn, double width, double height, Surface surface) {
            faces.push_back(stepdiag::make_rectangle(centre, about_y(turn), {width, height}, surface));
        };
        screen({0.0, 0.0, cube_z}, quarter, 1.3 * cube, 0.9 * cube, Surface::reflecting);  // splitting face
        screen({sensor_x, 0.0, cube_z}, 2.0 * quarter, 20.0, 20.0, Surface::absorbing);
        screen({0.0, 0.0, source_z - 5.0}, 0.0, 40.0, 40.0, Surface::absorbing);
        for (const double side : {-1.0, 1.0}) {  // housing
            screen({side * 60.0, 0.0, -20.0}, 2.0 * quarter, 110.0, 60.0, Surface::absorbing);
            faces.push_back(stepdiag::make_rectangle({0.0, side * 40.0, -20.0},
                                                     stepdiag::rotation_exp({2.0 * quarter, 0.0, 0.0}), {110.0, 110.0},
                                                     Surface::absorbing));
        }
        without_mirror.emplace(faces);
        faces.push_back(mirror(0));
        std::size_t triangles = 0;
        for (const Face& face : faces) triangles += face.outline.size() - 2;
        expect_near(double(triangles), 40.0, 0.0, "triangles");
        for (int i = 0; i < poses; ++i) truth.push_back(follow(scene(i), &steps));
    }

    Face mirror(int i) const {
        return stepdiag::make_rectangle(point[i], rotation[i], {100.0, 100.0}, Surface::reflecting);
    }
    stepdiag::Scene scene(int i) const { return without_mirror->with({mirror(i)}); }
    bool is_mirror(int face) const { return face + 1 == int(faces.size()); }

    // The branch of the ray tree to the sensor: transmitted by the splitting face, later reflected by it.
    static Arrival follow(const stepdiag::Scene& scene, std::vector<Step>* record) {
        stepdiag::Ray ray{{0.0, 0.0, source_z}, {0.0, 0.0, 1.0}};
        double index = air, optical_length = 0.0;
        if (record) record->clear();
        for (int n = 0; n < interactions; ++n) {
            const auto hit = scene.first_hit(ray);
            if (!hit) std::abort();
            const Face& face = scene.face(hit->face);
            ray.origin = hit->point;
            optical_length += index * hit->distance;
            const bool passes = n == 1;
            Event event = Event::absorbed;
            if (face.surface == Surface::refracting) {
                const double after = index == air ? glass : air;
                ray.direction = *stepdiag::refract(ray.direction, face.normal, index / after);
                index = after;
                event = Event::refracted;
            } else if (passes) {
                event = Event::refracted;
            } else if (face.surface == Surface::reflecting) {
                ray.direction = stepdiag::reflect(ray.direction, face.normal);
                event = Event::reflected;
            }
            if (record) record->push_back({event, !passes, hit->face});
        }
        return {ray.origin, optical_length};
    }
};

const Bench& bench() {
    static const Bench made;
    return made;
}

enum class Varies { mirror, planes, planes_and_indices };

// The recorded route. Each lane has its own plane for the mirror only, or for all faces.
struct Replay {
    std::deque<stepdiag::FaceFrame> frames;
    std::deque<stepdiag::Outline> outlines;
    std::deque<std::vector<double>> by_lane;
    std::deque<double> common;
    std::vector<stepdiag::Encounter> route;
    std::vector<double> number[8] = {};
    std::vector<std::uint8_t> followed = std::vector<std::uint8_t>(poses);

    explicit Replay(Varies varies) {
        for (auto& each : number) each.resize(poses);
        double index = air;
        for (const Step& step : bench().steps) {
            const Face& face = bench().faces[step.face];
            const double after = step.event != Event::refracted || !step.deflects ? index : index == air ? glass : air;
            frames.push_back(frame_of(face));
            outlines.push_back(outline_of(face, frames.back()));
            stepdiag::Encounter encounter{step.event, step.deflects, {}, {}, &outlines.back(), {}, {}};
            for (int k = 0; k < 12; ++k) {
                const auto value = [k](const stepdiag::FaceFrame& f) {
                    return k < 9 ? f.rotation[k] : f.translation[k - 9];
                };
                stepdiag::LaneValue& to = k < 9 ? encounter.rotation[k] : encounter.translation[k - 9];
                common.push_back(value(frames.back()));
                to = {&common.back()};
                if (!bench().is_mirror(step.face) && varies == Varies::mirror) continue;
                by_lane.emplace_back(poses, common.back());
                to = {by_lane.back().data(), 1};
                if (bench().is_mirror(step.face))
                    for (int i = 0; i < poses; ++i) by_lane.back()[i] = value(frame_of(bench().mirror(i)));
            }
            encounter.index_before = constant(index, varies);
            encounter.index_after = constant(after, varies);
            index = after;
            route.push_back(encounter);
        }
    }

    stepdiag::LaneValue constant(double value, Varies varies) {
        common.push_back(value);
        if (varies != Varies::planes_and_indices) return {&common.back()};
        by_lane.emplace_back(poses, value);
        return {by_lane.back().data(), 1};
    }

    void run() {
        const stepdiag::Ray& ray = bench().ray;
        static const double zero = 0.0;
        stepdiag::LaneRays rays{{}, {}, {&zero}, {&zero}};
        for (int k = 0; k < 3; ++k) rays.origin[k] = {&ray.origin[k]}, rays.direction[k] = {&ray.direction[k]};
        replay(route, rays, poses, 1e-3,
               {{number[0].data(), number[1].data(), number[2].data()},
                {number[3].data(), number[4].data(), number[5].data()},
                number[6].data(),
                number[7].data(),
                followed.data()});
    }

    void check() {
        run();
        for (int i = 0; i < poses; ++i) {
            const Arrival& truth = bench().truth[i];
            expect_near(followed[i], 1.0, 0.0, "followed");
            // Twelve planes, each with a rounding of 1e-13 mm at one metre; rounding of 1e-16 rad on a beam of 3 m.
            expect_near(number[6][i], truth.optical_length, 5e-12, "path of the replay");
            for (int k = 0; k < 3; ++k) expect_near(number[k][i], truth.point[k], 1e-11, "spot of the replay");
            // Perpendicular glass acts as reduced path to second order in the tilts. The rest is mm / 2 * (2e-3)^3.
            const auto reading = stepdiag::read_mirror(bench().point[i], bench().rotation[i].col(2));
            const double out = reading->beam_length() - source_z - (cube + window) * (1.0 - air / glass);
            const double t = reading->tan2_phi(), cos_2phi = (1.0 - t) / (1.0 + t);
            const double axial = (number[7][i] * air - out) * cos_2phi;  // from the mirror to the sensor, unfolded
            const Eigen::Vector2d spot = spot_position(*reading, axial - reading->beam_length());
            expect_near(number[1][i], spot.y(), 1e-6, "spot by the closed form");
        }
    }
};

// Reports the time per interaction.
void count(benchmark::State& state, double each_time) {
    state.counters["interaction"] = benchmark::Counter(
        each_time * interactions, benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}

void replayed(benchmark::State& state, const std::string& target, Varies varies) {
    const std::string before = stepdiag::instruction_set();
    stepdiag::choose_instruction_set(target);
    Replay replay(varies);
    replay.check();
    for (auto _ : state) {
        replay.run();
        benchmark::ClobberMemory();
    }
    stepdiag::choose_instruction_set(before);
    count(state, poses);
}

void embree_with_fixed_mirror(benchmark::State& state) {
    std::vector<Face> faces = bench().faces;
    faces.back() = bench().mirror(poses / 2);
    const stepdiag::Scene scene(faces);
    for (auto _ : state) benchmark::DoNotOptimize(Bench::follow(scene, nullptr));
    count(state, 1);
}

void embree_with_moving_mirror(benchmark::State& state) {
    int i = 0;
    for (auto _ : state) benchmark::DoNotOptimize(Bench::follow(bench().scene(i++ % poses), nullptr));
    count(state, 1);
}

void closed_form(benchmark::State& state) {
    int i = 0;
    for (auto _ : state) {
        const auto reading = stepdiag::read_mirror(bench().point[i % poses], bench().rotation[i % poses].col(2));
        benchmark::DoNotOptimize(spot_position(*reading, 60.0));
        ++i;
    }
    count(state, 1);
}

const bool registered = [] {
    for (const std::string& target : stepdiag::instruction_sets()) {
        const auto add = [&](const char* what, Varies varies) {
            benchmark::RegisterBenchmark(("replay/" + target + "/" + what).c_str(), replayed, target, varies);
        };
        add("mirror_by_lane", Varies::mirror);
        add("all_planes_by_lane", Varies::planes);
        add("all_planes_and_indices_by_lane", Varies::planes_and_indices);
    }
    return true;
}();
BENCHMARK(embree_with_fixed_mirror);
BENCHMARK(embree_with_moving_mirror);
BENCHMARK(closed_form);

}  // namespace
