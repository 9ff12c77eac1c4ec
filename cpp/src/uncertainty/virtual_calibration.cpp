#include "stepdiag/uncertainty/virtual_calibration.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <limits>
#include <sstream>

#include "stepdiag/core/error.hpp"
#include "stepdiag/core/instruction_set.hpp"
#include "stepdiag/core/random.hpp"
#include "stepdiag/core/random_blocks.hpp"
#include "uncertainty/run_model.hpp"
#include "uncertainty/scalar_sampler.hpp"
#include "uncertainty/simd_sampler.hpp"

namespace stepdiag {
namespace {

Measurement measurement_of(const RunModel& model, const Eigen::VectorXd& readings) {
    std::vector<PlannedPass> passes;
    for (const RunPass& pass : model.passes) passes.push_back(pass.planned);
    std::vector<SignalRow> rows(model.rows.size());
    for (std::size_t r = 0; r < rows.size(); ++r)
        for (std::size_t c = 0; c < model.channels.size(); ++c) {
            const double value = readings[Eigen::Index(r * model.channels.size() + c)];
            rows[r].push_back(std::isnan(value) ? std::nullopt : std::optional(value));
        }
    return as_measured(passes, model.channels, rows, model.run.simulation);
}

std::string unit_of(const std::string& parameter) {
    return parameter.size() == 3 && parameter[1] >= 'X' && parameter[1] <= 'Z' ? "mm" : "rad";
}

}  // namespace

Eigen::VectorXd drawn_inputs(const UncertainInputs& inputs, std::uint64_t seed, std::uint64_t sample) {
    return Draws(inputs, seed).inputs(sample);
}

struct VirtualCalibrations::State {
    State(const VirtualRun& run, const BatchOptions& evaluation, std::uint64_t seed, std::vector<DerivedOutput> given)
        : model(run, seed),
          scalar(model),
          simd(SimdSampler::make(model)),
          nominal(measurement_of(model, scalar.readings(model.draws.expectations(), std::nullopt))),
          evaluator(nominal, run.plan, run.machine.chain(), run.machine.tool(), run.calibration, evaluation),
          derived(std::move(given)) {
        for (const CalibrationEntry& entry : evaluator.entries())
            outputs.push_back({entry.parameter, entry.position, unit_of(entry.parameter)});
        for (const DerivedOutput& output : derived) {
            if (output.row.size() != Eigen::Index(evaluator.entries().size()) || !output.row.allFinite())
                throw InvalidArgument("derived output " + output.name + ": expected " +
                                      std::to_string(evaluator.entries().size()) + " finite coefficients");
            outputs.push_back({output.name, std::numeric_limits<double>::quiet_NaN(), output.unit});
        }
    }

    const RunModel model;
    const ScalarSampler scalar;
    const std::unique_ptr<const SimdSampler> simd;  // none: all samples are read one by one
    const Measurement nominal;
    const BatchEvaluator evaluator;
    const std::vector<DerivedOutput> derived;
    std::vector<Output> outputs;
    mutable std::atomic<std::uint64_t> replayed{0}, traced{0}, verified{0};
};

namespace {

constexpr std::size_t lanes = lane_group;  // at a time: readings of all rows stay in the cache

// Far above rounding, far below what another path would do: 1e-9 mm and 1e-13 of the path (as traced_head), 1e-12 rad.
double rounding(const std::string& channel, double value) {
    return channel == "alpha" || channel == "beta" ? 1e-12 : 1e-9 + 2e-13 * std::abs(value);
}

}  // namespace

// What a thread writes to.
class VirtualCalibrations::Lanes : public SampleModel::Worker {
public:
    explicit Lanes(const State& state)
        : state_(state),
          worker_(state.evaluator),
          readings_(state.model.rows.size() * state.model.channels.size()),
          deviations_(state.model.run.inputs.inputs.size() * lanes) {
        if (state.simd) scratch_.emplace(*state.simd);
    }

    void evaluate(const SampleBlock& block) override {
        for (std::size_t first = 0; first < block.samples; first += lanes) {
            const std::uint64_t sample = block.first_sample + first;
            state_.model.draws.inputs(sample, lanes, deviations_.data());
            read(sample);
            finish(block.outputs + first, block.samples);
        }
    }
    // A column of deviations each lane, the last of them repeated where there are fewer; without noise.
    void evaluate(const Eigen::Ref<const Eigen::MatrixXd>& deviations, double* outputs, std::size_t stride) {
        for (Eigen::Index i = 0; i < deviations.rows(); ++i)
            for (std::size_t lane = 0; lane < lanes; ++lane)
                deviations_[std::size_t(i) * lanes + lane] =
                    deviations(i, std::min<Eigen::Index>(Eigen::Index(lane), deviations.cols() - 1));
        read(std::nullopt);
        finish(outputs, stride);
    }

private:
    void read(std::optional<std::uint64_t> first_sample) {
        std::array<std::uint8_t, lanes> followed{};
        if (state_.simd) {
            state_.simd->trace(deviations_.data(), first_sample, *scratch_, readings_.front().value, followed.data());
            if (first_sample) {
                for (std::size_t lane = 0; lane < lanes; ++lane)
                    if (followed[lane]) verify(*first_sample, lane);
                state_.simd->add_noise(*first_sample, *scratch_, readings_.front().value);
            }
        }
        std::uint64_t replayed = 0;
        for (std::size_t lane = 0; lane < lanes; ++lane) {
            replayed += followed[lane];
            if (!followed[lane])
                put(lane, read_scalar(lane, first_sample ? std::optional(*first_sample + lane) : std::nullopt));
        }
        if (first_sample) state_.replayed += replayed, state_.traced += lanes - replayed;
    }

    Eigen::VectorXd deviations(std::size_t lane) const {
        return Eigen::Map<const Eigen::VectorXd, 0, Eigen::InnerStride<>>(
            deviations_.data() + lane, Eigen::Index(deviations_.size() / lanes), Eigen::InnerStride<>(lanes));
    }
    // A sample that cannot be (air out of its equation's range) has lost all readings.
    Eigen::VectorXd read_scalar(std::size_t lane, std::optional<std::uint64_t> sample) const {
        try {
            return state_.scalar.readings(deviations(lane), sample);
        } catch (const InvalidArgument&) {
            return Eigen::VectorXd::Constant(Eigen::Index(readings_.size()), std::numeric_limits<double>::quiet_NaN());
        }
    }
    void put(std::size_t lane, const Eigen::VectorXd& readings) {
        for (Eigen::Index i = 0; i < readings.size(); ++i) readings_[std::size_t(i)].value[lane] = readings[i];
    }

    // Of a share of the samples one reading of each pass is traced again.
    void verify(std::uint64_t first_sample, std::size_t lane) const {
        const RunModel& model = state_.model;
        const std::uint64_t sample = first_sample + lane;
        const auto uniform = [&](std::uint32_t item) {
            return uniform_pair(model.draws.seed(), RandomStream::verification, RandomBlock{sample, item})[0];
        };
        if (!(uniform(0) < model.run.simulation.verified_share)) return;
        ++state_.verified;
        const std::size_t channels = model.channels.size();
        std::vector<std::size_t> rows;
        for (const RunPass& pass : model.passes) {
            const double u = uniform(std::uint32_t(rows.size() + 1));
            rows.push_back(pass.first_row() + std::size_t(u * double(pass.rows())));
        }
        const Eigen::MatrixXd traced = state_.scalar.trace(deviations(lane), sample, rows);
        for (std::size_t v = 0; v < rows.size(); ++v) {
            for (std::size_t c = 0; c < channels; ++c) {
                const double found = readings_[rows[v] * channels + c].value[lane];
                const double expected = traced(Eigen::Index(v), Eigen::Index(c));
                if (std::abs(found - expected) <= rounding(model.channels[c], expected)) continue;
                std::ostringstream text;
                text.precision(17);
                text << "virtual calibration: sample " << sample << ", line " << model.passes[v].planned.line.name()
                     << ", row " << rows[v] << ": " << model.channels[c] << " is " << found << " by replay and "
                     << expected
                     << " when traced: another face came into its way; with a verified share of 1 every pose is traced "
                        "instead";
                throw ReplayMismatch(text.str());
            }
        }
    }

    void finish(double* outputs, std::size_t stride) {
        worker_.evaluate(readings_.front().value, lanes, outputs, stride);
        const std::size_t entries = state_.evaluator.entries().size();
        for (std::size_t d = 0; d < state_.derived.size(); ++d) {
            double* const sum = outputs + (entries + d) * stride;
            std::fill_n(sum, lanes, 0.0);
            for (std::size_t e = 0; e < entries; ++e) {
                const double factor = state_.derived[d].row[Eigen::Index(e)];
                if (factor == 0.0) continue;
                for (std::size_t lane = 0; lane < lanes; ++lane) sum[lane] += factor * outputs[e * stride + lane];
            }
        }
    }

    const State& state_;
    BatchEvaluator::Worker worker_;
    std::optional<SimdSampler::Scratch> scratch_;
    std::vector<SimdRow> readings_;  // by row and channel
    std::vector<double> deviations_;
};

VirtualCalibrations::VirtualCalibrations(const VirtualRun& run, const BatchOptions& evaluation, std::uint64_t seed,
                                         std::vector<DerivedOutput> derived)
    : state_(std::make_unique<const State>(run, evaluation, seed, std::move(derived))) {}
VirtualCalibrations::~VirtualCalibrations() = default;

const std::vector<SampleModel::Output>& VirtualCalibrations::outputs() const { return state_->outputs; }
std::uint64_t VirtualCalibrations::seed() const { return state_->model.draws.seed(); }
std::string VirtualCalibrations::target() const { return instruction_set(); }
std::unique_ptr<SampleModel::Worker> VirtualCalibrations::worker() const { return std::make_unique<Lanes>(*state_); }
const BatchEvaluator& VirtualCalibrations::evaluator() const { return state_->evaluator; }
const Measurement& VirtualCalibrations::nominal() const { return state_->nominal; }
bool VirtualCalibrations::is_in_lanes() const { return state_->simd != nullptr; }
SampleCount VirtualCalibrations::count() const {
    return {state_->replayed.load(), state_->traced.load(), state_->verified.load()};
}

Eigen::MatrixXd VirtualCalibrations::evaluate_at(const Eigen::MatrixXd& deviations) const {
    const auto inputs = Eigen::Index(state_->model.run.inputs.inputs.size());
    if (deviations.rows() != inputs || !deviations.allFinite())
        throw InvalidArgument("deviations: expected " + std::to_string(inputs) + " finite rows, got " +
                              std::to_string(deviations.rows()));
    Lanes worker(*state_);
    Eigen::MatrixXd result(Eigen::Index(state_->outputs.size()), deviations.cols());
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> block(result.rows(), Eigen::Index(lanes));
    for (Eigen::Index first = 0; first < deviations.cols(); first += Eigen::Index(lanes)) {
        const Eigen::Index count = std::min(Eigen::Index(lanes), deviations.cols() - first);
        worker.evaluate(deviations.middleCols(first, count), block.data(), lanes);
        result.middleCols(first, count) = block.leftCols(count);
    }
    return result;
}

Eigen::VectorXd VirtualCalibrations::readings(std::uint64_t sample) const {
    return state_->scalar.readings(state_->model.draws.inputs(sample), sample);
}

const VirtualRun& VirtualCalibrations::run() const { return state_->model.run; }
const std::vector<DerivedOutput>& VirtualCalibrations::derived() const { return state_->derived; }

}  // namespace stepdiag
