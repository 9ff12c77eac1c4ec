#include "adjustment/setup_priors.hpp"

#include <algorithm>
#include <cmath>

#include "stepdiag/core/error.hpp"

namespace stepdiag {
namespace {

constexpr PriorUncertainty usual_lateral = 1.0;  // mm
constexpr PriorUncertainty usual_roll = 20e-3;   // rad
constexpr PriorUncertainty usual_gain = 0.01;    // 1
// What "free" means where an unknown acts on tilts only that are 0 on a perfect machine.
constexpr PriorUncertainty broad_lateral = 1e3;           // mm
constexpr PriorUncertainty broad_roll = 1.0;              // rad
constexpr PriorUncertainty broad_gain = 1.0;              // 1
constexpr PriorUncertainty laser_beside_beams = 2e-3;     // rad, where the constants of the beams are unknown
constexpr PriorUncertainty usual_laser = 2e-3;            // rad, of a free one that nothing tells
constexpr PriorUncertainty laser_of_scale_line = 500e-6;  // rad

PriorUncertainty usual_prior(SetupQuantity quantity, bool is_scale_line, bool beams_unknown) {
    switch (quantity) {
        case SetupQuantity::reflector: return is_scale_line ? fixed_unknown : free_unknown;
        case SetupQuantity::laser:
            return is_scale_line ? laser_of_scale_line : beams_unknown ? laser_beside_beams : free_unknown;
        case SetupQuantity::distance_constant:
        case SetupQuantity::beam_constants:
        case SetupQuantity::psd_zero: return free_unknown;
        case SetupQuantity::lateral: return usual_lateral;
        case SetupQuantity::roll: return is_scale_line ? fixed_unknown : usual_roll;
        case SetupQuantity::gain: return is_scale_line ? fixed_unknown : usual_gain;
        case SetupQuantity::drift: break;
    }
    return fixed_unknown;
}

}  // namespace

std::string name(SetupQuantity quantity) {
    constexpr const char* names[setup_quantity_count] = {
        "reflector", "laser", "distance_constant", "beam_constants", "psd_zero", "lateral", "roll", "gain", "drift"};
    return names[static_cast<int>(quantity)];
}

PriorUncertainty broadest_prior(SetupQuantity quantity) {
    switch (quantity) {
        case SetupQuantity::lateral: return broad_lateral;
        case SetupQuantity::roll: return broad_roll;
        case SetupQuantity::gain: return broad_gain;
        default: return free_unknown;
    }
}

std::optional<SetupColumnName> setup_column_name(int column) {
    if (column >= setup::beam_constants)
        return SetupColumnName{SetupQuantity::beam_constants, column - setup::beam_constants + 1};
    switch (column) {
        case setup::reflector:
        case setup::reflector + 1: return SetupColumnName{SetupQuantity::reflector, column - setup::reflector};
        case setup::laser:
        case setup::laser + 1: return SetupColumnName{SetupQuantity::laser, column - setup::laser};
        case setup::distance_constant: return SetupColumnName{SetupQuantity::distance_constant, 0};
        case setup::psd_zero:
        case setup::psd_zero + 1: return SetupColumnName{SetupQuantity::psd_zero, column - setup::psd_zero};
        case setup::lateral:
        case setup::lateral + 1: return SetupColumnName{SetupQuantity::lateral, column - setup::lateral};
        case setup::roll: return SetupColumnName{SetupQuantity::roll, 0};
        case setup::gain: return SetupColumnName{SetupQuantity::gain, 0};
        case setup::drift: return SetupColumnName{SetupQuantity::drift, 0};
        default: return std::nullopt;
    }
}

std::vector<PriorUncertainty> setup_priors(const AdjustmentOptions& options, const std::string& line,
                                           bool is_scale_line, bool is_single_axis, bool has_tilts, ChannelKind kind,
                                           int columns) {
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
    const auto beam_prior = given(SetupQuantity::beam_constants);
    const bool beams_unknown = kind == ChannelKind::multi_beam && beam_prior.value_or(free_unknown) != fixed_unknown;
    const auto prior = [&](SetupQuantity quantity) {
        return given(quantity).value_or(usual_prior(quantity, is_scale_line, beams_unknown));
    };

    std::vector<PriorUncertainty> priors(columns, fixed_unknown);
    for (int column = 0; column < columns; ++column)
        if (const auto of = setup_column_name(column))
            priors[column] = std::min(prior(of->quantity), broadest_prior(of->quantity));
    // Without a reflector angle of its own a scale line's spots are not used.
    const bool has_spots = kind == ChannelKind::psd && !(is_scale_line && priors[setup::reflector] == fixed_unknown);
    if (!has_spots) priors[setup::psd_zero] = priors[setup::psd_zero + 1] = fixed_unknown;
    // E[((a^2 + b^2)/2)^2] = 2 s^4 for two normal angles of standard deviation s.
    const auto cosine_error = [](PriorUncertainty angle) { return std::sqrt(2.0) * angle * angle; };
    if (is_scale_line) {
        const PriorUncertainty angle = priors[setup::laser];
        if (std::isinf(angle))
            throw InvalidArgument("adjustment laser of " + line +
                                  ": a scale line's angle acts at second order only; expected fixed or its standard "
                                  "uncertainty, not free");
        priors[setup::cosine] = cosine_error(angle);
        priors[setup::laser] = priors[setup::laser + 1] = fixed_unknown;
    } else if (is_single_axis || !has_tilts) {
        // Tilts tell the laser from a known reflector. Without them mirror and laser stand by themselves, and a laser
        // that turns alone reads long by three times as much as one that the mirror follows reads short.
        const bool tilts_tell = has_tilts && !beams_unknown;
        const PriorUncertainty laser = std::min(priors[setup::laser], usual_laser);
        priors[setup::cosine] =
            tilts_tell ? cosine_error(std::min(laser, priors[setup::reflector])) : 3.0 * cosine_error(laser);
    }
    return priors;
}

}  // namespace stepdiag
