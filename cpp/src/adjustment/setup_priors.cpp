#include "adjustment/setup_priors.hpp"

#include <algorithm>
#include <cmath>

#include "stepdiag/core/error.hpp"

namespace stepdiag {
namespace {

constexpr double factor = 1.959963984540054;  // an interval of 95 %, by the standard uncertainty
constexpr double outside = 0.05;

// Standard uncertainties u, so that an error of second order is within factor u in 95 % of all cases (docs/method.md).

// Of v z^2/2, z standard normal: an angle of variance v in one direction.
double one_angle(double variance) { return factor / 2.0 * variance; }

// Of a E1 - b E2, E exponential with mean 1: a quadratic form of angles that are the same in both directions across the
// line, which has twice each of its eigenvalues. Its tail (a exp(-q/a) + b exp(-q/b))/(a + b) is convex: Newton's steps
// from below do not pass the root.
double both_directions(double a, double b) {
    if (a + b == 0.0) return 0.0;
    const auto term = [](double mean, double q) { return mean > 0.0 ? std::exp(-q / mean) : 0.0; };
    double q = -std::log(outside) * std::min(a, b);
    for (double step = a + b; step > 1e-12 * (a + b);) {
        const double tail = a * term(a, q) + b * term(b, q);
        step = (tail - outside * (a + b)) / (term(a, q) + term(b, q));
        q += step;
    }
    return q / factor;
}

// m^2/2 of either direction, when a tilt has told the difference of laser and mirror.
double tilt_known(double variance, int directions) {
    return directions == 2 ? both_directions(0.0, variance) : directions == 1 ? one_angle(variance) : 0.0;
}

// 3/2 l^2: a mirror that stands square to the line, or that points beside it have told, and a laser that turns alone.
double tilt_unknown(PriorUncertainty laser) { return both_directions(3.0 * laser * laser, 0.0); }

// D^2 - D l - l^2/2, D the mirror's angle against the laser: twice the eigenvalues of its matrix.
double mirror_unknown(PriorUncertainty laser, PriorUncertainty mirror) {
    const double l = laser * laser, d = mirror * mirror;
    const double mean = d - l / 2.0, apart = Eigen::Vector2d(d + l / 2.0, laser * mirror).norm();
    return both_directions(apart + mean, apart - mean);
}

// D l + l^2/2 of both directions, D known, of this size. Where both are of a size they add up in D's direction, of
// which their squares alone know nothing: the last term is fitted, and covers 94.9 to 95.3 % for every D.
double tilt_read(PriorUncertainty laser, double tilt) {
    const double l = laser * laser, product = l * tilt * tilt;
    return std::sqrt(std::pow(both_directions(0.0, l), 2) + product + std::min(product / 2.0, l * l));
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
        if (quantity == SetupQuantity::reflector && is_scale_line && !tilts_tell) usual = of.scale_line_usual;
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
        // Only its alignment by the beam that comes back knows the mirror.
        if (std::isinf(mirror)) mirror = usual_angle;
        priors[setup::reflector] = priors[setup::reflector + 1] = mirror;
        for (const int column : {int(setup::laser), int(setup::psd_zero)})
            priors[column] = priors[column + 1] = fixed_unknown;
        if (!readings.tilts) priors[setup::roll] = priors[setup::gain] = fixed_unknown;
        priors[setup::scale_factor] = mirror_unknown(laser, mirror);
        return priors;
    }
    if (is_scale_line && std::isinf(mirror)) {
        priors[setup::laser] = priors[setup::laser + 1] = fixed_unknown;
        priors[setup::scale_factor] = tilt_read(laser, readings.tilt);
        return priors;
    }
    if (std::isinf(laser) && (std::isinf(mirror) || !tilts_tell)) {
        laser = usual_angle;
        mirror = std::min(mirror, usual_angle);
    }
    const int open = int(std::count(readings.beside.begin(), readings.beside.end(), false));
    const double variance = 1.0 / (std::pow(laser, -2) + std::pow(mirror, -2));  // of either, D known
    priors[setup::scale_factor] = tilts_tell ? tilt_known(variance, open) : tilt_unknown(laser);
    return priors;
}

}  // namespace stepdiag
