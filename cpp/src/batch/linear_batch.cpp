#include "batch/linear_batch.hpp"

#include <algorithm>
#include <limits>

#include "batch/simd_reduction.hpp"
#include "evaluation/lane_maps.hpp"
#include "stepdiag/evaluation/conventional.hpp"
#include "stepdiag/evaluation/enhanced.hpp"

namespace stepdiag {
namespace {

static_assert(sizeof(LaneRow) == lane_group * sizeof(double));  // rows are read as one array of numbers

bool is_enhanced(const BatchPattern& pattern) { return pattern.options.method == EvaluationMethod::enhanced; }

LengthKind length_kind(const BatchPattern& pattern) {
    return is_enhanced(pattern) ? LengthKind::lever_arm_corrected : LengthKind::distance;
}

Calibration evaluate(const BatchPattern& p) {
    // This only sets the point at which the maps are linear, so no limits apply: samples may lie anywhere.
    const EvaluationOptions options{p.options.uncertainty, false, PlausibleLimits::none(), p.options.expansion};
    return is_enhanced(p) ? evaluate_enhanced(p.measurement, p.plan, p.chain, p.tool, p.heads, options)
                          : evaluate_conventional(p.measurement, p.plan, p.chain, p.tool, p.heads, options);
}

std::vector<Pass> passes_of(const BatchPattern& p, const ReadingUncertainty& uncertainty) {
    return collect_passes(p.measurement, p.plan, p.heads, uncertainty, length_kind(p), p.options.expansion);
}

// The same readings; the standard uncertainty of each one follows from its quantity alone.
Measurement without_uncertainties(const Measurement& measurement) {
    auto channels = measurement.channels();
    for (Channel& channel : channels) channel.standard_uncertainty.clear();
    return Measurement(measurement.stations(), channels);
}

class LinearBatch : public BatchMethod {
public:
    LinearBatch(const BatchPattern& pattern, std::vector<Pass> passes)
        : BatchMethod(evaluate(pattern)),
          passes_(std::move(passes)),
          reduction_(pattern.measurement, pattern.heads, passes_, length_kind(pattern)),
          map_(is_enhanced(pattern) ? enhanced_map(passes_, pattern.plan, pattern.chain, pattern.tool)
                                    : conventional_map(passes_, pattern.plan)),
          effects_(effects_of_raw_channels(pattern)) {}
    LinearBatch(const LinearBatch&) = delete;

    std::unique_ptr<Worker> worker() const override { return std::make_unique<LinearWorker>(*this); }

    Eigen::MatrixXd gain() const override {
        const auto raws = Eigen::Index(effects_.size());
        Eigen::MatrixXd gain(entries.size(), raws);
        Eigen::Matrix<double, lane_group, Eigen::Dynamic> values(lane_group, entries.size());
        for (Eigen::Index begin = 0; begin < raws; begin += lane_group) {
            const Eigen::Index lanes = std::min<Eigen::Index>(lane_group, raws - begin);
            ReadingRows<LaneRow> readings = no_readings();
            for (Eigen::Index lane = 0; lane < lanes; ++lane)
                for (int c = 0; c < values_per_reading; ++c) {
                    const RawEffect& effect = effects_[begin + lane];
                    readings.values[effect.place + c].numbers()[lane] = effect.by_channel[c];
                }
            map_(readings, values.data(), lane_group);
            gain.middleCols(begin, lanes) = values.topRows(lanes).transpose();
        }
        return gain;
    }

private:
    // Change of length, alpha and beta at `place` with one raw channel of one row.
    struct RawEffect {
        std::size_t place = 0;
        ChannelEffect by_channel = ChannelEffect::Zero();
    };

    class LinearWorker : public Worker {
    public:
        explicit LinearWorker(const LinearBatch& batch) : batch_(batch), readings_(batch.no_readings()) {}

        void evaluate(const double* readings, std::size_t lanes, double* values, std::size_t stride) override {
            for (std::size_t lane = 0; lane < lanes; lane += lane_group) {
                const SimdReduction::Lost lost =
                    batch_.reduction_.reduce(readings + lane, lanes, readings_.values.front().numbers());
                batch_.map_(readings_, values + lane, stride);
                for (std::size_t k = 0; k < lane_group; ++k)
                    for (std::size_t output = 0; lost[k] && output < batch_.entries.size(); ++output)
                        values[output * stride + lane + k] = std::numeric_limits<double>::quiet_NaN();
            }
        }

    private:
        const LinearBatch& batch_;
        ReadingRows<LaneRow> readings_;
    };

    ReadingRows<LaneRow> no_readings() const {
        const Pass& last = passes_.back();
        const std::size_t readings = std::size_t(last.first_reading) + last.points.size();
        return {std::vector<LaneRow>(values_per_reading * readings, LaneRow::Zero())};
    }

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

    std::vector<Pass> passes_;
    SimdReduction reduction_;
    LaneMap map_;
    std::vector<RawEffect> effects_;  // for each raw channel: row * channels + channel
};

}  // namespace

std::unique_ptr<const BatchMethod> make_linear_batch(const BatchPattern& pattern) {
    return std::make_unique<const LinearBatch>(pattern, passes_of(pattern, pattern.options.uncertainty));
}

}  // namespace stepdiag
