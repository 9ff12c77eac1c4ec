#include "controller/compensator_tables.hpp"
#include "core/platform.hpp"

namespace stepdiag {
namespace {

using Tables = CompensatorTables;

// The two ways of `Scales` that the functions below are made for.
struct Without {
    STEPDIAG_INLINED static ScalesOfTable scales(const Tables& /*t*/, const double* /*temperature*/) noexcept {
        return {};
    }
};
struct AtTemperature {
    STEPDIAG_INLINED static ExpandedScales scales(const Tables& t, const double* temperature) noexcept {
        return t.scales.at(temperature);
    }
};

// The answer to row i by itself; stores its status if there is a place for it.
auto one_error(decltype(Answers::error) error, const Tables& t, const double* p, const double* tool,
               const double* temperature, double* e, double* turns, unsigned* statuses) noexcept {
    return [=, &t](std::size_t i) noexcept {
        const unsigned status = error(t, p + 3 * i, tool, temperature, e + 3 * i, turns ? turns + 3 * i : nullptr);
        if (statuses) statuses[i] = status;
        return status;
    };
}
auto one_command(decltype(Answers::command) command, const Tables& t, const double* targets, const double* tool,
                 const double* temperature, double* commands, unsigned* statuses) noexcept {
    return [=, &t](std::size_t i) noexcept {
        const unsigned status = command(t, targets + 3 * i, tool, temperature, commands + 3 * i);
        if (statuses) statuses[i] = status;
        return status;
    };
}

// Baseline functions for all processors that the library supports. They answer many positions one after the other.
template <class Order, class Way>
struct Plain {
    static unsigned error(const Tables& t, const double* p, const double* tool, const double* temperature, double* e,
                          double* turn) noexcept {
        return answer_error(Order{}, Way::scales(t, temperature), t, p, tool, e, turn);
    }
    static unsigned command(const Tables& t, const double* target, const double* tool, const double* temperature,
                            double* command) noexcept {
        return answer_command(Order{}, Way::scales(t, temperature), t, target, tool, command);
    }
    static unsigned forward(const Tables& t, const double* command, const double* tool, const double* temperature,
                            double* actual) noexcept {
        return answer_forward(Order{}, Way::scales(t, temperature), t, command, tool, actual);
    }
    static unsigned errors(const Tables& t, std::size_t count, const double* p, const double* tool,
                           const double* temperature, double* e, double* turns, unsigned* statuses) noexcept {
        const auto one = one_error(error, t, p, tool, temperature, e, turns, statuses);
        unsigned flags = 0;
        for (std::size_t i = 0; i < count; ++i) flags |= one(i);
        return flags;
    }
    static unsigned commands(const Tables& t, std::size_t count, const double* targets, const double* tool,
                             const double* temperature, double* commands, unsigned* statuses) noexcept {
        const auto one = one_command(command, t, targets, tool, temperature, commands, statuses);
        unsigned flags = 0;
        for (std::size_t i = 0; i < count; ++i) flags |= one(i);
        return flags;
    }
};

template <class Order, class Way>
struct Fused {
    STEPDIAG_FUSED static unsigned error(const Tables& t, const double* p, const double* tool,
                                         const double* temperature, double* e, double* turn) noexcept {
        return answer_error(Order{}, Way::scales(t, temperature), t, p, tool, e, turn);
    }
    STEPDIAG_FUSED static unsigned command(const Tables& t, const double* target, const double* tool,
                                           const double* temperature, double* command) noexcept {
        return answer_command(Order{}, Way::scales(t, temperature), t, target, tool, command);
    }
    STEPDIAG_FUSED static unsigned forward(const Tables& t, const double* command, const double* tool,
                                           const double* temperature, double* actual) noexcept {
        return answer_forward(Order{}, Way::scales(t, temperature), t, command, tool, actual);
    }
    STEPDIAG_FUSED static unsigned errors(const Tables& t, std::size_t count, const double* p, const double* tool,
                                          const double* temperature, double* e, double* turns,
                                          unsigned* statuses) noexcept {
        return answer_errors(Order{}, Way::scales(t, temperature), t, count, p, tool, e, turns, statuses,
                             one_error(error, t, p, tool, temperature, e, turns, statuses));
    }
    STEPDIAG_FUSED static unsigned commands(const Tables& t, std::size_t count, const double* targets,
                                            const double* tool, const double* temperature, double* commands,
                                            unsigned* statuses) noexcept {
        return answer_commands(Order{}, Way::scales(t, temperature), t, count, targets, tool, commands, statuses,
                               one_command(command, t, targets, tool, temperature, commands, statuses));
    }
};

template <class Order, class Way>
Answers answers(bool fused) {
    using P = Plain<Order, Way>;
    using F = Fused<Order, Way>;
    return fused ? Answers{F::error, F::command, F::forward, F::errors, F::commands}
                 : Answers{P::error, P::command, P::forward, P::errors, P::commands};
}

template <int first, int second, int third>
Answers answers(bool fused, bool at_temperature) {
    using Order = AxisOrder<first, second, third>;
    return at_temperature ? answers<Order, AtTemperature>(fused) : answers<Order, Without>(fused);
}

}  // namespace

bool are_fused_answers_known() { return has_fused_multiply_add(); }

Answers answers_for(const Chain& chain, bool fused, bool at_temperature) {
    switch (3 * index(chain.order()[0]) + index(chain.order()[1])) {
        case 1: return answers<0, 1, 2>(fused, at_temperature);
        case 2: return answers<0, 2, 1>(fused, at_temperature);
        case 3: return answers<1, 0, 2>(fused, at_temperature);
        case 5: return answers<1, 2, 0>(fused, at_temperature);
        case 6: return answers<2, 0, 1>(fused, at_temperature);
        default: return answers<2, 1, 0>(fused, at_temperature);
    }
}

}  // namespace stepdiag
