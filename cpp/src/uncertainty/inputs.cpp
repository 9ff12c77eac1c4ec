#include "stepdiag/uncertainty/inputs.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <set>

#include "stepdiag/core/error.hpp"

namespace stepdiag {
namespace {

using Of = UncertainQuantity::Of;

// Order of SharedQuantity.
constexpr std::array<UncertainQuantity, 17> shared_quantities = {{
    {"part_shift", "shift_um", "shift", Of::part, "xyz"},
    {"part_rotation", "rotation_urad", "rotation", Of::part, "xyz"},
    {"psd_distance", "psd_distance_mm", "PSD distance", Of::head, "", HeadLayout::psd},
    {"beam_offset", "beam_offsets_um", "beam offset", Of::head, "uv", HeadLayout::multi_beam, true},
    {"reading_model", "reading_model", "reading model", Of::head},
    {"temperature", "temperature_c", "temperature", Of::air},
    {"pressure", "pressure_hpa", "pressure", Of::air},
    {"humidity", "humidity_percent", "humidity", Of::air},
    {"refractive_index", "refractive_index_ppm", "refractive index", Of::air},
    {"wavelength", "wavelength_ppm", "wavelength", Of::air},
    {"machine_drift", "machine_drift_um_per_h", "machine drift", Of::machine, "xyz"},
    {"expansion", "expansion_um_per_m_k", "expansion coefficient", Of::scale, "xyz"},
    {"common_expansion", "", "expansion coefficient", Of::scale},
    {"scale_temperature", "scale_temperature_c", "temperature of the scale", Of::scale, "xyz"},
    {"common_scale_temperature", "", "temperature of the scales", Of::scale},
    {"scale_ramp", "scale_temperature_c_per_h", "ramp of the scale's temperature", Of::scale, "xyz"},
    {"common_scale_ramp", "", "ramp of the scales' temperature", Of::scale},
}};
static_assert(shared_quantities.size() == std::size_t(SharedQuantity::common_scale_ramp) + 1);

// Order of NoiseQuantity.
constexpr std::array<UncertainQuantity, 6> noise_quantities = {{
    {"channel", "", "noise", Of::noise},
    {"common", "common_um", "common noise", Of::noise},
    {"head_walk", "head_walk_um_per_sqrt_h", "head walk", Of::noise},
    {"machine_walk", "machine_walk_um_per_sqrt_h", "machine walk", Of::noise, "xyz"},
    {"position", "repeatability_um", "position", Of::noise, "xyz"},
    {"orientation", "repeatability_urad", "orientation", Of::noise, "xyz"},
}};
static_assert(noise_quantities.size() == std::size_t(NoiseQuantity::orientation) + 1);

// " x", " d1", " v of d2"
std::string component_text(const UncertainQuantity& quantity, int component) {
    const int letters = int(quantity.components.size());
    if (component < 0 || (!quantity.of_beams && component >= quantity.count(0))) return " " + std::to_string(component);
    std::string text;
    if (letters > 0) text += {' ', quantity.components[std::size_t(component % letters)]};
    if (quantity.of_beams)
        text += (letters > 0 ? " of d" : " d") + std::to_string(component / std::max(1, letters) + 1);
    return text;
}

template <class Kinds>
std::size_t parse(const Kinds& kinds, std::size_t count, const char* what, const std::string& name) {
    std::string known;
    for (std::size_t i = 0; i < count; ++i) {
        if (name == kinds[i].name) return i;
        known += (i ? ", \"" : "\"") + std::string(kinds[i].name) + "\"";
    }
    throw InvalidArgument(std::string(what) + ": expected one of " + known + ", got \"" + name + "\"");
}

void check_component(const UncertainQuantity& quantity, int component) {
    const bool any = quantity.of_beams;
    const int last = any ? std::numeric_limits<int>::max() : quantity.count(0) - 1;
    if (component >= 0 && component <= last) return;
    throw InvalidArgument(std::string(quantity.text) + ", component: expected " +
                          (any ? "0 or more" : "0 to " + std::to_string(last)) + ", got " + std::to_string(component));
}

void check_place(const std::string& name, const char* what, bool wanted, const std::string& got) {
    if (wanted && got.empty()) throw InvalidArgument(name + ": expected the name of its " + what + ", got none");
    if (!wanted && !got.empty()) throw InvalidArgument(name + ": has no " + what + ", got \"" + got + "\"");
}

void check_input(const UncertainInput& input) {
    const UncertainQuantity& quantity = record(input.quantity);
    check_place(std::string(quantity.text), "line", quantity.of == Of::line, input.line);
    check_place(std::string(quantity.text), "part", quantity.of == Of::part, input.part);
    check_component(quantity, input.component);
    check(input.distribution, name(input));
}

void check_noise(const ReadingNoise& noise) {
    const UncertainQuantity& quantity = record(noise.quantity);
    check_place(std::string(quantity.text), "channel", noise.quantity == NoiseQuantity::channel, noise.channel);
    check_component(quantity, noise.component);
    check(noise.distribution, name(noise));
    const bool walks = noise.quantity == NoiseQuantity::head_walk || noise.quantity == NoiseQuantity::machine_walk;
    if (walks && noise.distribution.kind != DistributionKind::normal)
        throw InvalidArgument(name(noise) + ": expected a normal distribution, got " + name(noise.distribution.kind));
}

void check_members(const UncertainInputs& inputs, const CorrelatedInputs& correlated, std::set<int>& taken) {
    const int count = int(inputs.inputs.size());
    for (const int member : correlated.members) {
        if (member < 0 || member >= count)
            throw InvalidArgument("correlation: expected indices of inputs, 0 to " + std::to_string(count - 1) +
                                  ", got " + std::to_string(member));
        const UncertainInput& input = inputs.inputs[std::size_t(member)];
        if (input.distribution.kind != DistributionKind::normal)
            throw InvalidArgument("correlation: \"" + name(input) + "\" is not normal but " +
                                  name(input.distribution.kind));
        if (!taken.insert(member).second)
            throw InvalidArgument("correlation: \"" + name(input) + "\" is correlated twice");
    }
    if (correlated.correlation.rows() != Eigen::Index(correlated.members.size()))
        throw InvalidArgument("correlation: expected a row for each of " + std::to_string(correlated.members.size()) +
                              " inputs, got " + std::to_string(correlated.correlation.rows()));
}

}  // namespace

int UncertainQuantity::count(int beams) const { return std::max(1, int(components.size())) * (of_beams ? beams : 1); }

const std::vector<UncertainQuantity>& uncertain_quantities() {
    static const std::vector<UncertainQuantity> all = [] {
        std::vector<UncertainQuantity> list;
        for (const SetupQuantityRecord& r : setup_quantities)
            list.push_back({r.name, r.key, r.text, Of::line, r.components, r.layout, r.of_beams});
        list.insert(list.end(), shared_quantities.begin(), shared_quantities.end());
        list.insert(list.end(), noise_quantities.begin(), noise_quantities.end());
        return list;
    }();
    return all;
}

const UncertainQuantity& record(InputQuantity quantity) {
    if (const auto* setup = std::get_if<SetupQuantity>(&quantity)) return uncertain_quantities()[std::size_t(*setup)];
    return shared_quantities[std::size_t(std::get<SharedQuantity>(quantity))];
}
const UncertainQuantity& record(NoiseQuantity quantity) { return noise_quantities[std::size_t(quantity)]; }

std::string name(InputQuantity quantity) { return std::string(record(quantity).name); }
std::string name(NoiseQuantity quantity) { return std::string(record(quantity).name); }

InputQuantity parse_input_quantity(const std::string& name) {
    const std::size_t count = setup_quantities.size() + shared_quantities.size();
    const std::size_t found = parse(uncertain_quantities(), count, "quantity", name);
    if (found < setup_quantities.size()) return SetupQuantity(found);
    return SharedQuantity(found - setup_quantities.size());
}
NoiseQuantity parse_noise_quantity(const std::string& name) {
    return NoiseQuantity(parse(noise_quantities, noise_quantities.size(), "noise", name));
}

std::string name(const UncertainInput& input) {
    const UncertainQuantity& quantity = record(input.quantity);
    const std::string text = std::string(quantity.text) + component_text(quantity, input.component);
    const std::string& place = quantity.of == Of::part ? input.part : input.line;
    return place.empty() ? text : text + " of " + place;
}

std::string name(const ReadingNoise& noise) {
    const UncertainQuantity& quantity = record(noise.quantity);
    if (noise.quantity == NoiseQuantity::channel) return std::string(quantity.text) + " of " + noise.channel;
    return std::string(quantity.text) + component_text(quantity, noise.component);
}

void check(const UncertainInputs& inputs) {
    std::set<std::string> names;
    const auto once = [&](const std::string& name) {
        if (!names.insert(name).second) throw InvalidArgument("\"" + name + "\" is given twice");
    };
    for (const UncertainInput& input : inputs.inputs) {
        check_input(input);
        once(name(input));
    }
    for (const ReadingNoise& noise : inputs.noise) {
        check_noise(noise);
        once(name(noise));
    }
    std::set<int> taken;
    for (const CorrelatedInputs& correlated : inputs.correlations) {
        check_members(inputs, correlated, taken);
        correlation_factor(correlated.correlation, "correlation");
    }
}

}  // namespace stepdiag
