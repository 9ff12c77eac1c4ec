// Every limit that a verdict, or the search for faults and mistakes, is made with (docs/conventions.md, "Verdict of a
// fit"). All rooms and the Python package take them from here.
#pragma once

namespace stepdiag {

struct Thresholds {
    // Noise. A noise factor is the square root of a variance factor; probabilities are of a misfit at least as large.
    double largest_noise_factor = 3.0;       // beyond it the fit is rejected
    double misfit_rejected = 3e-4;           // below it, where the misfit also differs between lines, channels or times
    double misfit_doubtful = 1e-2;           // below it
    double no_misfit_doubtful = 1.0 - 1e-3;  // above it: less noise than stated
    double noise_component = 2e-4;           // that a channel scatters as much by chance: below it that is its noise
    double widest_component = 0.3;           // relative standard uncertainty of a noise factor that is used, at most
    // Of the most conspicuous of all patterns of residuals: where chi-square finds a misfit, and where it does not.
    double pattern = 1e-2, pattern_alone = 3e-3;
    // Residuals that are rounding (rms in its units), and below this noise factor: nothing tests what is stated.
    double rounding_alone = 1.0, far_below_stated = 1e-2;

    // Set-up. Five standard deviations: of dozens of unknowns in a sound run, one stands beyond four in every 250 runs.
    double farthest_prior = 5.0;
    double prior_scatter_rejected = 1e-6;  // probability, as of a single value beyond five

    // Faults and mistakes, in chi-square.
    double fault = 28.0;           // least gain of a fault
    double most_faults = 0.1;      // of a channel, by its redundancy; one in any case
    double fault_cost = 2.0;       // times as large an uncertainty, by what was done about faults, at most
    double alternative = 25.0;     // what is less behind the best may be it
    double second_order = 1000.0;  // gain from which second order may distinguish faults
    double gross_scatter = 25.0;   // of the square sum a reading: values far from any machine
    double mistake = 60.0;         // least gain of a mistake in the whole run
    double chance = 9.0;           // difference that does not make one mistake better than another
    // From so many faults, or faults on so many lines, one mistake that explains as much is the likelier.
    double faults_of_mistake = 3.0, lines_of_mistake = 2.0;
    // Power: square root of the noncentrality with which a fault is found with 99 %, sqrt(28) + 2.3.
    double found_with_99_percent = 7.6;

    // Variance factor beyond which nobody believes a fit.
    constexpr double largest_variance_factor() const { return largest_noise_factor * largest_noise_factor; }
};
inline constexpr Thresholds thresholds{};

}  // namespace stepdiag
