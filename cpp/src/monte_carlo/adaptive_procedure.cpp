#include "stepdiag/monte_carlo/adaptive_procedure.hpp"

#include <cmath>
#include <limits>

#include "monte_carlo/partial_statistics.hpp"
#include "stepdiag/core/error.hpp"

namespace stepdiag {
namespace {

constexpr std::string_view adaptive_kind = "stepdiag adaptive 1\n";  // the number is the version of the format

}  // namespace

AdaptiveProcedure::AdaptiveProcedure(const Bins& bins)
    : bins_(bins),
      average_(Eigen::ArrayX4d::Zero(Eigen::Index(bins.outputs().size()), 4)),
      squares_(Eigen::ArrayX4d::Zero(Eigen::Index(bins.outputs().size()), 4)) {}

std::uint64_t AdaptiveProcedure::leaves_per_block(double coverage) {
    const double rounding = 1e-9;  // because 100 / (1 - 0.99) is slightly more than 10,000
    const double samples = std::max(std::ceil(100.0 / (1.0 - coverage) * (1.0 - rounding)), 1e4);
    return std::uint64_t(std::ceil(samples / double(leaf_samples)));
}

LeafRange AdaptiveProcedure::next_block() const {
    const std::uint64_t size = leaves_per_block(bins_.options().coverage);
    return {blocks_ * size, (blocks_ + 1) * size};
}

void AdaptiveProcedure::add(const PartialStatistics& block, PartialStatistics& all) {
    check_same_run(bins_, block.bins());
    if (block.leaves() != std::vector<LeafRange>{next_block()})
        throw InvalidArgument("adaptive procedure: expected the leaves " + std::to_string(next_block().first) + " to " +
                              std::to_string(next_block().second));
    if (block.samples() < 2)
        throw InvalidArgument("adaptive procedure: block " + std::to_string(blocks_) + " has no samples with a result");
    const Eigen::ArrayX4d figures = main_figures(block.state());
    all.merge(block);
    const Eigen::ArrayX4d from_old = figures - average_;
    average_ += from_old / double(++blocks_);
    squares_ += from_old * (figures - average_);
}

Stability AdaptiveProcedure::stability(const PartialStatistics& all) const {
    if (blocks_ < 2)
        return {blocks_, std::numeric_limits<double>::infinity(), 0, Stability::Figure::mean, bins_.outputs().size()};
    Stability stability{blocks_, 0.0, 0, Stability::Figure::mean, 0};
    const double h = double(blocks_);
    const Eigen::VectorXd u = standard_uncertainties(all.state());
    for (Eigen::Index i = 0; i < u.size(); ++i) {
        // Skip an output that varies by rounding only; it has no significant digits.
        const OutputBins& of_output = bins_.content().by_output[std::size_t(i)];
        if (of_output.bins == 1 || !(u[i] > 0.0)) continue;
        const double tolerance = numerical_tolerance(u[i], bins_.options().digits);
        bool unstable = false;
        for (int figure = 0; figure < 4; ++figure) {
            const double ratio = 2.0 * std::sqrt(squares_(i, figure) / (h * (h - 1.0))) / tolerance;
            unstable = unstable || ratio > 1.0;
            if (ratio > stability.ratio) {
                stability.ratio = ratio;
                stability.output = std::size_t(i);
                stability.figure = Stability::Figure(figure);
            }
        }
        stability.unstable += unstable;
    }
    return stability;
}

MonteCarloResult AdaptiveProcedure::result(const PartialStatistics& all) const {
    MonteCarloResult result = all.result();
    result.stability = stability(all);
    return result;
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
