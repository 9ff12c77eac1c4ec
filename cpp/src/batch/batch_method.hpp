// What stands behind a BatchEvaluator: one method of evaluation, prepared for the pattern of its readings. Internal.
#pragma once

#include <memory>
#include <vector>

#include "stepdiag/batch/batch_evaluator.hpp"

namespace stepdiag {

class BatchMethod {
public:
    virtual ~BatchMethod() = default;

    std::vector<CalibrationEntry> entries;
    Calibration of_pattern;

    // What one thread writes to. Outlives no map.
    class Worker {
    public:
        virtual ~Worker() = default;
        virtual void evaluate(const double* readings, std::size_t lanes, double* values, std::size_t stride) = 0;
    };
    virtual std::unique_ptr<Worker> worker() const = 0;
    virtual Eigen::MatrixXd gain() const = 0;

protected:
    explicit BatchMethod(Calibration of_pattern);  // entries: those of its tables
};

// The pattern and what it is evaluated with.
struct BatchPattern {
    const Measurement& measurement;
    const Plan& plan;
    const Chain& chain;
    const Eigen::Vector3d& tool;
    const HeadCalibrations& heads;
    const BatchOptions& options;
};

// Channels of a set of readings, by their place in Measurement::channels(): all but time and temperature.
std::vector<int> signal_channels(const Measurement& measurement);

}  // namespace stepdiag
