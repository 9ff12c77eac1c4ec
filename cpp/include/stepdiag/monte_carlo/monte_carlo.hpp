// The Monte Carlo method of JCGM 101:2008 and JCGM 102:2011 for any SampleModel, in memory that does not grow with the
// number of samples.
//
// Samples come in leaves of 2,000. A pilot run over the first 10,000 samples fixes, for every output, a mean to take
// sums about and bins to count values in; then each leaf is computed by one thread from start to end, and sums over
// leaves are merged in a binary tree over the leaves' numbers. So for one instruction set the bits of a result depend
// on the set of leaves alone: not on threads, on who computed which leaf, nor on the order of merging.
//
// Bins are at most a fifth of the numerical tolerance wide: delta = 10^r / 2, where u = c 10^r with c a whole number of
// `digits` digits (JCGM 101, 7.9.2). Coverage intervals are interpolated within bins.
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
inline constexpr std::uint64_t largest_leaf_count = 2'000'000;  // counts have 32 bits

struct StatisticsOptions {
    double coverage = 0.95;
    int digits = 2;                                    // significant digits of u that matter: 1 to 3
    bool covariance = false;                           // of all outputs: dearer than most models for a thousand of them
    std::vector<std::size_t> kept = {};                // outputs of which every value is kept: 8 bytes a sample each
    std::vector<std::vector<std::size_t>> joint = {};  // sets of one to three outputs: joint coverage regions
};

// delta of a standard uncertainty u > 0.
double numerical_tolerance(double standard_uncertainty, int digits);

// What all parts of one run share: fixed by its pilot run. Copies share their content.
class Bins {
public:
    struct Content;
    explicit Bins(std::shared_ptr<const Content> content) : content_(std::move(content)) {}

    const Content& content() const { return *content_; }
    const std::vector<SampleModel::Output>& outputs() const;
    const StatisticsOptions& options() const;
    std::uint64_t seed() const;
    const std::string& target() const;
    std::size_t counts() const;  // of all bins together: 6 bytes each, for every thread

    std::string to_bytes() const;
    static Bins from_bytes(std::string_view bytes);

private:
    std::shared_ptr<const Content> content_;
};

// Throws InvalidArgument naming in what `other` is of another run: outputs, seed, instruction set, options, or pilot
// run (the model).
void check_same_run(const Bins& bins, const Bins& other);

// Threads: 0 takes as many as the processor has. `go_on` is called by the calling thread, several times a second, with
// the number of leaves done. False ends the run when the leaves in hand are done; an exception ends it at once.
struct RunControl {
    int threads = 0;
    std::function<bool(std::uint64_t leaves_done)> go_on = {};
};

// The pilot run. Throws InvalidArgument for options out of range, and where no pilot sample has a result.
Bins make_bins(const SampleModel& model, const StatisticsOptions& options, const RunControl& control = {});

// How far an adaptive procedure is from its end.
struct Stability {
    enum class Figure { mean, standard_uncertainty, low, high };
    std::uint64_t blocks;
    double ratio;  // 2 s / delta, the largest of all outputs and figures; infinite for fewer than two blocks
    std::size_t output;
    Figure figure;
    std::size_t unstable;  // outputs with a ratio above 1
    bool stable() const { return ratio <= 1.0; }
};

// A region of up to three outputs that holds the share `coverage` of all samples (JCGM 102, 6.5). Centre and covariance
// are those of the pilot run; the factors are what was counted.
struct JointRegion {
    std::vector<std::size_t> outputs;
    Eigen::VectorXd centre;
    Eigen::MatrixXd covariance;
    double ellipsoid_factor;  // k_p: (y - centre)^T covariance^-1 (y - centre) <= k_p^2; NaN for a singular covariance
    double rectangle_factor;  // k_q: |y_j - centre_j| <= k_q u_j for each j
    double ellipsoid_volume, rectangle_volume;
    // The smallest region made of cells: an equal grid from `grid_from`, cells of `grid_width`, `cells` an output. Its
    // cells are the fullest ones that hold the coverage together; last output fastest.
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
    std::uint64_t samples;  // that gave a result
    std::uint64_t lost;     // that gave none: left out
    // By output. NaN everywhere where no sample gave a result.
    Eigen::VectorXd mean, standard_uncertainty;
    Eigen::MatrixX2d symmetric, shortest;  // ends of the coverage intervals (JCGM 101, 7.7)
    Eigen::VectorXd lowest, highest;
    std::vector<std::uint64_t> outside;  // values beyond the bins: an interval's end among them is known roughly
    std::optional<Eigen::MatrixXd> covariance;
    std::map<std::size_t, std::vector<double>> kept;  // by sample; NaN for a lost one
    std::vector<JointRegion> joint;
    std::optional<Stability> stability = {};  // of an adaptive run
};

// Half-open: leaves first, ..., end - 1.
using LeafRange = std::pair<std::uint64_t, std::uint64_t>;

// Statistics of a set of leaves.
class PartialStatistics {
public:
    explicit PartialStatistics(const Bins& bins);  // of no leaves
    PartialStatistics(PartialStatistics&&) noexcept;
    PartialStatistics& operator=(PartialStatistics&&) noexcept;
    ~PartialStatistics();

    const Bins& bins() const;
    std::vector<LeafRange> leaves() const;  // ascending, apart
    std::uint64_t samples() const;
    std::uint64_t lost() const;

    // Throws InvalidArgument for parts of another run, and for leaves that are in both.
    void merge(const PartialStatistics& other);
    MonteCarloResult result() const;

    // A versioned format with a checksum; the bins are in it. from_bytes throws InvalidArgument for damaged bytes.
    std::string to_bytes() const;
    static PartialStatistics from_bytes(std::string_view bytes);

    struct State;
    State& state() { return *state_; }
    const State& state() const { return *state_; }

private:
    std::unique_ptr<State> state_;
};

// Adds the leaves first_leaf, ..., first_leaf + leaves - 1 to `all`. Those that are done stay there also where the run
// ends before, by `go_on` or by an exception. Throws InvalidArgument where the model is of another run than the bins,
// and where `all` has one of the leaves.
void add_leaves(PartialStatistics& all, const SampleModel& model, std::uint64_t first_leaf, std::uint64_t leaves,
                const RunControl& control = {});
PartialStatistics run_leaves(const SampleModel& model, const Bins& bins, std::uint64_t first_leaf, std::uint64_t leaves,
                             const RunControl& control = {});

// The same for several ranges, each computed by one thread and given back by itself; only those that are whole.
std::vector<PartialStatistics> run_ranges(const SampleModel& model, const Bins& bins,
                                          const std::vector<LeafRange>& ranges, const RunControl& control = {});

// Everything in one call: `samples`, rounded up to whole leaves.
MonteCarloResult monte_carlo(const SampleModel& model, const StatisticsOptions& options, std::uint64_t samples,
                             const RunControl& control = {});

}  // namespace stepdiag
