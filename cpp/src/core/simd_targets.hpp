// Before <hwy/foreach_target.h>, which compiles a source once for every instruction set: which of them. Left out are
// those that differ from another one only in what is not used here.
#pragma once

#include <hwy/detect_targets.h>

#undef HWY_DISABLED_TARGETS
#ifdef HWY_AVX3_ZEN4  // since Highway 1.1
#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_AVX3_DL | HWY_AVX3_ZEN4 | HWY_AVX3_SPR)
#else
#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_AVX3_DL)
#endif
