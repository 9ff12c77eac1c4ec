// Implementation of a BatchEvaluator: one method of evaluation, prepared for a pattern of readings. Internal.
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

    // Working memory of one thread. The method must outlive it.
    class Worker {
    public:
        virtual ~Worker() = default;
        virtual void evaluate(const double* readings, std::size_t lanes, double* values, std::size_t stride) = 0;
    };
    virtual std::unique_ptr<Worker> worker() const = 0;
    virtual Eigen::MatrixXd gain() const = 0;

protected:
    explicit BatchMethod(Calibration of_pattern);  // sets entries to those of its tables
};

// The pattern, and everything that its evaluation needs.
struct BatchPattern {
    const Measurement& measurement;
    const Plan& plan;
    const Chain& chain;
    const Eigen::Vector3d& tool;
    const HeadCalibrations& heads;
    const BatchOptions& options;
};

// Places in Measurement::channels() of the channels of a set of readings (is_signal).
std::vector<int> signal_channels(const Measurement& measurement);

}  // namespace stepdiag
