#include "monte_carlo/moment_tree.hpp"

#include <string>

#include "stepdiag/core/error.hpp"

namespace stepdiag {

Moments& Moments::operator+=(const Moments& other) {
    samples += other.samples;
    lost += other.lost;
    first += other.first;
    second += other.second;
    products += other.products;
    return *this;
}

void MomentTree::check_free(std::uint64_t first_leaf, std::uint64_t leaves) const {
    const auto next = nodes_.lower_bound(first_leaf);
    std::uint64_t twice = first_leaf;
    if (next != nodes_.end() && next->first < first_leaf + leaves) twice = next->first;
    else if (next == nodes_.begin()) return;
    else if (const auto previous = std::prev(next); previous->first + previous->second.leaves() <= first_leaf) return;
    throw InvalidArgument("leaf " + std::to_string(twice) + " of the samples is counted twice");
}

void MomentTree::add(std::uint64_t first_leaf, Node node) {
    check_free(first_leaf, node.leaves());
    for (;;) {
        const auto sibling = nodes_.find(first_leaf ^ node.leaves());
        if (sibling == nodes_.end() || sibling->second.level != node.level) break;
        node.moments += sibling->second.moments;  // the order of two summands does not affect the bits
        first_leaf = std::min(first_leaf, sibling->first);
        ++node.level;
        nodes_.erase(sibling);
    }
    nodes_.emplace(first_leaf, std::move(node));
}

void MomentTree::add(const MomentTree& other) {
    for (const auto& [first_leaf, node] : other.nodes_) check_free(first_leaf, node.leaves());
    for (const auto& [first_leaf, node] : other.nodes_) add(first_leaf, node);
}

Moments MomentTree::total(Eigen::Index outputs) const {
    if (nodes_.empty()) return {0, 0, Eigen::VectorXd::Zero(outputs), Eigen::VectorXd::Zero(outputs), {}};
    auto node = nodes_.begin();
    Moments sum = node->second.moments;
    while (++node != nodes_.end()) sum += node->second.moments;
    return sum;
}

std::vector<LeafRange> MomentTree::leaves() const {
    std::vector<LeafRange> ranges;
    for (const auto& [first_leaf, node] : nodes_) {
        if (ranges.empty() || ranges.back().second != first_leaf) ranges.push_back({first_leaf, first_leaf});
        ranges.back().second += node.leaves();
    }
    return ranges;
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

}  // namespace stepdiag
