#include "monte_carlo/leaf_worker.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/block_product.hpp"
#include "stepdiag/core/random_blocks.hpp"

namespace stepdiag {
namespace {

constexpr std::size_t block_bytes = 600'000;  // fits the second-level cache of 1 to 2 MB per core

std::vector<std::size_t> gathered_outputs(const Bins::Content& bins) {
    std::vector<std::size_t> outputs = bins.options.kept;
    for (const auto& set : bins.options.joint) outputs.insert(outputs.end(), set.begin(), set.end());
    if (bins.options.covariance)
        for (std::size_t i = 0; i < bins.outputs.size(); ++i) outputs.push_back(i);
    std::sort(outputs.begin(), outputs.end());
    outputs.erase(std::unique(outputs.begin(), outputs.end()), outputs.end());
    return outputs;
}

std::size_t distance_bin(double distance) {
    return std::size_t(std::min(distance / distance_width, double(distance_bins)));
}

// Asks for the counts of an output while those of another one are counted.
void prefetch(const std::uint16_t* counts, const OutputBins& output) {
    constexpr std::size_t line = 64 / sizeof(std::uint16_t);
    for (std::size_t bin = 0; bin < output.bins; bin += line) __builtin_prefetch(counts + output.offset + bin, 1);
}

// Lower triangle of the sum over samples of (y - mean)(y - mean)^T. Rows of `values` are outputs, `stride` apart. Takes
// m^2 / 2 multiplications per sample for m outputs.
Eigen::MatrixXd outer_products(const double* values, std::size_t stride, std::size_t samples,
                               const Eigen::VectorXd& mean) {
    constexpr Eigen::Index panel = 48;           // columns processed together, a multiple of 6
    constexpr std::size_t samples_at_once = 96;  // deviations of 900 outputs fit the second-level cache
    const Eigen::Index outputs = mean.size();
    const Eigen::Index columns = (outputs + panel - 1) / panel * panel;
    const Eigen::Index rows = columns + widest_vector;  // zeros for vectors that extend beyond the last output
    Eigen::MatrixXd deviations = Eigen::MatrixXd::Zero(rows, Eigen::Index(samples_at_once));
    Eigen::MatrixXd products = Eigen::MatrixXd::Zero(rows, columns);
    for (std::size_t done = 0; done < samples; done += samples_at_once) {
        const Eigen::Index inner = Eigen::Index(std::min(samples_at_once, samples - done));
        for (Eigen::Index i = 0; i < outputs; ++i) {
            const double* value = values + std::size_t(i) * stride + done;
            for (Eigen::Index s = 0; s < inner; ++s) deviations(i, s) = value[s] - mean[i];
        }
        for (Eigen::Index j = 0; j < outputs; j += panel) {
            const double* from = deviations.data() + j;
            subtract_product(outputs - j, panel, inner, {from, rows}, {from, 1, rows},
                             {products.data() + j + j * rows, rows});
        }
    }
    Eigen::MatrixXd sums = Eigen::MatrixXd::Zero(outputs, outputs);
    sums.triangularView<Eigen::Lower>() = -products.topLeftCorner(outputs, outputs);
    return sums;
}

}  // namespace

std::size_t block_samples(std::size_t outputs) {
    const std::size_t samples = block_bytes / (8 * outputs) / lane_group * lane_group;
    return std::clamp<std::size_t>(samples, lane_group, leaf_samples);
}

LeafWorker::LeafWorker(const SampleModel& model, const Bins::Content& bins)
    : bins_(bins), model_(model.worker()), gather_(gathered_outputs(bins)) {
    const std::size_t outputs = bins.outputs.size();
    for (const OutputBins& each : bins.by_output)
        scales_.push_back({each.mean, each.lower, 1.0 / each.width, double(each.bins) + 1.0});
    block_sums_.resize(outputs);
    sums_.resize(outputs);
    block_.resize(outputs * block_samples(outputs));
    indices_.resize(outputs * leaf_samples);
    place_.resize(outputs);
    for (std::size_t row = 0; row < gather_.size(); ++row) place_[gather_[row]] = row;
    gathered_.resize(gather_.size() * leaf_samples);
}

std::optional<Moments> LeafWorker::run(std::uint64_t leaf, Counts& counts, const std::atomic<bool>& stop) {
    constexpr double infinity = std::numeric_limits<double>::infinity();
    std::fill(sums_.begin(), sums_.end(), RowSums{0.0, 0.0, infinity, -infinity});
    lost_.clear();
    samples_ = 0;
    first_sample_ = leaf * leaf_samples;
    const std::size_t outputs = sums_.size(), block = block_samples(outputs);
    for (std::size_t done = 0; done < leaf_samples; done += block) {
        if (stop) return std::nullopt;
        add_block(first_sample_ + done, std::min<std::size_t>(block, leaf_samples - done));
    }
    count(leaf, counts);

    Moments moments{samples_, lost_.size(), Eigen::VectorXd(outputs), Eigen::VectorXd(outputs), {}};
    for (std::size_t i = 0; i < outputs; ++i) {
        moments.first[Eigen::Index(i)] = sums_[i].first;
        moments.second[Eigen::Index(i)] = sums_[i].second;
    }
    if (bins_.options.covariance)
        moments.products = outer_products(gathered_.data(), leaf_samples, samples_, bins_.means());
    return moments;
}

void LeafWorker::add_block(std::uint64_t first_sample, std::size_t samples) {
    const std::size_t outputs = sums_.size();
    model_->evaluate({first_sample, samples, block_.data()});
    sum_and_bin(block_.data(), outputs, samples, scales_.data(), block_sums_.data(), indices_.data() + samples_,
                leaf_samples);
    std::size_t good = samples;
    const auto is_finite = [](const RowSums& sums) { return std::isfinite(sums.second); };
    if (!std::all_of(block_sums_.begin(), block_sums_.end(), is_finite)) {
        good = leave_out_lost(first_sample, samples);
        sum_and_bin_any(block_.data(), outputs, good, samples, scales_.data(), block_sums_.data(),
                        indices_.data() + samples_, leaf_samples);
    }
    for (std::size_t i = 0; i < outputs; ++i) {
        sums_[i].first += block_sums_[i].first;
        sums_[i].second += block_sums_[i].second;
        sums_[i].lowest = std::min(sums_[i].lowest, block_sums_[i].lowest);
        sums_[i].highest = std::max(sums_[i].highest, block_sums_[i].highest);
    }
    for (std::size_t row = 0; row < gather_.size(); ++row)
        std::copy_n(block_.data() + gather_[row] * samples, good, gathered_.data() + row * leaf_samples + samples_);
    samples_ += good;
}

// Moves the samples with a result to the front of each row. Returns their number.
std::size_t LeafWorker::leave_out_lost(std::uint64_t first_sample, std::size_t samples) {
    std::vector<bool> finite(samples, true);
    for (std::size_t i = 0; i < sums_.size(); ++i)
        for (std::size_t s = 0; s < samples; ++s)
            if (!std::isfinite(block_[i * samples + s])) finite[s] = false;
    std::size_t good = 0;
    for (std::size_t s = 0; s < samples; ++s) {
        if (!finite[s]) {
            lost_.push_back(first_sample + s - first_sample_);
            continue;
        }
        if (good < s)
            for (std::size_t i = 0; i < sums_.size(); ++i) block_[i * samples + good] = block_[i * samples + s];
        ++good;
    }
    return good;
}

// Counts one output at a time, so that its bins stay in the first-level cache.
void LeafWorker::count(std::uint64_t leaf, Counts& counts) const {
    std::vector<std::uint16_t>& recent = counts.begin_leaf();
    for (std::size_t i = 0; i < sums_.size(); ++i) {
        std::uint16_t* bins = recent.data() + bins_.by_output[i].offset;
        const std::uint16_t* indices = indices_.data() + i * leaf_samples;
        if (i + 1 < sums_.size()) prefetch(recent.data(), bins_.by_output[i + 1]);
        for (std::size_t s = 0; s < samples_; ++s) ++bins[indices[s]];
        // + 0.0 changes -0.0 to 0.0, so that the bits do not depend on the order
        double& lowest = counts.lowest[Eigen::Index(i)];
        double& highest = counts.highest[Eigen::Index(i)];
        lowest = std::min(lowest, sums_[i].lowest + 0.0);
        highest = std::max(highest, sums_[i].highest + 0.0);
    }
    for (std::size_t i = 0; i < bins_.joint.size(); ++i) count_joint(bins_.joint[i], counts.joint[i]);
    if (!bins_.options.kept.empty()) counts.kept[leaf] = kept();
}

void LeafWorker::count_joint(const JointBins& joint, JointCounts& counts) const {
    const Eigen::Index size = Eigen::Index(joint.outputs.size());
    const Eigen::VectorXd u = joint.covariance.diagonal().cwiseSqrt();
    Eigen::Vector3d deviation = Eigen::Vector3d::Zero();
    for (std::size_t s = 0; s < samples_; ++s) {
        std::size_t cell = 0;
        bool inside = true;
        double rectangle = 0.0, square = 0.0;
        for (Eigen::Index j = 0; j < size; ++j) {
            const double value = values_of(joint.outputs[std::size_t(j)])[s];
            deviation[j] = value - joint.centre[j];
            if (u[j] > 0.0) rectangle = std::max(rectangle, std::abs(deviation[j]) / u[j]);
            const double place = std::floor((value - joint.grid_from[j]) / joint.grid_width[j]);
            inside = inside && place >= 0.0 && place < double(joint.cells[std::size_t(j)]);
            if (inside) cell = cell * joint.cells[std::size_t(j)] + std::size_t(place);
        }
        ++counts.cells[inside ? cell : counts.cells.size() - 1];
        ++counts.rectangle[distance_bin(rectangle)];
        counts.farthest_rectangle = std::max(counts.farthest_rectangle, rectangle);
        if (joint.whitening.rows() == 0) continue;
        for (Eigen::Index i = 0; i < size; ++i) {
            double component = 0.0;
            for (Eigen::Index j = 0; j <= i; ++j) component += joint.whitening(i, j) * deviation[j];
            square += component * component;
        }
        const double distance = std::sqrt(square);
        ++counts.ellipsoid[distance_bin(distance)];
        counts.farthest_ellipsoid = std::max(counts.farthest_ellipsoid, distance);
    }
}

// Values of the kept outputs for each sample of the leaf; NaN for a lost sample.
std::vector<double> LeafWorker::kept() const {
    std::vector<double> values;
    for (const std::size_t output : bins_.options.kept) {
        const double* next = values_of(output);
        auto lost = lost_.begin();
        for (std::uint64_t s = 0; s < leaf_samples; ++s) {
            const bool is_lost = lost != lost_.end() && *lost == s;
            values.push_back(is_lost ? std::numeric_limits<double>::quiet_NaN() : *next++);
            if (is_lost) ++lost;
        }
    }
    return values;
}

}  // namespace stepdiag
