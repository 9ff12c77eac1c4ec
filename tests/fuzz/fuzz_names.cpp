// The small languages: chain, order of the axes, line, parameter, decimal number. Read or refused, and read back.
#include "core/text_file.hpp"
#include "fuzzing.hpp"
#include "stepdiag/machine/chain.hpp"
#include "stepdiag/machine/parameter.hpp"
#include "stepdiag/plan/plan.hpp"

using namespace stepdiag;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const std::string_view text = fuzzing::text_before_nul(data, size);
    fuzzing::refused([&] {
        const Chain chain = Chain::parse(text);
        fuzzing::expect(Chain::parse(chain.name()) == chain, "a chain's name is the chain");
    });
    fuzzing::refused([&] {
        const Line line = Line::parse(text);
        fuzzing::expect(line.name() == text, "a line's name is the line");
    });
    fuzzing::refused([&] {
        const StepOrder order = parse_order(text);
        fuzzing::expect(order[0] != order[1] && order[1] != order[2] && order[2] != order[0],
                        "an order is a permutation");
    });
    if (const auto id = FunctionId::parse(text)) fuzzing::expect(id->name() == text, "a parameter's name");
    if (const auto squareness = parse_squareness(text))
        fuzzing::expect(name(*squareness) == text, "a squareness' name");
    for (const int shift : {0, -3, -6, 6})
        if (const auto number = parse_decimal(text, shift)) {
            fuzzing::expect(std::isfinite(*number), "a number is finite");
            const auto again = parse_decimal(format_decimal(*number, -shift), shift);
            fuzzing::expect(again && std::memcmp(&*again, &*number, sizeof(double)) == 0, "a number's bits are kept");
        }
    return 0;
}
