#include "adjustment/setup_priors.hpp"

#include <algorithm>
#include <cmath>

#include "stepdiag/core/error.hpp"

namespace stepdiag {
namespace {

// Mean and variance of 3/2 D^2 - m^2/2 in one direction across the line.
struct CosineError {
    double mean = 0.0, variance = 0.0;

    void add(const CosineError& other) {
        mean += other.mean;
        variance += other.variance;
    }
    double root_mean_square() const { return std::sqrt(mean * mean + variance); }
};

// Of normal angles of laser and mirror, when a tilt has told their difference.
CosineError tilt_known(PriorUncertainty laser, PriorUncertainty mirror) {
    const double variance = 1.0 / (std::pow(laser, -2) + std::pow(mirror, -2));  // of either of them then
    return {-variance / 2.0, variance * variance / 2.0};
}

// A mirror that stands square to the line, or that points beside it have told, and a laser that turns alone.
CosineError tilt_unknown(PriorUncertainty laser) {
    const double variance = laser * laser;
    return {1.5 * variance, 4.5 * variance * variance};
}

}  // namespace

std::vector<PriorUncertainty> setup_priors(const AdjustmentOptions& options, const std::string& line,
                                           bool is_scale_line, const LineReadings& readings,
                                           const ChannelModel& model) {
    const auto own = options.setup_by_line.find(line);
    const auto given = [&](SetupQuantity quantity) {
        const auto q = static_cast<std::size_t>(quantity);
        std::optional<PriorUncertainty> prior;
        // Scale lines are aligned by themselves: what is said of all lines' angles is said of the others.
        if (!is_scale_line || (quantity != SetupQuantity::reflector && quantity != SetupQuantity::laser))
            prior = options.setup[q];
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
    const bool tilts_tell = readings.tilts && !beams_unknown;
    const PriorUncertainty usual_angle = readings.usual_angle;

    std::vector<PriorUncertainty> priors(model.setup_size(), fixed_unknown);
    for (int q = 0; q < adjusted_quantity_count; ++q) {
        const SetupQuantity quantity{q};
        const SetupQuantityRecord& of = record(quantity);
        PriorUncertainty usual = is_scale_line ? of.scale_line_prior : of.prior;
        if (quantity == SetupQuantity::laser && !is_scale_line && beams_unknown) usual = of.usual;
        if (quantity == SetupQuantity::drift && !readings.times) usual = fixed_unknown;
        const PriorUncertainty prior = std::min(given(quantity).value_or(usual), of.broadest);
        const auto [first, count] = setup::columns(quantity, model.beams());
        if (of.layout.value_or(model.kind()) == model.kind()) std::fill_n(priors.begin() + first, count, prior);
    }
    if (model.beams() > 0) priors[setup::beam_constants] = fixed_unknown;  // the others' are against that of d1

    PriorUncertainty laser = priors[setup::laser], mirror = priors[setup::reflector];
    if (is_scale_line && std::isinf(laser))
        throw InvalidArgument("adjustment laser of " + line +
                              ": a scale line's angle acts at second order only; expected fixed or its standard "
                              "uncertainty, not free");
    if (is_scale_line && !tilts_tell) {
        // Without tilts the mirror is taken to be square to the beam, as it is after aligning it.
        mirror = free_unknown;
        for (const int column : {int(setup::reflector), int(setup::laser), int(setup::psd_zero)})
            priors[column] = priors[column + 1] = fixed_unknown;
        if (!readings.tilts) priors[setup::roll] = priors[setup::gain] = fixed_unknown;
    } else if (std::isinf(laser) && (std::isinf(mirror) || !tilts_tell)) {
        laser = usual_angle;
        mirror = std::min(mirror, usual_angle);
    }
    CosineError error;
    for (const bool beside : readings.beside) {
        if (tilts_tell || is_scale_line) error.add(beside ? CosineError{} : tilt_known(laser, mirror));
        else error.add(tilt_unknown(laser));
    }
    if (is_scale_line && tilts_tell && std::isinf(mirror)) {
        error.add({0.0, readings.tilt * readings.tilt * laser * laser});
        priors[setup::laser] = priors[setup::laser + 1] = fixed_unknown;
    }
    priors[setup::scale_factor] = error.root_mean_square();
    return priors;
}

}  // namespace stepdiag
