#include "adjustment/setup_priors.hpp"

#include <algorithm>
#include <cmath>

#include "stepdiag/core/error.hpp"

namespace stepdiag {

std::vector<PriorUncertainty> setup_priors(const AdjustmentOptions& options, const std::string& line,
                                           bool is_scale_line, bool is_single_axis, bool has_tilts,
                                           const ChannelModel& model) {
    const auto own = options.setup_by_line.find(line);
    const auto given = [&](SetupQuantity quantity) {
        const auto q = static_cast<std::size_t>(quantity);
        std::optional<PriorUncertainty> prior;
        // Scale lines are aligned by themselves: what is said of all lines is said of the others.
        const bool of_all =
            !is_scale_line || quantity == SetupQuantity::distance_constant || quantity == SetupQuantity::lateral;
        if (of_all) prior = options.setup[q];
        if (own != options.setup_by_line.end() && own->second[q]) prior = own->second[q];
        const bool usable =
            !prior || *prior == fixed_unknown || *prior == free_unknown || is_usable_uncertainty(*prior);
        if (!usable)
            throw InvalidArgument("adjustment " + name(quantity) + " of " + line +
                                  ": expected free, fixed or a standard uncertainty of 1e-12 to 1e6 mm or rad");
        return prior;
    };
    const bool beams_unknown = model.kind() == HeadLayout::multi_beam &&
                               given(SetupQuantity::beam_constants).value_or(free_unknown) != fixed_unknown;
    const PriorUncertainty usual_laser = record(SetupQuantity::laser).usual;

    std::vector<PriorUncertainty> priors(model.setup_size(), fixed_unknown);
    for (int q = 0; q < adjusted_quantity_count; ++q) {
        const SetupQuantity quantity{q};
        const SetupQuantityRecord& of = record(quantity);
        PriorUncertainty usual = is_scale_line ? of.scale_line_prior : of.prior;
        if (quantity == SetupQuantity::laser && !is_scale_line && beams_unknown) usual = usual_laser;
        const PriorUncertainty prior = std::min(given(quantity).value_or(usual), of.broadest);
        const auto [first, count] = setup::columns(quantity, model.beams());
        if (of.layout.value_or(model.kind()) == model.kind()) std::fill_n(priors.begin() + first, count, prior);
    }
    if (model.beams() > 0) priors[setup::beam_constants] = fixed_unknown;  // the others' are against that of d1
    // Without a reflector angle of its own a scale line's spots are not used.
    if (is_scale_line && priors[setup::reflector] == fixed_unknown)
        priors[setup::psd_zero] = priors[setup::psd_zero + 1] = fixed_unknown;
    // E[((a^2 + b^2)/2)^2] = 2 s^4 for two normal angles of standard deviation s.
    const auto cosine_error = [](PriorUncertainty angle) { return std::sqrt(2.0) * angle * angle; };
    if (is_scale_line) {
        const PriorUncertainty angle = priors[setup::laser];
        if (std::isinf(angle))
            throw InvalidArgument("adjustment laser of " + line +
                                  ": a scale line's angle acts at second order only; expected fixed or its standard "
                                  "uncertainty, not free");
        priors[setup::scale_factor] = cosine_error(angle);
        priors[setup::laser] = priors[setup::laser + 1] = fixed_unknown;
    } else if (is_single_axis || !has_tilts) {
        // Tilts tell the laser from a known reflector. Without them mirror and laser stand by themselves, and a laser
        // that turns alone reads long by three times as much as one that the mirror follows reads short.
        const bool tilts_tell = has_tilts && !beams_unknown;
        const PriorUncertainty laser = std::min(priors[setup::laser], usual_laser);
        priors[setup::scale_factor] =
            tilts_tell ? cosine_error(std::min(laser, priors[setup::reflector])) : 3.0 * cosine_error(laser);
    }
    return priors;
}

}  // namespace stepdiag
