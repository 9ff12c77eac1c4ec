#include "stepdiag/uncertainty/volumetric_accuracy.hpp"

#include <algorithm>
#include <cmath>

#include "stepdiag/core/error.hpp"
#include "uncertainty/derived_parts.hpp"
#include "uncertainty/in_blocks.hpp"
#include "uncertainty/normal_draws.hpp"

namespace stepdiag {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

void check_covariance(const Calibration& calibration) {
    if (calibration.covariance.size() == 0)
        throw InvalidArgument("calibration: expected one evaluated with full covariance");
}

}  // namespace

struct RangeModel::State {
    VolumeRanges ranges;
    VectorXd values;
    NormalDraws draws;
    std::uint64_t seed;
    std::vector<Output> outputs;
    std::vector<int> indices;  // index of each output in the ranges
};

RangeModel::RangeModel(const Calibration& calibration, const std::optional<Eigen::Vector3d>& tool, std::uint64_t seed) {
    check_covariance(calibration);
    auto state = std::make_shared<State>(State{VolumeRanges(calibration, tool_of(calibration, tool)),
                                               calibration_values(calibration),
                                               NormalDraws(calibration.covariance, seed),
                                               seed,
                                               {},
                                               {}});
    for (int i = 0; i < range_count; ++i) {
        if (!state->ranges.missing()[std::size_t(i)].empty()) continue;
        const bool is_angle = i >= 3 && i < deviation_count;
        state->outputs.push_back({range_names[std::size_t(i)], std::nan(""), is_angle ? "rad" : "mm"});
        state->indices.push_back(i);
    }
    state_ = std::move(state);
}

RangeModel::~RangeModel() = default;
const std::vector<SampleModel::Output>& RangeModel::outputs() const { return state_->outputs; }
std::uint64_t RangeModel::seed() const { return state_->seed; }
std::string RangeModel::target() const { return "scalar"; }

std::unique_ptr<SampleModel::Worker> RangeModel::worker() const {
    struct RangeWorker : Worker {
        explicit RangeWorker(const State& state) : state(state) {}
        void evaluate(const SampleBlock& block) override {
            MatrixXd noise;
            for (std::size_t begin = 0; begin < block.samples; begin += std::size_t(NormalDraws::together)) {
                state.draws.draw(block.first_sample + begin, noise);
                for (std::size_t s = 0; s < std::min(std::size_t(noise.cols()), block.samples - begin); ++s) {
                    const Ranges ranges = state.ranges.evaluate(state.values + noise.col(Index(s)));
                    for (std::size_t k = 0; k < state.indices.size(); ++k)
                        block.output(k)[begin + s] = ranges[state.indices[k]];
                }
            }
        }
        const State& state;
    };
    return std::make_unique<RangeWorker>(*state_);
}

VolumetricAccuracy volumetric_accuracy(const Calibration& calibration, const std::optional<Eigen::Vector3d>& tool,
                                       const RangeOptions& options) {
    if (!(options.coverage > 0.0 && options.coverage < 1.0))
        throw InvalidArgument("coverage: expected a probability between 0 and 1");
    if (double(options.samples) * (1.0 - options.coverage) < 100.0)
        throw InvalidArgument("samples: expected at least 100/(1 - coverage)");
    check_covariance(calibration);
    const VolumeRanges ranges(calibration, tool_of(calibration, tool));
    const VectorXd values = calibration_values(calibration);
    const NormalDraws draws(calibration.covariance, options.seed);

    const Index count = Index(options.samples);
    MatrixXd drawn(count, range_count), of_noise(count, range_count);
    // The numbers of a sample depend on its index only, so the result does not depend on the threads.
    in_blocks(count, NormalDraws::together, [&](Index begin, Index end) {
        MatrixXd noise;
        draws.draw(std::uint64_t(begin), noise);
        for (Index s = 0; s < end - begin; ++s) {
            drawn.row(begin + s) = ranges.evaluate(values + noise.col(s)).transpose();
            of_noise.row(begin + s) = ranges.evaluate(noise.col(s)).transpose();
        }
    });

    VolumetricAccuracy result;
    result.value = ranges.evaluate(values);
    result.mean = drawn.colwise().mean();
    result.standard_uncertainty =
        ((drawn.rowwise() - result.mean.transpose()).colwise().squaredNorm() / double(count - 1)).cwiseSqrt();
    const auto quantile = [&](MatrixXd& sorted, int column, double probability) {
        return sorted(std::clamp(Index(probability * double(count)), Index(0), count - 1), column);
    };
    for (int i = 0; i < range_count; ++i) {
        if (!ranges.missing()[std::size_t(i)].empty()) {
            result.drawn_interval.row(i).setConstant(std::nan(""));
            result.interval.row(i) = result.drawn_interval.row(i);
            result.bound[i] = std::nan("");
            continue;
        }
        std::sort(drawn.col(i).begin(), drawn.col(i).end());
        std::sort(of_noise.col(i).begin(), of_noise.col(i).end());
        const double low = quantile(drawn, i, (1.0 - options.coverage) / 2.0);
        const double high = quantile(drawn, i, (1.0 + options.coverage) / 2.0);
        result.drawn_interval.row(i) << low, high;
        result.interval.row(i) << std::max(2.0 * result.value[i] - high, 0.0),
            std::max(2.0 * result.value[i] - low, 0.0);
        result.bound[i] = quantile(of_noise, i, options.coverage);
    }
    result.resolution = ranges.resolution(values);
    result.missing = ranges.missing();
    result.samples = options.samples;
    return result;
}

}  // namespace stepdiag
