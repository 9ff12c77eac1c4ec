// Adjusts a measured run and prints the machine's error at the far corner: what a controller would correct there.
#include <cstdio>
#include <stepdiag/diagnosis/adjust.hpp>
#include <stepdiag/core/error.hpp>
#include <stepdiag/core/units.hpp>
#include <stepdiag/machine/machine.hpp>

int main(int count, char** arguments) try {
    using namespace stepdiag;
    if (count != 2) throw InvalidArgument("usage: calibrate RUN.csv (ppp npp pnp nnp in 20 steps, 800 x 600 x 500 mm)");
    const Eigen::Vector3d volume(800, 600, 500), tool(0, 0, 0);
    const Chain chain = Chain::parse("[w X' b Y Z t]");
    const Plan plan(volume, {Line::parse("ppp"), Line::parse("npp"), Line::parse("pnp"), Line::parse("nnp")}, 20,
                    all_axes, {Line::parse("p00"), Line::parse("0p0"), Line::parse("00p")});

    const Adjustment found = adjust(read_measurement(arguments[1]), plan, chain, tool, {});
    const Machine machine(chain, ErrorMap(to_parameter_table(found.calibration)), tool);
    const Eigen::Vector3d error = machine.error(volume) / micrometre;
    std::printf("error at the far corner: %.3f %.3f %.3f um\n", error.x(), error.y(), error.z());
} catch (const stepdiag::InvalidArgument& error) {
    std::fprintf(stderr, "calibrate: %s\n", error.what());
    return 2;
}
