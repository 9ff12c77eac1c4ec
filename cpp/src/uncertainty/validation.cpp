#include "stepdiag/uncertainty/validation.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "stepdiag/core/error.hpp"
#include "stepdiag/core/units.hpp"

namespace stepdiag {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

double rounding_of(const std::string& unit) { return unit == "rad" ? 1e-13 : 1e-10; }

// Reasons why one output is not validated, as text.
class Reasons {
public:
    Reasons(const Propagation& propagation, const MonteCarloResult& found, const Validation& validation, Index output)
        : gum_(propagation), found_(found), validation_(validation), i_(output) {}

    std::string text() {
        if (std::isnan(validation_.low[i_]))
            return "no expanded uncertainty: correlated inputs with finite degrees of freedom contribute, for which "
                   "Welch and Satterthwaite's formula does not hold";
        say_shift();
        say_width();
        say_shape();
        if (parts_.empty()) say("the interval's ends differ by " + number(largest_difference()));
        if (largest_difference() - validation_.delta[i_] < 3.0 * validation_.sampling[i_])
            say("it may be chance: the ends of the Monte Carlo interval are known to " +
                number(validation_.sampling[i_]) + " only; more samples would tell");
        std::string text;
        for (const std::string& part : parts_) text += (text.empty() ? "" : "; ") + part;
        return text;
    }

private:
    double u() const { return gum_.standard_uncertainty[i_]; }
    double drawn_u() const { return found_.standard_uncertainty[i_]; }
    double delta() const { return validation_.delta[i_]; }
    double largest_difference() const { return std::max(validation_.d_low[i_], validation_.d_high[i_]); }
    void say(const std::string& part) { parts_.push_back(part); }

    std::string number(double value) const {
        const std::string& unit = validation_.outputs[std::size_t(i_)].unit;
        const bool is_small = unit == "mm" || unit == "rad";
        std::ostringstream text;
        text.precision(2);
        text << value * (unit == "mm" ? 1e3 : unit == "rad" ? 1e6 : 1.0);
        if (unit != "1") text << " " << (is_small ? (unit == "mm" ? "um" : "urad") : unit);
        return text.str();
    }
    static std::string percent(double share) {
        std::ostringstream text;
        text << std::lround(100.0 * share) << " %";
        return text.str();
    }
    Index strongest_square() const {
        Index input = -1;
        if (gum_.second_order.cols() > 0) gum_.second_order.row(i_).cwiseAbs().maxCoeff(&input);
        return input;
    }
    std::string square_of(Index input, const char* does) const {
        return "the square of " + gum_.inputs[std::size_t(input)].name + " " + does + " by " +
               number(gum_.second_order(i_, input)) + ", u is " + number(u());
    }

    // The mean differs from the value at the inputs' expectations.
    void say_shift() {
        const double shift = found_.mean[i_] - gum_.value[i_];
        if (std::abs(shift) <= std::max(delta() / 4.0, 4.0 * drawn_u() / std::sqrt(double(found_.samples)))) return;
        std::string text = "the mean is shifted by " + number(shift);
        const Index input = strongest_square();
        const double by_squares = gum_.second_order_shift()[i_];
        if (input >= 0 && std::abs(by_squares - shift) < 0.5 * std::abs(shift)) {
            text += ": " + square_of(input, "moves it");
            if (gum_.second_order.cols() > 1) text += "; all squares together by " + number(by_squares);
        } else {
            text += ", of which the squares of single inputs explain " + number(by_squares) +
                    ": products of two inputs, or higher orders, explain the rest";
        }
        say(text);
    }

    // The standard uncertainties differ.
    void say_width() {
        const double excess = drawn_u() * drawn_u() - u() * u();
        if (std::abs(drawn_u() - u()) <= std::max(delta() / 4.0, 3.0 * drawn_u() / std::sqrt(2.0 * found_.samples)))
            return;
        std::string text = "u is " + number(drawn_u()) + " by Monte Carlo and " + number(u()) + " by propagation";
        const double by_squares = 2.0 * gum_.second_order.row(i_).squaredNorm();
        const double by_products = gum_.knows_products ? gum_.product_variance[i_] : 0.0;
        const bool explained = std::abs(by_squares + by_products - excess) < 0.5 * std::abs(excess);
        if (excess > 0.0 && excess_of_t() > 0.5 * excess)
            text += ": a t distribution is wider than its scale, which propagation takes with its degrees of freedom";
        else if (explained && by_products > by_squares)
            text += ": " + strongest_product() + "; all products together by " + number(std::sqrt(by_products));
        else if (explained && by_squares > 0.0) text += ": " + square_of(strongest_square(), "spreads it");
        else if (excess > 0.0)
            text += gum_.knows_products ? ": orders above the second spread it"
                                        : ": products of two inputs, or higher orders, spread it";
        else text += ": higher orders of the inputs reduce it";
        say(text);
    }
    std::string strongest_product() const {
        const auto& product = gum_.strongest_product[std::size_t(i_)];
        return "the product of " + gum_.inputs[std::size_t(product.first)].name + " and " +
               gum_.inputs[std::size_t(product.second)].name + " spreads it by " + number(std::abs(product.value));
    }
    double excess_of_t() const {
        double sum = 0.0;
        for (std::size_t k = 0; k < gum_.inputs.size(); ++k) {
            const double nu = gum_.inputs[k].degrees_of_freedom;
            if (gum_.inputs[k].distribution == DistributionKind::student_t && std::isfinite(nu))
                sum += std::pow(gum_.first_order(i_, Index(k)), 2) * 2.0 / (nu - 2.0);
        }
        return sum;
    }

    // The distribution is not normal.
    void say_shape() {
        const double below = found_.mean[i_] - found_.symmetric(i_, 0),
                     above = found_.symmetric(i_, 1) - found_.mean[i_];
        if (std::abs(above - below) > std::max(delta() / 2.0, 4.0 * validation_.sampling[i_]))
            say("the distribution is skew: its interval reaches " + number(below) + " below the mean and " +
                number(above) + " above");
        const double half = (above + below) / 2.0, factor = half / drawn_u();
        const double expected = (validation_.high[i_] - validation_.low[i_]) / (2.0 * u());
        if (!(std::abs(factor - expected) * drawn_u() > std::max(delta() / 2.0, 3.0 * validation_.sampling[i_])))
            return;
        std::ostringstream text;
        text.precision(3);
        text << "the interval is " << factor << " u wide to each side instead of " << expected << " u";
        Index input = -1;
        double share = 0.0;
        for (std::size_t k = 0; k < gum_.inputs.size(); ++k)
            if (gum_.inputs[k].distribution != DistributionKind::normal) {
                const double of_this = std::pow(gum_.first_order(i_, Index(k)) / u(), 2);
                if (of_this > share) share = of_this, input = Index(k);
            }
        if (share > 0.25)
            text << ": " << gum_.inputs[std::size_t(input)].name << ", "
                 << name(gum_.inputs[std::size_t(input)].distribution) << ", makes " << percent(share)
                 << " of the variance";
        say(text.str());
    }

    const Propagation& gum_;
    const MonteCarloResult& found_;
    const Validation& validation_;
    const Index i_;
    std::vector<std::string> parts_;
};

// Standard uncertainty of a quantile of a normal distribution, in units of its standard deviation.
double sampling_of_ends(double coverage, double samples) {
    const double p = (1.0 + coverage) / 2.0, z = normal_quantile(p);
    return std::sqrt(p * (1.0 - p) / samples) / (std::exp(-z * z / 2.0) / std::sqrt(2.0 * pi));
}

}  // namespace

std::size_t Validation::failures() const { return std::size_t(std::count(validated.begin(), validated.end(), false)); }

Validation compare(const Propagation& propagation, const MonteCarloResult& monte_carlo, int digits) {
    const auto same = [](const SampleModel::Output& a, const SampleModel::Output& b) {
        return a.name == b.name && a.unit == b.unit;
    };
    if (propagation.outputs.size() != monte_carlo.outputs.size() ||
        !std::equal(propagation.outputs.begin(), propagation.outputs.end(), monte_carlo.outputs.begin(), same))
        throw InvalidArgument("Monte Carlo result: expected the outputs of the propagation (" +
                              std::to_string(propagation.outputs.size()) + "), got others (" +
                              std::to_string(monte_carlo.outputs.size()) + ")");
    if (digits < 1 || digits > 3) throw InvalidArgument("digits: expected 1 to 3, got " + std::to_string(digits));
    const double coverage = monte_carlo.options.coverage;
    const VectorXd expanded = propagation.expanded(coverage);
    Validation v;
    v.outputs = propagation.outputs;
    v.coverage = coverage;
    v.digits = digits;
    v.low = propagation.value - expanded;
    v.high = propagation.value + expanded;
    v.d_low = (v.low - monte_carlo.symmetric.col(0)).cwiseAbs();
    v.d_high = (v.high - monte_carlo.symmetric.col(1)).cwiseAbs();
    v.sampling = monte_carlo.standard_uncertainty * sampling_of_ends(coverage, double(monte_carlo.samples));
    v.delta.resize(v.low.size());
    for (Index i = 0; i < v.low.size(); ++i) {
        const double u = propagation.standard_uncertainty[i], drawn = monte_carlo.standard_uncertainty[i];
        const double rounding = rounding_of(v.outputs[std::size_t(i)].unit);
        const double decisive = u > rounding ? u : drawn;
        v.delta[i] = decisive > rounding ? numerical_tolerance(decisive, digits) : rounding;
        v.validated.push_back(v.d_low[i] <= v.delta[i] && v.d_high[i] <= v.delta[i]);
        v.reason.push_back(v.validated.back() ? "" : Reasons(propagation, monte_carlo, v, i).text());
    }
    return v;
}

Validation compare(const Propagation& propagation, const MonteCarloResult& monte_carlo) {
    return compare(propagation, monte_carlo, monte_carlo.options.digits);
}

}  // namespace stepdiag
