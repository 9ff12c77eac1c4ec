// Content of Bins, and the counts in these bins. Internal.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "monte_carlo/byte_format.hpp"
#include "stepdiag/monte_carlo/monte_carlo.hpp"

namespace stepdiag {

// Results of the pilot run for one output, and its bins, which start at lower + i width, i = 0, ..., bins - 1. The
// counts of the output start at `offset`: values below the bins, bins, values above the bins.
struct OutputBins {
    double mean, standard_uncertainty, lowest, highest;
    double lower, width;
    std::uint32_t bins;
    std::size_t offset;
};
inline constexpr std::uint32_t largest_bin_count = 65534;  // plus one below and one above: 16-bit indices

// Bins of one set of outputs for a joint region. Distances from the centre (ellipsoid: Mahalanobis distance; rectangle:
// largest |y_j - centre_j| / u_j) are counted in bins of distance_width.
struct JointBins {
    std::vector<std::size_t> outputs;
    Eigen::VectorXd centre;
    Eigen::MatrixXd covariance;
    Eigen::MatrixXd whitening;  // L^-1 with L L^T = covariance; no rows for a singular covariance
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
    std::size_t counts = 0;  // number of counts of all outputs

    Eigen::VectorXd means() const;
};

// Bins of an output: at most delta/5 wide, over a range larger than that of the values in the pilot run.
OutputBins bins_of(double mean, double standard_uncertainty, double lowest, double highest, int digits);
// `values`: from the pilot run, one row for each output of the set.
JointBins joint_bins(const std::vector<std::size_t>& outputs, const Eigen::MatrixXd& values);

struct JointCounts {
    std::vector<std::uint32_t> ellipsoid, rectangle;  // distance_bins counts, then the count of larger distances
    double farthest_ellipsoid = 0.0, farthest_rectangle = 0.0;
    std::vector<std::uint32_t> cells;  // cell_count() counts, then the count outside the grid
};

// Counts, lowest and highest values, kept values. Addition is exact and does not depend on the order.
struct Counts {
    explicit Counts(const Bins::Content& bins);
    void operator+=(const Counts& other);  // both must be settled

    // Counts of the most recent leaves, in 16 bits to halve the memory traffic. Settled (added to the 32-bit counts)
    // after 32 leaves at the latest, and at the end.
    std::vector<std::uint16_t> recent = {};
    int recent_leaves = 0;
    std::vector<std::uint16_t>& begin_leaf();
    void settle();

    std::vector<std::uint32_t> by_bin;
    Eigen::VectorXd lowest, highest;
    std::vector<JointCounts> joint;
    std::map<std::uint64_t, std::vector<double>> kept;  // for each leaf: kept outputs x leaf_samples
};

// Read and write as a part of other bytes. Counts are read into an object that was made for their bins.
void write(ByteWriter& to, const Bins::Content& bins);
Bins read_bins(ByteReader& from);
void write(ByteWriter& to, const Counts& counts);
void read_counts(ByteReader& from, std::size_t kept_outputs, Counts& counts);

}  // namespace stepdiag
