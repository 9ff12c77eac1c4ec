// The C interface: any file, chain and options; a reason that fits its buffer, or a compensator that answers.
#include "fuzzing.hpp"
#include "stepdiag/controller/compensator.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    fuzzing::FileAndChoices input(data, size);
    FuzzedDataProvider& bytes = input.choices;
    stepdiag_options options = stepdiag_default_options();
    const bool defaults = !bytes.ConsumeBool();
    if (!defaults) {
        options.accept_unverified = 1;  // no table of a fuzzer has its checksum
        options.outside = bytes.ConsumeIntegralInRange(-1, 4);
        options.approach = bytes.ConsumeIntegralInRange(-1, 4);
        options.margin = fuzzing::any_number(bytes);
        options.largest_correction = fuzzing::any_number(bytes);
        for (double& origin : options.origin) origin = fuzzing::any_number(bytes);
        for (double& temperature : options.temperatures) temperature = fuzzing::any_number(bytes);
    }
    const auto position = fuzzing::any_vector(bytes), tool = fuzzing::any_vector(bytes);
    const bool own_tool = bytes.ConsumeBool();
    const auto message_size = bytes.ConsumeIntegralInRange<std::size_t>(0, 100);
    const char* known = bytes.PickValueInArray({"[w X' b Y Z t]", "wX'bYZt", "[w b Z X Y t]", ""});
    const std::string chain = *known ? known : bytes.ConsumeRandomLengthString(30);
    const fuzzing::FileInMemory file(input.text);

    std::string message(message_size, '#');
    stepdiag_compensator* c = stepdiag_compensator_load(file.path().c_str(), chain.c_str(),
                                                        defaults ? nullptr : &options, message.data(), message_size);
    if (!c) {
        fuzzing::expect(message_size == 0 || message.find('\0') != std::string::npos, "a reason ends in its buffer");
        fuzzing::expect(message_size < 2 || message[0] != '\0', "a refusal has a reason");
        return 0;
    }
    double error[3], orientation[3], command[3], actual[3];
    const double* const tool_or_own = own_tool ? nullptr : tool.data();
    stepdiag_error(c, position.data(), tool_or_own, error, nullptr);
    const unsigned status = stepdiag_error(c, position.data(), tool_or_own, error, orientation);
    const unsigned commanded = stepdiag_command(c, position.data(), tool_or_own, command);
    stepdiag_forward(c, position.data(), tool_or_own, actual);
    double warm[3];
    const auto temperature = fuzzing::any_vector(bytes);
    const unsigned warmed = stepdiag_command_at_temperature(c, position.data(), tool_or_own, temperature.data(), warm);
    for (int i = 0; i < 3; ++i) {
        fuzzing::expect(std::isfinite(warm[i]) || (warmed & STEPDIAG_REFUSED), "a command with temperatures is finite");
        fuzzing::expect(std::isfinite(error[i]) || (status & STEPDIAG_REFUSED), "an error is finite");
        fuzzing::expect(std::isfinite(command[i]) || (commanded & STEPDIAG_REFUSED), "a command is finite");
    }
    stepdiag_compensator_free(c);
    return 0;
}
