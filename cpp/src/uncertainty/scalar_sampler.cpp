#include "uncertainty/scalar_sampler.hpp"

#include <cmath>
#include <limits>

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
        if (!pass.head->design || has_sensor_noise(*pass.head->design)) continue;
        for (const double share : {model.run.simulation.verified_share, trace_all}) {
            SimulationOptions options = model.run.simulation;
            options.environment = true_environment(*pass.head, options);
            options.verified_share = share;
            auto& reader = readers_[{pass.head, share}];
            if (!reader)
                reader =
                    std::make_shared<TracedReader>(*pass.head, pass.mirror, traced_conditions(*pass.head, options));
        }
    }
}

std::vector<Displacement> ScalarSampler::displacements(const Eigen::VectorXd& deviations,
                                                       std::optional<std::uint64_t> sample, std::size_t rows) const {
    std::vector<Displacement> displaced(rows);
    const std::vector<double> shared = model_.shared.with(deviations);
    const Eigen::Vector3d drift(shared[shared_field::machine_drift], shared[shared_field::machine_drift + 1],
                                shared[shared_field::machine_drift + 2]);
    for (std::size_t r = 0; r < rows; ++r) displaced[r].shift = drift * (double(r) * model_.seconds);
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

std::vector<SignalRow> ScalarSampler::raw(const RunPass& pass, const Head& head, const HeadSetup& setup,
                                          const Misalignment& misalignment, const std::vector<double>& shared,
                                          const std::vector<Pose>& poses, std::optional<std::uint64_t> sample,
                                          std::size_t first_row, double verified_share) const {
    SimulationOptions options = model_.run.simulation;
    options.environment = model_.environment(*pass.head, shared);
    options.assumed = model_.assumed(*pass.head);
    options.verified_share = verified_share;
    options.noise.seed = sample ? model_.draws.sensor_seed(*sample) : 0;
    if (!head.design) return read_defined(head, setup, poses, misalignment, options);
    const auto found = readers_.find({pass.head, verified_share});
    const auto reader = found != readers_.end()
                            ? found->second
                            : std::make_shared<TracedReader>(head, pass.mirror, traced_conditions(head, options));
    return read_traced(*reader, setup, poses, first_row);
}

Eigen::MatrixXd ScalarSampler::read(const Eigen::VectorXd& deviations, std::optional<std::uint64_t> sample,
                                    const RunPass& pass, const std::vector<std::size_t>& rows,
                                    const std::vector<Displacement>& displaced, double verified_share) const {
    const std::vector<double> numbers = model_.lines[pass.line].with(deviations);
    const std::vector<double> shared = model_.shared.with(deviations);
    const Misalignment misalignment = misalignment_of(numbers);
    const Head head = model_.head(*pass.head, shared, deviations);
    const HeadSetup setup = set_up(head, pass.frame, pass.first_point, pass.mirror, misalignment);
    std::vector<Pose> poses;
    for (const std::size_t row : rows) {
        Pose pose = model_.poses[row];
        pose.position += displaced[row].shift;
        if (!displaced[row].rotation.isZero(0.0)) pose.rotation = rotation_exp(displaced[row].rotation) * pose.rotation;
        poses.push_back(pose);
    }
    std::vector<SignalRow> signals =
        raw(pass, head, setup, misalignment, shared, poses, sample, rows.front(), verified_share);

    const std::size_t channels = model_.channels.size();
    Eigen::MatrixXd readings = Eigen::MatrixXd::Constant(Eigen::Index(rows.size()), Eigen::Index(channels),
                                                         std::numeric_limits<double>::quiet_NaN());
    for (std::size_t k = 0; k < rows.size(); ++k) {
        const RunRow& row = model_.rows[rows[k]];
        add_setup(signals[k], model_.channels, misalignment, row.elapsed);
        double model_error = 0.0;
        if (shared[shared_field::reading_model] != 0.0)
            if (const auto reading = define_reading(setup, poses[k].position, poses[k].rotation))
                model_error = shared[shared_field::reading_model] * reading->beam_length() * reading->tan2_phi();
        for (std::size_t c = 0; c < channels; ++c) {
            if (!signals[k][c]) continue;
            double value = *signals[k][c];
            if (is_distance(model_.channels[c]))
                value = (value + model_error) / (1.0 + shared[shared_field::wavelength]) +
                        numbers[setup::scale_factor] * row.travel +
                        (row.is_last_point ? numbers[setup::scale_length] : 0.0);
            readings(Eigen::Index(k), Eigen::Index(c)) = value;
        }
    }
    return readings;
}

Eigen::MatrixXd ScalarSampler::trace(const Eigen::VectorXd& deviations, std::optional<std::uint64_t> sample,
                                     const RunPass& pass, const std::vector<std::size_t>& rows) const {
    return read(deviations, sample, pass, rows, displacements(deviations, sample, rows.back() + 1), trace_all);
}

Eigen::VectorXd ScalarSampler::readings(const Eigen::VectorXd& deviations, std::optional<std::uint64_t> sample) const {
    const std::size_t channels = model_.channels.size();
    Eigen::VectorXd all(model_.rows.size() * channels);
    const std::vector<Displacement> displaced = displacements(deviations, sample, model_.rows.size());
    for (const RunPass& pass : model_.passes) {
        std::vector<std::size_t> rows(pass.rows);
        for (std::size_t k = 0; k < pass.rows; ++k) rows[k] = std::size_t(pass.planned.first_row) + k;
        const Eigen::MatrixXd read_here =
            read(deviations, sample, pass, rows, displaced, model_.run.simulation.verified_share);
        for (std::size_t k = 0; k < pass.rows; ++k)
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
