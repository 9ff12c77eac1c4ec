// The search for faults of the readings, and what is done about them. Internal: not installed.
//  1. Adjust all readings.
//  2. Where that fails, or readings scatter far too much, find gross faults on the problem linearised at zero, and once
//     more where that leads. It has one minimum whatever the readings are; all of each class are free there.
//  3. Try each large fault as what second order may tell from it, with one of the other faults less.
//  4. Test all hypotheses. The worst is the one that takes most off chi-square, as long as that is significant.
//  5. Give up where there are too many for their channel, or where as many more as there may be leave a scatter that
//  nobody believes.
//  6. Adjust with the worst as one more free unknown, or with the best of its class where that fails.
//  7. Drop what is none beside the others, exchange what another one explains better; from 3 until no worst is left.
//  8. Find the class of each (fault_class.hpp). One that is not significant beside the others is dropped: back to 3.
//  9. Treat the classes (FaultTreatment), adjust, test. What is significant then is one more fault: back to 3.
// 10. Where it gave up, all readings stay. What is still significant gets its class, and nothing is done about it.
// What it takes is that a fault is controlled: N faults of which each is seen beside the others need as many redundant
// directions, and a channel may have a tenth as many faults, and at least one. The standard plan has one a step among
// the distances of the body diagonals, five among the tilts, and one among the scale lines.
#pragma once

#include <memory>
#include <optional>

#include "diagnosis/found_faults.hpp"

namespace stepdiag {

struct FaultState {
    FoundFaults found;
    std::shared_ptr<Solution> solution;              // with them
    std::shared_ptr<Solution> single = {};           // with one of each class alone, where classes were treated
    std::shared_ptr<const TestedFaults> tests = {};  // at the solution, where they were made
    bool gave_up = false;                            // it is not a few readings that do not fit
    std::optional<FoundFault> left = std::nullopt;   // what is still significant, and nothing was done about
};

// The adjustment with what was done about the faults; none where no minimum is reached.
std::optional<FaultState> search_faults(const FaultContext& context);
// The tests at the adjustment that came out, as it is now: another smoothness may have been found since.
std::shared_ptr<const TestedFaults> tests_now(const FaultContext& context, const FaultState& state);

}  // namespace stepdiag
