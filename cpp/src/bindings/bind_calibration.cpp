// Construction of a calibration from its parts, for readers of other formats. bind_evaluation.cpp binds results of
// evaluations.
#include <limits>

#include "bindings.hpp"
#include "stepdiag/evaluation/calibration.hpp"

namespace stepdiag::bindings {
namespace {

using Table = std::tuple<ArrayLike, ArrayLike, ArrayLike>;  // position, value, standard uncertainty
using Tables = std::map<std::string, Table>;
using Arrays = std::map<std::string, ArrayLike>;
using Names = std::vector<std::string>;
using Texts = std::map<std::string, std::string>;

std::vector<double> to_values(const ArrayLike& array, const std::string& name) {
    const Eigen::VectorXd vector = to_vector(array, name.c_str());
    return {vector.begin(), vector.end()};
}

int function_index(const std::string& name, const char* argument) {
    const auto id = FunctionId::parse(name);
    if (!id) throw InvalidArgument(std::string(argument) + ": expected names EXX ... ECZ, got \"" + name + "\"");
    return id->index();
}

CalibratedFunction to_function(const Table& table, const std::string& name) {
    const auto& [position, value, uncertainty] = table;
    return {to_values(position, name + " position"), to_values(value, name + " value"),
            to_values(uncertainty, name + " standard uncertainty"), true};
}

CalibratedReversal to_reversal(const Table& table, const std::string& name) {
    CalibratedFunction values = to_function(table, "reversal of " + name);
    // Not known unless given.
    std::vector<double> negative(values.position.size(), std::numeric_limits<double>::quiet_NaN());
    return {std::move(values.position), std::move(values.value), std::move(values.standard_uncertainty),
            std::move(negative), true};
}

Eigen::MatrixXd to_matrix(const ArrayLike& object, const char* name) {
    const DoubleArray array = DoubleArray::ensure(object);
    if (!array || array.ndim() != 2) {
        PyErr_Clear();
        throw InvalidArgument(std::string(name) + ": expected an array of numbers in rows and columns");
    }
    return Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>(
        array.data(), array.shape(0), array.shape(1));
}

template <class Entry>
Entry& known(std::optional<Entry>& entry, const std::string& name, const char* argument) {
    if (!entry) throw InvalidArgument(std::string(argument) + ": there is no table of " + name);
    return *entry;
}

Calibration make_calibration(
    const std::string& method, const ChainLike& chain, const ArrayLike& volume, const ArrayLike& tool,
    const Tables& functions, const std::map<std::string, std::pair<double, double>>& squareness,
    const Names& undetermined_slopes, const Names& undetermined, const std::optional<ArrayLike>& covariance,
    const Tables& reversal, const Arrays& reversal_negative_uncertainty, const Names& undetermined_reversal_constants,
    const std::string& date, const std::optional<std::string>& fit, const std::optional<double>& variance_factor,
    const Names& fit_codes, const Names& fit_reasons, const std::optional<double>& uncertainty_scaled,
    const Texts& provenance, const Names& unseen_faults, const Names& conditions, const std::string& budget,
    const std::optional<double>& between_nodes, const std::optional<double>& temperature_reference,
    const std::optional<ArrayLike>& temperature_as_found, const std::optional<ArrayLike>& expansion,
    const std::optional<ArrayLike>& fixed_point, bool unverified) {
    Calibration calibration{method, to_chain(chain), to_vector3(volume, "volume"), to_vector3(tool, "tool"), {}, {},
                            {},     undetermined};
    for (const auto& [name, table] : functions)
        calibration.functions[function_index(name, "functions")] = to_function(table, name);
    for (const auto& [text, entry] : squareness) {
        const auto id = parse_squareness(text);
        if (!id) throw InvalidArgument("squareness: expected names C0Y, B0Z, A0Z, got \"" + text + "\"");
        calibration.squarenesses[static_cast<int>(*id)] = CalibratedSquareness{entry.first, entry.second};
    }
    for (const auto& [name, table] : reversal)
        calibration.reversal[function_index(name, "reversal")] = to_reversal(table, name);

    const auto function = [&](const std::string& name, const char* argument) -> CalibratedFunction& {
        return known(calibration.functions[function_index(name, argument)], name, argument);
    };
    const auto reversal_of = [&](const std::string& name, const char* argument) -> CalibratedReversal& {
        return known(calibration.reversal[function_index(name, argument)], "the reversal of " + name, argument);
    };
    for (const auto& name : undetermined_slopes) function(name, "undetermined_slopes").slope_determined = false;
    for (const auto& [name, array] : reversal_negative_uncertainty)
        reversal_of(name, "reversal_negative_uncertainty").negative_standard_uncertainty =
            to_values(array, "reversal_negative_uncertainty of " + name);
    for (const auto& name : undetermined_reversal_constants)
        reversal_of(name, "undetermined_reversal_constants").constant_determined = false;
    if (covariance) calibration.covariance = to_matrix(*covariance, "covariance");
    if (covariance && calibration.covariance.size() == 0 && is_anything_determined(calibration))
        throw InvalidArgument("covariance: expected one row and column a value, got none");
    calibration.date = date;
    if (fit) calibration.fit = fit_of({{"fit", *fit}}, "calibration");
    calibration.variance_factor = variance_factor;
    calibration.fit_codes = fit_codes;
    calibration.fit_reasons = fit_reasons;
    calibration.uncertainty_scaled = uncertainty_scaled;
    calibration.provenance = provenance;
    calibration.unseen_faults = unseen_faults;
    calibration.conditions = conditions;
    calibration.budget = budget;
    calibration.between_nodes = between_nodes;
    calibration.temperature_reference = temperature_reference;
    if (temperature_as_found)
        calibration.temperature_as_found = to_vector3(*temperature_as_found, "temperature_as_found");
    if (expansion) calibration.expansion = to_vector3(*expansion, "expansion");
    if (fixed_point) calibration.fixed_point = to_vector3(*fixed_point, "fixed_point");
    calibration.unverified = unverified;
    check(calibration);
    return calibration;
}

}  // namespace

void bind_calibration(py::module_& m) {
    m.def(
        "straightness_reference",
        [](const ChainLike& chain, const ArrayLike& tool) {
            return straightness_reference(to_chain(chain), to_vector3(tool, "tool"));
        },
        py::arg("chain"), py::arg("tool") = zeros(3),
        "One line: to which point straightnesses refer, and what they are at the functional point.");
    auto calibration = py::reinterpret_borrow<py::class_<Calibration>>(m.attr("Calibration"));
    calibration
        .def(py::init(&make_calibration), py::arg("method"), py::arg("chain"), py::arg("volume"), py::arg("tool"),
             py::arg("functions"), py::arg("squareness") = std::map<std::string, std::pair<double, double>>{},
             py::kw_only(), py::arg("undetermined_slopes") = Names{}, py::arg("undetermined") = Names{},
             py::arg("covariance") = std::nullopt, py::arg("reversal") = Tables{},
             py::arg("reversal_negative_uncertainty") = Arrays{}, py::arg("undetermined_reversal_constants") = Names{},
             py::arg("date") = "", py::arg("fit") = std::nullopt, py::arg("variance_factor") = std::nullopt,
             py::arg("fit_codes") = Names{}, py::arg("fit_reasons") = Names{},
             py::arg("uncertainty_scaled") = std::nullopt, py::arg("provenance") = Texts{},
             py::arg("unseen_faults") = Names{}, py::arg("conditions") = Names{}, py::arg("budget") = "",
             py::arg("between_nodes") = std::nullopt, py::arg("temperature_reference") = std::nullopt,
             py::arg("temperature_as_found") = std::nullopt, py::arg("expansion") = std::nullopt,
             py::arg("fixed_point") = std::nullopt, py::arg("unverified") = false,
             "A calibration from its parts, each as the property of its name gives it; reversal_negative_uncertainty: "
             "name -> (n,), of negative_functions. A standard uncertainty that is not known is NaN. Raises "
             "InvalidArgument naming the parameter for what is none: nodes that do not "
             "ascend, values that are not finite, a covariance that is not one of these values.")
        .def_readonly("date", &Calibration::date, "When it was evaluated: ISO 8601, UTC; empty where it is not known.")
        .def_property_readonly(
            "fit", [](const Calibration& c) { return c.fit ? std::optional(name(*c.fit)) : std::nullopt; },
            "Verdict of the fit: \"accepted\", \"doubtful\", \"rejected\" (not to be used) or \"unchecked\" (nothing "
            "controls the readings); None where it is not known.")
        .def_readonly("unverified", &Calibration::unverified,
                      "Whether it, or one that it was made from, was read from a file without a checksum: nothing "
                      "tells whether its values are those that were written.")
        .def_readonly("variance_factor", &Calibration::variance_factor,
                      "Of the fit: 1 is expected; None where nothing controls the readings, or it is not known.")
        .def_readonly("fit_codes", &Calibration::fit_codes,
                      "Why that verdict, as stable codes: of an adjustment those of FitReason.finding; empty where it "
                      "is not known.")
        .def_readonly("fit_reasons", &Calibration::fit_reasons, "Why that verdict, a sentence each.")
        .def_readonly("unseen_faults", &Calibration::unseen_faults,
                      "How large faults of readings may be in it unseen, and what they then do, a sentence each.")
        .def_readonly(
            "conditions", &Calibration::conditions,
            "Under which conditions it was evaluated, as they were used: temperatures, coefficients, the air, "
            "the instrument; a sentence each.")
        .def_readonly("budget", &Calibration::budget,
                      "What makes its largest positioning uncertainty: one line; empty where it is not known.")
        .def_property_readonly(
            "uncertainty_parts",
            [](const Calibration& c) {
                std::map<std::string, DoubleArray> parts;
                for (const auto& [source, part] : c.uncertainty_parts)
                    parts.emplace(name(source), DoubleArray(py::ssize_t(part.size()), part.data()));
                return parts;
            },
            "Of an adjustment, by source (\"scale\" of the instrument, \"temperature\", \"air\"): what it makes of the "
            "standard uncertainties, mm or rad, in the order of covariance_labels. Sources that are not stated are "
            "absent; a file does not have them.")
        .def_readonly("uncertainty_scaled", &Calibration::uncertainty_scaled,
                      "What all uncertainties were multiplied by, beyond what follows from those of the readings "
                      "(scale_uncertainty); None: by nothing.")
        .def_readonly("between_nodes", &Calibration::between_nodes,
                      "Standard uncertainty of the functional point by errors between the nodes, as it was stated, mm; "
                      "None: nothing was stated. It is in no other uncertainty.")
        .def_readonly("temperature_reference", &Calibration::temperature_reference,
                      "Temperature of the scales that positioning errors are referred to, degrees Celsius; None: they "
                      "are as found.")
        .def_property_readonly(
            "temperature_as_found",
            [](const Calibration& c) {
                return c.temperature_as_found ? std::optional(to_numpy_vector(*c.temperature_as_found)) : std::nullopt;
            },
            "Temperatures of the scales of X, Y, Z (3,) where errors are as found, means over all readings, degrees "
            "Celsius; None: nothing was recorded, or they are referred to temperature_reference.")
        .def_property_readonly(
            "expansion",
            [](const Calibration& c) {
                return c.expansion ? std::optional(to_numpy_vector(*c.expansion)) : std::nullopt;
            },
            "Coefficients of the scales of X, Y, Z (3,) by which positioning errors are referred to "
            "temperature_reference, 1/K; of an adjustment as it found them. None: as found, or not known.")
        .def_property_readonly(
            "fixed_point", [](const Calibration& c) { return to_numpy_vector(c.fixed_point); },
            "Positions from which these scales expand (3,), mm.")
        .def_readonly("provenance", &Calibration::provenance,
                      "What it was made from, as far as it is known: program and version, SHA-256 of the run, the "
                      "scenario and the descriptions of heads, options that are not the default ones. Keys: program, "
                      "run_sha256, scenario_sha256, heads_sha256, options.")
        .def_property_readonly(
            "straightness_reference", [](const Calibration& c) { return straightness_reference(c.chain, c.tool); },
            "One line: to which point the straightnesses refer, and what they are at the functional point.")
        .def(
            "dated",
            [](Calibration c, const std::string& date) {
                c.date = date;
                check(c);
                return c;
            },
            py::arg("date"), "The same calibration with this date. Raises InvalidArgument for more than one line.")
        .def(
            "judged",
            [](Calibration c, const std::string& fit, const Names& reasons, const Names& codes) {
                c.fit = fit_of({{"fit", fit}}, "calibration");
                c.fit_reasons = reasons;
                c.fit_codes = codes;
                check(c);
                return c;
            },
            py::arg("fit"), py::arg("fit_reasons") = Names{}, py::arg("fit_codes") = Names{},
            "The same calibration with this verdict of its fit. Raises InvalidArgument for another word, and for "
            "reasons and codes that differ in number.")
        .def(
            "with_sentences",
            [](Calibration c, const Names& undetermined, const Names& fit_reasons, const Names& unseen_faults) {
                c.undetermined = undetermined;
                c.fit_reasons = fit_reasons;
                c.unseen_faults = unseen_faults;
                check(c);
                return c;
            },
            py::kw_only(), py::arg("undetermined"), py::arg("fit_reasons") = Names{},
            py::arg("unseen_faults") = Names{},
            "The same calibration with its findings in these words. Raises InvalidArgument for a sentence of more "
            "than one line.")
        .def(
            "with_between_nodes",
            [](Calibration c, const std::optional<double>& between_nodes) {
                c.between_nodes = between_nodes;
                check(c);
                return c;
            },
            py::arg("between_nodes"),
            "The same calibration with this standard uncertainty by errors between the nodes, mm. Raises "
            "InvalidArgument below 0.")
        .def(
            "with_conditions",
            [](Calibration c, const Names& conditions, const std::string& budget) {
                c.conditions = conditions;
                c.budget = budget;
                check(c);
                return c;
            },
            py::arg("conditions"), py::arg("budget"),
            "The same calibration with these words. Raises InvalidArgument for a sentence of more than one line.")
        .def_static(
            "provenance_keys", [] { return Names(provenance_keys.begin(), provenance_keys.end()); },
            "The keys that a provenance may have.")
        .def(
            "with_provenance",
            [](Calibration c, const Texts& provenance) {
                c.provenance = provenance;
                check(c);
                return c;
            },
            py::arg("provenance"),
            "The same calibration with this provenance, by the keys of the property. Raises InvalidArgument for other "
            "keys, and for texts that are empty or of more than one line.");
}

}  // namespace stepdiag::bindings
