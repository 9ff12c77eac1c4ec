// What Bins hold, and the counts that belong to them. Internal.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "monte_carlo/byte_format.hpp"
#include "stepdiag/monte_carlo/monte_carlo.hpp"

namespace stepdiag {

// Of one output: what the pilot run found, and the bins lower + i width, i = 0, ..., bins - 1. Its counts begin at
// `offset`: those below the bins, the bins, those above.
struct OutputBins {
    double mean, standard_uncertainty, lowest, highest;
    double lower, width;
    std::uint32_t bins;
    std::size_t offset;
};
inline constexpr std::uint32_t largest_bin_count = 65534;  // with those below and above: indices of 16 bits

// Of one set of outputs. Distances (ellipsoid: Mahalanobis; rectangle: largest |y_j - centre_j| / u_j) are counted in
// bins of distance_width up to the last one.
struct JointBins {
    std::vector<std::size_t> outputs;
    Eigen::VectorXd centre;
    Eigen::MatrixXd covariance;
    Eigen::MatrixXd whitening;  // L^-1 with L L^T = covariance; without rows for a singular one
    Eigen::VectorXd grid_from, grid_width;
    std::vector<std::size_t> cells;

    std::size_t cell_count() const;
};
inline constexpr double distance_width = 1.0 / 256.0;
inline constexpr std::size_t distance_bins = 20 * 256;

struct Bins::Content {
    std::vector<SampleModel::Output> outputs;
    StatisticsOptions options;
    std::uint64_t seed;
    std::string target;
    std::vector<OutputBins> by_output;
    std::vector<JointBins> joint;
    std::size_t counts = 0;  // of all outputs

    Eigen::VectorXd means() const;
};

// Where bins of an output lie: at most delta/5 wide, from beyond its pilot run's lowest to beyond its highest value.
OutputBins bins_of(double mean, double standard_uncertainty, double lowest, double highest, int digits);
// From the pilot's values, a row each output of the set.
JointBins joint_bins(const std::vector<std::size_t>& outputs, const Eigen::MatrixXd& values);

struct JointCounts {
    std::vector<std::uint32_t> ellipsoid, rectangle;  // distance_bins, then those beyond
    double farthest_ellipsoid = 0.0, farthest_rectangle = 0.0;
    std::vector<std::uint32_t> cells;  // cell_count(), then those outside
};

// All that is counted: whole numbers, lowest and highest, kept values. Adding is exact in any order.
struct Counts {
    explicit Counts(const Bins::Content& bins);
    void operator+=(const Counts& other);  // both settled

    // Where leaves are counted: half the memory to go through. Settled after 32 leaves at the latest, and at the end.
    std::vector<std::uint16_t> recent = {};
    int recent_leaves = 0;
    std::vector<std::uint16_t>& begin_leaf();
    void settle();

    std::vector<std::uint32_t> by_bin;
    Eigen::VectorXd lowest, highest;
    std::vector<JointCounts> joint;
    std::map<std::uint64_t, std::vector<double>> kept;  // by leaf: kept outputs x leaf_samples
};

// As parts of other bytes. Counts are read into those of their bins.
void write(ByteWriter& to, const Bins::Content& bins);
Bins read_bins(ByteReader& from);
void write(ByteWriter& to, const Counts& counts);
void read_counts(ByteReader& from, std::size_t kept_outputs, Counts& counts);

}  // namespace stepdiag
