#include "adjustment/verdict.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <unsupported/Eigen/SpecialFunctions>

namespace stepdiag {
namespace {

constexpr double largest_noise_factor = 3.0;
constexpr double rejected_below = 3e-4;  // probability of a sound run's misfit
constexpr double doubtful_below = 1e-2;
constexpr double doubtful_above = 1.0 - 1e-3;
constexpr double uneven_below = 1e-2;  // of the whole family of comparisons between lines and between channels
constexpr double farthest_prior = 5.0;
constexpr double significant_gain = 28.0;  // of a fault, in chi-square

// The readings of one line or of one channel.
struct Share {
    double square_sum = 0.0;
    double freedom = 0.0;  // sum of redundancy numbers

    void add(const Share& other) {
        square_sum += other.square_sum;
        freedom += other.freedom;
    }
};

// Probability that F of these degrees of freedom lies as far from 1 as this one, on its side, or on the other.
double two_sided_probability(double f, double freedom, double freedom_of_others) {
    const double x = freedom * f / (freedom * f + freedom_of_others);
    const double below = Eigen::numext::betainc(0.5 * freedom, 0.5 * freedom_of_others, x);
    return 2.0 * std::min(below, 1.0 - below);
}

// The line or channel whose scatter differs most from that of the others, if chance does not explain it. One factor on
// all uncertainties leaves nothing here: it is the noise then that is stated wrongly, not a reading that is wrong.
std::optional<FitReason> uneven_misfit(const Adjustment& adjustment, const Measurement& measurement) {
    std::map<std::string, Share> lines, channels;
    Share all;
    for (const ReadingResidual& r : adjustment.residuals) {
        if (!r.used() || r.redundancy == 0.0) continue;
        const Share share{r.normalised * r.normalised * r.redundancy, r.redundancy};
        lines[measurement.stations()[r.row].line.name()].add(share);
        channels[r.channel].add(share);
        all.add(share);
    }
    constexpr double fewest = 1.0;  // degrees of freedom on either side of a comparison
    const double comparisons = double(lines.size() + channels.size());
    double least = uneven_below / comparisons;
    std::optional<FitReason> reason;
    for (const bool is_line : {true, false})
        for (const auto& [name, share] : is_line ? lines : channels) {
            const double others = all.freedom - share.freedom;
            if (share.freedom < fewest || others < fewest) continue;
            const double factor = share.square_sum / share.freedom;
            const double probability =
                two_sided_probability(factor * others / (all.square_sum - share.square_sum), share.freedom, others);
            if (!(probability < least)) continue;
            least = probability;
            reason = FitReason{FitFinding::uneven_misfit, std::sqrt(factor),
                               std::sqrt((all.square_sum - share.square_sum) / others), is_line ? name : "",
                               is_line ? "" : name};
        }
    return reason;
}

// A value that stands further from its prior than the readings' own uncertainty of it lets chance explain. Five
// standard deviations: of dozens of unknowns in a sound run, one stands beyond four in every 250 runs.
void compare_with_priors(const Adjustment& adjustment, std::vector<FitReason>& reasons) {
    constexpr double least_share = 1e-3;  // of the prior: below it the readings say nothing that could contradict it
    for (const SetupEstimate& e : adjustment.setup) {
        if (!e.value || !std::isfinite(e.prior) || e.prior == 0.0) continue;
        const double known = std::max(e.prior * e.prior - e.standard_uncertainty * e.standard_uncertainty,
                                      least_share * least_share * e.prior * e.prior);
        const double distance = std::abs(*e.value) / std::sqrt(known);
        if (!(distance <= farthest_prior))
            reasons.push_back({FitFinding::prior, distance, farthest_prior, e.line, name(e.quantity), e.component});
    }
}

void judge_faults(const Adjustment& adjustment, std::vector<FitReason>& reasons) {
    for (std::size_t k = 0; k < adjustment.faults.size(); ++k) {
        const FaultClass& found = adjustment.faults[k];
        const Fault& best = found.members.front();
        FitReason reason{FitFinding::fault, best.chi_square_gain, significant_gain, best.line, best.channel};
        reason.fault = int(k) + 1;
        if (!found.corrected) reasons.push_back(reason);
        if (!(found.spread > found.plausible)) continue;
        reason.finding = FitFinding::alternatives;
        reason.parameter = found.widest;
        reason.value = found.spread;
        reason.limit = found.plausible;
        reasons.push_back(reason);
    }
}

}  // namespace

std::string name(FitFinding finding) {
    switch (finding) {
        case FitFinding::no_redundancy: return "no_redundancy";
        case FitFinding::noise_factor: return "noise_factor";
        case FitFinding::misfit: return "misfit";
        case FitFinding::no_misfit: return "no_misfit";
        case FitFinding::uneven_misfit: return "uneven_misfit";
        case FitFinding::prior: return "prior";
        case FitFinding::fault: return "fault";
        case FitFinding::alternatives: return "alternatives";
    }
    return "";
}

Verdict judge(const Adjustment& adjustment, const Measurement& measurement) {
    Verdict verdict{Fit::accepted, {}};
    auto& reasons = verdict.reasons;
    judge_faults(adjustment, reasons);
    if (reasons.empty() && adjustment.degrees_of_freedom <= 0)
        return {Fit::unchecked, {{FitFinding::no_redundancy, 0.0, 1.0}}};
    const double probability = adjustment.chi_square_probability;
    const double factor = std::sqrt(adjustment.variance_factor());
    if (!(factor <= largest_noise_factor)) reasons.push_back({FitFinding::noise_factor, factor, largest_noise_factor});
    if (!(probability >= rejected_below))
        if (const auto uneven = uneven_misfit(adjustment, measurement)) reasons.push_back(*uneven);
    compare_with_priors(adjustment, reasons);
    if (!reasons.empty()) verdict.fit = Fit::rejected;
    else if (!(probability >= doubtful_below)) {
        verdict.fit = Fit::doubtful;
        reasons.push_back({FitFinding::misfit, probability, doubtful_below});
    } else if (probability > doubtful_above) {
        verdict.fit = Fit::doubtful;
        reasons.push_back({FitFinding::no_misfit, 1.0 - probability, 1.0 - doubtful_above});
    }
    return verdict;
}

}  // namespace stepdiag
