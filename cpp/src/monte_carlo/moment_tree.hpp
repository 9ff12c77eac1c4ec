// Sums over leaves of samples, merged pairwise in a binary tree over the leaf numbers. Node (level, k) is the sum of
// the leaves k 2^level, ..., (k + 1) 2^level - 1. It exists as soon as all of them are present. The bits of a sum
// therefore depend only on the set of leaves, and a run of n leaves has about log2 n nodes. Internal.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <map>

#include "monte_carlo/byte_format.hpp"
#include "stepdiag/monte_carlo/monte_carlo.hpp"

namespace stepdiag {

// Sums of the deviations from the pilot's mean, of their squares, and on request of their products (lower triangle).
struct Moments {
    std::uint64_t samples = 0;
    std::uint64_t lost = 0;
    Eigen::VectorXd first, second;
    Eigen::MatrixXd products;

    Moments& operator+=(const Moments& other);
};

void write(ByteWriter& to, const Moments& moments);
Moments read_moments(ByteReader& from, std::size_t outputs, bool covariance);

class MomentTree {
public:
    struct Node {
        int level;
        Moments moments;
        std::uint64_t leaves() const { return std::uint64_t(1) << level; }
    };

    // All three throw InvalidArgument if a leaf is already present.
    void check_free(std::uint64_t first_leaf, std::uint64_t leaves) const;
    void add(std::uint64_t first_leaf, Node node);
    void add(const MomentTree& other);  // adds all leaves or none

    const std::map<std::uint64_t, Node>& nodes() const { return nodes_; }  // by first leaf
    Moments total(Eigen::Index outputs) const;
    std::vector<LeafRange> leaves() const;

private:
    std::map<std::uint64_t, Node> nodes_;
};

}  // namespace stepdiag
