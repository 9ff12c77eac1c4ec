#include "stepdiag/core/instruction_set.hpp"

#include <cstdint>

#include "core/simd_targets.hpp"
#include "stepdiag/core/error.hpp"
#define HWY_TARGET_INCLUDE "core/instruction_set.cpp"
#include <hwy/foreach_target.h>  // compiles this file once for every instruction set
//
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace stepdiag {
namespace HWY_NAMESPACE {

const char* target() { return hwy::TargetName(HWY_TARGET); }

}  // namespace HWY_NAMESPACE
}  // namespace stepdiag
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace stepdiag {
namespace {

HWY_EXPORT(target);

}  // namespace

std::string instruction_set() { return HWY_DYNAMIC_DISPATCH(target)(); }

namespace {

// One alone is not chosen, and is there whatever Highway finds in the processor.
std::vector<std::int64_t> targets() {
    if constexpr ((HWY_TARGETS & (HWY_TARGETS - 1)) == 0) return {HWY_TARGETS};
    return hwy::SupportedAndGeneratedTargets();
}

}  // namespace

std::vector<std::string> instruction_sets() {
    std::vector<std::string> names;
    for (const std::int64_t each : targets()) names.push_back(hwy::TargetName(each));
    return names;
}

void choose_instruction_set(const std::string& name) {
    std::string known;
    for (const std::int64_t each : targets()) {
        if (name == hwy::TargetName(each)) {
            hwy::GetChosenTarget().Update(each);
            return;
        }
        known += std::string(" ") + hwy::TargetName(each);
    }
    throw InvalidArgument("replay target: \"" + name + "\": expected one of" + known);
}

}  // namespace stepdiag
#endif  // HWY_ONCE
