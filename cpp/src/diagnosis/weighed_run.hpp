// A run with its readings weighed by their noise, and adjusted with what was done about faults. Internal: not
// installed.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "diagnosis/fault_search.hpp"
#include "diagnosis/variance_components.hpp"

namespace stepdiag {

struct WeighedRun {
    WeighedRun(const AdjustmentProblem& of_all, const AdjustmentOptions& options, std::vector<NoiseFactor> with);

    // What another look at the scatter says of the noise.
    std::vector<NoiseFactor> look();
    void find_faults();
    // Whether nothing scatters more than weighed beside these faults, of each class one: all alternatives together take
    // up noise, too.
    bool is_explained_by_faults() const;
    bool has_faults() const { return state && state->solution != plain; }

    std::vector<NoiseFactor> noise;
    std::shared_ptr<const AdjustmentProblem> problem;  // weighed, with nothing left out or freed
    std::shared_ptr<const FaultContext> faults;
    std::shared_ptr<Solution> plain;  // with nothing done about faults; none where no minimum is reached
    std::optional<FaultState> state;  // none where no minimum is reached
    std::vector<ScatterOfChannel> scatter;
};

// Scatter comes before faults. Where some channel scatters more than stated, a few faults may explain all of it. If
// they do not, and it is noise, the readings are weighed with that, and faults are sought as far as they stand out of
// it; beyond what is credible it is noise alone.
WeighedRun weigh_and_find_faults(const AdjustmentProblem& of_all, const AdjustmentOptions& options);

}  // namespace stepdiag
