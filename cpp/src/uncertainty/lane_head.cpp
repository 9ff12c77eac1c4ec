// The rows of a head: planes, source, detector and air of each lane.
#include <algorithm>
#include <cmath>
#include <limits>

#include "stepdiag/core/error.hpp"
#include "uncertainty/simd_sampler.hpp"

namespace stepdiag {
namespace {

void fill(const double* values, std::size_t count, LaneRow* rows) {
    for (std::size_t i = 0; i < count; ++i) rows[i].fill(values[i]);
}

using RowMajor = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

// What a detector says of light that ends at a point: of an interferometer the axis, of a sensor the signals as linear
// functions of the point.
std::vector<double> detector_numbers(const Placement& place, const NominalHead& nominal, bool is_sensor) {
    if (!is_sensor) {
        const Eigen::Vector3d axis = place.rotation.col(2);
        return {axis.begin(), axis.end()};
    }
    const Eigen::Matrix<double, 2, 3> map = nominal.spot_axes * place.rotation.leftCols<2>().transpose();
    const Eigen::Vector2d constant = -map * place.position - nominal.spot_axes * nominal.spot_zero;
    return {map(0, 0), map(0, 1), map(0, 2), constant[0], map(1, 0), map(1, 1), map(1, 2), constant[1]};
}

constexpr std::size_t rows_of_a_face = 14;  // plane, indices before and after
constexpr std::size_t rows_of_a_beam = 16;  // source, air, offset, detector
constexpr double no_index = std::numeric_limits<double>::quiet_NaN();

}  // namespace

void LaneRun::prepare_head(const HeadWays& ways, Scratch::HeadRows& to) const {
    const Head& head = *ways.head;
    if (!head.design && head.layout != HeadLayout::ideal) {
        to.rows.resize(2 + 2 * head.beam_offsets.size());
        to.index_ratio = &to.rows[0];
        if (head.layout == HeadLayout::psd) to.psd_distance = &to.rows[1];
        else to.beam_offsets = &to.rows[2];
        return;
    }
    std::size_t count = head.design ? 0 : rows_of_a_beam + rows_of_a_face;
    for (const BeamWay& way : ways.beams) count += rows_of_a_beam + rows_of_a_face * way.route.encounters.size();
    to.rows.resize(count);
    LaneRow* next = to.rows.data();
    const auto take = [&](std::size_t rows) {
        LaneRow* const taken = next;
        next += rows;
        return taken;
    };
    const auto new_beam = [&](LaneDetector detector, int channel) -> LaneBeam& {
        LaneBeam beam{};
        LaneRow* const rows = take(rows_of_a_beam);
        beam.source = rows;
        beam.air = rows + 6;
        beam.offset = rows + 7;
        beam.detector_rows = rows + 8;
        beam.detector = detector;
        beam.channel = channel;
        beam.scale = 0.5 / refractive_index(model_.assumed(head), head.wavelength);
        to.beams.push_back(std::move(beam));
        return to.beams.back();
    };
    if (!head.design) {
        static const double no_plane[12] = {1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0};
        LaneBeam& beam = new_beam(LaneDetector::ideal, 0);
        LaneFace face{Event::absorbed, false, &ways.reference, {}, 1.0, 1.0};
        std::copy_n(no_plane, 12, face.plane);
        LaneRow* const rows = take(rows_of_a_face);
        fill(no_plane, 12, rows);
        face.plane_rows = rows, face.before_row = face.after_row = beam.air;
        beam.back.push_back(face);
        const double source[6] = {0, 0, 0, 0, 0, 1};
        fill(source, 6, const_cast<LaneRow*>(beam.source));
        const_cast<LaneRow*>(beam.offset)->fill(0.0);
        return;
    }
    const bool by_lane = model_.has_uncertain_air() || !ways.moved.empty();
    for (const BeamWay& way : ways.beams) {
        const HeadBeam& light = head.design->beams[std::size_t(way.beam)];
        LaneBeam& beam =
            new_beam(light.interferometer ? LaneDetector::interferometer : LaneDetector::spot, way.channel);
        if (light.interferometer) {
            const double assumed = refractive_index(model_.assumed(head), light.mode.wavelength);
            beam.scale = 0.5 / (assumed * (1.0 + light.interferometer->index_error));
            beam.least_cosine = std::cos(light.interferometer->acceptance);
        }
        const Eigen::Vector3d &origin = way.source.origin, &direction = way.source.direction;
        const double source[6] = {origin[0], origin[1], origin[2], direction[0], direction[1], direction[2]};
        fill(source, 6, const_cast<LaneRow*>(beam.source));
        const auto detector = detector_numbers(way.detector, ways.nominal, !light.interferometer);
        fill(detector.data(), detector.size(), const_cast<LaneRow*>(beam.detector_rows));
        for (std::size_t e = 0; e < way.route.encounters.size(); ++e) {
            if (e == way.mirror_at) continue;
            const RecordedEncounter& met = way.route.encounters[e];
            const FaceFrame& frame = way.frames[std::size_t(met.face)];
            LaneFace face{met.event,
                          met.index_before != met.index_after,
                          &way.outlines[std::size_t(met.face)],
                          {},
                          met.index_before,
                          met.index_after};
            std::copy_n(frame.rotation.data(), 9, face.plane);
            std::copy_n(frame.translation.data(), 3, face.plane + 9);
            face.inverse_index = 1.0 / face.index_before;
            face.index_ratio = face.index_before / face.index_after;
            face.one_less_ratio2 = 1.0 - face.index_ratio * face.index_ratio;
            if (by_lane) {
                LaneRow* const rows = take(rows_of_a_face);
                fill(face.plane, 12, rows);
                rows[12].fill(face.index_before);
                rows[13].fill(face.index_after);
                face.plane_rows = rows;
                face.before_row = met.index_before == way.air_index ? beam.air : rows + 12;
                face.after_row = met.index_after == way.air_index ? beam.air : rows + 13;
            }
            (e < way.mirror_at ? beam.out : beam.back).push_back(face);
        }
    }
}

void LaneRun::fill_air(const HeadWays& ways, const Scratch& scratch, Scratch::HeadRows& to) const {
    const Head& head = *ways.head;
    std::vector<double> numbers(scratch.shared.size());
    for (std::size_t lane = 0; lane < run_lanes; ++lane) {
        for (std::size_t s = 0; s < numbers.size(); ++s) numbers[s] = scratch.shared[s].value[lane];
        const Environment environment = model_.environment(head, numbers);
        const auto index = [&](double wavelength) {
            try {
                return refractive_index(environment, wavelength);
            } catch (const InvalidArgument&) {
                return no_index;  // such a lane is not followed
            }
        };
        if (to.index_ratio)
            to.index_ratio->value[lane] =
                index(head.wavelength) / refractive_index(model_.assumed(head), head.wavelength);
        for (std::size_t b = 0; b < to.beams.size(); ++b) {
            const double air = index(head.design ? ways.beams[b].wavelength : head.wavelength);
            const_cast<LaneRow*>(to.beams[b].air)->value[lane] = air;
            if (to.beams[b].detector != LaneDetector::interferometer) continue;
            const auto& interferometer = *head.design->beams[std::size_t(ways.beams[b].beam)].interferometer;
            const double constant = ways.nominal.calibration.head_constants[std::size_t(to.beams[b].channel)];
            const_cast<LaneRow*>(to.beams[b].offset)->value[lane] =
                interferometer.dead_path * (2.0 * to.beams[b].scale * air - 1.0) - constant;
        }
    }
}

void LaneRun::move_parts(const HeadWays& ways, const double* deviations, Scratch::HeadRows& to) const {
    std::vector<double> of_lane(model_.run.inputs.inputs.size());
    for (std::size_t lane = 0; lane < run_lanes; ++lane) {
        for (std::size_t i = 0; i < of_lane.size(); ++i) of_lane[i] = deviations[i * run_lanes + lane];
        for (const MovedComponent& part : ways.moved) {
            const Placement place = part.at(of_lane);
            // A face fixed to the part: local = R x + t, R = R0 (P R_P0^T)^T, its origin as before.
            const Eigen::Matrix3d turn = place.rotation * part.expected.rotation.transpose();
            for (std::size_t b = 0; b < to.beams.size(); ++b) {
                const BeamWay& way = ways.beams[b];
                LaneBeam& beam = to.beams[b];
                std::size_t e = 0;
                const auto move = [&](const LaneFace& face) {
                    if (e == way.mirror_at) ++e;
                    const int number = way.route.encounters[e++].face;
                    if (way.component[std::size_t(number)] != part.component) return;
                    const FaceFrame& frame = way.frames[std::size_t(number)];
                    const RowMajor before = RowMajor::Map(frame.rotation.data());
                    const RowMajor rotation = before * turn.transpose();
                    const Eigen::Vector3d translation = Eigen::Vector3d::Map(frame.translation.data()) +
                                                        before * part.expected.position - rotation * place.position;
                    LaneRow* const rows = const_cast<LaneRow*>(face.plane_rows);
                    for (int k = 0; k < 9; ++k) rows[k].value[lane] = rotation.data()[k];
                    for (int k = 0; k < 3; ++k) rows[9 + k].value[lane] = translation[k];
                };
                for (const LaneFace& face : beam.out) move(face);
                for (const LaneFace& face : beam.back) move(face);
                if (way.source_component == part.component)
                    for (int k = 0; k < 3; ++k) {
                        const_cast<LaneRow*>(beam.source)[k].value[lane] = place.position[k];
                        const_cast<LaneRow*>(beam.source)[3 + k].value[lane] = place.rotation(k, 2);
                    }
                if (way.detector_component == part.component) {
                    const auto numbers = detector_numbers(place, ways.nominal, beam.detector == LaneDetector::spot);
                    for (std::size_t k = 0; k < numbers.size(); ++k)
                        const_cast<LaneRow*>(beam.detector_rows)[k].value[lane] = numbers[k];
                }
            }
        }
    }
}

void LaneRun::fill_head(const HeadWays& ways, const double* deviations, const Scratch& scratch,
                        Scratch::HeadRows& to) const {
    fill_air(ways, scratch, to);
    const Head& head = *ways.head;
    for (std::size_t lane = 0; lane < run_lanes; ++lane) {
        if (to.psd_distance)
            to.psd_distance->value[lane] = head.psd_distance + scratch.shared[shared_slot::psd_distance].value[lane];
        if (to.beam_offsets)
            for (std::size_t i = 0; i < 2 * head.beam_offsets.size(); ++i)
                to.beam_offsets[i].value[lane] = head.beam_offsets[i / 2][Eigen::Index(i % 2)] +
                                                 scratch.shared[shared_slot::beam_offset + i].value[lane];
    }
    move_parts(ways, deviations, to);
}

}  // namespace stepdiag
