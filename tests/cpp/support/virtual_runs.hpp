// Runs of a small plan with each kind of head, for tests of virtual calibrations.
#pragma once

#include <string>
#include <vector>

#include "stepdiag/uncertainty/virtual_calibration.hpp"
#include "support/head_designs.hpp"
#include "support/usual.hpp"

namespace stepdiag::test {

enum class Kind { ideal, psd, psd_traced, multi_beam, multi_beam_traced };
inline const std::vector<Kind> all_kinds = {Kind::ideal, Kind::psd, Kind::psd_traced, Kind::multi_beam,
                                            Kind::multi_beam_traced};

inline Head head_of(Kind kind) {
    Head head;
    switch (kind) {
        case Kind::ideal: break;
        case Kind::psd:
            head.layout = HeadLayout::psd;
            head.psd_distance = 50.0;
            break;
        case Kind::psd_traced: return make_head(beam_and_psd(), 100.0);
        case Kind::multi_beam:
            head.layout = HeadLayout::multi_beam;
            head.beam_offsets = {{0.0, 0.0}, {20.0, 0.0}, {0.0, 20.0}};
            break;
        case Kind::multi_beam_traced: return make_head(three_beams(), 100.0);
    }
    return head;
}

inline VirtualRun run_of(Kind kind, int steps = 3) {
    RandomErrorMap errors;
    errors.seed = 4;
    const Heads heads(head_of(kind));
    return {Machine(chain, make_random_error_map(volume, errors), {5.0, -3.0, 70.0}),
            plan(steps),
            heads,
            heads.calibration(),
            {},
            {},
            2.0};
}

inline UncertainInput normal(InputQuantity quantity, double spread, const std::string& line = "",
                             const std::string& part = "", int component = 0) {
    return {quantity, {DistributionKind::normal, 0.0, spread}, line, part, component};
}

// All quantities of a set-up for this kind of head, on different lines.
inline std::vector<UncertainInput> setup_inputs(Kind kind) {
    std::vector<UncertainInput> inputs;
    const auto pair = [&](InputQuantity quantity, double spread, const char* line) {
        for (int k = 0; k < 2; ++k) inputs.push_back(normal(quantity, spread, line, "", k));
    };
    for (const char* line : {"ppp", "npp", "nnp"}) {
        pair(InputQuantity::reflector, 200e-6, line);
        pair(InputQuantity::laser, 150e-6, line);
    }
    pair(InputQuantity::lateral, 0.2, "npp");
    inputs.push_back(normal(InputQuantity::roll, 2e-3, "npp"));
    inputs.push_back(normal(InputQuantity::distance_constant, 0.01, "pnp"));
    inputs.push_back(normal(InputQuantity::drift, 1e-6, "ppp"));
    inputs.push_back(normal(InputQuantity::drift, 1e-6, "0p0"));
    if (kind != Kind::multi_beam_traced) inputs.push_back(normal(InputQuantity::gain, 0.01, "nnp"));
    if (kind == Kind::psd || kind == Kind::psd_traced) pair(InputQuantity::psd_zero, 0.01, "pnp");
    if (kind == Kind::multi_beam || kind == Kind::multi_beam_traced)
        for (int beam = 0; beam < 3; ++beam)
            inputs.push_back(normal(InputQuantity::beam_constant, 1e-4, "pnp", "", beam));
    return inputs;
}

// All uncertain quantities for this kind of head, including those of the air.
inline UncertainInputs everything(Kind kind) {
    UncertainInputs all{setup_inputs(kind)};
    const auto add_all = [&](InputQuantity quantity, double spread, int components, const std::string& part = "") {
        for (int k = 0; k < components; ++k) all.inputs.push_back(normal(quantity, spread, "", part, k));
    };
    for (const char* line : {"p00", "0p0"}) {
        all.inputs.push_back(normal(InputQuantity::scale_length, 1e-3, line));
        all.inputs.push_back(normal(InputQuantity::scale_factor, 1e-6, line));
    }
    add_all(InputQuantity::reading_model, 1.5, 1);
    add_all(InputQuantity::temperature, 0.5, 1);
    add_all(InputQuantity::pressure, 100.0, 1);
    add_all(InputQuantity::humidity, 0.05, 1);
    add_all(InputQuantity::refractive_index, 1e-7, 1);
    add_all(InputQuantity::wavelength, 1e-7, 1);
    add_all(InputQuantity::machine_drift, 1e-6, 3);
    if (kind == Kind::psd) add_all(InputQuantity::psd_distance, 0.5, 1);
    if (kind == Kind::multi_beam) add_all(InputQuantity::beam_offset, 0.05, 6);
    const HeadDesign design = kind == Kind::psd_traced ? beam_and_psd() : three_beams();
    if (kind == Kind::psd_traced || kind == Kind::multi_beam_traced) {
        for (const auto& body : design.bodies) {
            add_all(InputQuantity::part_shift, 0.05, 3, body.name);
            add_all(InputQuantity::part_rotation, 1e-4, 3, body.name);
        }
        add_all(InputQuantity::part_shift, 0.05, 3, design.beams.back().name);
        add_all(InputQuantity::part_rotation, 1e-4, 3, design.beams.back().name);
        if (kind == Kind::psd_traced) add_all(InputQuantity::part_shift, 0.05, 3, "psd");
        if (kind == Kind::psd_traced) add_all(InputQuantity::part_rotation, 1e-3, 3, "psd");
    }
    for (const std::string& channel : signal_names(head_of(kind))) {
        const bool tilt = channel == "alpha" || channel == "beta";
        all.noise.push_back({NoiseQuantity::channel, {DistributionKind::normal, 0.0, tilt ? 1e-6 : 1e-4}, channel});
    }
    all.noise[0].distribution.kind = DistributionKind::rectangular;
    all.noise.push_back({NoiseQuantity::common, {DistributionKind::normal, 1e-5, 1e-4}});
    all.noise.push_back({NoiseQuantity::head_walk, {DistributionKind::normal, 0.0, 1e-5}});
    for (int k = 0; k < 3; ++k) {
        all.noise.push_back({NoiseQuantity::machine_walk, {DistributionKind::normal, 0.0, 1e-5}, "", k});
        all.noise.push_back({NoiseQuantity::position, {DistributionKind::triangular, 0.0, 1e-4}, "", k});
        all.noise.push_back({NoiseQuantity::orientation, {DistributionKind::normal, 0.0, 1e-6}, "", k});
    }
    return all;
}

inline Eigen::VectorXd readings_of(const Measurement& run) {
    std::vector<const Channel*> channels;
    for (const Channel& channel : run.channels())
        if (channel.name != "time") channels.push_back(&channel);
    Eigen::VectorXd readings(run.size() * channels.size());
    for (std::size_t r = 0; r < run.size(); ++r)
        for (std::size_t c = 0; c < channels.size(); ++c)
            readings[Eigen::Index(r * channels.size() + c)] = channels[c]->value[r].value();
    return readings;
}

// Values of a calibration in the order of its entries.
inline Eigen::VectorXd values_of(const Calibration& calibration) {
    std::vector<double> values;
    for (const auto& function : calibration.functions)
        if (function) values.insert(values.end(), function->value.begin(), function->value.end());
    for (const auto& squareness : calibration.squarenesses)
        if (squareness) values.push_back(squareness->value);
    return Eigen::Map<const Eigen::VectorXd>(values.data(), Eigen::Index(values.size()));
}

}  // namespace stepdiag::test
