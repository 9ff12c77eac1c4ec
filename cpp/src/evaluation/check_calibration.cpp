#include <algorithm>
#include <cmath>

#include "stepdiag/core/error.hpp"
#include "stepdiag/evaluation/calibration.hpp"

namespace stepdiag {
namespace {

// A covariance comes from sums over thousands of readings in another order than the standard uncertainties: some 1e-12
// apart. What is further apart than this belongs to other values.
constexpr double covariance_tolerance = 1e-9;

// NaN: not known.
bool is_uncertainty(double u) { return std::isnan(u) || (std::isfinite(u) && u >= 0.0); }

void check_one_line(const std::string& text, const char* what) {
    if (text.find_first_of("\r\n") != std::string::npos)
        throw InvalidArgument(std::string(what) + ": expected one line of text, got a line break");
}

void check_sizes(const std::string& name, std::size_t nodes, std::initializer_list<std::size_t> others) {
    if (nodes == 0 || std::any_of(others.begin(), others.end(), [&](std::size_t size) { return size != nodes; }))
        throw InvalidArgument(name + ": expected as many values and uncertainties as positions, and at least one");
}

void check_reversal(const CalibratedReversal& reversal, const std::string& name) {
    check_sizes(
        name, reversal.position.size(),
        {reversal.value.size(), reversal.standard_uncertainty.size(), reversal.negative_standard_uncertainty.size()});
    for (std::size_t k = 0; k < reversal.position.size(); ++k) {
        const std::string node = name + ", node " + std::to_string(k);
        if (!std::isfinite(reversal.position[k]) || !std::isfinite(reversal.value[k]))
            throw InvalidArgument(node + ": position and value must be finite");
        if (k > 0 && !(reversal.position[k] > reversal.position[k - 1]))
            throw InvalidArgument(node + ": positions must ascend");
        if (!is_uncertainty(reversal.standard_uncertainty[k]) ||
            !is_uncertainty(reversal.negative_standard_uncertainty[k]))
            throw InvalidArgument(node + ": standard uncertainties must be finite and at least 0");
    }
}

// The standard uncertainties in the order of the covariance, and the parameter that each belongs to.
struct Uncertainties {
    std::vector<double> u;
    std::vector<std::string> parameter;
};

Uncertainties uncertainties(const Calibration& calibration) {
    Uncertainties all;
    for (int i = 0; i < function_count; ++i)
        if (const auto& function = calibration.functions[i])
            for (const double u : function->standard_uncertainty) {
                all.u.push_back(u);
                all.parameter.push_back(FunctionId::at(i).name());
            }
    for (const Squareness s : all_squarenesses)
        if (const auto& entry = calibration.squarenesses[static_cast<int>(s)]) {
            all.u.push_back(entry->standard_uncertainty);
            all.parameter.push_back(name(s));
        }
    return all;
}

void check_covariance(const Eigen::MatrixXd& covariance, const Uncertainties& values) {
    const auto size = Eigen::Index(values.u.size());
    if (covariance.rows() != size || covariance.cols() != size)
        throw InvalidArgument("covariance: expected " + std::to_string(size) + " rows and columns, one a value, got " +
                              std::to_string(covariance.rows()) + " by " + std::to_string(covariance.cols()));
    const auto fail = [&](Eigen::Index i, Eigen::Index j, const char* expected) {
        throw InvalidArgument("covariance of " + values.parameter[i] + " and " + values.parameter[j] + ", row " +
                              std::to_string(i) + ", column " + std::to_string(j) + ": " + expected);
    };
    for (Eigen::Index i = 0; i < size; ++i) {
        const double u = values.u[i], variance = covariance(i, i);
        if (!std::isfinite(variance) || variance < 0.0) fail(i, i, "expected a variance, finite and at least 0");
        if (!std::isnan(u) && std::abs(variance - u * u) > covariance_tolerance * u * u)
            fail(i, i, "expected the square of the standard uncertainty");
    }
    for (Eigen::Index j = 0; j < size; ++j)
        for (Eigen::Index i = 0; i < j; ++i) {
            const double most = std::sqrt(covariance(i, i)) * std::sqrt(covariance(j, j));
            if (!(std::abs(covariance(i, j)) <= most * (1.0 + covariance_tolerance)))
                fail(i, j, "expected at most the product of the two standard uncertainties");
            if (!(std::abs(covariance(i, j) - covariance(j, i)) <= covariance_tolerance * most))
                fail(i, j, "expected a symmetric matrix");
        }
}

}  // namespace

void check(const Calibration& calibration) {
    if (!calibration.volume.allFinite() || !(calibration.volume.minCoeff() > 0.0))
        throw InvalidArgument("volume: expected three positive edges in mm");
    if (!calibration.tool.allFinite()) throw InvalidArgument("tool: expected three finite lengths in mm");
    check_one_line(calibration.method, "method");
    check_one_line(calibration.date, "date");
    if (const auto& factor = calibration.variance_factor; factor && !(std::isfinite(*factor) && *factor >= 0.0))
        throw InvalidArgument("variance_factor: expected a finite number of at least 0");
    for (const std::string& sentence : calibration.undetermined) check_one_line(sentence, "undetermined");
    for (int i = 0; i < function_count; ++i) {
        const std::string name = FunctionId::at(i).name();
        if (const auto& f = calibration.functions[i])
            check_sizes(name, f->position.size(), {f->value.size(), f->standard_uncertainty.size()});
        if (const auto& reversal = calibration.reversal[i]) check_reversal(*reversal, "reversal of " + name);
    }
    ErrorMap(to_parameter_table(calibration));  // checks nodes and values of functions
    for (const Squareness s : all_squarenesses)
        if (const auto& entry = calibration.squarenesses[static_cast<int>(s)])
            if (!is_uncertainty(entry->standard_uncertainty))
                throw InvalidArgument(name(s) + ": standard uncertainty must be finite and at least 0");
    if (calibration.covariance.size() > 0) check_covariance(calibration.covariance, uncertainties(calibration));
}

}  // namespace stepdiag
