// What a machine can be. A result beyond it comes from readings in another unit, of another volume or of another plan,
// however small its standard uncertainties are.
#pragma once

#include <limits>

#include "stepdiag/evaluation/calibration.hpp"
#include "stepdiag/measurement/measurement.hpp"
#include "stepdiag/plan/plan.hpp"

namespace stepdiag {

struct PlausibleLimits {
    double positioning = 1e-3;  // of a positioning error, by the travel of its axis
    double translation = 2.0;   // mm: of a positioning error or a straightness
    double rotation = 5e-3;     // rad: of an angular error or a squareness

    static PlausibleLimits none() {
        constexpr double infinity = std::numeric_limits<double>::infinity();
        return {infinity, infinity, infinity};
    }
};

// Throws InvalidArgument for limits that are not positive.
void check(const PlausibleLimits& limits);

// Throws InvalidArgument for a row whose point the plan does not have, or has more than 1 um elsewhere.
void check_points(const Measurement& measurement, const Plan& plan);

// Throws InvalidArgument, before the evaluation, where the distances of a line do not grow with the plan's travel: in
// another unit, not at all, or the wrong way. Single wrong readings do not matter here.
void refuse_foreign_distances(const Measurement& measurement, const Plan& plan);

// Says which distance stands furthest from where the other readings of its line say, if that is more than a hundredth
// of the volume's shortest edge; empty where none does.
std::string far_reading(const Measurement& measurement, const Plan& plan);

// Throws InvalidArgument, after the evaluation, where a value is not finite, or exceeds its limit by more than three
// times its standard uncertainty: the parameter, its value and limit, and what the readings look like.
void refuse_implausible(const Calibration& calibration, const Measurement& measurement, const Plan& plan,
                        const PlausibleLimits& limits);

}  // namespace stepdiag
