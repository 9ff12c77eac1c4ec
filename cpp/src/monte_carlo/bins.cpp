#include "monte_carlo/bins.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>

#include "stepdiag/core/error.hpp"

namespace stepdiag {
namespace {

// Number of cells of a joint region's grid along each output, for one, two and three outputs.
constexpr std::size_t cells_along[] = {0, 1000, 100, 40};
constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr std::string_view bins_kind = "stepdiag bins 1\n";  // the number is the version of the format

void check_equal(const std::string& what, const std::string& expected, const std::string& got) {
    if (expected != got)
        throw InvalidArgument("statistics of another run: expected " + what + " " + expected + ", got " + got);
}

std::string text(double number) {
    char digits[32];
    return {digits, std::to_chars(digits, digits + sizeof digits, number).ptr};
}

std::string text(const SampleModel::Output& output) {
    return output.name + (std::isnan(output.position) ? "" : " at " + text(output.position) + " mm");
}

void check_same_options(const StatisticsOptions& a, const StatisticsOptions& b) {
    const auto numbers = [](const std::vector<std::size_t>& list) {
        std::string joined = "[";
        for (const std::size_t number : list) joined += (joined.size() > 1 ? ", " : "") + std::to_string(number);
        return joined + "]";
    };
    check_equal("coverage", text(a.coverage), text(b.coverage));
    check_equal("digits", std::to_string(a.digits), std::to_string(b.digits));
    check_equal("covariance", a.covariance ? "true" : "false", b.covariance ? "true" : "false");
    check_equal("kept outputs", numbers(a.kept), numbers(b.kept));
    check_equal("number of joint regions", std::to_string(a.joint.size()), std::to_string(b.joint.size()));
    for (std::size_t i = 0; i < a.joint.size(); ++i)
        check_equal("joint region of outputs", numbers(a.joint[i]), numbers(b.joint[i]));
}

}  // namespace

double numerical_tolerance(double standard_uncertainty, int digits) {
    const auto exponent = [&](double u) { return int(std::floor(std::log10(u))) - digits + 1; };
    const int r = exponent(standard_uncertainty);
    // Rounding can increase the exponent: 9.97 is 10 with two digits, so r is 0 instead of -1.
    const bool rounds_up = std::round(standard_uncertainty / std::pow(10.0, r)) >= std::pow(10.0, digits);
    return 0.5 * std::pow(10.0, rounds_up ? r + 1 : r);
}

OutputBins bins_of(double mean, double standard_uncertainty, double lowest, double highest, int digits) {
    OutputBins bins{mean, standard_uncertainty, lowest, highest, lowest, 1.0, 1, 0};
    const double magnitude = std::max({std::abs(mean), std::abs(lowest), std::abs(highest)});
    // Bins must not be finer than the spacing of floating-point numbers.
    const double finest = 8.0 * std::numeric_limits<double>::epsilon() * magnitude;
    if (!(standard_uncertainty > finest)) {
        bins.width = std::max({finest, highest - lowest, std::numeric_limits<double>::min()});
        return bins;
    }
    // The final u may be in a lower decade than the pilot's u. The margin of 5 % is seven times the scatter of a
    // pilot's u.
    bins.width = std::max(finest, numerical_tolerance(0.95 * standard_uncertainty, digits) / 5.0);
    bins.lower = lowest - 0.5 * standard_uncertainty;
    const double count = std::ceil((highest + 0.5 * standard_uncertainty - bins.lower) / bins.width);
    bins.bins = std::uint32_t(std::min(count, double(largest_bin_count)));
    if (count > largest_bin_count)  // keep the bins about the mean
        bins.lower = std::clamp(mean - 0.5 * largest_bin_count * bins.width, bins.lower,
                                highest + 0.5 * standard_uncertainty - largest_bin_count * bins.width);
    return bins;
}

std::size_t JointBins::cell_count() const {
    std::size_t count = 1;
    for (const std::size_t each : cells) count *= each;
    return count;
}

JointBins joint_bins(const std::vector<std::size_t>& outputs, const Eigen::MatrixXd& values) {
    JointBins bins;
    bins.outputs = outputs;
    bins.centre = values.rowwise().mean();
    const Eigen::MatrixXd deviations = values.colwise() - bins.centre;
    bins.covariance = deviations * deviations.transpose() / double(std::max<Eigen::Index>(values.cols() - 1, 1));
    const Eigen::VectorXd u = bins.covariance.diagonal().cwiseSqrt();
    // Scale by u, because outputs may have different units (mm and rad).
    const Eigen::VectorXd unit = u.unaryExpr([](double each) { return each > 0.0 ? 1.0 / each : 1.0; });
    const Eigen::LLT<Eigen::MatrixXd> cholesky(unit.asDiagonal() * bins.covariance * unit.asDiagonal());
    const Eigen::Index size = values.rows();
    // There is no ellipsoid if a correlation is 1 within rounding.
    if (cholesky.info() == Eigen::Success && cholesky.matrixLLT().diagonal().minCoeff() > 1e-6) {
        bins.whitening = cholesky.matrixL().solve(Eigen::MatrixXd::Identity(size, size));
        bins.whitening = bins.whitening * unit.asDiagonal();
    } else {
        bins.whitening.resize(0, size);
    }
    bins.cells.assign(outputs.size(), cells_along[outputs.size()]);
    bins.grid_from = values.rowwise().minCoeff() - 0.5 * u;
    bins.grid_width = (values.rowwise().maxCoeff() + 0.5 * u - bins.grid_from) / double(bins.cells[0]);
    for (double& width : bins.grid_width)
        if (!(width > 0.0)) width = 1.0;
    return bins;
}

Eigen::VectorXd Bins::Content::means() const {
    Eigen::VectorXd means(by_output.size());
    for (std::size_t i = 0; i < by_output.size(); ++i) means[Eigen::Index(i)] = by_output[i].mean;
    return means;
}

const std::vector<SampleModel::Output>& Bins::outputs() const { return content_->outputs; }
const StatisticsOptions& Bins::options() const { return content_->options; }
std::uint64_t Bins::seed() const { return content_->seed; }
const std::string& Bins::target() const { return content_->target; }
std::size_t Bins::counts() const { return content_->counts; }

void check_same_run(const Bins& bins, const Bins& other) {
    const Bins::Content &a = bins.content(), &b = other.content();
    if (&a == &b) return;
    check_equal("number of outputs", std::to_string(a.outputs.size()), std::to_string(b.outputs.size()));
    for (std::size_t i = 0; i < a.outputs.size(); ++i) {
        check_equal("output", text(a.outputs[i]), text(b.outputs[i]));
        check_equal("unit of " + a.outputs[i].name, a.outputs[i].unit, b.outputs[i].unit);
    }
    check_equal("seed", std::to_string(a.seed), std::to_string(b.seed));
    check_equal("instruction set", a.target, b.target);
    check_same_options(a.options, b.options);
    for (std::size_t i = 0; i < a.by_output.size(); ++i) {
        const OutputBins &of_a = a.by_output[i], &of_b = b.by_output[i];
        const std::string of = "another model: over the pilot run " + text(a.outputs[i]) + " has the ";
        check_equal(of + "mean", text(of_a.mean), text(of_b.mean));
        check_equal(of + "standard uncertainty", text(of_a.standard_uncertainty), text(of_b.standard_uncertainty));
        check_equal(of + "lowest value", text(of_a.lowest), text(of_b.lowest));
        check_equal(of + "highest value", text(of_a.highest), text(of_b.highest));
    }
}

Counts::Counts(const Bins::Content& bins)
    : by_bin(bins.counts),
      lowest(Eigen::VectorXd::Constant(Eigen::Index(bins.outputs.size()), infinity)),
      highest(Eigen::VectorXd::Constant(Eigen::Index(bins.outputs.size()), -infinity)) {
    for (const JointBins& each : bins.joint) {
        const std::size_t distances = each.whitening.rows() > 0 ? distance_bins + 1 : 0;
        joint.push_back({std::vector<std::uint32_t>(distances), std::vector<std::uint32_t>(distance_bins + 1), 0.0, 0.0,
                         std::vector<std::uint32_t>(each.cell_count() + 1)});
    }
}

std::vector<std::uint16_t>& Counts::begin_leaf() {
    if (recent_leaves == std::numeric_limits<std::uint16_t>::max() / int(leaf_samples)) settle();
    recent.resize(by_bin.size());
    ++recent_leaves;
    return recent;
}

void Counts::settle() {
    if (recent_leaves == 0) return;
    for (std::size_t i = 0; i < by_bin.size(); ++i) by_bin[i] += recent[i];
    std::fill(recent.begin(), recent.end(), std::uint16_t(0));
    recent_leaves = 0;
}

void Counts::operator+=(const Counts& other) {
    const auto add = [](std::vector<std::uint32_t>& to, const std::vector<std::uint32_t>& from) {
        for (std::size_t i = 0; i < to.size(); ++i) to[i] += from[i];
    };
    add(by_bin, other.by_bin);
    lowest = lowest.cwiseMin(other.lowest);
    highest = highest.cwiseMax(other.highest);
    for (std::size_t i = 0; i < joint.size(); ++i) {
        add(joint[i].ellipsoid, other.joint[i].ellipsoid);
        add(joint[i].rectangle, other.joint[i].rectangle);
        add(joint[i].cells, other.joint[i].cells);
        joint[i].farthest_ellipsoid = std::max(joint[i].farthest_ellipsoid, other.joint[i].farthest_ellipsoid);
        joint[i].farthest_rectangle = std::max(joint[i].farthest_rectangle, other.joint[i].farthest_rectangle);
    }
    kept.insert(other.kept.begin(), other.kept.end());
}

// --- as bytes ---

namespace {

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

}  // namespace

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

}  // namespace stepdiag
