#include <cmath>
#include <limits>

#include "evaluation/batch_map.hpp"
#include "stepdiag/core/error.hpp"
#include "stepdiag/evaluation/conventional.hpp"
#include "stepdiag/evaluation/enhanced.hpp"

namespace stepdiag {
namespace {

class LinearBatch : public BatchMap {
public:
    explicit LinearBatch(const BatchPattern& pattern)
        : BatchMap(
              evaluate(pattern.measurement, pattern.plan, pattern.chain, pattern.tool, pattern.heads, pattern.options)),
          measurement_(pattern.measurement),
          plan_(pattern.plan),
          chain_(pattern.chain),
          tool_(pattern.tool),
          heads_(pattern.heads),
          options_(pattern.options) {}

    std::unique_ptr<Worker> worker() const override { return std::make_unique<LinearWorker>(*this); }

    Eigen::MatrixXd gain() const override {
        Eigen::VectorXd readings = readings_of_pattern();
        Eigen::MatrixXd gain(entries.size(), readings.size());
        for (Eigen::Index r = 0; r < readings.size(); ++r) {
            const double at = readings[r], step = 1e-5;
            readings[r] = at + step;
            gain.col(r) = values(readings);
            readings[r] = at - step;
            gain.col(r) = (gain.col(r) - values(readings)) / (2.0 * step);
            readings[r] = at;
        }
        return gain;
    }

private:
    class LinearWorker : public Worker {
    public:
        explicit LinearWorker(const LinearBatch& batch) : batch_(batch) {}
        void evaluate(const double* readings, std::size_t lanes, double* values, std::size_t stride) override {
            const std::size_t rows = batch_.measurement_.size() * signal_channels(batch_.measurement_).size();
            for (std::size_t lane = 0; lane < lanes; ++lane) {
                Eigen::VectorXd own(rows);
                for (std::size_t r = 0; r < rows; ++r) own[Eigen::Index(r)] = readings[r * lanes + lane];
                const Eigen::VectorXd result = batch_.values(own);
                for (Eigen::Index e = 0; e < result.size(); ++e)
                    values[e * Eigen::Index(stride) + Eigen::Index(lane)] = result[e];
            }
        }

    private:
        const LinearBatch& batch_;
    };

    static Calibration evaluate(const Measurement& measurement, const Plan& plan, const Chain& chain,
                                const Eigen::Vector3d& tool, const HeadCalibrations& heads,
                                const BatchOptions& options) {
        const EvaluationOptions evaluation{options.uncertainty};
        return options.method == EvaluationMethod::enhanced
                   ? evaluate_enhanced(measurement, plan, chain, tool, heads, evaluation)
                   : evaluate_conventional(measurement, plan, chain, tool, heads, evaluation);
    }

    Eigen::VectorXd readings_of_pattern() const {
        const auto signals = signal_channels(measurement_);
        Eigen::VectorXd readings(measurement_.size() * signals.size());
        for (std::size_t row = 0, r = 0; row < measurement_.size(); ++row)
            for (const int c : signals)
                readings[Eigen::Index(r++)] = measurement_.channels()[c].value[row].value_or(0.0);
        return readings;
    }

    Eigen::VectorXd values(const Eigen::VectorXd& readings) const {
        Eigen::VectorXd result(entries.size());
        result.setConstant(std::numeric_limits<double>::quiet_NaN());
        if (!readings.allFinite()) return result;
        auto channels = measurement_.channels();
        const auto signals = signal_channels(measurement_);
        for (std::size_t row = 0, r = 0; row < measurement_.size(); ++row)
            for (const int c : signals) {
                if (channels[c].value[row]) channels[c].value[row] = readings[Eigen::Index(r)];
                ++r;
            }
        try {
            const Calibration calibration =
                evaluate(Measurement(measurement_.stations(), channels), plan_, chain_, tool_, heads_, options_);
            Eigen::Index e = 0;
            for (const auto& function : calibration.functions)
                if (function)
                    for (const double value : function->value) result[e++] = value;
            for (const auto& squareness : calibration.squarenesses)
                if (squareness) result[e++] = squareness->value;
        } catch (const InvalidArgument&) {
        }
        return result;
    }

    Measurement measurement_;
    Plan plan_;
    Chain chain_;
    Eigen::Vector3d tool_;
    HeadCalibrations heads_;
    BatchOptions options_;
};

}  // namespace

std::unique_ptr<const BatchMap> make_linear_batch(const BatchPattern& pattern) {
    return std::make_unique<const LinearBatch>(pattern);
}

}  // namespace stepdiag
