#include "batch/adjustment_batch.hpp"

#include <algorithm>
#include <utility>

#include "adjustment/smoothness.hpp"
#include "batch/simd_adjustment.hpp"
#include "stepdiag/core/error.hpp"
#include "stepdiag/diagnosis/adjust.hpp"

namespace stepdiag {
namespace {

// A batch uses every reading with its stated uncertainty; options that ask for anything else are refused.
AdjustmentOptions of_sets(AdjustmentOptions options) {
    const double asked = options.outlier_probability;
    if (asked != 0.0 && asked != AdjustmentOptions{}.outlier_probability)
        throw InvalidArgument(
            "outlier_probability: expected 0, or nothing said: no reading of many sets is left out as an outlier");
    if (options.scale_uncertainty)
        throw InvalidArgument("scale_uncertainty: expected false: many sets have no uncertainties of their own");
    options.outlier_probability = 0.0;
    return options;
}

std::vector<double> standard_uncertainties(const Calibration& calibration) {
    std::vector<double> all;
    for (const auto& function : calibration.functions)
        if (function)
            all.insert(all.end(), function->standard_uncertainty.begin(), function->standard_uncertainty.end());
    for (const auto& squareness : calibration.squarenesses)
        if (squareness) all.push_back(squareness->standard_uncertainty);
    return all;
}

// For each reading of the problem: row * channels + channel, where channels are those of signal_channels.
std::vector<std::ptrdiff_t> inputs(const AdjustmentProblem& problem, const Measurement& measurement) {
    const std::vector<int> signals = signal_channels(measurement);
    std::vector<std::ptrdiff_t> list;
    for (const AdjustedReading& reading : problem.readings()) {
        const auto channel = std::find_if(signals.begin(), signals.end(), [&](int c) {
            return measurement.channels()[c].name == problem.channel_name(reading);
        });
        list.push_back(std::ptrdiff_t(reading.row * signals.size()) + (channel - signals.begin()));
    }
    return list;
}

class AdjustmentBatch : public BatchMethod {
public:
    AdjustmentBatch(const BatchPattern& pattern, const Adjustment& adjustment)
        : BatchMethod(adjustment.calibration),
          in_one_step_(pattern.options.method == EvaluationMethod::one_step),
          readings_(pattern.measurement.size() * signal_channels(pattern.measurement).size()),
          start_(prepare(pattern, adjustment)) {}

    class Worker : public BatchMethod::Worker {
    public:
        explicit Worker(const AdjustmentBatch& batch) : in_one_step_(batch.in_one_step_), lanes_(*batch.start_) {}

        void evaluate(const double* readings, std::size_t lanes, double* values, std::size_t stride) override {
            for (std::size_t lane = 0; lane < lanes; lane += lane_group) {
                if (in_one_step_) lanes_.adjust_in_one_step(readings + lane, lanes, values + lane, stride);
                else lanes_.adjust(readings + lane, lanes, values + lane, stride);
            }
        }

    private:
        bool in_one_step_;
        SimdAdjustment lanes_;
    };
    std::unique_ptr<BatchMethod::Worker> worker() const override { return std::make_unique<Worker>(*this); }

    Eigen::MatrixXd gain() const override { return simd_gain(*start_, readings_); }

private:
    static std::unique_ptr<const SimdStart> prepare(const BatchPattern& p, const Adjustment& adjustment) {
        const PreparedAdjustment prepared(p.measurement, p.plan, p.chain, p.tool, p.heads,
                                          of_sets(p.options.adjustment), adjustment.smoothness);
        return std::make_unique<const SimdStart>(prepared, inputs(prepared.problem, p.measurement),
                                                 standard_uncertainties(adjustment.calibration));
    }

    bool in_one_step_;
    std::size_t readings_;  // in a set
    std::unique_ptr<const SimdStart> start_;
};

}  // namespace

std::unique_ptr<const BatchMethod> make_adjustment_batch(const BatchPattern& p) {
    const Adjustment adjustment =
        adjust(p.measurement, p.plan, p.chain, p.tool, p.heads, of_sets(p.options.adjustment));
    return std::make_unique<const AdjustmentBatch>(p, adjustment);
}

}  // namespace stepdiag
