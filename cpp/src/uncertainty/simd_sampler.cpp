#include "uncertainty/simd_sampler.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "stepdiag/core/error.hpp"

namespace stepdiag {
namespace {

using RowMajor = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

}  // namespace

std::unique_ptr<const SimdSampler> SimdSampler::make(const RunModel& model) {
    if (model.run.simulation.verified_share >= 1.0) return nullptr;
    std::unique_ptr<SimdSampler> run(new SimdSampler(model));
    for (const RunPass& pass : model.passes) {
        auto head = std::find_if(run->heads_.begin(), run->heads_.end(),
                                 [&](const HeadPaths& paths) { return paths.head == pass.place.head; });
        if (head == run->heads_.end()) {
            std::optional<HeadPaths> paths = record_paths(model, *pass.place.head);
            if (!paths) return nullptr;
            run->heads_.push_back(std::move(*paths));
            head = std::prev(run->heads_.end());
        }
        if (pass.planned.line_index < run->lines_.size()) continue;
        const LinePlace& place = pass.place;
        Line line{};
        const Eigen::Vector3d origin = place.first_point - place.head->standoff * place.frame.col(2);
        RowMajor::Map(line.frame.frame) = place.frame;
        Eigen::Vector3d::Map(line.frame.origin) = origin;
        line.head = std::size_t(head - run->heads_.begin());
        const Fields& fields = model.lines[pass.planned.line_index];
        for (int column = 0; column < int(fields.nominal.size()); ++column) {
            const SetupQuantity quantity = setup::component(column).quantity;
            const bool stands = quantity == SetupQuantity::reflector || quantity == SetupQuantity::laser ||
                                quantity == SetupQuantity::lateral || quantity == SetupQuantity::roll;
            const bool of_beams = quantity == SetupQuantity::gain && place.head->layout == HeadLayout::multi_beam;
            if (stands) line.setup_varies = line.setup_varies || fields.is_uncertain(column);
            else if (!of_beams) line.corrects = line.corrects || fields.acts(column);
        }
        line.corrects = line.corrects || model.shared.acts(shared_field::reading_model) ||
                        model.shared.acts(shared_field::wavelength);
        run->lines_.push_back(line);
    }
    for (const Pose& pose : model.poses) {
        ToolPose& to = run->poses_.emplace_back();
        RowMajor::Map(to.rotation) = pose.rotation;
        Eigen::Vector3d::Map(to.position) = pose.position;
    }
    for (const RunRow& row : model.rows) {
        run->elapsed_.push_back(row.elapsed);
        run->travel_.push_back(row.travel);
        run->length_share_.push_back(row.length_share);
    }
    for (const std::string& channel : model.channels) run->is_distance_.push_back(is_distance(channel));
    run->heads_vary_ = model.has_uncertain_air() || !model.moved_parts.empty() ||
                       model.shared.is_uncertain(shared_field::psd_distance,
                                                 int(model.shared.nominal.size()) - shared_field::psd_distance);
    run->reads_excess_ = model.shared.acts(shared_field::reading_model);
    return run;
}

SimdSampler::Scratch::Scratch(const SimdSampler& run) {
    const RunModel& model = run.model_;
    heads.resize(run.heads_.size());
    for (std::size_t h = 0; h < heads.size(); ++h) run.prepare_head(run.heads_[h], heads[h]);
    setups.resize(model.lines.size());
    closed_beams.resize(model.lines.size());
    fields.resize(model.lines.size());
    const std::vector<double> expected(lane_group * model.run.inputs.inputs.size(), 0.0);
    std::vector<double> deviations = expected;
    const Eigen::VectorXd expectations = model.draws.expectations();
    for (std::size_t i = 0; i < deviations.size(); ++i) deviations[i] = expectations[Eigen::Index(i / lane_group)];
    run.fill_fields(model.shared, deviations.data(), shared);
    for (std::size_t h = 0; h < heads.size(); ++h) run.fill_head(run.heads_[h], deviations.data(), *this, heads[h]);
    std::uint8_t followed[lane_group];
    for (std::size_t l = 0; l < fields.size(); ++l) {
        run.fill_fields(model.lines[l], deviations.data(), fields[l]);
        set_up_pass(run.lines_[l].frame, fields[l].data(), setups[l], followed);
        closed_beams[l].resize(2 * run.heads_[run.lines_[l].head].head->beam_offsets.size());
    }
    if (model.moves_poses()) displaced.resize(3 * model.rows.size());
    if (model.has(NoiseQuantity::orientation)) turned.resize(3 * model.rows.size());
    if (run.reads_excess_) excess.resize(model.rows.size());
    numbers.resize(model.rows.size() + model.rows.size() % 2);
}

// --- a block of lanes ---

void SimdSampler::fill_fields(const Fields& fields, const double* deviations, std::vector<SimdRow>& to) const {
    to.resize(fields.nominal.size());
    for (std::size_t s = 0; s < to.size(); ++s) to[s].fill(fields.nominal[s]);
    for (const Deviating& each : fields.uncertain)
        for (std::size_t lane = 0; lane < lane_group; ++lane)
            to[std::size_t(each.field)].value[lane] += deviations[std::size_t(each.input) * lane_group + lane];
}

void SimdSampler::displace(std::optional<std::uint64_t> first_sample, Scratch& scratch) const {
    const bool of_scales = model_.has_uncertain_scales();
    for (std::size_t r = 0; r < model_.rows.size(); ++r)
        for (int k = 0; k < 3; ++k) {
            const double time = double(r) * model_.seconds;
            const auto shared = [&](int field) { return scratch.shared[std::size_t(field + k)].value; };
            const double* const drift = shared(shared_field::machine_drift);
            double* const to = scratch.displaced[3 * r + std::size_t(k)].value;
            for (std::size_t lane = 0; lane < lane_group; ++lane) to[lane] = drift[lane] * time;
            for (std::size_t lane = 0; of_scales && lane < lane_group; ++lane)
                to[lane] += model_.moved_by_scale(
                    model_.rows[r], k, shared(shared_field::expansion)[lane],
                    shared(shared_field::scale_temperature)[lane] + time * shared(shared_field::scale_ramp)[lane]);
        }
    std::fill(scratch.turned.begin(), scratch.turned.end(), SimdRow{});
    if (!first_sample) return;
    const auto& noise = model_.run.inputs.noise;
    for (std::size_t e = 0; e < noise.size(); ++e) {
        const NoiseQuantity quantity = noise[e].quantity;
        const std::size_t number = std::size_t(noise[e].component);
        if (quantity == NoiseQuantity::orientation)
            add_draws(e, *first_sample, scratch, {scratch.turned[number].value}, 3 * lane_group);
        if (quantity == NoiseQuantity::position || quantity == NoiseQuantity::machine_walk)
            add_draws(e, *first_sample, scratch, {scratch.displaced[number].value}, 3 * lane_group);
    }
}

void SimdSampler::correct(const RunPass& pass, const SimdPass& lanes, const Scratch& scratch) const {
    const std::vector<SimdRow>& fields = scratch.fields[pass.planned.line_index];
    std::vector<SimdRow> constant(lanes.channels);
    SimdRow gain, wavelength;
    for (std::size_t lane = 0; lane < lane_group; ++lane) {
        gain.value[lane] = 1.0 + fields[setup::gain].value[lane];
        wavelength.value[lane] = 1.0 / (1.0 + scratch.shared[shared_field::wavelength].value[lane]);
        for (std::size_t c = 0; c < lanes.channels; ++c) {
            double& to = constant[c].value[lane];
            to = 0.0;
            if (is_distance_[c]) to = fields[setup::distance_constant].value[lane];
            if (is_distance_[c] && setup::beam_constants + c < fields.size())
                to += fields[setup::beam_constants + c].value[lane];
            if (model_.channels[c] == "spot_x" || model_.channels[c] == "spot_y")
                to = fields[setup::psd_zero + (model_.channels[c] == "spot_y")].value[lane];
        }
    }
    const std::size_t first = pass.first_row();
    correct_pass(lanes, {&elapsed_[first], &travel_[first], &length_share_[first], constant.data(), &gain,
                         &fields[setup::drift], &scratch.shared[shared_field::reading_model], &wavelength,
                         &fields[setup::scale_factor], &fields[setup::scale_length], is_distance_.data()});
}

void SimdSampler::trace(const double* deviations, std::optional<std::uint64_t> first_sample, Scratch& scratch,
                        double* readings, std::uint8_t* followed) const {
    std::fill_n(followed, lane_group, std::uint8_t(1));
    fill_fields(model_.shared, deviations, scratch.shared);
    if (heads_vary_)
        for (std::size_t h = 0; h < heads_.size(); ++h) fill_head(heads_[h], deviations, scratch, scratch.heads[h]);
    for (std::size_t l = 0; l < lines_.size(); ++l) {
        if (!model_.lines[l].uncertain.empty()) fill_fields(model_.lines[l], deviations, scratch.fields[l]);
        if (lines_[l].setup_varies) set_up_pass(lines_[l].frame, scratch.fields[l].data(), scratch.setups[l], followed);
        if (const SimdRow* const offsets = scratch.heads[lines_[l].head].beam_offsets)
            for (std::size_t i = 0; i < scratch.closed_beams[l].size(); ++i)
                for (std::size_t lane = 0; lane < lane_group; ++lane)
                    scratch.closed_beams[l][i].value[lane] =
                        offsets[i].value[lane] * (1.0 + scratch.fields[l][setup::gain].value[lane]);
    }
    if (!scratch.displaced.empty()) displace(first_sample, scratch);

    const std::size_t channels = model_.channels.size();
    for (const RunPass& pass : model_.passes) {
        const std::size_t first = pass.first_row(), l = pass.planned.line_index;
        const Line& line = lines_[l];
        const HeadPaths& paths = heads_[line.head];
        const Scratch::HeadRows& head = scratch.heads[line.head];
        SimdPass lanes{&poses_[first],
                       nullptr,
                       nullptr,
                       pass.rows(),
                       &scratch.setups[l],
                       channels,
                       readings + first * channels * lane_group,
                       nullptr,
                       followed};
        if (!scratch.displaced.empty()) lanes.displaced = &scratch.displaced[3 * first];
        if (!scratch.turned.empty()) lanes.turned = &scratch.turned[3 * first];
        if (reads_excess_) lanes.excess = &scratch.excess[first];
        if (head.beams.empty())
            define_pass(lanes, {paths.head->layout, head.index_ratio, head.psd_distance, scratch.closed_beams[l].data(),
                                paths.mirror.half_size, paths.head->aperture});
        else trace_pass(lanes, paths.mirror, head.beams, paths.gap);
        if (line.corrects) correct(pass, lanes, scratch);
    }
}

void SimdSampler::add_draws(std::size_t entry, std::uint64_t first_sample, Scratch& scratch,
                            const std::vector<double*>& to, std::size_t stride) const {
    constexpr std::size_t rows_at_a_time = 32;  // so that numbers and what they change are still in the nearest cache
    const ReadingNoise& noise = model_.run.inputs.noise[entry];
    const bool of_head = noise.quantity == NoiseQuantity::head_walk;
    const bool walks = of_head || noise.quantity == NoiseQuantity::machine_walk;
    const bool is_normal = noise.distribution.kind == DistributionKind::normal;
    double* const numbers = scratch.numbers[0].value;
    SimdRow walked{};
    for (std::size_t first = 0; first < model_.rows.size(); first += rows_at_a_time) {
        const std::size_t count = std::min(rows_at_a_time, model_.rows.size() - first);
        if (is_normal) model_.draws.standard_noise(entry, first_sample, lane_group, first, count, numbers);
        else model_.draws.noise(entry, first_sample, lane_group, first, count, numbers);
        double spread = is_normal ? noise.distribution.spread : 1.0;
        double expectation = is_normal ? noise.distribution.expectation : 0.0;
        if (walks) {
            for (std::size_t r = 0; r < count; ++r) {
                const bool starts = of_head ? elapsed_[first + r] == 0.0 : first + r == 0;
                for (std::size_t lane = 0; lane < lane_group; ++lane) {
                    double& number = numbers[r * lane_group + lane];
                    if (starts) walked.value[lane] = number = 0.0;
                    else number = walked.value[lane] += (expectation + spread * number) * std::sqrt(model_.seconds);
                }
            }
            spread = 1.0, expectation = 0.0;
        }
        for (double* const each : to)
            add_noise_to_pass(numbers, count, spread, expectation, each + first * stride, stride);
    }
}

void SimdSampler::add_noise(std::uint64_t first_sample, Scratch& scratch, double* readings) const {
    const auto& noise = model_.run.inputs.noise;
    const std::size_t channels = model_.channels.size();
    for (std::size_t e = 0; e < noise.size(); ++e) {
        const bool of_channel = noise[e].quantity == NoiseQuantity::channel;
        if (!of_channel && noise[e].quantity != NoiseQuantity::common && noise[e].quantity != NoiseQuantity::head_walk)
            continue;
        std::vector<double*> to;
        for (std::size_t c = 0; c < channels; ++c)
            if (of_channel ? model_.channels[c] == noise[e].channel : bool(is_distance_[c]))
                to.push_back(readings + c * lane_group);
        add_draws(e, first_sample, scratch, to, channels * lane_group);
    }
}

// --- rows of a head: planes, source, detector and air of each lane ---

namespace {

void fill(const double* values, std::size_t count, SimdRow* rows) {
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

namespace {

SimdFace nominal_face(const BeamPath& path, std::size_t encounter) {
    const RecordedEncounter& met = path.route.encounters[encounter];
    const FaceFrame frame = path.unfolding(encounter).of(path.frames[std::size_t(met.face)]);
    SimdFace face{met.event,
                  met.index_before != met.index_after,
                  &path.outlines[std::size_t(met.face)],
                  {},
                  met.index_before,
                  met.index_after};
    std::copy_n(frame.rotation.data(), 9, face.plane);
    std::copy_n(frame.translation.data(), 3, face.plane + 9);
    face.inverse_index = 1.0 / face.index_before;
    face.index_ratio = face.index_before / face.index_after;
    face.one_less_ratio2 = 1.0 - face.index_ratio * face.index_ratio;
    return face;
}

}  // namespace

void SimdSampler::prepare_head(const HeadPaths& paths, Scratch::HeadRows& to) const {
    const Head& head = *paths.head;
    if (!head.design) {
        to.rows.resize(2 + 2 * head.beam_offsets.size());
        to.index_ratio = &to.rows[0];
        if (head.layout == HeadLayout::psd) to.psd_distance = &to.rows[1];
        if (head.layout == HeadLayout::multi_beam) to.beam_offsets = &to.rows[2];
        return;
    }
    std::size_t count = 0;
    for (const BeamPath& path : paths.beams) count += rows_of_a_beam + rows_of_a_face * path.route.encounters.size();
    to.rows.resize(count);
    SimdRow* next = to.rows.data();
    const auto take = [&](std::size_t rows) {
        SimdRow* const taken = next;
        next += rows;
        return taken;
    };
    const auto new_beam = [&](SimdDetector detector, int channel) -> SimdBeam& {
        SimdRow* const rows = take(rows_of_a_beam);
        SimdBeam& beam = to.beams.emplace_back();
        beam.source = rows;
        beam.air = rows + 6;
        beam.offset = rows + 7;
        beam.detector_rows = rows + 8;
        beam.detector = detector;
        beam.channel = channel;
        beam.scale = 0.5 / refractive_index(model_.assumed(head), head.wavelength);
        return beam;
    };
    const bool by_lane = model_.has_uncertain_air() || !paths.moved.empty();
    for (const BeamPath& path : paths.beams) {
        const HeadBeam& light = head.design->beams[std::size_t(path.beam)];
        SimdBeam& beam =
            new_beam(light.interferometer ? SimdDetector::interferometer : SimdDetector::spot, path.channel);
        if (light.interferometer) {
            const double assumed = refractive_index(model_.assumed(head), light.mode.wavelength);
            beam.scale = 0.5 / (assumed * (1.0 + light.interferometer->index_error));
            beam.least_cosine = std::cos(light.interferometer->acceptance);
        }
        const Eigen::Vector3d &origin = path.source.origin, &direction = path.source.direction;
        const double source[6] = {origin[0], origin[1], origin[2], direction[0], direction[1], direction[2]};
        fill(source, 6, const_cast<SimdRow*>(beam.source));
        const Placement place = path.unfolding(path.route.encounters.size()).of(path.detector);
        const auto detector = detector_numbers(place, paths.nominal, !light.interferometer);
        beam.plates = path.plates ? &*path.plates : nullptr;
        fill(detector.data(), detector.size(), const_cast<SimdRow*>(beam.detector_rows));
        for (std::size_t e = 0; e < path.route.encounters.size(); ++e) {
            if (!path.is_alone(e)) continue;
            const RecordedEncounter& met = path.route.encounters[e];
            SimdFace face = nominal_face(path, e);
            if (by_lane) {
                SimdRow* const rows = take(rows_of_a_face);
                fill(face.plane, 12, rows);
                rows[12].fill(face.index_before);
                rows[13].fill(face.index_after);
                face.plane_rows = rows;
                face.before_row = met.index_before == path.air_index ? beam.air : rows + 12;
                face.after_row = met.index_after == path.air_index ? beam.air : rows + 13;
            }
            (e < path.mirror_at ? beam.out : beam.back).push_back(face);
        }
    }
}

void SimdSampler::fill_air(const HeadPaths& paths, const Scratch& scratch, Scratch::HeadRows& to) const {
    const Head& head = *paths.head;
    std::vector<double> numbers(scratch.shared.size());
    for (std::size_t lane = 0; lane < lane_group; ++lane) {
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
            const double air = index(paths.beams[b].wavelength);
            const_cast<SimdRow*>(to.beams[b].air)->value[lane] = air;
            if (to.beams[b].detector != SimdDetector::interferometer) continue;
            const auto& interferometer = *head.design->beams[std::size_t(paths.beams[b].beam)].interferometer;
            const double constant = paths.nominal.calibration.head_constants[std::size_t(to.beams[b].channel)];
            const_cast<SimdRow*>(to.beams[b].offset)->value[lane] =
                interferometer.dead_path * (2.0 * to.beams[b].scale * air - 1.0) - constant;
        }
    }
}

void SimdSampler::move_parts(const HeadPaths& paths, const double* deviations, Scratch::HeadRows& to) const {
    std::vector<double> of_lane(model_.run.inputs.inputs.size());
    for (std::size_t lane = 0; lane < lane_group; ++lane) {
        for (std::size_t i = 0; i < of_lane.size(); ++i) of_lane[i] = deviations[i * lane_group + lane];
        for (const MovedComponent& part : paths.moved) {
            const Placement place = part.at(of_lane);
            // A face fixed to the part: local = R x + t, R = R0 (P R_P0^T)^T, its origin as before.
            const Eigen::Matrix3d turn = place.rotation * part.expected.rotation.transpose();
            for (std::size_t b = 0; b < to.beams.size(); ++b) {
                const BeamPath& path = paths.beams[b];
                SimdBeam& beam = to.beams[b];
                std::size_t e = 0;
                const auto move = [&](const SimdFace& face) {
                    while (!path.is_alone(e)) ++e;
                    const Unfolding unfolding = path.unfolding(e);
                    const int number = path.route.encounters[e++].face;
                    if (path.component[std::size_t(number)] != part.component) return;
                    FaceFrame frame = path.frames[std::size_t(number)];
                    const RowMajor before = RowMajor::Map(frame.rotation.data()), rotation = before * turn.transpose();
                    RowMajor::Map(frame.rotation.data()) = rotation;
                    Eigen::Vector3d::Map(frame.translation.data()) +=
                        before * part.expected.position - rotation * place.position;
                    frame = unfolding.of(frame);
                    SimdRow* const rows = const_cast<SimdRow*>(face.plane_rows);
                    for (int k = 0; k < 9; ++k) rows[k].value[lane] = frame.rotation[k];
                    for (int k = 0; k < 3; ++k) rows[9 + k].value[lane] = frame.translation[k];
                };
                for (const SimdFace& face : beam.out) move(face);
                for (const SimdFace& face : beam.back) move(face);
                if (path.source_component == part.component)
                    for (int k = 0; k < 3; ++k) {
                        const_cast<SimdRow*>(beam.source)[k].value[lane] = place.position[k];
                        const_cast<SimdRow*>(beam.source)[3 + k].value[lane] = place.rotation(k, 2);
                    }
                if (path.detector_component == part.component) {
                    const auto numbers = detector_numbers(path.unfolding(path.route.encounters.size()).of(place),
                                                          paths.nominal, beam.detector == SimdDetector::spot);
                    for (std::size_t k = 0; k < numbers.size(); ++k)
                        const_cast<SimdRow*>(beam.detector_rows)[k].value[lane] = numbers[k];
                }
            }
        }
    }
}

void SimdSampler::fill_head(const HeadPaths& paths, const double* deviations, const Scratch& scratch,
                            Scratch::HeadRows& to) const {
    fill_air(paths, scratch, to);
    const Head& head = *paths.head;
    for (std::size_t lane = 0; lane < lane_group; ++lane) {
        if (to.psd_distance)
            to.psd_distance->value[lane] = head.psd_distance + scratch.shared[shared_field::psd_distance].value[lane];
        if (to.beam_offsets)
            for (std::size_t i = 0; i < 2 * head.beam_offsets.size(); ++i)
                to.beam_offsets[i].value[lane] = head.beam_offsets[i / 2][Eigen::Index(i % 2)] +
                                                 scratch.shared[shared_field::beam_offset + i].value[lane];
    }
    move_parts(paths, deviations, to);
}

}  // namespace stepdiag
