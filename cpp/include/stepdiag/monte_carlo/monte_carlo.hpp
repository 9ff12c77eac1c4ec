// Monte Carlo method of JCGM 101:2008 and JCGM 102:2011 for any SampleModel. The memory does not depend on the number
// of samples.
//
// Samples are grouped in leaves of 2,000. A pilot run over the first 10,000 samples determines two things for every
// output: a reference mean for the sums, and bins for counting values. One thread computes each leaf from start to end.
// The sums over leaves are merged in a binary tree over the leaf numbers. For one instruction set, the bits of a result
// therefore depend only on the set of leaves. They do not depend on the number of threads, on the machine that computed
// a leaf, or on the order of merging.
//
// The width of a bin is at most a fifth of the numerical tolerance delta = 10^r / 2, where u = c 10^r and c is an
// integer with `digits` digits (JCGM 101, 7.9.2). Coverage intervals are interpolated within bins.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "stepdiag/monte_carlo/sample_model.hpp"

namespace stepdiag {

inline constexpr std::uint64_t leaf_samples = 2000;
inline constexpr std::uint64_t pilot_samples = 10000;
inline constexpr std::uint64_t largest_leaf_count = 2'000'000;  // because counts have 32 bits

struct StatisticsOptions {
    double coverage = 0.95;              // coverage probability
    int digits = 2;                      // significant digits of u: 1 to 3
    bool covariance = false;             // of all outputs; for a thousand outputs it costs more than most models
    std::vector<std::size_t> kept = {};  // outputs whose values are all kept: 8 bytes per sample and output
    std::vector<std::vector<std::size_t>> joint = {};  // sets of one to three outputs for joint coverage regions
};

// Numerical tolerance delta of a standard uncertainty u > 0 (see above).
double numerical_tolerance(double standard_uncertainty, int digits);

// Bins and options common to all parts of one run, determined by its pilot run. Copies share their content.
class Bins {
public:
    struct Content;
    explicit Bins(std::shared_ptr<const Content> content) : content_(std::move(content)) {}

    const Content& content() const { return *content_; }
    const std::vector<SampleModel::Output>& outputs() const;
    const StatisticsOptions& options() const;
    std::uint64_t seed() const;
    const std::string& target() const;
    std::size_t counts() const;  // number of counts in all bins; each takes 6 bytes per thread

    std::string to_bytes() const;
    static Bins from_bytes(std::string_view bytes);

private:
    std::shared_ptr<const Content> content_;
};

// Throws InvalidArgument if `other` belongs to another run. The message names the difference: outputs, seed,
// instruction set, options, or the results of the pilot run (another model).
void check_same_run(const Bins& bins, const Bins& other);

// `threads`: 0 uses all processor threads. The calling thread calls `go_on` several times per second with the number of
// completed leaves. If it returns false, the run ends after the leaves in progress; an exception ends the run at once.
struct RunControl {
    int threads = 0;
    std::function<bool(std::uint64_t leaves_done)> go_on = {};
};

// Makes the pilot run. Throws InvalidArgument for an option out of range, and if no pilot sample has a result.
Bins make_bins(const SampleModel& model, const StatisticsOptions& options, const RunControl& control = {});

// Stability of the results of an adaptive procedure (JCGM 101, 7.9.4).
struct Stability {
    enum class Figure { mean, standard_uncertainty, low, high };
    std::uint64_t blocks;
    double ratio;        // largest 2 s / delta of all outputs and figures; infinite for fewer than two blocks
    std::size_t output;  // output and figure with the largest ratio
    Figure figure;
    std::size_t unstable;  // outputs with a ratio above 1
    bool stable() const { return ratio <= 1.0; }
};

// Joint coverage region of up to three outputs: it contains the share `coverage` of all samples (JCGM 102, 6.5). Centre
// and covariance come from the pilot run; the factors come from counts.
struct JointRegion {
    std::vector<std::size_t> outputs;
    Eigen::VectorXd centre;
    Eigen::MatrixXd covariance;
    double ellipsoid_factor;  // k_p: (y - centre)^T covariance^-1 (y - centre) <= k_p^2; NaN for a singular covariance
    double rectangle_factor;  // k_q: |y_j - centre_j| <= k_q u_j for each j
    double ellipsoid_volume, rectangle_volume;
    // Smallest region made of cells of a regular grid. The grid starts at `grid_from` and has `cells` cells of
    // `grid_width` along each output. The region consists of the fullest cells that together contain the coverage. In
    // `smallest`, the index of the last output varies fastest.
    Eigen::VectorXd grid_from, grid_width;
    std::vector<std::size_t> cells;
    std::vector<bool> smallest;
    double smallest_volume, smallest_share;
};

struct MonteCarloResult {
    std::vector<SampleModel::Output> outputs;
    StatisticsOptions options;
    std::uint64_t seed;
    std::string target;
    std::uint64_t samples;  // with a result
    std::uint64_t lost;     // without a result; excluded from the statistics
    // One entry for each output. NaN if no sample has a result.
    Eigen::VectorXd mean, standard_uncertainty;
    Eigen::MatrixX2d symmetric, shortest;  // ends of the coverage intervals (JCGM 101, 7.7)
    Eigen::VectorXd lowest, highest;
    std::vector<std::uint64_t> outside;  // values outside the bins; the end of an interval among them is approximate
    std::optional<Eigen::MatrixXd> covariance;
    std::map<std::size_t, std::vector<double>> kept;  // values of all samples by output; NaN for a lost sample
    std::vector<JointRegion> joint;
    std::optional<Stability> stability = {};  // for an adaptive run
};

// Half-open range (first, end): the leaves first, ..., end - 1.
using LeafRange = std::pair<std::uint64_t, std::uint64_t>;

// Statistics of a set of leaves.
class PartialStatistics {
public:
    explicit PartialStatistics(const Bins& bins);  // without leaves
    PartialStatistics(PartialStatistics&&) noexcept;
    PartialStatistics& operator=(PartialStatistics&&) noexcept;
    ~PartialStatistics();

    const Bins& bins() const;
    std::vector<LeafRange> leaves() const;  // ascending, separated by gaps
    std::uint64_t samples() const;
    std::uint64_t lost() const;

    // Throws InvalidArgument if `other` belongs to another run or has leaves in common with this object.
    void merge(const PartialStatistics& other);
    MonteCarloResult result() const;

    // Versioned format with a checksum, including the bins. from_bytes throws InvalidArgument for damaged bytes.
    std::string to_bytes() const;
    static PartialStatistics from_bytes(std::string_view bytes);

    struct State;
    State& state() { return *state_; }
    const State& state() const { return *state_; }

private:
    std::unique_ptr<State> state_;
};

// Adds the leaves first_leaf, ..., first_leaf + leaves - 1 to `all`. If `go_on` or an exception ends the run early, the
// completed leaves remain in `all`. Throws InvalidArgument if the model and the bins belong to different runs, or if
// `all` already has one of the leaves.
void add_leaves(PartialStatistics& all, const SampleModel& model, std::uint64_t first_leaf, std::uint64_t leaves,
                const RunControl& control = {});
PartialStatistics run_leaves(const SampleModel& model, const Bins& bins, std::uint64_t first_leaf, std::uint64_t leaves,
                             const RunControl& control = {});

// Computes several ranges, each with one thread, and returns one object per range. Incomplete ranges are omitted.
std::vector<PartialStatistics> run_ranges(const SampleModel& model, const Bins& bins,
                                          const std::vector<LeafRange>& ranges, const RunControl& control = {});

// Complete run in one call. `samples` is rounded up to whole leaves.
MonteCarloResult monte_carlo(const SampleModel& model, const StatisticsOptions& options, std::uint64_t samples,
                             const RunControl& control = {});

}  // namespace stepdiag
