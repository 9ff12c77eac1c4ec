#include "controller/compensator_tables.hpp"

namespace stepdiag {
namespace {

using Tables = CompensatorTables;

// Baseline functions for all processors that the library supports.
template <class Order>
struct Plain {
    static unsigned error(const Tables& t, const double* p, const double* tool, double* e, double* turn) noexcept {
        return answer_error(Order{}, t, p, tool, e, turn);
    }
    static unsigned command(const Tables& t, const double* target, const double* tool, double* command) noexcept {
        return answer_command(Order{}, t, target, tool, command);
    }
    static unsigned forward(const Tables& t, const double* command, const double* tool, double* actual) noexcept {
        return answer_forward(Order{}, t, command, tool, actual);
    }
};

#if defined(__x86_64__)
#define STEPDIAG_FUSED [[gnu::target("avx2,fma")]]

template <class Order>
struct Fused {
    STEPDIAG_FUSED static unsigned error(const Tables& t, const double* p, const double* tool, double* e,
                                         double* turn) noexcept {
        return answer_error(Order{}, t, p, tool, e, turn);
    }
    STEPDIAG_FUSED static unsigned command(const Tables& t, const double* target, const double* tool,
                                           double* command) noexcept {
        return answer_command(Order{}, t, target, tool, command);
    }
    STEPDIAG_FUSED static unsigned forward(const Tables& t, const double* command, const double* tool,
                                           double* actual) noexcept {
        return answer_forward(Order{}, t, command, tool, actual);
    }
};
#else
template <class Order>
using Fused = Plain<Order>;
#endif

template <int first, int second, int third>
Answers answers(bool fused) {
    using Order = AxisOrder<first, second, third>;
    if (fused) return {Fused<Order>::error, Fused<Order>::command, Fused<Order>::forward};
    return {Plain<Order>::error, Plain<Order>::command, Plain<Order>::forward};
}

}  // namespace

bool are_fused_answers_known() {
#if defined(__x86_64__)
    return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
#else
    return false;
#endif
}

Answers answers_for(const Chain& chain, bool fused) {
    switch (3 * index(chain.order()[0]) + index(chain.order()[1])) {
        case 1: return answers<0, 1, 2>(fused);
        case 2: return answers<0, 2, 1>(fused);
        case 3: return answers<1, 0, 2>(fused);
        case 5: return answers<1, 2, 0>(fused);
        case 6: return answers<2, 0, 1>(fused);
        default: return answers<2, 1, 0>(fused);
    }
}

}  // namespace stepdiag
