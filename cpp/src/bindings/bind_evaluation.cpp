#include "bindings.hpp"
#include "stepdiag/evaluation/constant_index.hpp"
#include "stepdiag/evaluation/conventional.hpp"
#include "stepdiag/evaluation/enhanced.hpp"
#include "stepdiag/evaluation/plausibility.hpp"
#include "struct_table.hpp"

namespace stepdiag::bindings {

namespace {

template <class Enum, int count>
std::vector<std::string> names_of() {
    std::vector<std::string> names;
    for (int i = 0; i < count; ++i) names.push_back(name(Enum(i)));
    return names;
}

void check_usable(const ReadingUncertainty& uncertainty) {
    for (const auto& [key, u] : {std::pair("distance", uncertainty.distance), std::pair("tilt", uncertainty.tilt),
                                 std::pair("spot", uncertainty.spot)})
        if (!is_usable_uncertainty(u))
            throw InvalidArgument(std::string("uncertainty ") + key +
                                  ": expected a standard uncertainty of 1e-12 to 1e6 mm or rad");
}

// By a linear method; the adjustment has a function of its own.
Calibration evaluate(const Measurement& measurement, const Plan& plan, const HeadLike& head, const ChainLike& chain,
                     const ArrayLike& tool, const std::string& method, const ReadingUncertainty& uncertainty,
                     bool full_covariance, const PlausibleLimits& plausible,
                     const std::optional<KnownExpansion>& expansion) {
    const auto evaluator = method == "enhanced"       ? &evaluate_enhanced
                           : method == "conventional" ? &evaluate_conventional
                                                      : nullptr;
    if (!evaluator)
        throw InvalidArgument("method: expected \"conventional\", \"enhanced\" or \"adjustment\", got \"" + method +
                              "\"");
    const Eigen::Vector3d offset = to_vector3(tool, "tool");
    const Chain kinematics = to_chain(chain);
    const HeadCalibrations heads = to_heads(head, plan).calibration();
    const py::gil_scoped_release release;
    return evaluator(measurement, plan, kinematics, offset, heads,
                     {uncertainty, full_covariance, plausible, expansion});
}

void bind_undetermined(py::module_& m) {
    bind_record(
        m, "Undetermined", "What the readings leave open, as data; `Calibration.undetermined` has it in words.",
        field("part", &Undetermined::part,
              "What is open: \"whole\"; \"slope\"; \"positions\": at some of them; \"reversal\"; "
              "\"reversal_at_home\": of the reversal errors only the change along the axis is known; \"setup\"."),
        field("parameters", &Undetermined::parameters,
              "\"EXX\", ..., \"C0Y\"; of a set-up its quantity, as in SetupEstimate."),
        field("reason", &Undetermined::reason, "One of `reasons()`."),
        field("positions", &Undetermined::positions,
              "mm: where it is open; of a step that was read on too few lines its two ends."),
        field("step", &Undetermined::step, "Of such a step: its number, from 1; else 0."),
        field("lines_read", &Undetermined::lines_read, "Of such a step: the lines that it was read on."),
        field("lines_planned", &Undetermined::lines_planned, "Of such a step: its lines in the plan."),
        field("line", &Undetermined::line, "The line to add; else empty."),
        field("component", &Undetermined::component, "Of a set-up: as in SetupEstimate."),
        field("setups", &Undetermined::setups, "Of a set-up: (first run, line) of each that is open."))
        .def_property_readonly(
            "remedies",
            [](const Undetermined& u) {
                std::vector<std::string> names;
                for (const Remedy remedy : u.remedies) names.push_back(name(remedy));
                return names;
            },
            "What would help, the best first; any one of them does. Of `all_remedies()`.")
        .def_static("reasons", &names_of<OpenReason, open_reason_count>)
        .def_static("all_remedies", &names_of<Remedy, remedy_count>);
}

std::vector<std::pair<std::string, std::optional<double>>> covariance_labels(const Calibration& calibration) {
    std::vector<std::pair<std::string, std::optional<double>>> labels;
    for (int i = 0; i < function_count; ++i)
        if (const auto& function = calibration.functions[i])
            for (const double position : function->position) labels.emplace_back(FunctionId::at(i).name(), position);
    for (const Squareness s : all_squarenesses)
        if (calibration.squarenesses[static_cast<int>(s)]) labels.emplace_back(name(s), std::nullopt);
    return labels;
}

}  // namespace

static void bind_evaluation_options(py::module_& m) {
    bind_options<KnownExpansion, 2>(
        m, "KnownExpansion",
        "What is known of the expansion of the scales. With it, positioning errors are referred to the reference "
        "temperature, by the temperatures in the run's channels.",
        &check, required("expansion", &KnownExpansion::expansion, "Of the scales."),
        required("standard_uncertainty", &KnownExpansion::standard_uncertainty, "(3,) of the coefficients, 1/K"),
        required("one_coefficient", &KnownExpansion::one_coefficient, "Whether it is common to the axes."),
        required("sensor_uncertainty", &KnownExpansion::sensor_uncertainty,
                 "Standard uncertainty of each sensor's constant deviation, K."),
        field("temperature", &KnownExpansion::temperature,
              "(3,) of the scales where the run says nothing, degrees Celsius"),
        field("one_temperature", &KnownExpansion::one_temperature, "Whether one sensor measured it for all axes."));

    bind_options<ReadingUncertainty, 3>(
        m, "ReadingUncertainty", "Standard uncertainty of a reading where the run gives none: 1e-12 to 1e6 each.",
        &check_usable, field("distance", &ReadingUncertainty::distance, "mm; also of d1, ..."),
        field("tilt", &ReadingUncertainty::tilt, "rad"), field("spot", &ReadingUncertainty::spot, "mm"));

    bind_options<PlausibleLimits>(
        m, "PlausibleLimits", "What a machine can be. A result beyond is an error; inf: no limit.", &check,
        field("positioning", &PlausibleLimits::positioning, "Positioning errors by the travel of their axis."),
        field("translation", &PlausibleLimits::translation, "Positioning errors and straightnesses, mm."),
        field("rotation", &PlausibleLimits::rotation, "Angular errors and squarenesses, rad."));

    bind_undetermined(m);
}

static void bind_calibration_found(py::module_& m) {
    bind_record(
        m, "Calibration",
        "The 21 parameters as far as the readings determine them, with standard uncertainties; native units (mm, rad).",
        field("method", &Calibration::method,
              "\"conventional\", \"enhanced\" or \"adjustment\", perhaps with remarks."),
        field("chain", &Calibration::chain, "Of the machine."), field("volume", &Calibration::volume, "(3,) edges, mm"),
        field("tool", &Calibration::tool, "(3,) offset of the functional point, mm"),
        field("findings", &Calibration::findings,
              "What the readings do not determine, why, and what would help; files keep it in words only."),
        field("undetermined", &Calibration::undetermined,
              "The findings in words, one sentence each; empty until they are put in (with_sentences)."))
        .def_property_readonly(
            "functions",
            [](const Calibration& c) {
                std::map<std::string, std::tuple<DoubleArray, DoubleArray, DoubleArray>> functions;
                for (int i = 0; i < function_count; ++i)
                    if (const auto& f = c.functions[i])
                        functions[FunctionId::at(i).name()] = {to_numpy(f->position), to_numpy(f->value),
                                                               to_numpy(f->standard_uncertainty)};
                return functions;
            },
            "name -> (position, value, standard uncertainty); what is not determined is absent.")
        .def_property_readonly(
            "squareness",
            [](const Calibration& c) {
                std::map<std::string, std::pair<double, double>> values;
                for (const Squareness s : all_squarenesses)
                    if (const auto& entry = c.squarenesses[static_cast<int>(s)])
                        values[name(s)] = {entry->value, entry->standard_uncertainty};
                return values;
            },
            "name -> (value, standard uncertainty), rad.")
        .def_property_readonly(
            "undetermined_slopes",
            [](const Calibration& c) {
                std::vector<std::string> names;
                for (int i = 0; i < function_count; ++i)
                    if (c.functions[i] && !c.functions[i]->slope_determined) names.push_back(FunctionId::at(i).name());
                return names;
            },
            "Functions of which only the shape is known; their values are 0 at both ends.")
        .def_property_readonly(
            "reversal",
            [](const Calibration& c) {
                std::map<std::string, std::tuple<DoubleArray, DoubleArray, DoubleArray>> reversal;
                for (int i = 0; i < function_count; ++i)
                    if (const auto& r = c.reversal[i])
                        reversal[FunctionId::at(i).name()] = {to_numpy(r->position), to_numpy(r->value),
                                                              to_numpy(r->standard_uncertainty)};
                return reversal;
            },
            "name -> (position, value, standard uncertainty): the function approached in + direction less that in - "
            "direction, where backward runs tell it. `functions` are those of the + direction.")
        .def_property_readonly(
            "negative_functions",
            [](const Calibration& c) {
                std::map<std::string, std::tuple<DoubleArray, DoubleArray, DoubleArray>> functions;
                const ParameterTable table = to_parameter_table(c);
                for (int i = 0; i < function_count; ++i)
                    if (const auto& f = table.negative_functions[i])
                        functions[FunctionId::at(i).name()] = {to_numpy(f->position), to_numpy(f->value),
                                                               to_numpy(f->standard_uncertainty)};
                return functions;
            },
            "name -> (position, value, standard uncertainty) of functions approached in - direction, which are "
            "functions - reversal.")
        .def_property_readonly(
            "undetermined_reversal_constants",
            [](const Calibration& c) {
                std::vector<std::string> names;
                for (int i = 0; i < function_count; ++i)
                    if (c.reversal[i] && !c.reversal[i]->constant_determined) names.push_back(FunctionId::at(i).name());
                return names;
            },
            "Functions of whose reversal error only the change from home is known; its values are 0 at home.")
        .def_property_readonly(
            "covariance",
            [](const Calibration& c) {
                return c.covariance.size() > 0 ? std::optional(to_numpy(c.covariance)) : std::nullopt;
            },
            "(n, n) in the order of covariance_labels, native units; None unless evaluated with full_covariance.")
        .def_property_readonly("covariance_labels", &covariance_labels,
                               "(parameter, position in mm or None) of each row.")
        .def(
            "write_csv", [](const Calibration& c, const PathLike& path) { write_calibration(c, to_path(path)); },
            py::arg("path"),
            "Writes the calibration CSV (the covariance is not kept). Raises InvalidArgument when it cannot be "
            "written.")
        .def(
            "to_error_map", [](const Calibration& c) { return ErrorMap(to_parameter_table(c)); },
            "The calibration as a machine's errors; what is undetermined is 0 there.");
}

static void bind_evaluate(py::module_& m) {
    m.def(
        "read_calibration", [](const PathLike& path) { return read_calibration(to_path(path)); }, py::arg("path"),
        "Reads a calibration CSV. Raises InvalidArgument naming file and line.");
    m.def("check_points", &check_points, py::arg("measurement"), py::arg("plan"),
          "Raises InvalidArgument for a row whose point the plan does not have, or has more than 1 um elsewhere.");
    m.def(
        "in_recorded_air",
        [](const Measurement& measurement, const Plan& plan, const HeadLike& head, const Environment& assumed) {
            const Heads heads = to_heads(head, plan);
            std::map<std::string, CountingHead> of_line;
            for (const auto* lines : {&plan.lines(), &plan.scale_lines()})
                for (const Line& line : *lines)
                    of_line[line.name()] = {heads.of(line).standoff, heads.of(line).wavelength};
            return in_recorded_air(measurement, plan, of_line, assumed);
        },
        py::arg("measurement"), py::arg("plan"), py::arg("head"), py::arg("assumed_environment"),
        "The run of an instrument that counted with the constant index of the assumed air, with distances in the air "
        "that the run's channels air_temperature, air_pressure and air_humidity recorded. Raises InvalidArgument for a "
        "run without any of them, a quantity that nothing states, and air out of the equation's range.");
    m.def("evaluate", &evaluate, py::arg("measurement"), py::arg("plan"), py::arg("head"), py::arg("chain"),
          py::arg("tool") = zeros(3), py::kw_only(), py::arg("method"), py::arg("uncertainty") = ReadingUncertainty{},
          py::arg("full_covariance") = false, py::arg("plausible") = PlausibleLimits{},
          py::arg("expansion") = std::nullopt,
          "Calibration from a run by a linear method; findings are data, methods.evaluate gives them in words, too.");
}

void bind_evaluation(py::module_& m) {
    bind_evaluation_options(m);
    bind_calibration_found(m);
    bind_evaluate(m);
}

}  // namespace stepdiag::bindings
