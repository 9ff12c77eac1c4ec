#include "stepdiag/monte_carlo/function_model.hpp"

#include <set>
#include <string>

#include "stepdiag/core/error.hpp"
#include "stepdiag/core/instruction_set.hpp"
#include "stepdiag/core/random.hpp"
#include "stepdiag/core/random_blocks.hpp"

namespace stepdiag {

class FunctionModel::FunctionWorker : public SampleModel::Worker {
public:
    explicit FunctionWorker(const FunctionModel& model) : model_(model) {}

    void evaluate(const SampleBlock& block) override {
        inputs_.resize(Eigen::Index(model_.distributions_.size()), Eigen::Index(block.samples));
        model_.draw(block.first_sample, inputs_);
        Eigen::Map<Values> outputs(block.outputs, Eigen::Index(model_.outputs_.size()), Eigen::Index(block.samples));
        model_.function_(inputs_, outputs);
    }

private:
    const FunctionModel& model_;
    Values inputs_;
};

FunctionModel::FunctionModel(Function function, std::vector<Distribution> distributions, std::vector<Output> outputs,
                             std::uint64_t seed, std::vector<CorrelatedInputs> correlations)
    : function_(std::move(function)),
      distributions_(std::move(distributions)),
      outputs_(std::move(outputs)),
      seed_(seed),
      correlations_(std::move(correlations)) {
    if (outputs_.empty()) throw InvalidArgument("outputs: expected at least one, got none");
    for (std::size_t i = 0; i < distributions_.size(); ++i) check(distributions_[i], "input " + std::to_string(i));
    std::set<int> taken;
    for (CorrelatedInputs& correlated : correlations_) {
        for (const int member : correlated.members) {
            const std::string input = "correlation: input " + std::to_string(member);
            if (member < 0 || member >= int(distributions_.size()))
                throw InvalidArgument(input + " does not exist: expected 0 to " +
                                      std::to_string(int(distributions_.size()) - 1));
            if (distributions_[std::size_t(member)].kind != DistributionKind::normal)
                throw InvalidArgument(input + " is not normal but " + name(distributions_[std::size_t(member)].kind));
            if (!taken.insert(member).second) throw InvalidArgument(input + " is correlated twice");
        }
        correlated.correlation = correlation_factor(correlated.correlation, "correlation");
        if (correlated.correlation.rows() != Eigen::Index(correlated.members.size()))
            throw InvalidArgument("correlation: expected a row for each of " +
                                  std::to_string(correlated.members.size()) + " inputs, got " +
                                  std::to_string(correlated.correlation.rows()));
    }
}

std::string FunctionModel::target() const { return instruction_set(); }

std::unique_ptr<SampleModel::Worker> FunctionModel::worker() const { return std::make_unique<FunctionWorker>(*this); }

void FunctionModel::draw(std::uint64_t first_sample, Eigen::Ref<Values> inputs) const {
    const std::size_t samples = std::size_t(inputs.cols()), count = distributions_.size();
    const RandomBlocks lanes{seed_, RandomStream::monte_carlo, first_sample, samples};
    Values normals(Eigen::Index((count + 1) / 2 * 2), inputs.cols());
    fill_normal(lanes, (count + 1) / 2, normals.data());
    for (const CorrelatedInputs& correlated : correlations_) {
        const Values independent = normals(correlated.members, Eigen::all);
        normals(correlated.members, Eigen::all) = (correlated.correlation * independent.matrix()).array();
    }
    Values uniform(2, inputs.cols());
    for (std::size_t i = 0; i < count; ++i) {
        const Distribution& distribution = distributions_[i];
        if (distribution.kind != DistributionKind::normal) {
            RandomBlocks of_input = lanes;
            of_input.first_item = std::uint32_t(i);
            of_input.draw = 1;
            fill_uniform(of_input, 1, uniform.data());
        }
        for (Eigen::Index s = 0; s < inputs.cols(); ++s)
            inputs(Eigen::Index(i), s) =
                stepdiag::draw(distribution, normals(Eigen::Index(i), s), uniform(0, s), uniform(1, s));
    }
}

}  // namespace stepdiag
