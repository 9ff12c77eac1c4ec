#include "monte_carlo/partial_statistics.hpp"

#include <cmath>
#include <limits>

#include "monte_carlo/coverage_intervals.hpp"
#include "monte_carlo/joint_regions.hpp"

namespace stepdiag {
namespace {

constexpr std::string_view statistics_kind = "stepdiag statistics 1\n";  // the number is the version of the format

// Values of all samples in the order of their indices. Samples of missing leaves are omitted.
std::map<std::size_t, std::vector<double>> kept_values(const StatisticsOptions& options, const Counts& counts) {
    std::map<std::size_t, std::vector<double>> kept;
    for (std::size_t i = 0; i < options.kept.size(); ++i) {
        std::vector<double>& values = kept[options.kept[i]];
        for (const auto& [leaf, all] : counts.kept) {
            const auto from = all.begin() + std::ptrdiff_t(i * leaf_samples);
            values.insert(values.end(), from, from + std::ptrdiff_t(leaf_samples));
        }
    }
    return kept;
}

// NaN for fewer than two samples.
Eigen::VectorXd standard_uncertainties(const Moments& moments) {
    const double n = double(moments.samples);
    if (moments.samples < 2)
        return Eigen::VectorXd::Constant(moments.first.size(), std::numeric_limits<double>::quiet_NaN());
    return ((moments.second.array() - moments.first.array().square() / n) / (n - 1.0)).max(0.0).sqrt();
}

Eigen::MatrixXd covariance(const Moments& moments) {
    const double n = double(moments.samples);
    Eigen::MatrixXd products = moments.products.selfadjointView<Eigen::Lower>();
    products.noalias() -= moments.first * moments.first.transpose() / n;
    return products / (n - 1.0);
}

}  // namespace

Eigen::VectorXd standard_uncertainties(const PartialStatistics::State& state) {
    return standard_uncertainties(state.tree.total(Eigen::Index(state.bins.outputs().size())));
}

Eigen::ArrayX4d main_figures(const PartialStatistics::State& state) {
    const Bins::Content& bins = state.bins.content();
    const Moments total = state.tree.total(Eigen::Index(bins.outputs.size()));
    Eigen::ArrayX4d figures(total.first.size(), 4);
    figures.setConstant(std::numeric_limits<double>::quiet_NaN());
    if (total.samples < 2) return figures;
    figures.col(0) = bins.means() + total.first / double(total.samples);
    figures.col(1) = standard_uncertainties(total);
    for (Eigen::Index i = 0; i < figures.rows(); ++i) {
        const OutputBins& of_output = bins.by_output[std::size_t(i)];
        const CountedValues values(of_output, state.counts.by_bin.data() + of_output.offset, state.counts.lowest[i],
                                   state.counts.highest[i]);
        figures.row(i).tail(2) = values.symmetric_interval(bins.options.coverage).array();
    }
    return figures;
}

PartialStatistics::PartialStatistics(const Bins& bins)
    : state_(std::make_unique<State>(State{bins, {}, Counts(bins.content())})) {}
PartialStatistics::PartialStatistics(PartialStatistics&&) noexcept = default;
PartialStatistics& PartialStatistics::operator=(PartialStatistics&&) noexcept = default;
PartialStatistics::~PartialStatistics() = default;

const Bins& PartialStatistics::bins() const { return state_->bins; }
std::vector<LeafRange> PartialStatistics::leaves() const { return state_->tree.leaves(); }

std::uint64_t PartialStatistics::samples() const {
    std::uint64_t samples = 0;
    for (const auto& [leaf, node] : state_->tree.nodes()) samples += node.moments.samples;
    return samples;
}

std::uint64_t PartialStatistics::lost() const {
    std::uint64_t lost = 0;
    for (const auto& [leaf, node] : state_->tree.nodes()) lost += node.moments.lost;
    return lost;
}

void PartialStatistics::merge(const PartialStatistics& other) {
    check_same_run(bins(), other.bins());
    state_->tree.add(other.state_->tree);
    state_->counts += other.state_->counts;
}

MonteCarloResult PartialStatistics::result() const {
    const Bins::Content& bins = state_->bins.content();
    const Counts& counts = state_->counts;
    const Eigen::Index outputs = Eigen::Index(bins.outputs.size());
    const Moments total = state_->tree.total(outputs);
    const double nan = std::numeric_limits<double>::quiet_NaN(), n = double(total.samples);

    MonteCarloResult result{bins.outputs, bins.options, bins.seed, bins.target, total.samples, total.lost,
                            {},           {},           {},        {},          counts.lowest, counts.highest,
                            {},           {},           {},        {}};
    result.mean = bins.means() + total.first / n;
    result.standard_uncertainty = standard_uncertainties(total);
    result.symmetric = result.shortest = Eigen::MatrixX2d::Constant(outputs, 2, nan);
    result.outside.assign(bins.outputs.size(), 0);
    if (total.samples == 0) {
        result.mean.setConstant(nan);
        result.lowest.setConstant(nan);
        result.highest.setConstant(nan);
    }
    for (Eigen::Index i = 0; total.samples > 0 && i < outputs; ++i) {
        const OutputBins& of_output = bins.by_output[std::size_t(i)];
        const std::uint32_t* of_bin = counts.by_bin.data() + of_output.offset;
        const CountedValues values(of_output, of_bin, result.lowest[i], result.highest[i]);
        result.symmetric.row(i) = values.symmetric_interval(bins.options.coverage);
        result.shortest.row(i) = values.shortest_interval(bins.options.coverage);
        result.outside[std::size_t(i)] = std::uint64_t(of_bin[0]) + of_bin[of_output.bins + 1];
    }
    if (bins.options.covariance && total.samples > 1) result.covariance = covariance(total);
    result.kept = kept_values(bins.options, counts);
    for (std::size_t i = 0; i < bins.joint.size(); ++i)
        result.joint.push_back(joint_region(bins.joint[i], counts.joint[i], bins.options.coverage));
    return result;
}

std::string PartialStatistics::to_bytes() const {
    ByteWriter to(statistics_kind);
    write(to, bins().content());
    to.size(state_->tree.nodes().size());
    for (const auto& [first_leaf, node] : state_->tree.nodes()) {
        to.number(first_leaf);
        to.number(std::int32_t(node.level));
        write(to, node.moments);
    }
    write(to, state_->counts);
    return std::move(to).finish();
}

PartialStatistics PartialStatistics::from_bytes(std::string_view bytes) {
    ByteReader from(bytes, statistics_kind, "statistics");
    PartialStatistics part(read_bins(from));
    const Bins::Content& bins = part.bins().content();
    const std::size_t nodes = from.size();
    for (std::size_t i = 0; i < nodes; ++i) {
        const auto first_leaf = from.number<std::uint64_t>();
        const int level = from.number<std::int32_t>();
        from.expect(level >= 0 && level < 32 && first_leaf < largest_leaf_count);
        part.state_->tree.add(first_leaf, {level, read_moments(from, bins.outputs.size(), bins.options.covariance)});
    }
    read_counts(from, bins.options.kept.size(), part.state_->counts);
    from.finish();
    return part;
}

}  // namespace stepdiag
