#include "uncertainty/functional.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "stepdiag/machine/machine.hpp"

namespace stepdiag {

std::string parameter_name(int parameter) {
    return parameter < function_count ? FunctionId::at(parameter).name() : name(Squareness(parameter - function_count));
}

std::array<Functional, 6> deviations_at(const Chain& chain, const Eigen::Vector3d& tool, const Eigen::Vector3d& point) {
    std::array<Functional, 6> deviations;
    for (const Axis axis : all_axes) {
        const double p = point[index(axis)];
        const Eigen::Vector3d lever = angular_lever(chain, tool, axis, point);
        for (int c = 0; c < 3; ++c) {
            deviations[c].push_back({FunctionId{axis, Component(c)}.index(), p, 1.0});
            const int rotation = FunctionId{axis, Component(c + 3)}.index();
            const Eigen::Vector3d turned = Eigen::Vector3d::Unit(c).cross(lever);
            for (int k = 0; k < 3; ++k)
                if (turned[k] != 0.0) deviations[k].push_back({rotation, p, turned[k]});
            deviations[c + 3].push_back({rotation, p, 1.0});
        }
    }
    for (const Squareness s : all_squarenesses) {
        const SquarenessTerm term = squareness_term(s);
        deviations[term.component].push_back(
            {function_count + static_cast<int>(s), 0.0, term.sign * point[index(term.axis)]});
    }
    return deviations;
}

EntryLayout::EntryLayout(const Calibration& calibration) {
    first_.fill(-1);
    has_slope_.fill(true);
    for (int i = 0; i < function_count; ++i) {
        const auto& function = calibration.functions[i];
        if (!function) continue;
        first_[i] = size_;
        has_slope_[i] = function->slope_determined;
        positions_[i] = function->position;
        size_ += Eigen::Index(function->position.size());
    }
    for (int i = 0; i < squareness_count; ++i)
        if (calibration.squarenesses[i]) first_[function_count + i] = size_++;
}

std::array<EntryLayout::Weighted, 2> EntryLayout::interpolation(int function, double position) const {
    const std::vector<double>& nodes = positions_[function];
    const auto after = std::upper_bound(nodes.begin(), nodes.end(), position);
    const auto at = [&](std::ptrdiff_t node) { return first_[function] + Eigen::Index(node); };
    if (after == nodes.begin()) return {Weighted{at(0), 1.0}, Weighted{at(0), 0.0}};
    const std::ptrdiff_t j = after - nodes.begin();
    if (after == nodes.end()) return {Weighted{at(j - 1), 1.0}, Weighted{at(j - 1), 0.0}};
    const double t = (position - nodes[j - 1]) / (nodes[j] - nodes[j - 1]);
    return {Weighted{at(j - 1), 1.0 - t}, Weighted{at(j), t}};
}

Eigen::VectorXd EntryLayout::row(const Functional& functional) const {
    Eigen::VectorXd row = Eigen::VectorXd::Zero(size_);
    for (const Term& term : functional) {
        if (!has(term.parameter)) continue;
        if (term.parameter >= function_count) {
            row[first(term.parameter)] += term.coefficient;
            continue;
        }
        for (const Weighted& node : interpolation(term.parameter, term.position))
            row[node.entry] += term.coefficient * node.weight;
    }
    return row;
}

std::vector<std::string> EntryLayout::missing(const Functional& functional) const {
    std::map<std::pair<int, double>, double> coefficients;
    double largest = 0.0;
    for (const Term& term : functional) {
        coefficients[{term.parameter, term.position}] += term.coefficient;
        largest = std::max(largest, std::abs(term.coefficient));
    }
    std::vector<std::string> names;
    for (const auto& [where, coefficient] : coefficients) {
        const auto& [parameter, position] = where;
        const bool is_function = parameter < function_count;
        // Functions are 0 at home by definition, and cancelled levers leave only rounding.
        if ((is_function && position == 0.0) || std::abs(coefficient) <= 1e-12 * largest) continue;
        std::string what = parameter_name(parameter);
        if (has(parameter)) {
            if (!is_function || has_slope_[parameter]) continue;
            what = "slope of " + what;
        }
        if (names.empty() || names.back() != what) names.push_back(what);  // the map is sorted by parameter
    }
    return names;
}

}  // namespace stepdiag
