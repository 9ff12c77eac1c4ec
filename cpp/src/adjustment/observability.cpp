#include "adjustment/observability.hpp"

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <map>
#include <sstream>

namespace stepdiag {
namespace {

// A null vector touches a sum of unknowns where it changes it by more than this part of what unknowns of that size may:
// well above rounding (1e-16 times the square of the condition), well below the least share of a slope, 1/steps.
constexpr double touching = 1e-5;

// The unit of each unknown in which all columns of the problem have length 1.
Eigen::VectorXd column_units(const GaussNewton& solver) {
    Eigen::VectorXd units = solver.scale();
    for (double& unit : units) unit = unit > 0.0 ? 1.0 / unit : 1.0;
    return units;
}

bool touches(const Eigen::VectorXd& vector, const LinearForm& form, const Eigen::VectorXd& units, double largest) {
    double possible = 0.0;
    for (int i = 0; i < form.size; ++i) possible += std::abs(form.coefficient[i]) * units[form.unknown[i]];
    return std::abs(form.value(vector)) > touching * largest * possible;
}

std::string join(const std::vector<std::string>& parts) {
    std::string text;
    for (const auto& part : parts) text += (text.empty() ? "" : ", ") + part;
    return text;
}

std::string slope_name(FunctionId id) {
    return id.is_positioning() ? std::string("scale of ") + letter(id.axis) : "slope of " + id.name();
}

std::string setup_name(int column) {
    const auto [quantity, component] = setup::component(column);
    const std::string axis = component == 0 ? " about local x" : " about local y";
    const std::string along = component == 0 ? " along local x" : " along local y";
    switch (quantity) {
        case SetupQuantity::reflector: return "reflector tilt" + axis;
        case SetupQuantity::laser: return "laser tilt" + axis;
        case SetupQuantity::distance_constant: return "distance constant";
        case SetupQuantity::beam_constants: return "constant of beam d" + std::to_string(component + 1);
        case SetupQuantity::psd_zero: return "zero offset of the position sensing device" + along;
        case SetupQuantity::lateral: return "lateral beam offset" + along;
        case SetupQuantity::roll: return "head roll";
        case SetupQuantity::gain: return "tilt gain";
        case SetupQuantity::drift: return "drift";
        default: return "cosine error";
    }
}

std::string place(const LineSetup& setup) {
    return setup.line.name() + (setup.run > 0 ? " (run " + std::to_string(setup.run) + ")" : "");
}

}  // namespace

Observability::Observability(const GaussNewton& solver, AdjustmentTables& tables)
    : problem_(solver.equations().problem()), tables_(tables), determined_(problem_.size(), true) {
    std::vector<FunctionId> sloped;
    for (int i = 0; i < function_count; ++i)
        if (tables.slope(FunctionId::at(i))) sloped.push_back(FunctionId::at(i));
    std::vector<LinearForm*> forms = tables.all();
    // A tilt reads reflector minus laser: where each of them is open, that may be known.
    std::vector<KnownCombination> differences;
    for (const LineSetup& setup : problem_.setups())
        for (int i = 0; i < 2; ++i) {
            const int reflector = setup.unknown[setup::reflector + i], laser = setup.unknown[setup::laser + i];
            if (reflector == no_unknown || laser == no_unknown) continue;
            KnownCombination difference{
                {}, setup_name(setup::reflector + i) + " - laser tilt on " + place(setup), true};
            difference.form.add(reflector, 1.0);
            difference.form.add(laser, -1.0);
            differences.push_back(difference);
        }
    for (KnownCombination& difference : differences) forms.push_back(&difference.form);

    const Eigen::VectorXd units = column_units(solver);
    const std::vector<int>& held = solver.dependent();
    Eigen::MatrixXd slopes(sloped.size(), held.size());
    for (std::size_t h = 0; h < held.size(); ++h) {
        const Eigen::VectorXd vector = solver.null_vector(held[h]);
        const double largest = vector.cwiseQuotient(units).cwiseAbs().maxCoeff();
        for (int j = 0; j < vector.size(); ++j)
            if (std::abs(vector[j]) > touching * largest * units[j]) determined_[j] = false;
        for (LinearForm* form : forms)
            if (form->determined && touches(vector, *form, units, largest)) form->determined = false;
        for (std::size_t i = 0; i < sloped.size(); ++i)
            slopes(i, h) = tables.slope(sloped[i])->value(vector) / problem_.plan().volume()[index(sloped[i].axis)];
    }
    for (const KnownCombination& difference : differences)
        if (difference.form.determined && !determined_[difference.form.unknown[0]]) combinations_.push_back(difference);
    combine_slopes(slopes, sloped);
}

// Combinations of the scales and squarenesses that are not known one by one: what no null vector changes.
void Observability::combine_slopes(const Eigen::MatrixXd& slopes, const std::vector<FunctionId>& functions) {
    std::vector<Eigen::Index> open;
    for (std::size_t i = 0; i < functions.size(); ++i)
        if (!functions[i].is_rotation() && !tables_.slope(functions[i])->determined) open.push_back(Eigen::Index(i));
    if (open.size() < 2 || slopes.cols() == 0) return;
    Eigen::MatrixXd part(open.size(), slopes.cols());
    for (std::size_t i = 0; i < open.size(); ++i) part.row(Eigen::Index(i)) = slopes.row(open[i]);
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
        KnownCombination combination{{}, "", false};
        std::ostringstream text;
        text.precision(3);
        for (std::size_t i = 0; i < open.size(); ++i) {
            const double weight = weights[Eigen::Index(i)];
            if (std::abs(weight) < 1e-3 || combination.form.size == 6) continue;
            const FunctionId id = functions[open[i]];
            const LinearForm& slope = *tables_.slope(id);
            combination.form.add(slope.unknown[0], weight / problem_.plan().volume()[index(id.axis)]);
            text << (weight < 0.0 ? (i ? " - " : "-") : (text.tellp() > 0 ? " + " : "")) << std::abs(weight) << ' '
                 << slope_name(id);
        }
        combination.text = text.str();
        combinations_.push_back(combination);
    }
}

std::vector<std::string> Observability::sentences(const std::vector<bool>& known) const {
    std::vector<std::string> sentences;
    add_function_sentences(sentences);
    add_setup_sentences(known, sentences);
    return sentences;
}

void Observability::add_function_sentences(std::vector<std::string>& sentences) const {
    std::vector<std::string> open, not_moved;
    for (int i = 0; i < function_count; ++i) {
        const FunctionId id = FunctionId::at(i);
        const FunctionForms &values = tables_.values(id), &shapes = tables_.shapes(id);
        if (id.is_rotation() && !problem_.has_rotations()) continue;
        if (values.position.size() < 2 && shapes.position.size() < 2) {
            not_moved.push_back(id.name());
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
        if (slope_open && (shape_only || (id.is_positioning() && count(values, true) == 0))) {
            const std::string line = std::array<const char*, 3>{"p00", "0p0", "00p"}[index(id.axis)];
            const auto& lines = problem_.setups();
            const bool measured = std::any_of(lines.begin(), lines.end(), [&](const LineSetup& setup) {
                return setup.line.moves(id.axis) && setup.line.moved_axes() == 1;
            });
            sentences.push_back(
                slope_name(id) +
                (id.is_positioning() && measured ? ": its line does not tell it from rotations that move the tool; "
                                                   "add body diagonals, or give priors to the line's set-up"
                 : id.is_positioning()           ? ": add the line " + line
                                                 : ": read tilts on lines of other directions, or give a prior to "
                                                   "the set-up"));
        }
        if (count(known, true) == 0) {
            open.push_back(id.name());
            continue;
        }
        if (const auto lost = count(known, false); lost > 0) {
            std::ostringstream text;
            text << id.name() << " at " << lost << " of its positions (";
            int listed = 0;
            for (std::size_t k = 0; k < known.value.size(); ++k)
                if (known.value[k].size > 0 && !known.value[k].determined && ++listed <= 4)
                    text << (listed > 1 ? ", " : "") << known.position[k];
            text << (lost > 4 ? ", ... mm)" : " mm)")
                 << ": the readings do not tell it there; measure points that were lost, or more lines that visit them";
            sentences.push_back(text.str());
        }
    }
    if (!not_moved.empty())
        sentences.push_back(join(not_moved) + ": no reading on a line that moves the axis to its end; add such lines");
    if (!open.empty())
        sentences.push_back(
            join(open) +
            ": the readings do not tell them apart; read tilts too, or add lines of other directions or "
            "another order of steps");
    for (const Squareness s : all_squarenesses)
        if (!tables_.squareness(s) || !tables_.squareness(s)->determined)
            sentences.push_back(name(s) + ": add body diagonals, or the two face diagonals of its plane");
    std::vector<std::string> reversals, constants;
    for (int i = 0; i < function_count; ++i) {
        const FunctionForms &reversal = tables_.reversal(FunctionId::at(i)),
                            &change = tables_.reversal_change(FunctionId::at(i));
        const auto open_at = [](const FunctionForms& forms) {
            return std::any_of(forms.value.begin(), forms.value.end(),
                               [](const auto& form) { return !form.determined; });
        };
        if (open_at(change)) reversals.push_back(FunctionId::at(i).name());
        else if (open_at(reversal)) constants.push_back(FunctionId::at(i).name());
    }
    if (!reversals.empty())
        sentences.push_back("reversal of " + join(reversals) + ": measure more lines forward and backward");
    if (!constants.empty())
        sentences.push_back("reversal of " + join(constants) +
                            " at home: only its change along the axis is known; measure single-axis lines forward and "
                            "backward");
}

void Observability::add_setup_sentences(const std::vector<bool>& known, std::vector<std::string>& sentences) const {
    std::map<int, std::vector<std::string>> lines;  // by column
    for (const LineSetup& setup : problem_.setups())
        for (const int column : setup.active)
            if (!known[setup.unknown[column]]) lines[column].push_back(place(setup));
    bool scale_open = false;
    for (const Axis axis : all_axes) {
        const auto& slope = tables_.slope({axis, Component(index(axis))});
        scale_open = scale_open || (slope && !slope->determined);
    }
    for (const auto& [column, places] : lines)
        sentences.push_back(setup_name(column) + " on " + join(places) + ": give a prior" +
                            (scale_open && column >= setup::laser && column < setup::distance_constant
                                 ? ", or make the scales known"
                                 : ", or take it as fixed"));
}

}  // namespace stepdiag
