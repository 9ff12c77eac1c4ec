#include <cstdio>
#include <cstring>
#include <stepdiag/core/error.hpp>
#include <stepdiag/plan/plan.hpp>
#include <stepdiag/version.hpp>

int main() {
    if (std::strcmp(stepdiag::version(), STEPDIAG_VERSION) != 0) {
        std::printf("headers %s, library %s\n", STEPDIAG_VERSION, stepdiag::version());
        return 1;
    }
    const auto diagonal = stepdiag::Line::parse("ppp");
    const stepdiag::Plan plan({800, 600, 500}, {diagonal}, 50);
    if (plan.points(diagonal).size() != 151) return 1;
    try {
        stepdiag::Plan({800, 600, 500}, {diagonal}, -1);
    } catch (const stepdiag::InvalidArgument& error) {  // the type survives the library's border
        std::printf("stepdiag %s: %s\n", stepdiag::version(), error.what());
        return 0;
    }
    return 1;
}
