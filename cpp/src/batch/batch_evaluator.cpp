#include "stepdiag/batch/batch_evaluator.hpp"

#include "batch/adjustment_batch.hpp"
#include "batch/linear_batch.hpp"

namespace stepdiag {

struct BatchEvaluator::Map {
    std::unique_ptr<const BatchMethod> of_method;
};

struct BatchEvaluator::Worker::State {
    std::unique_ptr<BatchMethod::Worker> of_method;
};

BatchEvaluator::BatchEvaluator(const Measurement& pattern, const Plan& plan, const Chain& chain,
                               const Eigen::Vector3d& tool, const HeadCalibrations& heads,
                               const BatchOptions& options) {
    const bool is_linear =
        options.method == EvaluationMethod::conventional || options.method == EvaluationMethod::enhanced;
    const BatchPattern given{pattern, plan, chain, tool, heads, options};
    map_ = std::make_unique<const Map>(Map{is_linear ? make_linear_batch(given) : make_adjustment_batch(given)});
}
BatchEvaluator::~BatchEvaluator() = default;
BatchEvaluator::BatchEvaluator(BatchEvaluator&&) noexcept = default;

const std::vector<CalibrationEntry>& BatchEvaluator::entries() const { return map_->of_method->entries; }
const Calibration& BatchEvaluator::of_pattern() const { return map_->of_method->of_pattern; }
Eigen::MatrixXd BatchEvaluator::gain() const { return map_->of_method->gain(); }

BatchEvaluator::Worker::Worker(const BatchEvaluator& evaluator)
    : state_(std::make_unique<State>(State{evaluator.map_->of_method->worker()})) {}
BatchEvaluator::Worker::~Worker() = default;
BatchEvaluator::Worker::Worker(Worker&&) noexcept = default;

void BatchEvaluator::Worker::evaluate(const double* readings, std::size_t lanes, double* values, std::size_t stride) {
    state_->of_method->evaluate(readings, lanes, values, stride);
}

}  // namespace stepdiag
