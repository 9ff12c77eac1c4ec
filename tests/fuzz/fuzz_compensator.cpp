// A table, a chain and options from the bytes: refused, or a compensator that keeps its word at positions of all kinds.
#include <algorithm>
#include <optional>

#include "fuzzing.hpp"
#include "stepdiag/controller/compensator.hpp"
#include "stepdiag/machine/parameter_table.hpp"

using namespace stepdiag;

namespace {

CompensatorOptions any_options(FuzzedDataProvider& bytes) {
    CompensatorOptions options;
    options.accept_unverified = true;  // no table of a fuzzer has its checksum
    if (!bytes.ConsumeBool()) return options;
    options.outside = Outside(bytes.ConsumeIntegralInRange(0, 3));  // 3 is none
    options.approach = CompensatedApproach(bytes.ConsumeIntegralInRange(0, 3));
    options.margin = fuzzing::any_number(bytes);
    options.largest_correction = fuzzing::any_number(bytes);
    options.origin = fuzzing::any_vector(bytes);
    if (bytes.ConsumeBool()) options.temperatures = {fuzzing::any_number(bytes), fuzzing::any_number(bytes)};
    return options;
}

// Mostly inside the volume or near it, sometimes anything.
std::array<double, 3> any_position(FuzzedDataProvider& bytes, const Compensator& compensator,
                                   const std::array<double, 3>& origin) {
    if (bytes.ConsumeIntegralInRange(0, 3) == 0) return fuzzing::any_vector(bytes);
    std::array<double, 3> position;
    for (int i = 0; i < 3; ++i)
        position[i] = origin[i] + compensator.volume()[i] * bytes.ConsumeIntegralInRange(-10, 110) / 100.0;
    return position;
}

double largest(const std::array<double, 3>& v) { return std::max({std::abs(v[0]), std::abs(v[1]), std::abs(v[2])}); }

void check_position(const Compensator& c, const CompensatorOptions& options, const std::array<double, 3>& position,
                    const std::array<double, 3>& tool) {
    using fuzzing::expect;
    const MachineError error = c.error(position, tool);
    const CompensatedPosition forward = c.forward(position, tool), command = c.command(position, tool);
    const CompensatedPosition back = c.forward(command.position, tool);

    expect(fuzzing::is_finite(error.position) || (error.status & compensation_refused), "an error is finite");
    expect(fuzzing::is_finite(error.orientation) || (error.status & compensation_refused), "an orientation is finite");
    for (const auto& result : {forward, command}) {
        if (result.status & compensation_refused)
            expect(fuzzing::same_bits(result.position, position), "a refusal gives the position asked for");
        else expect(fuzzing::is_finite(result.position), "an answer is finite");
    }
    if (!((command.status | back.status) & (compensation_refused | compensation_capped)))
        expect(std::hypot(back.position[0] - position[0], back.position[1] - position[1],
                          back.position[2] - position[2]) <= c.inverse_bound(),
               "forward of command is within the bound");
    if (!(command.status & compensation_refused)) {
        const double length = std::hypot(command.position[0] - position[0], command.position[1] - position[1],
                                         command.position[2] - position[2]);
        expect(length <= options.largest_correction + c.inverse_bound() + 4e-16 * largest(position),
               "a correction is no longer than the largest");
    }
    expect(fuzzing::same_bits(c.command(position, tool).position, command.position), "a command is reproducible");

    const std::array<double, 3> warm =
        options.temperatures[0] < options.temperatures[1]
            ? std::array<double, 3>{options.temperatures[0], options.temperatures[1], options.temperatures[0]}
            : position;
    const CompensatedPosition there = c.command(position, tool, warm);
    const CompensatedPosition from = c.forward(there.position, tool, warm);
    if (!((there.status | from.status) & (compensation_refused | compensation_capped)))
        expect(std::hypot(from.position[0] - position[0], from.position[1] - position[1],
                          from.position[2] - position[2]) <= c.inverse_bound(),
               "forward of command is within the bound with temperatures");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    fuzzing::FileAndChoices input(data, size);
    FuzzedDataProvider& choices = input.choices;
    const CompensatorOptions options = any_options(choices);
    const char* chain =
        choices.PickValueInArray({"[w X' b Y Z t]", "[w b Z X Y t]", "[w Z' X' b Y t]", "[w Y' b X Z t]"});

    ParameterTable table;
    std::optional<Compensator> compensator;
    if (fuzzing::refused([&] {
            table = parse_parameter_table(input.text, "fuzz.csv");
            compensator.emplace(table, "fuzz.csv", chain, options);
        }))
        return 0;
    fuzzing::expect(std::isfinite(compensator->inverse_bound()) && compensator->inverse_bound() >= 0.0,
                    "a bound is one");
    fuzzing::expect(compensator->fingerprint() == Compensator(table, "again", chain, options).fingerprint(),
                    "a fingerprint is reproducible");
    do {
        const auto tool = choices.ConsumeBool() ? fuzzing::any_vector(choices) : compensator->tool();
        check_position(*compensator, options, any_position(choices, *compensator, options.origin), tool);
    } while (choices.remaining_bytes() > 0);
    return 0;
}
