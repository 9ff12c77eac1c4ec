#include "uncertainty/draws.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <string>

#include "stepdiag/core/error.hpp"
#include "stepdiag/core/random_blocks.hpp"

namespace stepdiag {
namespace {

constexpr RandomStream stream = RandomStream::virtual_calibration;

std::uint32_t item_of(std::size_t sequence, std::size_t number) {
    return std::uint32_t(sequence) * Draws::items_of_a_sequence + std::uint32_t(number);
}

// One number of a sequence, transformed to its distribution.
double number_of(const Distribution& distribution, std::uint64_t seed, std::uint64_t sample, std::size_t sequence,
                 std::size_t number) {
    const double normal = normal_pair(seed, stream, {sample, item_of(sequence, number / 2)})[number % 2];
    if (distribution.kind == DistributionKind::normal) return draw(distribution, normal, 0.5, 0.5);
    const auto uniform = uniform_pair(seed, stream, {sample, item_of(sequence, number), 1});
    return draw(distribution, normal, uniform[0], uniform[1]);
}

// Cholesky factor. A semidefinite matrix may have none; its root is computed from eigenvectors.
Eigen::MatrixXd root_of(const Eigen::MatrixXd& correlation) {
    const Eigen::LLT<Eigen::MatrixXd> factor(correlation);
    if (factor.info() == Eigen::Success) return factor.matrixL();
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(correlation);
    return solver.eigenvectors() * solver.eigenvalues().cwiseMax(0.0).cwiseSqrt().asDiagonal();
}

}  // namespace

Draws::Draws(UncertainInputs inputs, std::uint64_t seed) : inputs_(std::move(inputs)), seed_(seed) {
    check(inputs_);
    if (inputs_.noise.size() + 1 >= most_sequences || inputs_.inputs.size() >= items_of_a_sequence)
        throw InvalidArgument("uncertain inputs: expected fewer than " + std::to_string(most_sequences) +
                              " kinds of noise and " + std::to_string(items_of_a_sequence) + " inputs");
    for (const CorrelatedInputs& correlated : inputs_.correlations) roots_.push_back(root_of(correlated.correlation));
}

Eigen::VectorXd Draws::expectations() const {
    Eigen::VectorXd values(inputs_.inputs.size());
    for (std::size_t i = 0; i < inputs_.inputs.size(); ++i)
        values[Eigen::Index(i)] = inputs_.inputs[i].distribution.expectation;
    return values;
}

Eigen::VectorXd Draws::inputs(std::uint64_t sample) const {
    Eigen::VectorXd values(inputs_.inputs.size());
    for (std::size_t i = 0; i < inputs_.inputs.size(); ++i)
        values[Eigen::Index(i)] = number_of(inputs_.inputs[i].distribution, seed_, sample, 0, i);
    for (std::size_t c = 0; c < roots_.size(); ++c) {
        const std::vector<int>& members = inputs_.correlations[c].members;
        Eigen::VectorXd normals(members.size());
        for (std::size_t m = 0; m < members.size(); ++m)
            normals[Eigen::Index(m)] = normal_pair(seed_, stream, {sample, item_of(0, members[m] / 2)})[members[m] % 2];
        const Eigen::VectorXd correlated = roots_[c] * normals;
        for (std::size_t m = 0; m < members.size(); ++m)
            values[members[m]] = draw(inputs_.inputs[members[m]].distribution, correlated[Eigen::Index(m)], 0.5, 0.5);
    }
    return values;
}

double Draws::noise(std::size_t entry, std::uint64_t sample, std::size_t row) const {
    return number_of(inputs_.noise[entry].distribution, seed_, sample, 1 + entry, row);
}

std::uint64_t Draws::sensor_seed(std::uint64_t sample) const {
    return std::uint64_t(uniform_pair(seed_, stream, {sample, 0, 2})[0] * 0x1p53);
}

namespace {

// Transforms the standard normal numbers of one input or row to its distribution.
void scale(const Distribution& distribution, std::uint64_t seed, std::uint64_t first_sample, std::size_t lanes,
           std::uint32_t item, double* values, std::vector<double>& uniform) {
    if (distribution.kind == DistributionKind::normal) {
        for (std::size_t lane = 0; lane < lanes; ++lane)
            values[lane] = distribution.expectation + distribution.spread * values[lane];
        return;
    }
    uniform.resize(2 * lanes);
    fill_uniform({seed, stream, first_sample, lanes, item, 1}, 1, uniform.data());
    for (std::size_t lane = 0; lane < lanes; ++lane)
        values[lane] = draw(distribution, values[lane], uniform[lane], uniform[lanes + lane]);
}

}  // namespace

void Draws::inputs(std::uint64_t first_sample, std::size_t lanes, double* out) const {
    const std::size_t n = inputs_.inputs.size(), items = (n + 1) / 2;
    std::vector<double> normals(2 * items * lanes), uniform;
    fill_normal({seed_, stream, first_sample, lanes, 0, 0}, items, normals.data());
    for (std::size_t c = 0; c < roots_.size(); ++c) {
        const std::vector<int>& members = inputs_.correlations[c].members;
        Eigen::VectorXd own(members.size());
        for (std::size_t lane = 0; lane < lanes; ++lane) {
            for (std::size_t m = 0; m < members.size(); ++m)
                own[Eigen::Index(m)] = normals[std::size_t(members[m]) * lanes + lane];
            const Eigen::VectorXd correlated = roots_[c] * own;
            for (std::size_t m = 0; m < members.size(); ++m)
                normals[std::size_t(members[m]) * lanes + lane] = correlated[Eigen::Index(m)];
        }
    }
    for (std::size_t i = 0; i < n; ++i) {
        scale(inputs_.inputs[i].distribution, seed_, first_sample, lanes, item_of(0, i), &normals[i * lanes], uniform);
        std::copy_n(&normals[i * lanes], lanes, out + i * lanes);
    }
}

void Draws::standard_noise(std::size_t entry, std::uint64_t first_sample, std::size_t lanes, std::size_t first_row,
                           std::size_t rows, double* out) const {
    fill_normal({seed_, stream, first_sample, lanes, item_of(1 + entry, first_row / 2), 0}, (rows + 1) / 2, out);
}

void Draws::noise(std::size_t entry, std::uint64_t first_sample, std::size_t lanes, std::size_t first_row,
                  std::size_t rows, double* out) const {
    standard_noise(entry, first_sample, lanes, first_row, rows, out);
    std::vector<double> uniform;
    for (std::size_t r = 0; r < rows; ++r)
        scale(inputs_.noise[entry].distribution, seed_, first_sample, lanes, item_of(1 + entry, first_row + r),
              out + r * lanes, uniform);
}

}  // namespace stepdiag
