#include "head/spot_profile.hpp"

#include <cmath>

#include "head/checks.hpp"
#include "stepdiag/core/units.hpp"
#include "stepdiag/head/spot_sensor.hpp"

namespace stepdiag {
namespace {

// Share of the power beyond an edge, on the side of the centre where the edge is. Small tails keep their relative
// precision.
double tail(double edge, double centre, double radius) {
    return 0.5 * std::erfc(std::sqrt(2.0) * std::abs(edge - centre) / radius);
}

double share(double low, double low_tail, double high, double high_tail, double centre) {
    if (low >= centre) return low_tail - high_tail;
    if (high <= centre) return high_tail - low_tail;
    return 1.0 - low_tail - high_tail;
}

double irradiance(double position, double centre, double radius) {
    const double t = (position - centre) / radius;
    return std::sqrt(2.0 / pi) / radius * std::exp(-2.0 * t * t);
}

}  // namespace

void check_spot(const BeamSpot& spot) {
    const Check check{"spot"};
    check.finite("centre x", spot.centre.x(), "a length in mm");
    check.finite("centre y", spot.centre.y(), "a length in mm");
    check.positive("radius", spot.radius, "a length in mm");
    check.not_negative("power", spot.power, "a share of the source's power");
}

double beam_radius(const GaussianMode& mode, double reduced_length) {
    const double ratio = (reduced_length - mode.waist_position) / rayleigh_length(mode);
    return mode.waist_radius * std::sqrt(1.0 + ratio * ratio);
}

double share_between(double low, double high, double centre, double radius) {
    return share(low, tail(low, centre, radius), high, tail(high, centre, radius), centre);
}

double moment_between(double low, double high, double centre, double radius) {
    // From the mean of a truncated normal distribution with standard deviation radius / 2.
    return centre * share_between(low, high, centre, radius) -
           radius * radius / 4.0 * (irradiance(high, centre, radius) - irradiance(low, centre, radius));
}

double power_inside(const BeamSpot& spot, const Eigen::Vector2d& low, const Eigen::Vector2d& high) {
    return spot.power * share_between(low.x(), high.x(), spot.centre.x(), spot.radius) *
           share_between(low.y(), high.y(), spot.centre.y(), spot.radius);
}

Eigen::ArrayXd pixel_shares(double centre, double radius, double start, double pitch, int count) {
    Eigen::ArrayXd shares(count);
    double low = start, low_tail = tail(low, centre, radius);
    for (int i = 0; i < count; ++i) {
        const double high = start + (i + 1) * pitch, high_tail = tail(high, centre, radius);
        shares[i] = share(low, low_tail, high, high_tail, centre);
        low = high, low_tail = high_tail;
    }
    return shares;
}

Eigen::ArrayX3d pixel_shares_and_derivatives(double centre, double radius, double start, double pitch, int count) {
    Eigen::ArrayX3d profile(count, 3);
    profile.col(0) = pixel_shares(centre, radius, start, pitch, count);
    double low = start, low_irradiance = irradiance(low, centre, radius);
    for (int i = 0; i < count; ++i) {
        const double high = start + (i + 1) * pitch, high_irradiance = irradiance(high, centre, radius);
        profile(i, 1) = low_irradiance - high_irradiance;
        profile(i, 2) = ((low - centre) * low_irradiance - (high - centre) * high_irradiance) / radius;
        low = high, low_irradiance = high_irradiance;
    }
    return profile;
}

}  // namespace stepdiag
