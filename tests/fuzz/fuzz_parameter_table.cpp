// An error map or calibration: read or refused; what was read is written and read back the same.
#include "fuzzing.hpp"
#include "stepdiag/machine/error_map.hpp"

using namespace stepdiag;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    ParameterTable table;
    if (fuzzing::refused([&] { table = parse_parameter_table(fuzzing::text_before_nul(data, size), "fuzz.csv"); }))
        return 0;
    const ErrorMap map(table);  // what the reader lets through is a map
    for (int i = 0; i < function_count; ++i)
        for (const double position : {0.0, -1e300, 1e300, 123.4})
            for (const Approach approach : {Approach::positive, Approach::negative})
                (void)map.function(FunctionId::at(i), position, approach);

    std::string text;
    if (fuzzing::refused([&] { text = format_parameter_table(table); })) return 0;  // a line break in a leading line
    const ParameterTable again = parse_parameter_table(text, "again.csv");
    fuzzing::expect(format_parameter_table(again) == text, "a table that is written is read back the same");
    return 0;
}
