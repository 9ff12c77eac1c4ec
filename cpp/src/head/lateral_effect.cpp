#include <cmath>

#include "head/checks.hpp"
#include "head/spot_profile.hpp"
#include "stepdiag/core/random.hpp"
#include "stepdiag/head/spot_sensor.hpp"

namespace stepdiag {

void check_lateral_effect(const LateralEffect& device) {
    const Check check{"position device"};
    check.positive("size", device.size.x(), "a width in mm");
    check.positive("size", device.size.y(), "a height in mm");
    check.not_negative("noise", device.noise, "a length in mm");
    check.not_negative("resolution", device.resolution, "a length in mm");
    check.positive("least_power", device.least_power, "a share of the source's power");
    check.within("least_power", device.least_power, 0.0, 1.0, "a share of the source's power");
}

std::optional<Eigen::Vector2d> locate(const LateralEffect& device, const std::vector<BeamSpot>& spots,
                                      std::uint64_t seed, std::uint64_t counter) {
    const Eigen::Vector2d high = device.size / 2.0, low = -high;
    double power = 0.0;
    Eigen::Vector2d moment = Eigen::Vector2d::Zero();
    for (const BeamSpot& spot : spots) {
        check_spot(spot);
        const double width = share_between(low.x(), high.x(), spot.centre.x(), spot.radius);
        const double height = share_between(low.y(), high.y(), spot.centre.y(), spot.radius);
        power += spot.power * width * height;
        moment.x() += spot.power * moment_between(low.x(), high.x(), spot.centre.x(), spot.radius) * height;
        moment.y() += spot.power * moment_between(low.y(), high.y(), spot.centre.y(), spot.radius) * width;
    }
    if (!(power >= device.least_power)) return std::nullopt;

    Eigen::Vector2d position = moment / power;
    if (device.noise > 0.0) {
        const auto noise = normal_pair(seed, RandomStream::position_device, counter);
        position += device.noise / power * Eigen::Vector2d(noise[0], noise[1]);
    }
    if (device.resolution > 0.0) position = device.resolution * (position / device.resolution).array().round();
    return position;
}

}  // namespace stepdiag
