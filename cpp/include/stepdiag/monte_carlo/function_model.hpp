// Measurement model given as a function y = f(x), with distributions of the inputs x (JCGM 101:2008, 5.9).
#pragma once

#include <Eigen/Core>
#include <functional>
#include <vector>

#include "stepdiag/monte_carlo/distribution.hpp"
#include "stepdiag/monte_carlo/sample_model.hpp"

namespace stepdiag {

class FunctionModel : public SampleModel {
public:
    using Values = Eigen::Array<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
    // Computes output values from input values. Rows are inputs or outputs, columns are samples. Several threads call
    // it concurrently.
    using Function = std::function<void(Eigen::Ref<const Values> inputs, Eigen::Ref<Values> outputs)>;

    // Throws InvalidArgument for an invalid distribution (check), an invalid correlation, or an empty list of outputs.
    FunctionModel(Function function, std::vector<Distribution> distributions, std::vector<Output> outputs,
                  std::uint64_t seed = 0, std::vector<CorrelatedInputs> correlations = {});

    const std::vector<Output>& outputs() const override { return outputs_; }
    std::uint64_t seed() const override { return seed_; }
    std::string target() const override;
    std::unique_ptr<Worker> worker() const override;

    // Draws the inputs of the samples first_sample, first_sample + 1, ..., one for each column. first_sample and the
    // number of columns are multiples of lane_group. Normal inputs use number input % 2 of
    // RandomBlock{sample, input / 2, 0}; the others use both numbers of RandomBlock{sample, input, 1}.
    void draw(std::uint64_t first_sample, Eigen::Ref<Values> inputs) const;

private:
    class FunctionWorker;
    Function function_;
    std::vector<Distribution> distributions_;
    std::vector<Output> outputs_;
    std::uint64_t seed_;
    std::vector<CorrelatedInputs> correlations_;  // with correlation_factor() instead of the correlation
};

}  // namespace stepdiag
