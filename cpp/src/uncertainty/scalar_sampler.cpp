#include "uncertainty/scalar_sampler.hpp"

#include <cmath>
#include <limits>
#include <numeric>

#include "stepdiag/core/rotation.hpp"

namespace stepdiag {
namespace {

constexpr double trace_all = 1.0;  // verified share: nothing is replayed

bool has_sensor_noise(const HeadDesign& design) {
    for (const SpotSensor& sensor : design.sensors) {
        if (const auto* camera = std::get_if<Camera>(&sensor.device)) {
            if (camera->shot_noise || camera->read_noise > 0.0) return true;
        } else if (std::get<LateralEffect>(sensor.device).noise > 0.0) {
            return true;
        }
    }
    return false;
}

}  // namespace

ScalarSampler::ScalarSampler(const RunModel& model) : model_(model) {
    if (model.has_uncertain_air() || !model.moved_parts.empty()) return;
    for (const RunPass& pass : model.passes) {
        const Head& head = *pass.place.head;
        if (!head.design || has_sensor_noise(*head.design)) continue;
        for (const double share : {model.run.simulation.verified_share, trace_all}) {
            ReadingConditions conditions = model.run.simulation.conditions_of(head);
            conditions.replay.verified_share = share;
            auto& traced = traced_[share][&head];
            if (!traced) traced = std::make_shared<TracedReader>(head, pass.place.mirror, conditions);
        }
    }
}

std::vector<Displacement> ScalarSampler::displacements(const Eigen::VectorXd& deviations,
                                                       std::optional<std::uint64_t> sample) const {
    const std::size_t rows = model_.rows.size();
    std::vector<Displacement> displaced(rows);
    const std::vector<double> shared = model_.shared.with(deviations);
    const Eigen::Vector3d drift(shared[shared_field::machine_drift], shared[shared_field::machine_drift + 1],
                                shared[shared_field::machine_drift + 2]);
    const bool of_scales = model_.has_uncertain_scales();
    for (std::size_t r = 0; r < rows; ++r) {
        const double time = double(r) * model_.seconds;
        displaced[r].shift = drift * time;
        for (int k = 0; of_scales && k < 3; ++k)
            displaced[r].shift[k] += model_.moved_by_scale(
                model_.rows[r], k, shared[shared_field::expansion + k],
                shared[shared_field::scale_temperature + k] + time * shared[shared_field::scale_ramp + k]);
    }
    if (!sample) return displaced;
    const auto& noise = model_.run.inputs.noise;
    for (std::size_t e = 0; e < noise.size(); ++e) {
        const int k = noise[e].component;
        double walked = 0.0;
        for (std::size_t r = 0; r < rows; ++r) {
            if (noise[e].quantity == NoiseQuantity::position) {
                displaced[r].shift[k] += model_.draws.noise(e, *sample, r);
            } else if (noise[e].quantity == NoiseQuantity::orientation) {
                displaced[r].rotation[k] += model_.draws.noise(e, *sample, r);
            } else if (noise[e].quantity == NoiseQuantity::machine_walk && r > 0) {
                walked += model_.draws.noise(e, *sample, r) * std::sqrt(model_.seconds);
                displaced[r].shift[k] += walked;
            }
        }
    }
    return displaced;
}

Eigen::MatrixXd ScalarSampler::read(const Eigen::VectorXd& deviations, std::optional<std::uint64_t> sample,
                                    const RunPass& pass, const std::vector<std::size_t>& rows,
                                    const std::vector<Displacement>& displaced, double verified_share,
                                    Readers& readers) const {
    const std::vector<double> numbers = model_.lines[pass.planned.line_index].with(deviations);
    const std::vector<double> shared = model_.shared.with(deviations);
    const Head& nominal = *pass.place.head;
    const std::uint64_t seed = sample ? model_.draws.sensor_seed(*sample) : 0;
    const ReadingConditions conditions{
        model_.environment(nominal, shared), model_.assumed(nominal), {verified_share, seed}, seed};
    auto& traced = readers[&nominal];
    const PassReader reader(model_.head(nominal, shared, deviations), pass.place, misalignment_of(numbers), conditions,
                            traced);
    traced = reader.traced();
    std::vector<Pose> poses;
    std::vector<double> elapsed;
    for (const std::size_t row : rows) {
        Pose pose = model_.poses[row];
        pose.position += displaced[row].shift;
        if (!displaced[row].rotation.isZero(0.0)) pose.rotation = rotation_exp(displaced[row].rotation) * pose.rotation;
        poses.push_back(pose);
        elapsed.push_back(model_.rows[row].elapsed);
    }
    const std::vector<SignalRow> signals = reader.read(poses, elapsed, rows.front());

    const std::size_t channels = model_.channels.size();
    Eigen::MatrixXd readings = Eigen::MatrixXd::Constant(Eigen::Index(rows.size()), Eigen::Index(channels),
                                                         std::numeric_limits<double>::quiet_NaN());
    for (std::size_t k = 0; k < rows.size(); ++k) {
        const RunRow& row = model_.rows[rows[k]];
        double model_error = 0.0;
        if (shared[shared_field::reading_model] != 0.0) {
            const MirrorPose mirror = reader.mirror(poses[k]);
            if (const auto reading = read_mirror(mirror.point, mirror.rotation.col(2)))
                model_error = shared[shared_field::reading_model] * reading->beam_length() * reading->tan2_phi();
        }
        for (std::size_t c = 0; c < channels; ++c) {
            if (!signals[k][c]) continue;
            double value = *signals[k][c];
            if (is_distance(model_.channels[c]))
                value = (value + model_error) / (1.0 + shared[shared_field::wavelength]) +
                        numbers[setup::scale_factor] * row.travel + row.length_share * numbers[setup::scale_length];
            readings(Eigen::Index(k), Eigen::Index(c)) = value;
        }
    }
    return readings;
}

ScalarSampler::Readers ScalarSampler::readers(double verified_share) const {
    const auto same_in_all = traced_.find(verified_share);
    return same_in_all == traced_.end() ? Readers() : same_in_all->second;
}

Eigen::MatrixXd ScalarSampler::trace(const Eigen::VectorXd& deviations, std::uint64_t sample,
                                     const std::vector<std::size_t>& rows) const {
    Eigen::MatrixXd all(Eigen::Index(rows.size()), Eigen::Index(model_.channels.size()));
    const std::vector<Displacement> displaced = displacements(deviations, sample);
    Readers of_sample = readers(trace_all);
    for (std::size_t v = 0; v < rows.size(); ++v)
        all.row(Eigen::Index(v)) =
            read(deviations, sample, model_.passes[v], {rows[v]}, displaced, trace_all, of_sample);
    return all;
}

Eigen::VectorXd ScalarSampler::readings(const Eigen::VectorXd& deviations, std::optional<std::uint64_t> sample) const {
    const std::size_t channels = model_.channels.size();
    Eigen::VectorXd all(model_.rows.size() * channels);
    const std::vector<Displacement> displaced = displacements(deviations, sample);
    const double share = model_.run.simulation.verified_share;
    Readers of_sample = readers(share);
    for (const RunPass& pass : model_.passes) {
        std::vector<std::size_t> rows(pass.rows());
        std::iota(rows.begin(), rows.end(), pass.first_row());
        const Eigen::MatrixXd read_here = read(deviations, sample, pass, rows, displaced, share, of_sample);
        for (std::size_t k = 0; k < rows.size(); ++k)
            for (std::size_t c = 0; c < channels; ++c)
                all[Eigen::Index(rows[k] * channels + c)] = read_here(Eigen::Index(k), Eigen::Index(c));
    }
    if (sample) add_noise(*sample, all);
    return all;
}

void ScalarSampler::add_noise(std::uint64_t sample, Eigen::VectorXd& readings) const {
    const std::size_t channels = model_.channels.size();
    const auto& noise = model_.run.inputs.noise;
    for (std::size_t e = 0; e < noise.size(); ++e) {
        const bool walks = noise[e].quantity == NoiseQuantity::head_walk;
        const bool of_channel = noise[e].quantity == NoiseQuantity::channel;
        if (!walks && !of_channel && noise[e].quantity != NoiseQuantity::common) continue;
        double walked = 0.0;
        for (std::size_t r = 0; r < model_.rows.size(); ++r) {
            double value = 0.0;
            if (!walks) value = model_.draws.noise(e, sample, r);
            else if (model_.rows[r].elapsed == 0.0) walked = 0.0;
            else value = walked += model_.draws.noise(e, sample, r) * std::sqrt(model_.seconds);
            for (std::size_t c = 0; c < channels; ++c)
                if (of_channel ? model_.channels[c] == noise[e].channel : is_distance(model_.channels[c]))
                    readings[Eigen::Index(r * channels + c)] += value;
        }
    }
}

}  // namespace stepdiag
