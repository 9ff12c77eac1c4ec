// A calibration with its leading lines, from a file: read or refused; what was read is written and read back the same.
#include "fuzzing.hpp"
#include "stepdiag/evaluation/calibration.hpp"

using namespace stepdiag;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const fuzzing::FileInMemory file(fuzzing::text_of(data, size));
    std::string text;
    if (fuzzing::refused([&] { text = format_parameter_table(to_parameter_table(read_calibration(file.path()))); }))
        return 0;
    const fuzzing::FileInMemory written(text);
    const std::string again = format_parameter_table(to_parameter_table(read_calibration(written.path())));
    // The values of the - direction are kept as a difference, and rounded in it: only their text may change.
    fuzzing::expect(again == text || text.find(",direction\n") != std::string::npos,
                    "a calibration that is written is read back the same");
    return 0;
}
