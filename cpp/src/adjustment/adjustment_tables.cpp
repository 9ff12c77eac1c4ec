#include "adjustment/adjustment_tables.hpp"

#include "adjustment/normal_equations.hpp"

namespace stepdiag {

void LinearForm::add(int index, double factor) {
    if (index == no_unknown || factor == 0.0) return;
    for (int i = 0; i < size; ++i)
        if (unknown[i] == index) {
            coefficient[i] += factor;
            return;
        }
    unknown[size] = index;
    coefficient[size++] = factor;
}

void LinearForm::subtract(const LinearForm& other) {
    for (int i = 0; i < other.size; ++i) add(other.unknown[i], -other.coefficient[i]);
}

double LinearForm::value(const Eigen::VectorXd& x) const {
    double value = 0.0;
    for (int i = 0; i < size; ++i) value += coefficient[i] * x[unknown[i]];
    return value;
}

BorderedFactor::OfSides LinearForm::values(const BorderedFactor::Sides& x) const {
    BorderedFactor::OfSides values = BorderedFactor::OfSides::Zero();
    for (int i = 0; i < size; ++i) values += coefficient[i] * x.row(unknown[i]);
    return values;
}

double LinearForm::variance(const BorderedBand& inverse) const {
    double variance = 0.0;
    for (int i = 0; i < size; ++i)
        for (int j = 0; j < size; ++j)
            variance += coefficient[i] * coefficient[j] * element(inverse, unknown[i], unknown[j]);
    return variance;
}

AdjustmentTables::AdjustmentTables(const AdjustmentProblem& problem) {
    for (int i = 0; i < function_count; ++i) {
        make_function(problem, FunctionId::at(i));
        if (problem.tells_reversal()) make_reversal(problem, FunctionId::at(i));
    }
    for (const Squareness s : all_squarenesses) {
        const SquarenessTerm term = squareness_term(s);
        const auto& end = slopes_[FunctionId{term.axis, Component(term.component)}.index()];
        if (!end) continue;
        // delta at the end of travel is the term's sign times the squareness times the travel.
        LinearForm& form = squareness_[static_cast<int>(s)].emplace();
        for (int i = 0; i < end->size; ++i)
            form.add(end->unknown[i], term.sign / problem.plan().volume()[index(term.axis)] * end->coefficient[i]);
    }
}

std::vector<LinearForm*> AdjustmentTables::all() {
    std::vector<LinearForm*> forms;
    for (auto* tables : {&values_, &shapes_, &reversal_, &reversal_change_})
        for (FunctionForms& function : *tables)
            for (LinearForm& form : function.value) forms.push_back(&form);
    for (auto& form : slopes_)
        if (form) forms.push_back(&*form);
    for (auto& form : squareness_)
        if (form) forms.push_back(&*form);
    return forms;
}

void AdjustmentTables::make_function(const AdjustmentProblem& problem, FunctionId id) {
    const int component = static_cast<int>(id.component), steps = problem.plan().steps();
    const double travel = problem.plan().volume()[index(id.axis)];
    const AxisNode* end = problem.find(id.axis, steps, false);
    const int at_end = end ? end->unknown[component] : no_unknown;
    if (at_end != no_unknown) slopes_[id.index()].emplace().add(at_end, 1.0);

    FunctionForms &values = values_[id.index()], &shapes = shapes_[id.index()];
    for (FunctionForms* forms : {&values, &shapes}) {
        forms->position.push_back(0.0);
        forms->value.emplace_back();
    }
    for (int k = 1; k <= steps; ++k) {
        const AxisNode* node = problem.find(id.axis, k, false);
        if (!node) continue;
        LinearForm value, shape;
        value.add(node->unknown[component], 1.0);
        if (k < steps) {
            shape.add(node->unknown[component], 1.0);
            shape.add(at_end, -node->position / travel);
        }
        // Without its end a straightness has no reference.
        if (end) {
            shapes.position.push_back(node->position);
            shapes.value.push_back(shape);
        }
        if (!id.is_straightness()) {
            values.position.push_back(node->position);
            values.value.push_back(value);
        }
    }
    if (id.is_straightness()) values = shapes;
}

void AdjustmentTables::make_reversal(const AdjustmentProblem& problem, FunctionId id) {
    const int component = static_cast<int>(id.component);
    const AxisNode* home = problem.find(id.axis, 0, true);
    if (!home) return;
    for (int k = 0; k <= problem.plan().steps(); ++k) {
        const AxisNode *positive = problem.find(id.axis, k, false), *negative = problem.find(id.axis, k, true);
        if (!negative || (k > 0 && !positive)) continue;
        LinearForm reversal;
        if (positive) reversal.add(positive->unknown[component], 1.0);
        reversal.add(negative->unknown[component], -1.0);
        LinearForm change;
        if (k > 0) {
            change = reversal;
            change.add(home->unknown[component], 1.0);
        }
        for (const auto& [forms, form] :
             {std::pair(&reversal_[id.index()], reversal), std::pair(&reversal_change_[id.index()], change)}) {
            forms->position.push_back(negative->position);
            forms->value.push_back(form);
        }
    }
}

}  // namespace stepdiag
