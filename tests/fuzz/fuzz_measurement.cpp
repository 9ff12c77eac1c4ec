// A measurement: read or refused; what was read is written and read back the same.
#include "fuzzing.hpp"
#include "stepdiag/measurement/measurement.hpp"

using namespace stepdiag;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    std::string text;
    if (fuzzing::refused(
            [&] { text = format_measurement(parse_measurement(fuzzing::text_before_nul(data, size), "fuzz.csv")); }))
        return 0;
    fuzzing::expect(format_measurement(parse_measurement(text, "again.csv")) == text,
                    "a measurement that is written is read back the same");
    return 0;
}
