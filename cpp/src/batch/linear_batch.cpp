#include "batch/linear_batch.hpp"

#include <hwy/aligned_allocator.h>

#include <algorithm>
#include <limits>

#include "batch/simd_reduction.hpp"
#include "evaluation/linear_evaluation.hpp"
#include "evaluation/linear_maps.hpp"
#include "stepdiag/core/random_blocks.hpp"
#include "stepdiag/evaluation/conventional.hpp"
#include "stepdiag/evaluation/enhanced.hpp"

namespace stepdiag {
namespace {

static_assert(lane_group % program_lanes == 0);

bool is_enhanced(const BatchPattern& pattern) { return pattern.options.method == EvaluationMethod::enhanced; }

LengthKind length_kind(const BatchPattern& pattern) {
    return is_enhanced(pattern) ? LengthKind::lever_arm_corrected : LengthKind::distance;
}

Calibration evaluate(const BatchPattern& p) {
    // No calibration to be used, but the point at which maps are linear: samples may lie anywhere.
    const EvaluationOptions options{p.options.uncertainty, false, PlausibleLimits::none()};
    return is_enhanced(p) ? evaluate_enhanced(p.measurement, p.plan, p.chain, p.tool, p.heads, options)
                          : evaluate_conventional(p.measurement, p.plan, p.chain, p.tool, p.heads, options);
}

std::vector<Pass> passes_of(const BatchPattern& p, const ReadingUncertainty& uncertainty) {
    return collect_passes(p.measurement, p.plan, p.heads, uncertainty, length_kind(p));
}

// The same readings, each of the standard uncertainty that it has by its quantity alone.
Measurement without_uncertainties(const Measurement& measurement) {
    auto channels = measurement.channels();
    for (Channel& channel : channels) channel.standard_uncertainty.clear();
    return Measurement(measurement.stations(), channels);
}

class LinearBatch : public BatchMethod {
public:
    LinearBatch(const BatchPattern& pattern, const std::vector<Pass>& passes)
        : BatchMethod(evaluate(pattern)),
          reduction_(pattern.measurement, pattern.heads, passes, length_kind(pattern)),
          program_(is_enhanced(pattern) ? enhanced_program(passes, pattern.plan, pattern.chain, pattern.tool)
                                        : conventional_program(passes, pattern.plan)),
          effects_(effects_of_raw_channels(pattern)) {}

    std::unique_ptr<Worker> worker() const override { return std::make_unique<LinearWorker>(*this); }

    Eigen::MatrixXd gain() const override {
        const auto raws = Eigen::Index(effects_.size());
        Eigen::MatrixXd gain(program_.outputs(), raws);
        std::vector<double> registers(program_.registers() * program_lanes);
        std::vector<double> values(program_.outputs() * program_lanes);
        for (Eigen::Index begin = 0; begin < raws; begin += program_lanes) {
            const Eigen::Index lanes = std::min<Eigen::Index>(program_lanes, raws - begin);
            std::fill(registers.begin(), registers.end(), 0.0);
            for (Eigen::Index lane = 0; lane < lanes; ++lane)
                for (int c = 0; c < values_per_reading; ++c) {
                    const RawEffect& effect = effects_[begin + lane];
                    registers[(effect.place + c) * program_lanes + lane] = effect.by_channel[c];
                }
            program_.run(registers.data(), values.data(), program_lanes);
            gain.middleCols(begin, lanes) = Eigen::Map<const Eigen::Matrix<double, program_lanes, Eigen::Dynamic>>(
                                                values.data(), program_lanes, Eigen::Index(program_.outputs()))
                                                .topRows(lanes)
                                                .transpose();
        }
        return gain;
    }

private:
    // How length, alpha and beta at `place` change with one raw channel of one row.
    struct RawEffect {
        std::size_t place = 0;
        ChannelEffect by_channel = ChannelEffect::Zero();
    };

    class LinearWorker : public Worker {
    public:
        explicit LinearWorker(const LinearBatch& batch)
            : batch_(batch), registers_(hwy::AllocateAligned<double>(batch.program_.registers() * program_lanes)) {
            std::fill_n(registers_.get(), batch.program_.registers() * program_lanes, 0.0);
        }

        void evaluate(const double* readings, std::size_t lanes, double* values, std::size_t stride) override {
            for (std::size_t lane = 0; lane < lanes; lane += program_lanes) {
                const SimdReduction::Lost lost = batch_.reduction_.reduce(readings + lane, lanes, registers_.get());
                batch_.program_.run(registers_.get(), values + lane, stride);
                for (std::size_t k = 0; k < program_lanes; ++k)
                    for (std::size_t output = 0; lost[k] && output < batch_.program_.outputs(); ++output)
                        values[output * stride + lane + k] = std::numeric_limits<double>::quiet_NaN();
            }
        }

    private:
        const LinearBatch& batch_;
        hwy::AlignedFreeUniquePtr<double[]> registers_;
    };

    std::vector<RawEffect> effects_of_raw_channels(const BatchPattern& pattern) const {
        const Measurement measurement = without_uncertainties(pattern.measurement);
        const BatchPattern unweighted{measurement,  pattern.plan,  pattern.chain,
                                      pattern.tool, pattern.heads, pattern.options};
        const auto passes = passes_of(unweighted, ReadingUncertainty{1.0, 1.0, 1.0});
        std::vector<const PassPoint*> points;
        for (const Pass& pass : passes)
            for (const PassPoint& point : pass.points) points.push_back(&point);
        std::vector<RawEffect> effects(measurement.size() * signal_channels(measurement).size());
        const std::uint32_t* raw = reduction_.raws();
        for (const ReducedRow& row : reduction_.rows())
            for (std::size_t k = 0; k < row.raws; ++k)
                effects[*raw++] = {row.place, points[row.place / values_per_reading]->effects[k]};
        return effects;
    }

    SimdReduction reduction_;
    LinearProgram program_;
    std::vector<RawEffect> effects_;  // by raw channel: row * channels + channel
};

}  // namespace

std::unique_ptr<const BatchMethod> make_linear_batch(const BatchPattern& pattern) {
    return std::make_unique<const LinearBatch>(pattern, passes_of(pattern, pattern.options.uncertainty));
}

}  // namespace stepdiag
