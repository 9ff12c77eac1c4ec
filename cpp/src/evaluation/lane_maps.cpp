#include "evaluation/lane_maps.hpp"

#include <algorithm>
#include <memory>

#include "core/simd_targets.hpp"
#include "evaluation/conventional_map.hpp"
#include "evaluation/enhanced_map.hpp"
#define HWY_TARGET_INCLUDE "evaluation/lane_maps.cpp"
#include <hwy/foreach_target.h>  // compiles this file once for every instruction set
//
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace stepdiag {
namespace HWY_NAMESPACE {

// Inlined completely, so that the templates of the evaluation are compiled for this instruction set.
HWY_FLATTEN void apply_enhanced(const EnhancedMap& map, const ReadingRows<LaneRow>& readings,
                                std::vector<LaneRow>& parameters) {
    parameters = map.apply(readings);
}
HWY_FLATTEN void apply_conventional(const ConventionalMap& map, const ReadingRows<LaneRow>& readings,
                                    std::vector<LaneRow>& parameters) {
    parameters = map.apply(readings);
}

}  // namespace HWY_NAMESPACE
}  // namespace stepdiag
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace stepdiag {
namespace {

HWY_EXPORT(apply_enhanced);
HWY_EXPORT(apply_conventional);

template <class Map, class Apply>
LaneMap determined_part(std::shared_ptr<const Map> map, const Plan& plan, Apply apply) {
    return [map, apply, rows = determined_rows(*map, ParameterLayout{plan.steps() + 1})](
               const ReadingRows<LaneRow>& readings, double* values, std::size_t stride) {
        std::vector<LaneRow> parameters;
        apply(*map, readings, parameters);
        for (std::size_t i = 0; i < rows.size(); ++i)
            std::copy_n(parameters[rows[i]].numbers(), lane_group, values + i * stride);
    };
}

}  // namespace

LaneMap enhanced_map(const std::vector<Pass>& passes, const Plan& plan, const Chain& chain,
                     const Eigen::Vector3d& tool) {
    return determined_part(std::make_shared<const EnhancedMap>(passes, plan, chain, tool), plan,
                           [](auto&... of) { HWY_DYNAMIC_DISPATCH(apply_enhanced)(of...); });
}

LaneMap conventional_map(const std::vector<Pass>& passes, const Plan& plan) {
    return determined_part(std::make_shared<const ConventionalMap>(passes, plan, body_diagonals(passes)), plan,
                           [](auto&... of) { HWY_DYNAMIC_DISPATCH(apply_conventional)(of...); });
}

}  // namespace stepdiag
#endif  // HWY_ONCE
