// Bins, partial statistics and the adaptive procedure as bytes.
#include <string>

#include "stepdiag/core/error.hpp"
#include "monte_carlo/byte_format.hpp"
#include "monte_carlo/partial_statistics.hpp"

namespace stepdiag {
namespace {

// The number at the end: the version of the format.
constexpr std::string_view bins_kind = "stepdiag bins 1\n";
constexpr std::string_view statistics_kind = "stepdiag statistics 1\n";
constexpr std::string_view adaptive_kind = "stepdiag adaptive 1\n";

void write(ByteWriter& to, const StatisticsOptions& options) {
    to.number(options.coverage);
    to.number(std::int32_t(options.digits));
    to.number(std::uint8_t(options.covariance));
    to.indices(options.kept);
    to.size(options.joint.size());
    for (const auto& set : options.joint) to.indices(set);
}

StatisticsOptions read_options(ByteReader& from) {
    StatisticsOptions options;
    options.coverage = from.number<double>();
    options.digits = from.number<std::int32_t>();
    options.covariance = from.number<std::uint8_t>() != 0;
    options.kept = from.indices();
    options.joint.resize(from.size());
    for (auto& set : options.joint) set = from.indices();
    return options;
}

void write(ByteWriter& to, const JointBins& joint) {
    to.indices(joint.outputs);
    to.matrix(joint.centre);
    to.matrix(joint.covariance);
    to.matrix(joint.whitening);
    to.matrix(joint.grid_from);
    to.matrix(joint.grid_width);
    to.indices(joint.cells);
}

JointBins read_joint(ByteReader& from) {
    JointBins joint;
    joint.outputs = from.indices();
    joint.centre = from.matrix().reshaped();
    joint.covariance = from.matrix();
    joint.whitening = from.matrix();
    joint.grid_from = from.matrix().reshaped();
    joint.grid_width = from.matrix().reshaped();
    joint.cells = from.indices();
    from.expect(joint.outputs.size() <= 3 && joint.cells.size() == joint.outputs.size());
    for (const std::size_t cells : joint.cells) from.expect(cells > 0 && cells <= 1000);
    for (const Eigen::Index size : {joint.centre.size(), joint.covariance.rows(), joint.covariance.cols(),
                                    joint.whitening.cols(), joint.grid_from.size(), joint.grid_width.size()})
        from.expect(size == Eigen::Index(joint.outputs.size()));
    return joint;
}

void write(ByteWriter& to, const Bins::Content& bins) {
    write(to, bins.options);
    to.number(bins.seed);
    to.text(bins.target);
    to.size(bins.outputs.size());
    for (std::size_t i = 0; i < bins.outputs.size(); ++i) {
        to.text(bins.outputs[i].name);
        to.number(bins.outputs[i].position);
        to.text(bins.outputs[i].unit);
        const OutputBins& each = bins.by_output[i];
        for (const double number :
             {each.mean, each.standard_uncertainty, each.lowest, each.highest, each.lower, each.width})
            to.number(number);
        to.number(each.bins);
    }
    to.size(bins.joint.size());
    for (const JointBins& joint : bins.joint) write(to, joint);
}

Bins read_bins(ByteReader& from) {
    auto bins = std::make_shared<Bins::Content>();
    bins->options = read_options(from);
    bins->seed = from.number<std::uint64_t>();
    bins->target = from.text();
    const std::size_t outputs = from.size();
    for (std::size_t i = 0; i < outputs; ++i) {
        SampleModel::Output output;
        output.name = from.text();
        output.position = from.number<double>();
        output.unit = from.text();
        bins->outputs.push_back(std::move(output));
        OutputBins each;
        for (double* number :
             {&each.mean, &each.standard_uncertainty, &each.lowest, &each.highest, &each.lower, &each.width})
            *number = from.number<double>();
        each.bins = from.number<std::uint32_t>();
        from.expect(each.bins > 0 && each.bins <= largest_bin_count);
        each.offset = bins->counts;
        bins->counts += std::size_t(each.bins) + 2;
        bins->by_output.push_back(each);
    }
    const std::size_t joint = from.size();
    for (std::size_t i = 0; i < joint; ++i) bins->joint.push_back(read_joint(from));
    from.expect(outputs > 0 && joint == bins->options.joint.size());
    for (const JointBins& each : bins->joint)
        for (const std::size_t output : each.outputs) from.expect(output < outputs);
    return Bins(bins);
}

void write(ByteWriter& to, const Moments& moments) {
    to.number(moments.samples);
    to.number(moments.lost);
    to.doubles(moments.first.data(), std::size_t(moments.first.size()));
    to.doubles(moments.second.data(), std::size_t(moments.second.size()));
    to.matrix(moments.products);
}

Moments read_moments(ByteReader& from, std::size_t outputs, bool covariance) {
    Moments moments;
    moments.samples = from.number<std::uint64_t>();
    moments.lost = from.number<std::uint64_t>();
    for (Eigen::VectorXd* sums : {&moments.first, &moments.second}) {
        sums->resize(Eigen::Index(outputs));
        from.doubles(sums->data(), outputs);
    }
    moments.products = from.matrix();
    const Eigen::Index size = covariance ? Eigen::Index(outputs) : 0;
    from.expect(moments.products.rows() == size && moments.products.cols() == size);
    return moments;
}

void write(ByteWriter& to, const Counts& counts) {
    to.counts(counts.by_bin);
    to.doubles(counts.lowest.data(), std::size_t(counts.lowest.size()));
    to.doubles(counts.highest.data(), std::size_t(counts.highest.size()));
    for (const JointCounts& joint : counts.joint) {
        to.counts(joint.ellipsoid);
        to.counts(joint.rectangle);
        to.counts(joint.cells);
        to.number(joint.farthest_ellipsoid);
        to.number(joint.farthest_rectangle);
    }
    to.size(counts.kept.size());
    for (const auto& [leaf, values] : counts.kept) {
        to.number(leaf);
        to.doubles(values.data(), values.size());
    }
}

void read_counts(ByteReader& from, std::size_t kept_outputs, Counts& counts) {
    from.counts(counts.by_bin);
    from.doubles(counts.lowest.data(), std::size_t(counts.lowest.size()));
    from.doubles(counts.highest.data(), std::size_t(counts.highest.size()));
    for (JointCounts& joint : counts.joint) {
        from.counts(joint.ellipsoid);
        from.counts(joint.rectangle);
        from.counts(joint.cells);
        joint.farthest_ellipsoid = from.number<double>();
        joint.farthest_rectangle = from.number<double>();
    }
    const std::size_t kept = from.size();
    for (std::size_t i = 0; i < kept; ++i) {
        const auto leaf = from.number<std::uint64_t>();
        std::vector<double>& values = counts.kept[leaf];
        values.resize(kept_outputs * leaf_samples);
        from.doubles(values.data(), values.size());
    }
}

}  // namespace

std::string Bins::to_bytes() const {
    ByteWriter to(bins_kind);
    write(to, content());
    return std::move(to).finish();
}

Bins Bins::from_bytes(std::string_view bytes) {
    ByteReader from(bytes, bins_kind, "bins");
    Bins bins = read_bins(from);
    from.finish();
    return bins;
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

std::string AdaptiveProcedure::to_bytes() const {
    ByteWriter to(adaptive_kind);
    write(to, bins_.content());
    to.number(blocks_);
    to.matrix(average_.matrix());
    to.matrix(squares_.matrix());
    return std::move(to).finish();
}

AdaptiveProcedure AdaptiveProcedure::from_bytes(std::string_view bytes) {
    ByteReader from(bytes, adaptive_kind, "adaptive procedure");
    AdaptiveProcedure procedure(read_bins(from));
    procedure.blocks_ = from.number<std::uint64_t>();
    const Eigen::MatrixXd average = from.matrix(), squares = from.matrix();
    from.expect(average.cols() == 4 && squares.cols() == 4);
    procedure.average_ = average.array();
    procedure.squares_ = squares.array();
    const Eigen::Index outputs = Eigen::Index(procedure.bins_.outputs().size());
    from.expect(procedure.average_.rows() == outputs && procedure.squares_.rows() == outputs);
    from.finish();
    return procedure;
}

}  // namespace stepdiag
