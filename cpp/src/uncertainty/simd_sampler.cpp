#include "uncertainty/simd_sampler.hpp"

#include <algorithm>
#include <cmath>

namespace stepdiag {
namespace {

using RowMajor = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

}  // namespace

std::unique_ptr<const LaneRun> LaneRun::make(const RunModel& model) {
    if (model.run.simulation.verified_share >= 1.0) return nullptr;
    std::unique_ptr<LaneRun> run(new LaneRun(model));
    for (const RunVisit& visit : model.visits) {
        auto head = std::find_if(run->heads_.begin(), run->heads_.end(),
                                 [&](const HeadWays& ways) { return ways.head == visit.head; });
        if (head == run->heads_.end()) {
            std::optional<HeadWays> ways = record_ways(model, *visit.head);
            if (!ways) return nullptr;
            run->heads_.push_back(std::move(*ways));
            head = std::prev(run->heads_.end());
        }
        if (visit.line < run->lines_.size()) continue;
        Line line{};
        const Eigen::Vector3d origin = visit.first_point - visit.head->standoff * visit.frame.col(2);
        RowMajor::Map(line.frame.frame) = visit.frame;
        Eigen::Vector3d::Map(line.frame.origin) = origin;
        line.head = std::size_t(head - run->heads_.begin());
        const Slots& slots = model.lines[visit.line];
        line.setup_varies = slots.is_uncertain(slot::reflector, slot::gain);
        const bool gain_corrects = visit.head->layout != HeadLayout::multi_beam && slots.acts(slot::gain);
        line.corrects = gain_corrects || slots.acts(slot::psd_zero, int(slots.nominal.size()) - slot::psd_zero) ||
                        model.shared.acts(shared_slot::reading_model) || model.shared.acts(shared_slot::wavelength);
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
        run->is_last_.push_back(row.is_last_point ? 1.0 : 0.0);
    }
    for (const std::string& channel : model.channels) run->is_distance_.push_back(is_distance(channel));
    run->heads_vary_ = model.has_uncertain_air() || !model.moved_parts.empty() ||
                       model.shared.is_uncertain(shared_slot::psd_distance,
                                                 int(model.shared.nominal.size()) - shared_slot::psd_distance);
    run->reads_excess_ = model.shared.acts(shared_slot::reading_model);
    return run;
}

LaneRun::Scratch::Scratch(const LaneRun& run) {
    const RunModel& model = run.model_;
    heads.resize(run.heads_.size());
    for (std::size_t h = 0; h < heads.size(); ++h) run.prepare_head(run.heads_[h], heads[h]);
    setups.resize(model.lines.size());
    closed_beams.resize(model.lines.size());
    slots.resize(model.lines.size());
    const std::vector<double> expected(run_lanes * model.run.inputs.inputs.size(), 0.0);
    std::vector<double> deviations = expected;
    const Eigen::VectorXd expectations = model.draws.expectations();
    for (std::size_t i = 0; i < deviations.size(); ++i) deviations[i] = expectations[Eigen::Index(i / run_lanes)];
    run.fill_slots(model.shared, deviations.data(), shared);
    for (std::size_t h = 0; h < heads.size(); ++h) run.fill_head(run.heads_[h], deviations.data(), *this, heads[h]);
    std::uint8_t followed[run_lanes];
    for (std::size_t l = 0; l < slots.size(); ++l) {
        run.fill_slots(model.lines[l], deviations.data(), slots[l]);
        set_up_lanes(run.lines_[l].frame, slots[l].data(), setups[l], followed);
        closed_beams[l].resize(2 * run.heads_[run.lines_[l].head].head->beam_offsets.size());
    }
    if (model.moves_poses()) displaced.resize(6 * model.rows.size());
    if (run.reads_excess_) excess.resize(model.rows.size());
    numbers.resize(model.rows.size() + model.rows.size() % 2);
}

// --- a block of lanes ---

void LaneRun::fill_slots(const Slots& slots, const double* deviations, std::vector<LaneRow>& to) const {
    to.resize(slots.nominal.size());
    for (std::size_t s = 0; s < to.size(); ++s) to[s].fill(slots.nominal[s]);
    for (const Deviating& each : slots.uncertain)
        for (std::size_t lane = 0; lane < run_lanes; ++lane)
            to[std::size_t(each.slot)].value[lane] += deviations[std::size_t(each.input) * run_lanes + lane];
}

void LaneRun::displace(std::optional<std::uint64_t> first_sample, Scratch& scratch) const {
    for (std::size_t r = 0; r < model_.rows.size(); ++r)
        for (std::size_t k = 0; k < 6; ++k)
            for (std::size_t lane = 0; lane < run_lanes; ++lane)
                scratch.displaced[6 * r + k].value[lane] =
                    k < 3 ? scratch.shared[shared_slot::machine_drift + k].value[lane] * (double(r) * model_.seconds)
                          : 0.0;
    if (!first_sample) return;
    const auto& noise = model_.run.inputs.noise;
    for (std::size_t e = 0; e < noise.size(); ++e) {
        const bool walks = noise[e].quantity == NoiseQuantity::machine_walk;
        const bool turns = noise[e].quantity == NoiseQuantity::orientation;
        if (!walks && !turns && noise[e].quantity != NoiseQuantity::position) continue;
        model_.draws.noise(e, *first_sample, run_lanes, 0, model_.rows.size(), scratch.numbers[0].value);
        const std::size_t number = std::size_t(noise[e].component) + (turns ? 3 : 0);
        LaneRow walked{};
        for (std::size_t r = 0; r < model_.rows.size(); ++r)
            for (std::size_t lane = 0; lane < run_lanes; ++lane) {
                double value = scratch.numbers[r].value[lane];
                if (walks && r == 0) continue;
                if (walks) value = walked.value[lane] += value * std::sqrt(model_.seconds);
                scratch.displaced[6 * r + number].value[lane] += value;
            }
    }
}

void LaneRun::correct(const RunVisit& visit, const LaneVisit& lanes, const Scratch& scratch) const {
    const std::vector<LaneRow>& slots = scratch.slots[visit.line];
    std::vector<LaneRow> constant(lanes.channels);
    LaneRow gain, wavelength;
    for (std::size_t lane = 0; lane < run_lanes; ++lane) {
        gain.value[lane] = 1.0 + slots[slot::gain].value[lane];
        wavelength.value[lane] = 1.0 / (1.0 + scratch.shared[shared_slot::wavelength].value[lane]);
        for (std::size_t c = 0; c < lanes.channels; ++c) {
            double& to = constant[c].value[lane];
            to = 0.0;
            if (is_distance_[c]) to = slots[slot::distance_constant].value[lane];
            if (is_distance_[c] && slot::beam_constant + c < slots.size())
                to += slots[slot::beam_constant + c].value[lane];
            if (model_.channels[c] == "spot_x" || model_.channels[c] == "spot_y")
                to = slots[slot::psd_zero + (model_.channels[c] == "spot_y")].value[lane];
        }
    }
    const std::size_t first = std::size_t(visit.visit.first_row);
    correct_lanes(lanes, {&elapsed_[first], &travel_[first], &is_last_[first], constant.data(), &gain,
                          &slots[slot::drift], &scratch.shared[shared_slot::reading_model], &wavelength,
                          &slots[slot::scale_factor], &slots[slot::scale_length], is_distance_.data()});
}

void LaneRun::trace(const double* deviations, std::optional<std::uint64_t> first_sample, Scratch& scratch,
                    double* readings, std::uint8_t* followed) const {
    std::fill_n(followed, run_lanes, std::uint8_t(1));
    fill_slots(model_.shared, deviations, scratch.shared);
    if (heads_vary_)
        for (std::size_t h = 0; h < heads_.size(); ++h) fill_head(heads_[h], deviations, scratch, scratch.heads[h]);
    for (std::size_t l = 0; l < lines_.size(); ++l) {
        if (!model_.lines[l].uncertain.empty()) fill_slots(model_.lines[l], deviations, scratch.slots[l]);
        if (lines_[l].setup_varies) set_up_lanes(lines_[l].frame, scratch.slots[l].data(), scratch.setups[l], followed);
        if (const LaneRow* const offsets = scratch.heads[lines_[l].head].beam_offsets)
            for (std::size_t i = 0; i < scratch.closed_beams[l].size(); ++i)
                for (std::size_t lane = 0; lane < run_lanes; ++lane)
                    scratch.closed_beams[l][i].value[lane] =
                        offsets[i].value[lane] * (1.0 + scratch.slots[l][slot::gain].value[lane]);
    }
    if (!scratch.displaced.empty()) displace(first_sample, scratch);

    const std::size_t channels = model_.channels.size();
    for (const RunVisit& visit : model_.visits) {
        const std::size_t first = std::size_t(visit.visit.first_row);
        const Line& line = lines_[visit.line];
        const HeadWays& ways = heads_[line.head];
        const Scratch::HeadRows& head = scratch.heads[line.head];
        LaneVisit lanes{&poses_[first], nullptr,
                        visit.rows,     &scratch.setups[visit.line],
                        channels,       readings + first * channels * run_lanes,
                        nullptr,        followed};
        if (!scratch.displaced.empty()) lanes.displaced = &scratch.displaced[6 * first];
        if (reads_excess_) lanes.excess = &scratch.excess[first];
        if (head.beams.empty())
            define_lanes(lanes, {head.index_ratio, head.psd_distance, scratch.closed_beams[visit.line].data()});
        else trace_lanes(lanes, ways.mirror, head.beams, ways.gap);
        if (line.corrects) correct(visit, lanes, scratch);
    }
}

void LaneRun::add_noise(std::uint64_t first_sample, Scratch& scratch, double* readings) const {
    constexpr std::size_t rows_at_a_time = 32;  // so that numbers and readings are still in the nearest cache
    const auto& noise = model_.run.inputs.noise;
    const std::size_t rows = model_.rows.size(), channels = model_.channels.size(), stride = channels * run_lanes;
    double* const numbers = scratch.numbers[0].value;
    for (std::size_t e = 0; e < noise.size(); ++e) {
        const bool walks = noise[e].quantity == NoiseQuantity::head_walk;
        const bool of_channel = noise[e].quantity == NoiseQuantity::channel;
        if (!walks && !of_channel && noise[e].quantity != NoiseQuantity::common) continue;
        const bool is_normal = noise[e].distribution.kind == DistributionKind::normal;
        LaneRow walked{};
        for (std::size_t first = 0; first < rows; first += rows_at_a_time) {
            const std::size_t count = std::min(rows_at_a_time, rows - first);
            if (is_normal) model_.draws.standard_noise(e, first_sample, run_lanes, first, count, numbers);
            else model_.draws.noise(e, first_sample, run_lanes, first, count, numbers);
            double spread = is_normal ? noise[e].distribution.spread : 1.0;
            double expectation = is_normal ? noise[e].distribution.expectation : 0.0;
            if (walks) {
                for (std::size_t r = 0; r < count; ++r)
                    for (std::size_t lane = 0; lane < run_lanes; ++lane) {
                        double& number = numbers[r * run_lanes + lane];
                        if (elapsed_[first + r] == 0.0) walked.value[lane] = number = 0.0;
                        else number = walked.value[lane] += (expectation + spread * number) * std::sqrt(model_.seconds);
                    }
                spread = 1.0, expectation = 0.0;
            }
            for (std::size_t c = 0; c < channels; ++c)
                if (of_channel ? model_.channels[c] == noise[e].channel : bool(is_distance_[c]))
                    add_noise_lanes(numbers, count, spread, expectation, readings + first * stride + c * run_lanes,
                                    stride);
        }
    }
}

}  // namespace stepdiag
