// Loads a calibration and prints where the axes must stand for the tool to be at a point.
// compensate CALIBRATION.csv
#include <cstdio>
#include <exception>
#include <stepdiag/controller/compensator.hpp>

int main(int count, char** arguments) try {
    const auto c = stepdiag::Compensator::load(count > 1 ? arguments[1] : "", "wX'bYZt");
    const auto [command, status] = c.command({700.0, 500.0, 400.0}, c.tool());
    if (status & stepdiag::compensation_refused) return 1;
    std::printf("%.4f %.4f %.4f\n", command[0], command[1], command[2]);
} catch (const std::exception& error) {
    std::fprintf(stderr, "compensate: %s\n", error.what());
    return 2;
}
