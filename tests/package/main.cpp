// Uses the dependencies that a static archive must link: Embree (optics) and libcsv and libmd (tables).
#include <cstdio>
#include <cstring>
#include <stepdiag/core/error.hpp>
#include <stepdiag/machine/parameter_table.hpp>
#include <stepdiag/optics/path.hpp>
#include <stepdiag/version.hpp>

namespace {

bool check(bool holds, const char* claim) {
    std::printf("%s: %s\n", holds ? "ok" : "FAILED", claim);
    return holds;
}

bool the_type_of_an_exception_survives_the_border_of_the_library() {
    try {
        stepdiag::parse_parameter_table("no,such,columns\n", "table.csv");
    } catch (const stepdiag::InvalidArgument&) {
        return true;
    }
    return false;
}

}  // namespace

int main() {
    using namespace stepdiag;
    const Scene scene({make_rectangle({0, 0, 500}, Eigen::Matrix3d::Identity(), {100, 100}, Surface::absorbing)});
    const Path path = trace(scene, {}, {{0, 0, 0}, {0, 0, 1}});

    bool good = check(std::strcmp(version(), STEPDIAG_VERSION) == 0, "headers and library are of one version");
    good &= check(path.end == PathEnd::absorbed && path.optical_length == 500.0, "a ray meets a face");
    good &= check(the_type_of_an_exception_survives_the_border_of_the_library(), "a bad table throws InvalidArgument");
    return good ? 0 : 1;
}
