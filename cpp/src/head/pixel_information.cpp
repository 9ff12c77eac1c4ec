#include "head/pixel_information.hpp"

#include <algorithm>
#include <cmath>

#include "stepdiag/core/units.hpp"

namespace stepdiag {
namespace {

constexpr double lowest = 1e-4, highest = 100.0;  // electrons; above, I (m + v) is 1 within about 1e-4
constexpr int per_decade = 16;
constexpr int entries = 6 * per_decade + 1;
constexpr double countable = 0.01;  // variance: with a noise of 0.1 electrons, their number is known exactly
constexpr double least = 1e-9;      // variance: keeps the information of a dark pixel finite

// Trapezoidal rule for the integral. Its error is below 1e-6 with ten steps per standard deviation.
double integrate(double mean, double variance) {
    constexpr double reach = 8.0;  // standard deviations
    const double sigma = std::sqrt(variance), step = sigma / 10.0;
    const double end = std::ceil(mean + 10.0 * std::sqrt(mean) + 20.0 + reach * sigma);
    std::vector<double> poisson{std::exp(-mean)};  // one more than the end, for the slope
    for (double k = 1.0; k <= end + 1.0; ++k) poisson.push_back(poisson.back() * mean / k);

    double sum = 0.0;
    for (double z = -reach * sigma; z < end; z += step) {
        const auto gaussian = [&](double k) { return std::exp(-(z - k) * (z - k) / (2.0 * variance)); };
        const auto first = std::size_t(std::max(0.0, std::ceil(z - reach * sigma - 1.0)));
        const auto last = std::size_t(std::max(0.0, std::floor(z + reach * sigma) + 1.0));
        double density = 0.0, slope = 0.0, here = gaussian(double(first));
        for (std::size_t k = first; k <= last && k < poisson.size(); ++k) {
            const double next = gaussian(double(k + 1));
            density += poisson[k] * here;
            slope += poisson[k] * (next - here);
            here = next;
        }
        if (density > 1e-290) sum += slope * slope / density;
    }
    return sum * step / (sigma * std::sqrt(2.0 * pi));
}

}  // namespace

PixelInformation::PixelInformation(bool shot_noise, double variance)
    : shot_noise_(shot_noise), variance_(shot_noise && variance < countable ? least : variance) {
    if (!shot_noise || variance < countable) return;
    for (int i = 0; i < entries; ++i) {
        const double mean = lowest * std::pow(10.0, double(i) / per_decade);
        log_gain_.push_back(std::log(integrate(mean, variance) * (mean + variance)));
    }
}

double PixelInformation::operator()(double mean) const {
    if (!shot_noise_) return 1.0 / variance_;
    const double by_variance = 1.0 / (std::max(mean, 0.0) + variance_);
    if (log_gain_.empty() || mean >= highest) return by_variance;
    const double place = std::max(0.0, std::log10(std::max(mean, lowest) / lowest) * per_decade);
    const int i = std::min(int(place), entries - 2);
    return by_variance * std::exp(log_gain_[i] + (place - i) * (log_gain_[i + 1] - log_gain_[i]));
}

}  // namespace stepdiag
