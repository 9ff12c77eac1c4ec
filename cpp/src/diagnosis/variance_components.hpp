// How much each channel scatters: variance components. Internal: not installed.
//
// Residuals are w = R e, e the errors of the readings in units of their weights, R the redundancy matrix. Where group d
// of the readings has the variance v_d in these units, the square sum of the residuals of group c has the mean
//   E[Q_c] = sum_d S_cd v_d,  S_cd = tr(R_cd R_dc),  and cov(Q_c, Q_d) = 2 S_cd where all v are 1:
// Q = S v is solved for v (Helmert 1924), whose covariance is then 2 S^-1. S is the mean of |R_cd z|^2 over standard
// normal z, a few draws each (M. Hutchinson, Commun. Stat. 18 (1989) 1059), a solution a draw; sum_d S_cd is the sum of
// redundancies, which is known.
//
// Gross readings and slips spoil square sums. So the differences of successive residuals of a channel in one set-up,
// which a slip changes once, are compared with those of the draws. The mean of the smaller half of their squares gives
// the robust factor: up to half of them may be anything. Gross readings make the smaller half small beside the
// residuals, and what is smooth makes all differences small beside them. Where neither ratio is clearly smaller than
// that of the draws, the scatter is that of noise, and its component comes from the square sum, which knows it more
// closely.
#pragma once

#include <vector>

#include "adjustment/solution.hpp"

namespace stepdiag {

// Probability of a factor below which a channel is looked at more closely.
inline constexpr double odd_scatter = 0.01;

struct ScatterOfChannel {
    VarianceComponent component;  // beside what was stated
    double probability = 1.0;     // that chance makes the factor as large where the noise is as stated
    bool is_significant = false;  // more than stated, and known closely enough to say so
    bool is_noise = true;         // the differences are as large beside the residuals as those of noise
};

// Of each channel that is controlled, and of its lines that scatter otherwise than the others. `weighed`: the factors
// that the problem has been weighed with. Where something else than noise is in the residuals, factors are the robust
// ones.
std::vector<ScatterOfChannel> scatter_of_channels(Solution& solution, const std::vector<NoiseFactor>& weighed);

// Which of them the readings are to be weighed with.
std::vector<NoiseFactor> to_weigh(const std::vector<ScatterOfChannel>& scatter);
// To a hundredth.
bool are_alike(const std::vector<NoiseFactor>& a, const std::vector<NoiseFactor>& b);

}  // namespace stepdiag
