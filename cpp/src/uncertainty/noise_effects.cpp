#include "uncertainty/noise_effects.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <variant>

#include "stepdiag/core/error.hpp"

namespace stepdiag {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double shift_step = 1e-3;     // mm
constexpr double rotation_step = 1e-5;  // rad; spots answer with 2 L = 2 m: what is left over is of third order, 1e-10

// The machine with a function of an axis that reads `step` more everywhere.
Machine displaced(const Machine& machine, FunctionId id, double step) {
    ParameterTable table = machine.errors().table();
    auto& function = table.functions[std::size_t(id.index())];
    if (!function) function = FunctionTable{{0.0}, {0.0}, {std::nullopt}};
    for (double& value : function->value) value += step;
    if (auto& negative = table.negative_functions[std::size_t(id.index())])
        for (double& value : negative->value) value += step;
    return Machine(machine.chain(), ErrorMap(std::move(table)), machine.tool());
}

std::vector<std::string> signals_of(const Measurement& measurement) {
    std::vector<std::string> names;
    for (const Channel& channel : measurement.channels())
        if (is_signal(channel.name)) names.push_back(channel.name);
    return names;
}

bool has_noise(const Head& head) {
    if (!head.design) return false;
    const auto is_noisy = [](const SpotSensor& sensor) {
        if (const auto* camera = std::get_if<Camera>(&sensor.device))
            return camera->shot_noise || camera->read_noise > 0.0;
        return std::get<LateralEffect>(sensor.device).noise > 0.0;
    };
    return std::any_of(head.design->sensors.begin(), head.design->sensors.end(), is_noisy);
}

VectorXd readings_of(const VirtualRun& run, const Machine& machine, std::uint64_t seed = 0) {
    SimulationOptions options = run.simulation;
    options.noise = {};
    options.noise.seed = seed;
    if (!options.seconds_per_reading) options.seconds_per_reading = run.seconds_per_reading;
    const Measurement measurement = simulate(machine, run.plan, run.heads, options);
    const auto channels = signals_of(measurement);
    VectorXd readings(Index(measurement.size() * channels.size()));
    for (std::size_t r = 0; r < measurement.size(); ++r)
        for (std::size_t c = 0; c < channels.size(); ++c) {
            const auto& value = measurement.find(channels[c])->value[r];
            if (!value)
                throw InvalidArgument("virtual run: expected readings at all poses, row " + std::to_string(r) +
                                      " is lost");
            readings[Index(r * channels.size() + c)] = *value;
        }
    return readings;
}

}  // namespace

VectorXd sensor_noise(const VirtualRun& run) {
    bool any = has_noise(run.heads.head);
    for (const auto& [line, head] : run.heads.by_line) any = any || has_noise(head);
    if (!any) return {};
    // Outputs sum up hundreds of readings, so that theirs is known to about a hundredth.
    constexpr int runs = 16;
    MatrixXd readings;
    for (int i = 0; i < runs; ++i) {
        const VectorXd one = readings_of(run, run.machine, std::uint64_t(i) + 1);
        if (i == 0) readings.resize(one.size(), runs);
        readings.col(i) = one;
    }
    const VectorXd mean = readings.rowwise().mean();
    return ((readings.colwise() - mean).rowwise().squaredNorm() / double(runs - 1)).cwiseSqrt();
}

Eigen::Matrix<double, Eigen::Dynamic, 6> pose_sensitivity(const VirtualRun& run, const Measurement& nominal) {
    const Chain& chain = run.machine.chain();
    const Axis first = chain.order().front(), last = chain.order().back();
    const auto difference = [&](FunctionId id, double step) -> VectorXd {
        return (readings_of(run, displaced(run.machine, id, step)) -
                readings_of(run, displaced(run.machine, id, -step))) /
               (2.0 * step);
    };
    Eigen::Matrix<double, Eigen::Dynamic, 6> sensitivity;
    for (int k = 0; k < 6; ++k) {
        const VectorXd column =
            k < 3 ? difference({first, Component(k)}, shift_step) : difference({last, Component(k)}, rotation_step);
        if (k == 0) sensitivity.resize(column.size(), 6);
        sensitivity.col(k) = column;
    }
    // A rotation of the last axis moves the functional point, too; that is taken off again.
    const Index channels = sensitivity.rows() / Index(nominal.size());
    Index row = 0;
    for (const Station& station : nominal.stations()) {
        const Eigen::Vector3d lever = angular_lever(chain, run.machine.tool(), last, station.commanded);
        for (int k = 0; k < 3; ++k) {
            const Eigen::Vector3d moved = Eigen::Vector3d::Unit(k).cross(lever);
            sensitivity.block(row, 3 + k, channels, 1) -= sensitivity.block(row, 0, channels, 3) * moved;
        }
        row += channels;
    }
    return sensitivity;
}

NoiseEffects::NoiseEffects(const VirtualCalibrations& calibrations, MatrixXd gain)
    : run_(calibrations.run()),
      nominal_(calibrations.nominal()),
      channels_(signals_of(calibrations.nominal())),
      gain_(std::move(gain)) {
    const auto moves = [](const ReadingNoise& noise) {
        return noise.quantity == NoiseQuantity::machine_walk || noise.quantity == NoiseQuantity::position ||
               noise.quantity == NoiseQuantity::orientation;
    };
    const auto& noise = run_.inputs.noise;
    if (std::any_of(noise.begin(), noise.end(), moves)) poses_ = pose_sensitivity(run_, nominal_);
}

MatrixXd NoiseEffects::of_distances() const {
    const Index rows = Index(nominal_.size()), channels = Index(channels_.size());
    MatrixXd effect = MatrixXd::Zero(gain_.rows(), rows);
    for (Index c = 0; c < channels; ++c)
        if (is_distance(channels_[std::size_t(c)]))
            for (Index r = 0; r < rows; ++r) effect.col(r) += gain_.col(r * channels + c);
    return effect;
}

MatrixXd NoiseEffects::of_poses(int column) const {
    const Index rows = Index(nominal_.size()), channels = Index(channels_.size());
    MatrixXd effect(gain_.rows(), rows);
    for (Index r = 0; r < rows; ++r)
        effect.col(r) = gain_.middleCols(r * channels, channels) * poses_.block(r * channels, column, channels, 1);
    return effect;
}

void NoiseEffects::sum_walks(MatrixXd& by_row, bool by_setup) const {
    std::vector<bool> starts(std::size_t(by_row.cols()));
    starts[0] = true;
    for (const PlannedPass& pass : planned_passes(run_.plan, run_.simulation.repeats, run_.simulation.backward))
        if (by_setup) starts[pass.setup_row] = true;
    // The step to a row acts on it and all that follow, up to where the walk begins anew.
    for (Index r = by_row.cols() - 2; r >= 0; --r)
        if (!starts[std::size_t(r) + 1]) by_row.col(r) += by_row.col(r + 1);
    for (Index r = 0; r < by_row.cols(); ++r)
        if (starts[std::size_t(r)]) by_row.col(r).setZero();
    by_row *= std::sqrt(run_.simulation.seconds_per_reading.value_or(run_.seconds_per_reading));
}

MatrixXd NoiseEffects::of(const ReadingNoise& noise) const {
    MatrixXd effect;
    switch (noise.quantity) {
        case NoiseQuantity::channel: {
            const auto found = std::find(channels_.begin(), channels_.end(), noise.channel);
            const Index channels = Index(channels_.size());
            return gain_(Eigen::all, Eigen::seqN(Index(found - channels_.begin()), Index(nominal_.size()), channels));
        }
        case NoiseQuantity::common: return of_distances();
        case NoiseQuantity::head_walk:
            effect = of_distances();
            sum_walks(effect, true);
            return effect;
        case NoiseQuantity::machine_walk:
            effect = of_poses(noise.component);
            sum_walks(effect, false);
            return effect;
        case NoiseQuantity::position: return of_poses(noise.component);
        case NoiseQuantity::orientation: return of_poses(3 + noise.component);
    }
    return effect;
}

std::string budget_group(const UncertainInput& input) {
    if (const auto* quantity = std::get_if<SetupQuantity>(&input.quantity))
        return is_adjusted(*quantity) ? name(*quantity) : "scale lines";
    switch (std::get<SharedQuantity>(input.quantity)) {
        case SharedQuantity::part_shift:
        case SharedQuantity::part_rotation: return "head part " + input.part;
        case SharedQuantity::temperature:
        case SharedQuantity::pressure:
        case SharedQuantity::humidity:
        case SharedQuantity::refractive_index: return "air";
        case SharedQuantity::expansion:
        case SharedQuantity::common_expansion: return "expansion of the scales";
        case SharedQuantity::scale_temperature:
        case SharedQuantity::common_scale_temperature: return "temperature of the scales";
        case SharedQuantity::scale_ramp:
        case SharedQuantity::common_scale_ramp: return "ramp of the scales' temperature";
        default: return name(input.quantity);
    }
}

std::string budget_group(const ReadingNoise& noise) {
    switch (noise.quantity) {
        case NoiseQuantity::channel: return "noise of " + noise.channel;
        case NoiseQuantity::common: return "common noise";
        case NoiseQuantity::head_walk: return "walk of the head";
        case NoiseQuantity::machine_walk: return "walk of the machine";
        case NoiseQuantity::position: return "repeatability of position";
        default: return "repeatability of orientation";
    }
}

}  // namespace stepdiag
