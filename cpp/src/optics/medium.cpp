#include "stepdiag/optics/medium.hpp"

#include <algorithm>
#include <cmath>

#include "stepdiag/core/air.hpp"
#include "stepdiag/core/error.hpp"

namespace stepdiag {

const std::vector<Glass>& glasses() {
    static const std::vector<Glass> list = {
        {"N-BK7", {1.03961212, 0.231792344, 1.01046945}, {0.00600069867, 0.0200179144, 103.560653}},
        {"K7", {1.1273555, 0.124412303, 0.827100531}, {0.00720341707, 0.0269835916, 100.384588}},
        {"N-SK4", {1.32993741, 0.228542996, 0.988465211}, {0.00716874107, 0.0246455892, 100.886364}},
        {"F2", {1.34533359, 0.209073176, 0.937357162}, {0.00997743871, 0.0470450767, 111.886764}},
        {"N-SF11", {1.73759695, 0.313747346, 1.89878101}, {0.013188707, 0.0623068142, 155.23629}},
        {"fused silica",
         {0.6961663, 0.4079426, 0.8974794},
         {0.0684043 * 0.0684043, 0.1162414 * 0.1162414, 9.896161 * 9.896161}},
    };
    return list;
}

const Glass& find_glass(std::string_view name) {
    std::string known;
    for (const Glass& glass : glasses()) {
        if (glass.name == name) return glass;
        known += (known.empty() ? "" : ", ") + glass.name;
    }
    throw InvalidArgument("glass: expected one of " + known + ", got \"" + std::string(name) + "\"");
}

double refractive_index(const Glass& glass, double wavelength) {
    constexpr double lowest = 334.0, highest = 2325.0;
    if (!(wavelength >= lowest && wavelength <= highest))
        throw InvalidArgument(glass.name + ", wavelength in nm: expected " + std::to_string(lowest) + " to " +
                              std::to_string(highest) + ", got " + std::to_string(wavelength));
    // The catalogue states no humidity.
    const Air of_catalogue{20.0, 101325.0, 0.0, 450.0};
    constexpr double longest_in_air = 1700.0;  // its index is smaller by 2e-7 where glasses end
    const double air = refractive_index(of_catalogue, std::min(wavelength, longest_in_air));
    const double L = 1e-6 * std::pow(wavelength / air, 2);
    double n2 = 1.0;
    for (int i = 0; i < 3; ++i) n2 += glass.B[i] * L / (L - glass.C[i]);
    return air * std::sqrt(n2);
}

}  // namespace stepdiag
