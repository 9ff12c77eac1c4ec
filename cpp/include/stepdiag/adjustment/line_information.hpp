// How well the lines of a plan determine a machine, before anyone measures: for comparing thousands of choices of lines
// with the same settings (steps, scale points, directions).
#pragma once

#include <Eigen/Core>
#include <array>
#include <memory>
#include <string>
#include <vector>

#include "stepdiag/adjustment/options.hpp"
#include "stepdiag/machine/error_map.hpp"
#include "stepdiag/measurement/measurement.hpp"

namespace stepdiag {

// A line of a plan, or a scale line of it.
struct ChosenLine {
    std::string name;
    bool is_scale_line;
};

// What the adjustment of a run of some lines would know.
struct KnownByLines {
    static constexpr int parameters = function_count + squareness_count;
    // Functions by FunctionId::index, then C0Y, B0Z, A0Z: the largest standard uncertainty of its values, mm or rad,
    // NaN where none is determined; and whether all of them are, with the slope.
    std::array<double, parameters> largest;
    std::array<bool, parameters> whole;
    // Variances of the functional point's error, summed over X, Y and Z, mm^2, at a grid of commanded positions, Z
    // changing fastest; NaN where something that acts there is not determined.
    Eigen::VectorXd volume;
};

// What adjust() knows by a run without noise, without its tests of the readings: a tenth of its time with the
// covariance of all values. `grid`: positions of each axis in the grid of KnownByLines, at least 2. Throws
// InvalidArgument for what LineInformation refuses, and where nothing is determined.
KnownByLines known_by_run(const Measurement& run, const Plan& plan, const Chain& chain, const Eigen::Vector3d& tool,
                          const HeadCalibrations& heads, const AdjustmentOptions& options, int grid);

// The normal equations of each line without the unknowns of its set-up, which no other line has. Those of some lines
// are sums of theirs, so that a choice of lines takes one factor and its inverse: a tenth of the time of an adjustment.
// What is determined is the same, uncertainties are within a hundredth or so: a set-up is taken to be where is usual
// for it, and the machine where all lines together say.
class LineInformation {
public:
    // A run without noise, in which lines visit every node that any line visits: as the adjustment would evaluate it
    // with these options. `grid`: positions of each axis in the grid of KnownByLines, at least 2. Throws
    // InvalidArgument for what lines have in common besides the machine (expansion coefficients and drifts that are
    // unknowns, smoothness, an uncertain scale of distances or index of the air), and where no machine explains the
    // readings.
    LineInformation(const Measurement& run, const Plan& plan, const Chain& chain, const Eigen::Vector3d& tool,
                    const HeadCalibrations& heads, const AdjustmentOptions& options, int grid);
    // Lines of another run with the same steps, but for those that there are already.
    void add(const Measurement& run, const Plan& plan, const HeadCalibrations& heads, const AdjustmentOptions& options);

    // Of the lines that are chosen, each of which one of the runs has; else throws InvalidArgument.
    KnownByLines known_by(const std::vector<ChosenLine>& lines);

private:
    struct State;
    std::shared_ptr<State> state_;
};

}  // namespace stepdiag
