#include "stepdiag/monte_carlo/distribution.hpp"

#include <Eigen/Cholesky>
#include <array>
#include <boost/math/distributions/normal.hpp>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <sstream>

#include "stepdiag/core/error.hpp"
#include "stepdiag/core/units.hpp"

namespace stepdiag {
namespace {

constexpr std::array names = {"normal", "rectangular", "triangular", "arcsine", "t", "curvilinear_trapezoid"};

[[noreturn]] void refuse(const std::string& name, const std::string& expected, double got) {
    std::ostringstream message;
    message << name << ": expected " << expected << ", got " << got;
    throw InvalidArgument(message.str());
}

void check_probability(double probability) {
    if (!(probability > 0.0 && probability < 1.0)) refuse("probability", "a number between 0 and 1", probability);
}

}  // namespace

std::string name(DistributionKind kind) { return names[std::size_t(kind)]; }

DistributionKind parse_distribution_kind(const std::string& name) {
    std::string known;
    for (std::size_t i = 0; i < names.size(); ++i) {
        if (name == names[i]) return DistributionKind(i);
        known += std::string(i ? ", \"" : "\"") + names[i] + "\"";
    }
    throw InvalidArgument("distribution: expected one of " + known + ", got \"" + name + "\"");
}

double Distribution::standard_uncertainty() const {
    switch (kind) {
        case DistributionKind::normal: return spread;
        case DistributionKind::rectangular: return spread / std::sqrt(3.0);
        case DistributionKind::triangular: return spread / std::sqrt(6.0);
        case DistributionKind::arcsine: return spread / std::sqrt(2.0);
        case DistributionKind::student_t:
            if (std::isinf(degrees_of_freedom)) return spread;
            return spread * std::sqrt(degrees_of_freedom / (degrees_of_freedom - 2.0));
        case DistributionKind::curvilinear_trapezoid: return std::sqrt(spread * spread / 3.0 + edge * edge / 9.0);
    }
    return 0.0;
}

void check(const Distribution& distribution, const std::string& name) {
    if (!std::isfinite(distribution.expectation))
        refuse(name + ", expectation", "a finite number", distribution.expectation);
    if (!(distribution.spread >= 0.0 && std::isfinite(distribution.spread)))
        refuse(name + ", spread", "a finite number, 0 or more", distribution.spread);
    const bool trapezoid = distribution.kind == DistributionKind::curvilinear_trapezoid;
    if (!(distribution.edge >= 0.0 && distribution.edge <= (trapezoid ? distribution.spread : 0.0)))
        refuse(name + ", edge", trapezoid ? "a number from 0 to the half width" : "0 (curvilinear_trapezoid has one)",
               distribution.edge);
    if (!(distribution.degrees_of_freedom > 0.0))
        refuse(name + ", degrees of freedom", "a number above 0", distribution.degrees_of_freedom);
    if (distribution.kind == DistributionKind::student_t && distribution.degrees_of_freedom <= 2.0)
        refuse(name + ", degrees of freedom", "more than 2, since a t distribution with fewer has no variance",
               distribution.degrees_of_freedom);
}

double draw(const Distribution& distribution, double normal, double u, double v) {
    const double mean = distribution.expectation, spread = distribution.spread;
    switch (distribution.kind) {
        case DistributionKind::normal: return mean + spread * normal;
        case DistributionKind::rectangular: return mean + spread * (2.0 * u - 1.0);
        case DistributionKind::triangular:
            return mean + spread * (u < 0.5 ? std::sqrt(2.0 * u) - 1.0 : 1.0 - std::sqrt(2.0 * (1.0 - u)));
        case DistributionKind::arcsine: return mean + spread * std::sin(2.0 * pi * u);
        case DistributionKind::student_t: {
            const double nu = distribution.degrees_of_freedom;
            // nu (u^(-2/nu) - 1). Its limit for infinite degrees of freedom is the Box-Muller formula.
            const double square = std::isinf(nu) ? -2.0 * std::log(u) : nu * std::expm1(-2.0 / nu * std::log(u));
            return mean + spread * std::sqrt(square) * std::cos(2.0 * pi * v);
        }
        case DistributionKind::curvilinear_trapezoid:
            return mean + (spread + distribution.edge * (1.0 - 2.0 * u)) * (2.0 * v - 1.0);
    }
    return mean;
}

double normal_quantile(double probability) {
    check_probability(probability);
    return boost::math::quantile(boost::math::normal(), probability);
}

double t_quantile(double probability, double degrees_of_freedom) {
    check_probability(probability);
    if (!(degrees_of_freedom > 0.0)) refuse("degrees of freedom", "a number above 0", degrees_of_freedom);
    if (std::isinf(degrees_of_freedom)) return normal_quantile(probability);
    return boost::math::quantile(boost::math::students_t(degrees_of_freedom), probability);
}

Eigen::MatrixXd correlation_factor(const Eigen::MatrixXd& correlation, const std::string& name) {
    // Accepts rounding of doubles, which is far below the digits of the entries.
    constexpr double rounding = 1e-9;
    if (correlation.rows() != correlation.cols() || correlation.rows() == 0)
        throw InvalidArgument(name + ": expected a square matrix, got " + std::to_string(correlation.rows()) + " x " +
                              std::to_string(correlation.cols()));
    if (!correlation.allFinite()) throw InvalidArgument(name + ": expected finite numbers");
    if (!((correlation.diagonal().array() - 1.0).abs() < rounding).all())
        throw InvalidArgument(name + ": expected 1 on the diagonal");
    if (!((correlation - correlation.transpose()).array().abs() < rounding).all())
        throw InvalidArgument(name + ": expected a symmetric matrix");

    const Eigen::LDLT<Eigen::MatrixXd> ldlt(correlation);
    const Eigen::VectorXd roots = ldlt.vectorD().cwiseMax(0.0).cwiseSqrt();
    Eigen::MatrixXd factor = Eigen::MatrixXd(ldlt.matrixL()) * roots.asDiagonal();
    factor = ldlt.transpositionsP().transpose() * factor;
    if (!((factor * factor.transpose() - correlation).array().abs() < rounding).all())
        throw InvalidArgument(name + ": expected a positive semidefinite matrix, as every correlation matrix is");
    return factor;
}

}  // namespace stepdiag
