#include <cmath>

#include "measurement/records.hpp"
#include "stepdiag/core/error.hpp"
#include "stepdiag/evaluation/evaluation.hpp"

namespace stepdiag {

void check(const KnownExpansion& known) {
    check(known.expansion);
    if (!(known.standard_uncertainty.allFinite() && known.standard_uncertainty.minCoeff() >= 0.0))
        throw InvalidArgument(
            "expansion standard_uncertainty: expected three finite numbers of at least 0, per kelvin");
    if (!(std::isfinite(known.sensor_uncertainty) && known.sensor_uncertainty >= 0.0))
        throw InvalidArgument("expansion sensor_uncertainty: expected a finite number of at least 0, in kelvin");
    if (known.temperature && !known.temperature->allFinite())
        throw InvalidArgument("expansion temperature: expected three finite temperatures in degrees Celsius");
    const auto same = [](const Eigen::Vector3d& of_axes) { return (of_axes.array() == of_axes[0]).all(); };
    if (known.one_coefficient && !(same(known.expansion.coefficient) && same(known.standard_uncertainty)))
        throw InvalidArgument("expansion coefficient: expected the same for all axes, as one_coefficient says");
}

std::vector<AxisGroup> axis_groups(bool together) {
    if (together) return {{0, 1, 2}};
    return {{0}, {1}, {2}};
}

std::vector<AxisGroup> coefficient_groups(const KnownExpansion& known) { return axis_groups(known.one_coefficient); }

std::vector<AxisGroup> sensor_groups(const Measurement& measurement, const KnownExpansion& known) {
    const bool stated = !measurement.find("temperature") && has_one_sensor(measurement);
    return axis_groups(stated ? known.one_temperature : has_one_sensor(measurement));
}

void state_temperature(const Measurement& measurement, const std::optional<KnownExpansion>& known,
                       Calibration& calibration) {
    if (known) {
        calibration.temperature_reference = known->expansion.reference;
        calibration.expansion = known->expansion.coefficient;
        calibration.fixed_point = known->expansion.fixed_point;
    } else calibration.temperature_as_found = mean_scale_temperatures(measurement);
}

}  // namespace stepdiag
