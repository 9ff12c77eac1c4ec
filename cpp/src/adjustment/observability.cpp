#include "adjustment/observability.hpp"

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <map>

#include "stepdiag/core/random.hpp"

namespace stepdiag {
namespace {

// A null vector touches a sum of unknowns where it changes it by more than this part of what unknowns of that size may:
// well above rounding (1e-16 times the square of the condition), well below the least share of a slope, 1/steps.
constexpr double touching = 1e-5;
// So many null vectors are looked at one by one. What more of them touch, a few sums of all with random weights touch:
// the time is then proportional to the number of steps, not to its square (the idea is that of N. Halko, P. G.
// Martinsson and J. A. Tropp, SIAM Review 53 (2011) 217).
constexpr Eigen::Index few_vectors = 256, sums = 4 * BorderedFactor::sides;

bool touches(const Eigen::VectorXd& vector, const LinearForm& form, const Eigen::VectorXd& units, double largest) {
    double possible = 0.0;
    for (int i = 0; i < form.size; ++i) possible += std::abs(form.coefficient[i]) * units[form.unknown[i]];
    return std::abs(form.value(vector)) > touching * largest * possible;
}

// By held unknown, its change in each null vector that is looked at, in its unit.
Eigen::MatrixXd changes_of_held(Eigen::Index held) {
    if (held <= few_vectors) return Eigen::MatrixXd::Identity(held, held);
    Eigen::MatrixXd changes(held, sums);
    for (Eigen::Index i = 0; i < held; ++i)
        for (Eigen::Index k = 0; k < sums; ++k)
            changes(i, k) = normal_pair(0, RandomStream::null_vectors, std::uint64_t(i * sums + k))[0];
    return changes;
}

// The quantity that a column of a set-up's vector stands for, and its component.
std::pair<std::string, int> setup_unknown(int column) {
    const auto [quantity, component] = setup::component(column);
    return {is_adjusted(quantity) ? name(quantity) : "cosine_error", component};
}

}  // namespace

Eigen::VectorXd units_of_columns(const Eigen::VectorXd& lengths) {
    return lengths.unaryExpr([](double length) { return length > 0.0 ? 1.0 / length : 1.0; });
}

void mark_touched(const Eigen::VectorXd& null_vector, const Eigen::VectorXd& units,
                  const std::vector<LinearForm*>& forms, std::vector<bool>& determined) {
    const double largest = null_vector.cwiseQuotient(units).cwiseAbs().maxCoeff();
    for (int j = 0; j < null_vector.size(); ++j)
        if (std::abs(null_vector[j]) > touching * largest * units[j]) determined[j] = false;
    for (LinearForm* form : forms)
        if (form->determined && touches(null_vector, *form, units, largest)) form->determined = false;
}

Observability::Observability(const GaussNewton& solver, AdjustmentTables& tables)
    : problem_(solver.equations().problem()), tables_(tables), determined_(problem_.size(), true) {
    std::vector<LinearForm*> forms = tables.all();
    // A tilt reads reflector minus laser: where each of them is open, that may be known.
    std::vector<OpenCombination> differences;
    for (const LineSetup& setup : problem_.setups())
        for (int i = 0; i < 2; ++i) {
            const int reflector = setup.unknown[setup::reflector + i], laser = setup.unknown[setup::laser + i];
            if (reflector == no_unknown || laser == no_unknown) continue;
            OpenCombination difference;
            difference.combination.terms = {{1.0, name(SetupQuantity::reflector)}, {-1.0, name(SetupQuantity::laser)}};
            difference.combination.component = i;
            difference.combination.run = setup.run;
            difference.combination.line = setup.line.name();
            difference.form.add(reflector, 1.0);
            difference.form.add(laser, -1.0);
            differences.push_back(difference);
        }
    for (OpenCombination& difference : differences) forms.push_back(&difference.form);

    const Eigen::VectorXd units = units_of_columns(solver.scale());
    const std::vector<int>& held = solver.dependent();
    const Eigen::MatrixXd changes = changes_of_held(Eigen::Index(held.size()));
    for (Eigen::Index first = 0; first < changes.cols(); first += BorderedFactor::sides) {
        const Eigen::Index count = std::min<Eigen::Index>(BorderedFactor::sides, changes.cols() - first);
        BorderedFactor::Sides some = BorderedFactor::Sides::Zero(units.size(), BorderedFactor::sides);
        for (std::size_t h = 0; h < held.size(); ++h)
            some.row(held[h]).head(count) = units[held[h]] * changes.row(Eigen::Index(h)).segment(first, count);
        const BorderedFactor::Sides vectors = solver.null_vectors(std::move(some));
        for (Eigen::Index k = 0; k < count; ++k) mark_touched(vectors.col(k), units, forms, determined_);
    }
    for (const OpenCombination& difference : differences)
        if (difference.form.determined && !determined_[difference.form.unknown[0]]) combinations_.push_back(difference);
    combine_slopes(solver);
}

// Combinations of the scales and squarenesses that are not known one by one: what no null vector changes.
void Observability::combine_slopes(const GaussNewton& solver) {
    std::vector<FunctionId> open;
    for (int i = 0; i < function_count; ++i) {
        const FunctionId id = FunctionId::at(i);
        const auto& slope = tables_.slope(id);
        if (slope && !slope->determined && !id.is_rotation()) open.push_back(id);
    }
    const std::vector<int>& held = solver.dependent();
    if (open.size() < 2 || held.empty()) return;
    Eigen::MatrixXd part(open.size(), held.size());
    for (std::size_t first = 0; first < open.size(); first += BorderedFactor::sides) {
        const std::size_t count = std::min<std::size_t>(BorderedFactor::sides, open.size() - first);
        BorderedFactor::Sides slopes = BorderedFactor::Sides::Zero(solver.scale().size(), BorderedFactor::sides);
        for (std::size_t i = 0; i < count; ++i) {
            const LinearForm& slope = *tables_.slope(open[first + i]);
            for (int j = 0; j < slope.size; ++j)
                slopes(slope.unknown[j], Eigen::Index(i)) +=
                    slope.coefficient[j] / problem_.plan().volume()[index(open[first + i].axis)];
        }
        const BorderedFactor::Sides changes = solver.along_null_vectors(std::move(slopes));
        for (std::size_t i = 0; i < count; ++i)
            for (std::size_t h = 0; h < held.size(); ++h)
                part(Eigen::Index(first + i), Eigen::Index(h)) = changes(held[h], Eigen::Index(i));
    }
    for (Eigen::Index h = 0; h < part.cols(); ++h)
        if (const double size = part.col(h).norm(); size > 0.0) part.col(h) /= size;
    const Eigen::JacobiSVD<Eigen::MatrixXd> svd(part, Eigen::ComputeFullU);
    const auto& values = svd.singularValues();
    for (Eigen::Index k = 0; k < part.rows(); ++k) {
        if (k < values.size() && values[k] > 1e-4 * values[0]) continue;
        Eigen::VectorXd weights = svd.matrixU().col(k);
        Eigen::Index largest;
        weights.cwiseAbs().maxCoeff(&largest);
        weights /= weights[largest] > 0.0 ? weights.cwiseAbs().sum() : -weights.cwiseAbs().sum();
        OpenCombination combination;
        for (std::size_t i = 0; i < open.size(); ++i) {
            const double weight = weights[Eigen::Index(i)];
            if (std::abs(weight) < 1e-3 || combination.form.size == 6) continue;
            const FunctionId id = open[i];
            const LinearForm& slope = *tables_.slope(id);
            combination.form.add(slope.unknown[0], weight / problem_.plan().volume()[index(id.axis)]);
            combination.combination.terms.push_back({weight, id.name()});
        }
        combinations_.push_back(combination);
    }
}

std::vector<Undetermined> Observability::findings(const std::vector<bool>& known) const {
    std::vector<Undetermined> findings;
    add_functions(findings);
    add_reversal(findings);
    add_setups(known, findings);
    return findings;
}

void Observability::add_functions(std::vector<Undetermined>& findings) const {
    Undetermined open{
        OpenPart::whole, {}, OpenReason::not_separated, {Remedy::tilts, Remedy::other_directions, Remedy::other_order}};
    Undetermined not_moved{OpenPart::whole, {}, OpenReason::not_moved, {Remedy::lines_to_the_end}};
    for (int i = 0; i < function_count; ++i) {
        const FunctionId id = FunctionId::at(i);
        const FunctionForms &values = tables_.values(id), &shapes = tables_.shapes(id);
        if (id.is_rotation() && !problem_.has_rotations()) continue;
        if (values.position.size() < 2 && shapes.position.size() < 2) {
            not_moved.parameters.push_back(id.name());
            continue;
        }
        const auto count = [](const FunctionForms& forms, bool determined) {
            return std::count_if(forms.value.begin(), forms.value.end(), [&](const LinearForm& form) {
                return form.size > 0 && form.determined == determined;
            });
        };
        const auto& slope = tables_.slope(id);
        const bool slope_open = slope && !slope->determined && !id.is_straightness();
        const bool shape_only = slope_open && count(shapes, true) > count(values, true);
        const FunctionForms& known = shape_only ? shapes : values;
        if (slope_open && (shape_only || (id.is_positioning() && count(values, true) == 0)))
            findings.push_back(open_slope(id));
        if (count(known, true) == 0) {
            open.parameters.push_back(id.name());
        } else if (count(known, false) > 0) {
            findings.push_back(
                {OpenPart::positions, {id.name()}, OpenReason::not_seen, {Remedy::lost_points, Remedy::lines_there}});
            for (std::size_t k = 0; k < known.value.size(); ++k)
                if (known.value[k].size > 0 && !known.value[k].determined)
                    findings.back().positions.push_back(known.position[k]);
        }
    }
    for (const Undetermined& finding : {not_moved, open})
        if (!finding.parameters.empty()) findings.push_back(finding);
    for (const Squareness s : all_squarenesses)
        if (!tables_.squareness(s) || !tables_.squareness(s)->determined)
            findings.push_back(
                {OpenPart::whole, {name(s)}, OpenReason::not_seen, {Remedy::body_diagonals, Remedy::face_diagonals}});
}

Undetermined Observability::open_slope(FunctionId id) const {
    Undetermined slope{OpenPart::slope, {id.name()}};
    const bool measured = std::any_of(problem_.setups().begin(), problem_.setups().end(), [&](const LineSetup& setup) {
        return setup.line.moves(id.axis) && setup.line.moved_axes() == 1;
    });
    if (!id.is_positioning()) {
        slope.remedies = {Remedy::tilts_of_other_directions, Remedy::line_priors};
    } else if (measured) {
        slope.reason = OpenReason::tool_rotations;
        slope.remedies = {Remedy::body_diagonals, Remedy::line_priors};
    } else {
        slope.remedies = {Remedy::axis_line};
        slope.line = line_along(id.axis);
    }
    return slope;
}

void Observability::add_reversal(std::vector<Undetermined>& findings) const {
    Undetermined reversal{OpenPart::reversal, {}, OpenReason::not_seen, {Remedy::both_ways}};
    Undetermined at_home{OpenPart::reversal_at_home, {}, OpenReason::not_seen, {Remedy::single_axes_both_ways}};
    const auto is_open = [](const FunctionForms& forms) {
        return std::any_of(forms.value.begin(), forms.value.end(), [](const auto& form) { return !form.determined; });
    };
    for (int i = 0; i < function_count; ++i) {
        const FunctionId id = FunctionId::at(i);
        if (is_open(tables_.reversal_change(id))) reversal.parameters.push_back(id.name());
        else if (is_open(tables_.reversal(id))) at_home.parameters.push_back(id.name());
    }
    for (const Undetermined& finding : {reversal, at_home})
        if (!finding.parameters.empty()) findings.push_back(finding);
}

void Observability::add_setups(const std::vector<bool>& known, std::vector<Undetermined>& findings) const {
    const bool scale_open = std::any_of(all_axes.begin(), all_axes.end(), [&](Axis axis) {
        const auto& slope = tables_.slope({axis, Component(index(axis))});
        return slope && !slope->determined;
    });
    std::map<int, Undetermined> by_column;
    for (const LineSetup& setup : problem_.setups())
        for (const int column : setup.active) {
            if (known[setup.unknown[column]]) continue;
            Undetermined& finding = by_column[column];
            const bool hangs_on_scales = column >= setup::laser && column < setup::distance_constant && scale_open;
            const auto [quantity, component] = setup_unknown(column);
            finding.part = OpenPart::setup;
            finding.parameters = {quantity};
            finding.remedies = {Remedy::prior, hangs_on_scales ? Remedy::scales : Remedy::fixed};
            finding.component = component;
            finding.setups.emplace_back(setup.run, setup.line.name());
        }
    for (const auto& entry : by_column) findings.push_back(entry.second);
}

}  // namespace stepdiag
