#include "batch/tilt_effects.hpp"

#include "stepdiag/core/random_blocks.hpp"

namespace stepdiag {
namespace {

// By setup::Column. The tilt is (alpha, beta) of reading-inl.hpp: reflector - laser, or of the line the reflector
// alone.
struct Rule {
    int of, like, tilt;
    bool to_the_beam;
    double factor;
};
constexpr Rule rules[] = {
    {setup::roll, setup::laser, 1, true, -1.0},
    {setup::roll, setup::laser + 1, 0, true, 1.0},
    {setup::gain, setup::laser, 0, true, -1.0},
    {setup::gain, setup::laser + 1, 1, true, -1.0},
    {setup::lateral, setup::distance_constant, 1, false, -1.0},
    {setup::lateral + 1, setup::distance_constant, 0, false, 1.0},
};

}  // namespace

TiltEffects::TiltEffects(const AdjustmentProblem& problem, const Eigen::VectorXd& start) {
    const auto place = [&](int unknown) { return unknown == no_unknown ? problem.size() : unknown; };
    const auto value = [&](int place) { return place < start.size() ? start[place] : 0.0; };
    for (const LineSetup& setup : problem.setups())
        for (const Rule& rule : rules) {
            const int of = setup.unknown[rule.of], like = setup.unknown[rule.like];
            if (of == no_unknown || like == no_unknown) continue;
            const int plus = place(setup.unknown[setup::reflector + rule.tilt]);
            const int minus = place(rule.to_the_beam ? setup.unknown[setup::laser + rule.tilt] : no_unknown);
            effects_.push_back({of, like, plus, minus, rule.factor, value(plus) - value(minus)});
        }
}

void TiltEffects::find_shares(const Effect& effect, const double* x, double* share) const {
    const double* plus = x + lane_group * std::size_t(effect.plus);
    const double* minus = x + lane_group * std::size_t(effect.minus);
    for (std::size_t i = 0; i < lane_group; ++i) share[i] = effect.factor * (plus[i] - minus[i] - effect.tilt_at_start);
}

// No unknown is `of` one effect and `like` another, so T^-1 = 2 I - T.
void TiltEffects::divide_transposed(const double* x, double* forces) const {
    double share[lane_group];
    for (const Effect& effect : effects_) {
        find_shares(effect, x, share);
        double* of = forces + lane_group * std::size_t(effect.of);
        const double* like = forces + lane_group * std::size_t(effect.like);
        for (std::size_t i = 0; i < lane_group; ++i) of[i] -= share[i] * like[i];
    }
}

void TiltEffects::divide(const double* x, double* step) const {
    double share[lane_group];
    for (const Effect& effect : effects_) {
        find_shares(effect, x, share);
        const double* of = step + lane_group * std::size_t(effect.of);
        double* like = step + lane_group * std::size_t(effect.like);
        for (std::size_t i = 0; i < lane_group; ++i) like[i] -= share[i] * of[i];
    }
}

}  // namespace stepdiag
