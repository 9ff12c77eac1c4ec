#include "stepdiag/uncertainty/derived.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>

#include "stepdiag/core/error.hpp"
#include "stepdiag/plan/line.hpp"
#include "uncertainty/derived_parts.hpp"

namespace stepdiag {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double undetermined = std::numeric_limits<double>::quiet_NaN();

// Joint covariance of linear functionals of a calibration. Rows and columns with a missing parameter are NaN.
MatrixXd covariance_of(const Calibration& calibration, const MatrixXd& rows, const std::vector<bool>& missing) {
    MatrixXd covariance = MatrixXd::Constant(rows.rows(), rows.rows(), undetermined);
    if (calibration.covariance.size() > 0) covariance = rows * calibration.covariance * rows.transpose();
    for (std::size_t i = 0; i < missing.size(); ++i)
        if (missing[i]) {
            covariance.row(Index(i)).setConstant(undetermined);
            covariance.col(Index(i)).setConstant(undetermined);
        }
    return covariance;
}

// Rounding can make a variance negative.
VectorXd roots(const VectorXd& variances) {
    return variances.unaryExpr([](double v) { return v < 0.0 ? 0.0 : std::sqrt(v); });
}

std::string text_of(const Eigen::Vector3d& point) {
    std::ostringstream text;
    text << "(" << point[0] << ", " << point[1] << ", " << point[2] << ")";
    return text.str();
}

}  // namespace

Calibration with_covariance(Calibration calibration, const MatrixXd& covariance) {
    const EntryLayout layout(calibration);
    if (covariance.rows() != layout.size() || covariance.cols() != layout.size())
        throw InvalidArgument("covariance: expected a row and a column for each of " + std::to_string(layout.size()) +
                              " values, got " + std::to_string(covariance.rows()) + " x " +
                              std::to_string(covariance.cols()));
    const VectorXd u = roots(covariance.diagonal());
    for (int i = 0; i < function_count; ++i)
        if (auto& function = calibration.functions[i])
            for (std::size_t k = 0; k < function->standard_uncertainty.size(); ++k)
                function->standard_uncertainty[k] = u[layout.first(i) + Index(k)];
    for (int i = 0; i < squareness_count; ++i)
        if (auto& squareness = calibration.squarenesses[i])
            squareness->standard_uncertainty = u[layout.first(function_count + i)];
    calibration.covariance = covariance;
    check(calibration);
    return calibration;
}

Eigen::Vector3d tool_of(const Calibration& calibration, const std::optional<Eigen::Vector3d>& tool) {
    if (tool && !tool->allFinite()) throw InvalidArgument("tool: expected three finite lengths in mm");
    return tool.value_or(calibration.tool);
}

DeviationRows deviation_rows(const Calibration& calibration, const Eigen::Vector3d& tool,
                             const Eigen::Vector3d& point) {
    if (!point.allFinite()) throw InvalidArgument("point: expected three finite positions in mm");
    const EntryLayout layout(calibration);
    const auto deviations = deviations_at(calibration.chain, tool, point);
    DeviationRows result;
    result.rows.resize(deviation_count, layout.size());
    for (int c = 0; c < deviation_count; ++c) {
        result.rows.row(c) = layout.row(deviations[std::size_t(c)]).transpose();
        result.missing[std::size_t(c)] = layout.missing(deviations[std::size_t(c)]);
    }
    return result;
}

ErrorAtPoint error_at_point(const Calibration& calibration, const Eigen::Vector3d& point,
                            const std::optional<Eigen::Vector3d>& tool) {
    ErrorAtPoint error;
    error.point = point;
    error.tool = tool_of(calibration, tool);
    const DeviationRows deviations = deviation_rows(calibration, error.tool, point);
    error.missing = deviations.missing;
    std::vector<bool> missing;
    for (const auto& names : error.missing) missing.push_back(!names.empty());
    error.value = deviations.rows * calibration_values(calibration);
    for (int c = 0; c < deviation_count; ++c)
        if (missing[std::size_t(c)]) error.value[c] = undetermined;
    error.covariance = covariance_of(calibration, deviations.rows, missing);
    return error;
}

Deviations ErrorAtPoint::standard_uncertainty() const { return roots(covariance.diagonal()); }

std::vector<DiagonalRows> diagonal_rows(const Calibration& calibration, const Eigen::Vector3d& tool) {
    std::size_t nodes = 2;
    for (const auto& function : calibration.functions)
        if (function) nodes = std::max(nodes, function->position.size());
    const EntryLayout layout(calibration);
    std::vector<DiagonalRows> diagonals;
    for (const char* name : {"ppp", "npp", "pnp", "nnp"}) {
        DiagonalRows diagonal{Line::parse(name), {}, {}, {}, {}};
        const Eigen::Vector3d direction = line_frame(diagonal.line, calibration.volume).col(2);
        diagonal.point.resize(Index(nodes), 3);
        diagonal.travel.resize(Index(nodes));
        diagonal.rows.resize(Index(nodes), layout.size());
        for (Index k = 0; k < Index(nodes); ++k) {
            for (const Axis axis : all_axes) {
                // Same formula as for the nodes of a plan, so that positions agree with nodes to the last bit.
                const Index node = diagonal.line.sign(axis) > 0 ? k : Index(nodes) - 1 - k;
                diagonal.point(k, index(axis)) = double(node) * calibration.volume[index(axis)] / double(nodes - 1);
            }
            diagonal.travel[k] = double(k) * calibration.volume.norm() / double(nodes - 1);
            Functional along;
            for (const Index at : {k, Index(0)}) {
                const auto deviations = deviations_at(calibration.chain, tool, diagonal.point.row(at).transpose());
                for (int c = 0; c < 3; ++c)
                    for (Term term : deviations[std::size_t(c)]) {
                        term.coefficient *= at == k ? direction[c] : -direction[c];
                        along.push_back(term);
                    }
                if (k == 0) along.clear();  // the first point is its own reference
            }
            diagonal.rows.row(k) = layout.row(along).transpose();
            const auto missing = layout.missing(along);
            diagonal.is_missing.push_back(!missing.empty());
            for (const std::string& what : missing)
                if (std::find(diagonal.missing.begin(), diagonal.missing.end(), what) == diagonal.missing.end())
                    diagonal.missing.push_back(what);
        }
        diagonals.push_back(std::move(diagonal));
    }
    return diagonals;
}

std::array<DiagonalErrors, 4> diagonal_errors(const Calibration& calibration,
                                              const std::optional<Eigen::Vector3d>& tool) {
    const VectorXd values = calibration_values(calibration);
    const auto of = [&](const DiagonalRows& diagonal) {
        DiagonalErrors errors{diagonal.line,
                              diagonal.point,
                              diagonal.travel,
                              diagonal.rows * values,
                              covariance_of(calibration, diagonal.rows, diagonal.is_missing),
                              diagonal.missing};
        for (Index k = 0; k < errors.value.size(); ++k)
            if (diagonal.is_missing[std::size_t(k)]) errors.value[k] = undetermined;
        return errors;
    };
    const auto rows = diagonal_rows(calibration, tool_of(calibration, tool));
    return {of(rows[0]), of(rows[1]), of(rows[2]), of(rows[3])};
}

VectorXd DiagonalErrors::standard_uncertainty() const { return roots(covariance.diagonal()); }

double DiagonalErrors::range() const {
    return value.maxCoeff<Eigen::PropagateNaN>() - value.minCoeff<Eigen::PropagateNaN>();
}

std::vector<DerivedOutput> derived_at_point(const Calibration& calibration, const Eigen::Vector3d& point,
                                            const std::optional<Eigen::Vector3d>& tool) {
    const DeviationRows deviations = deviation_rows(calibration, tool_of(calibration, tool), point);
    std::vector<DerivedOutput> outputs;
    for (int c = 0; c < deviation_count; ++c)
        if (deviations.missing[std::size_t(c)].empty())
            outputs.push_back({std::string("e_") + deviation_names[std::size_t(c)] + " at " + text_of(point) +
                                   (tool ? " with tool " + text_of(*tool) : ""),
                               c < 3 ? "mm" : "rad", deviations.rows.row(c).transpose()});
    return outputs;
}

std::vector<DerivedOutput> derived_on_diagonals(const Calibration& calibration,
                                                const std::optional<Eigen::Vector3d>& tool) {
    std::vector<DerivedOutput> outputs;
    for (const DiagonalRows& diagonal : diagonal_rows(calibration, tool_of(calibration, tool)))
        for (Index k = 0; k < diagonal.rows.rows(); ++k) {
            if (diagonal.is_missing[std::size_t(k)]) continue;
            std::ostringstream name;
            name << "E_D " << diagonal.line.name() << " at " << diagonal.travel[k];
            outputs.push_back({name.str(), "mm", diagonal.rows.row(k).transpose()});
        }
    return outputs;
}

}  // namespace stepdiag
