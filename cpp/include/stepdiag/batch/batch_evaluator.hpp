// One evaluation of many sets of readings of the same plan, head and pattern of readings: samples in lanes.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "stepdiag/adjustment/options.hpp"
#include "stepdiag/evaluation/evaluation.hpp"

namespace stepdiag {

enum class EvaluationMethod { conventional, enhanced, adjustment, one_step };
// one_step: the adjustment's first Gauss-Newton step from the pattern's own solution, a fixed matrix; off by terms of
// second order in what changes.

struct BatchOptions {
    EvaluationMethod method = EvaluationMethod::enhanced;
    ReadingUncertainty uncertainty = {};  // conventional, enhanced, as the next
    std::optional<KnownExpansion> expansion = {};
    // Of adjustment and one_step. Nothing is left out as an outlier, and no uncertainty is scaled: options that ask for
    // it are refused. full_covariance and plausible concern the pattern alone.
    AdjustmentOptions adjustment = {};
};

class BatchEvaluator {
public:
    // `pattern`: a run of this plan whose readings are there; rows and channels of all sets are like its own. For the
    // adjustment it is also where each set's solution starts. Readings that it lost are lost in all sets. The linear
    // methods weigh all sets as the pattern: what moves a value by a thousandth of its uncertainty or so beside an
    // evaluation of the set by itself (most with beams that stand close together). Throws InvalidArgument like the
    // evaluation itself.
    BatchEvaluator(const Measurement& pattern, const Plan& plan, const Chain& chain, const Eigen::Vector3d& tool,
                   const HeadCalibrations& heads, const BatchOptions& options);
    ~BatchEvaluator();
    BatchEvaluator(BatchEvaluator&&) noexcept;

    const std::vector<CalibrationEntry>& entries() const;
    const Calibration& of_pattern() const;  // with standard uncertainties

    // What a thread writes to.
    class Worker {
    public:
        explicit Worker(const BatchEvaluator& evaluator);
        ~Worker();
        Worker(Worker&&) noexcept;
        // `readings`: [(row * channels + channel) * lanes + lane], rows and channels of the pattern's signals (without
        // time and temperature), `lanes` a multiple of lane_group; results: values[entry * stride + lane]. A lane with
        // a reading that counts and is NaN, or without a solution, gives NaN. Fastest where both begin at cache lines
        // and all lanes' readings fit into a core's own cache.
        void evaluate(const double* readings, std::size_t lanes, double* values, std::size_t stride);

    private:
        struct State;
        std::unique_ptr<State> state_;
    };

    // Of the linear method, or of the adjustment at the pattern's solution: d entry / d reading, entries x (row *
    // channels + channel), by central differences or exactly.
    Eigen::MatrixXd gain() const;

private:
    struct Map;
    std::unique_ptr<const Map> map_;
};

}  // namespace stepdiag
