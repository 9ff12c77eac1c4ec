// The answer of examples/compensate.cpp, as the last of five in one call.
#include <cstdio>
#include <exception>
#include <stepdiag/controller/compensator.hpp>

int main(int count, char** arguments) try {
    const auto c = stepdiag::Compensator::load(count > 1 ? arguments[1] : "", "wX'bYZt");
    const double targets[15] = {0, 0, 0, 100, 100, 100, 200, 200, 200, 300, 300, 300, 700, 500, 400};
    double commands[15];
    if (c.commands(5, targets, nullptr, nullptr, commands, nullptr)) return 1;
    std::printf("%.4f %.4f %.4f\n", commands[12], commands[13], commands[14]);
} catch (const std::exception& error) {
    std::fprintf(stderr, "many: %s\n", error.what());
    return 2;
}
