#include "stepdiag/uncertainty/inputs.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <set>

#include "stepdiag/core/error.hpp"

namespace stepdiag {
namespace {

enum class Of { line, part, head, air, machine };

struct InputKind {
    const char* name;  // of the quantity
    const char* text;  // what reports call it
    Of of;
    const char* components;  // a letter each; "" for one without
};

// Order of InputQuantity. Beams are counted, not lettered.
constexpr std::array<InputKind, 22> input_kinds = {{
    {"reflector", "reflector", Of::line, "ab"},
    {"laser", "laser", Of::line, "ab"},
    {"psd_zero", "PSD zero", Of::line, "xy"},
    {"distance_constant", "distance constant", Of::line, ""},
    {"beam_constant", "beam constant", Of::line, "d"},
    {"lateral", "lateral", Of::line, "xy"},
    {"roll", "roll", Of::line, ""},
    {"gain", "gain", Of::line, ""},
    {"drift", "drift", Of::line, ""},
    {"scale_length", "scale length", Of::line, ""},
    {"scale_factor", "scale factor", Of::line, ""},
    {"part_shift", "shift", Of::part, "xyz"},
    {"part_rotation", "rotation", Of::part, "xyz"},
    {"psd_distance", "PSD distance", Of::head, ""},
    {"beam_offset", "beam offset", Of::head, "uv"},
    {"reading_model", "reading model", Of::head, ""},
    {"temperature", "temperature", Of::air, ""},
    {"pressure", "pressure", Of::air, ""},
    {"humidity", "humidity", Of::air, ""},
    {"refractive_index", "refractive index", Of::air, ""},
    {"wavelength", "wavelength", Of::air, ""},
    {"machine_drift", "machine drift", Of::machine, "xyz"},
}};
static_assert(input_kinds.size() == std::size_t(InputQuantity::machine_drift) + 1);

struct NoiseKind {
    const char* name;
    const char* text;
    const char* components;
};

// Order of NoiseQuantity.
constexpr std::array<NoiseKind, 6> noise_kinds = {{
    {"channel", "noise", ""},
    {"common", "common noise", ""},
    {"head_walk", "head walk", ""},
    {"machine_walk", "machine walk", "xyz"},
    {"position", "position", "xyz"},
    {"orientation", "orientation", "xyz"},
}};
static_assert(noise_kinds.size() == std::size_t(NoiseQuantity::orientation) + 1);

const InputKind& kind_of(InputQuantity quantity) { return input_kinds[std::size_t(quantity)]; }
const NoiseKind& kind_of(NoiseQuantity quantity) { return noise_kinds[std::size_t(quantity)]; }

// Beams have any number of components: 0, 1, ... for their constants, two a beam for their offsets.
bool counts_beams(InputQuantity quantity) {
    return quantity == InputQuantity::beam_constant || quantity == InputQuantity::beam_offset;
}

std::string component_text(const std::string& components, int component) {
    return component >= 0 && component < int(components.size()) ? " " + components.substr(std::size_t(component), 1)
           : component == 0                                     ? ""
                                                                : " " + std::to_string(component);
}

template <class Kinds>
std::size_t parse(const Kinds& kinds, const char* what, const std::string& name) {
    std::string known;
    for (std::size_t i = 0; i < kinds.size(); ++i) {
        if (name == kinds[i].name) return i;
        known += std::string(i ? ", \"" : "\"") + kinds[i].name + "\"";
    }
    throw InvalidArgument(std::string(what) + ": expected one of " + known + ", got \"" + name + "\"");
}

void check_component(const std::string& name, const std::string& components, int component, bool any) {
    const int last = any ? std::numeric_limits<int>::max() : std::max(0, int(components.size()) - 1);
    if (component >= 0 && component <= last) return;
    throw InvalidArgument(name + ", component: expected " + (any ? "0 or more" : "0 to " + std::to_string(last)) +
                          ", got " + std::to_string(component));
}

void check_place(const std::string& name, const char* what, bool wanted, const std::string& got) {
    if (wanted && got.empty()) throw InvalidArgument(name + ": expected the name of its " + what + ", got none");
    if (!wanted && !got.empty()) throw InvalidArgument(name + ": has no " + what + ", got \"" + got + "\"");
}

void check_input(const UncertainInput& input) {
    const InputKind& kind = kind_of(input.quantity);
    check_place(kind.text, "line", kind.of == Of::line, input.line);
    check_place(kind.text, "part", kind.of == Of::part, input.part);
    check_component(kind.text, kind.components, input.component, counts_beams(input.quantity));
    check(input.distribution, name(input));
}

void check_noise(const ReadingNoise& noise) {
    const NoiseKind& kind = kind_of(noise.quantity);
    check_place(kind.text, "channel", noise.quantity == NoiseQuantity::channel, noise.channel);
    check_component(kind.text, kind.components, noise.component, false);
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

std::string name(InputQuantity quantity) { return kind_of(quantity).name; }
std::string name(NoiseQuantity quantity) { return kind_of(quantity).name; }

InputQuantity parse_input_quantity(const std::string& name) {
    return InputQuantity(parse(input_kinds, "quantity", name));
}
NoiseQuantity parse_noise_quantity(const std::string& name) { return NoiseQuantity(parse(noise_kinds, "noise", name)); }

std::string name(const UncertainInput& input) {
    const InputKind& kind = kind_of(input.quantity);
    std::string text = kind.text;
    if (input.quantity == InputQuantity::beam_constant) text += " d" + std::to_string(input.component + 1);
    else if (input.quantity == InputQuantity::beam_offset)
        text += std::string(input.component % 2 ? " v" : " u") + " of d" + std::to_string(input.component / 2 + 1);
    else text += component_text(kind.components, input.component);
    const std::string& place = kind.of == Of::part ? input.part : input.line;
    return place.empty() ? text : text + " of " + place;
}

std::string name(const ReadingNoise& noise) {
    const NoiseKind& kind = kind_of(noise.quantity);
    if (noise.quantity == NoiseQuantity::channel) return std::string(kind.text) + " of " + noise.channel;
    return kind.text + component_text(kind.components, noise.component);
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
