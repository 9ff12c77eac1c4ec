// A measurement model given as a function: y = f(x), with distributions of the inputs x (JCGM 101, 5.9).
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
    // Values of the outputs (a row each) for those of the inputs, a column a sample. Called by several threads at once.
    using Function = std::function<void(Eigen::Ref<const Values> inputs, Eigen::Ref<Values> outputs)>;

    // Throws InvalidArgument for distributions and correlations that make no sense, and where there is no output.
    FunctionModel(Function function, std::vector<Distribution> distributions, std::vector<Output> outputs,
                  std::uint64_t seed = 0, std::vector<CorrelatedInputs> correlations = {});

    const std::vector<Output>& outputs() const override { return outputs_; }
    std::uint64_t seed() const override { return seed_; }
    std::string target() const override;
    std::unique_ptr<Worker> worker() const override;

    // Inputs of the samples from first_sample on (a multiple of lane_group), as many as columns (a multiple, too):
    // normal ones by RandomBlock{sample, input / 2, 0}, half input % 2, others from both numbers of {sample, input, 1}.
    void draw(std::uint64_t first_sample, Eigen::Ref<Values> inputs) const;

private:
    class FunctionWorker;
    Function function_;
    std::vector<Distribution> distributions_;
    std::vector<Output> outputs_;
    std::uint64_t seed_;
    std::vector<CorrelatedInputs> correlations_;  // with correlation_factor in place of the correlation
};

}  // namespace stepdiag
