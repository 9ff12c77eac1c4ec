#include <pybind11/typing.h>

#include <memory>

#include "batch_options.hpp"
#include "bindings.hpp"
#include "stepdiag/uncertainty/inputs.hpp"
#include "stepdiag/uncertainty/propagation.hpp"
#include "stepdiag/uncertainty/validation.hpp"
#include "stepdiag/uncertainty/virtual_calibration.hpp"
#include "stepdiag/uncertainty/volumetric_accuracy.hpp"
#include "struct_table.hpp"

namespace stepdiag::bindings {

template <>
InputQuantity parsed<InputQuantity>(const std::string& word) {
    return parse_input_quantity(word);
}
template <>
struct InPython<InputQuantity> : AsWord<InputQuantity> {};
template <>
NoiseQuantity parsed<NoiseQuantity>(const std::string& word) {
    return parse_noise_quantity(word);
}

// --- uncertain inputs ---

static void bind_uncertain_quantities(py::module_& m) {
    using Quantity = UncertainQuantity;
    bind_record(m, "UncertainQuantity", "What may be uncertain about a virtual calibration.",
                field("name", &Quantity::name),
                field("key", &Quantity::key, "In scenarios, with its unit; empty: it has others."))
        .def_property_readonly(
            "of",
            [](const Quantity& q) {
                constexpr const char* names[] = {"line", "part", "head", "air", "machine", "scale", "noise"};
                return names[int(q.of)];
            },
            "\"line\", \"part\" (of the head), \"head\", \"air\", \"machine\" or \"noise\".")
        .def_property_readonly(
            "layout", [](const Quantity& q) { return q.layout ? std::optional(name(*q.layout)) : std::nullopt; },
            "The only layout of heads that has it.")
        .def("count", &Quantity::count, py::arg("beams"), "Of components, with so many beams.");
    m.def(
        "uncertain_quantities", [] { return to_tuple(uncertain_quantities()); },
        "The set-up quantities, what lines share, and the noises.");
}

static void bind_inputs_and_noise(py::module_& m) {
    bind_options<UncertainInput, 2>(
        m, "UncertainInput",
        "An input quantity that is drawn once for each virtual calibration, as a deviation added to what is nominal.",
        nullptr,
        required("quantity", &UncertainInput::quantity,
                 "One of setup_quantities(), of a line (component 0, 1: a, b or x, y); \"part_shift\" (mm), "
                 "\"part_rotation\" (rad): of a part of the head; \"psd_distance\", \"beam_offset\" (mm), "
                 "\"reading_model\" (1): of the head; \"temperature\" (degrees Celsius), \"pressure\" (Pa), "
                 "\"humidity\" (1), \"refractive_index\", \"wavelength\" (1, relative): of the air; "
                 "\"machine_drift\" (mm/s, x, y, z)."),
        required("distribution", &UncertainInput::distribution,
                 "Of the deviation from the nominal value, mm, rad or the quantity's unit."),
        field("line", &UncertainInput::line), field("part", &UncertainInput::part),
        field("component", &UncertainInput::component))
        .def_property_readonly(
            "name", [](const UncertainInput& input) { return name(input); }, "With its line, component and part.");

    bind_options<ReadingNoise, 2>(
        m, "ReadingNoise", "What is drawn for every reading or pose.", nullptr,
        required("quantity", &ReadingNoise::quantity,
                 "\"channel\" (of the channel named), \"common\" (mm, one draw a reading for all its distances), "
                 "\"head_walk\", \"machine_walk\" (mm/sqrt(s), random walks), \"position\" (mm), \"orientation\" "
                 "(rad): repeatability of the machine, component x, y, z."),
        required("distribution", &ReadingNoise::distribution, "Of each draw, mm or rad."),
        field("channel", &ReadingNoise::channel), field("component", &ReadingNoise::component))
        .def_property_readonly(
            "name", [](const ReadingNoise& noise) { return name(noise); }, "With its line and component.");

    using Correlation = std::pair<std::vector<int>, ArrayLike>;
    py::class_<UncertainInputs>(m, "UncertainInputs", "What is uncertain about a virtual calibration.")
        .def(py::init([](std::vector<UncertainInput> inputs, std::vector<ReadingNoise> noise,
                         const std::vector<Correlation>& correlations) {
                 UncertainInputs all{std::move(inputs), std::move(noise)};
                 for (const Correlation& correlation : correlations)
                     all.correlations.push_back({correlation.first, to_matrix(correlation.second, "correlation")});
                 check(all);
                 return all;
             }),
             py::arg("inputs") = std::vector<UncertainInput>{}, py::arg("noise") = std::vector<ReadingNoise>{},
             py::arg("correlations") = std::vector<Correlation>{},
             "correlations: pairs of indices of normal inputs and their correlation matrix. Raises InvalidArgument for "
             "an input given twice, a line, part or component that its quantity does not have, a matrix that is no "
             "correlation.")
        .def_readonly("inputs", &UncertainInputs::inputs)
        .def_readonly("noise", &UncertainInputs::noise, "A ReadingNoise for each.")
        .def_property_readonly("correlations", [](const UncertainInputs& all) {
            std::vector<std::pair<std::vector<int>, DoubleArray>> correlations;
            for (const CorrelatedInputs& correlated : all.correlations)
                correlations.emplace_back(correlated.members, to_numpy(correlated.correlation));
            return correlations;
        });
}

static void bind_uncertain_inputs(py::module_& m) {
    bind_uncertain_quantities(m);
    bind_inputs_and_noise(m);
}

// --- derived ---

namespace {

std::optional<Eigen::Vector3d> to_tool(const std::optional<ArrayLike>& tool) {
    return tool ? std::optional(to_vector3(*tool, "tool")) : std::nullopt;
}

// Name -> undetermined parameters that it needs; only names that lack any.
template <std::size_t Size>
std::map<std::string, std::vector<std::string>> missing_by_name(
    const std::array<std::vector<std::string>, Size>& missing, const std::array<const char*, Size>& names) {
    std::map<std::string, std::vector<std::string>> named;
    for (std::size_t i = 0; i < Size; ++i)
        if (!missing[i].empty()) named[names[i]] = missing[i];
    return named;
}

void bind_points(py::module_& m) {
    bind_record(
        m, "ErrorAtPoint",
        "The deviations X, Y, Z (mm) of the functional point and A, B, C (rad) of the tool at a commanded point, to "
        "first order, with covariance from the calibration's. NaN where the calibration lacks something that acts "
        "there.",
        field("point", &ErrorAtPoint::point, "(3,) mm"), field("tool", &ErrorAtPoint::tool, "(3,) mm"),
        field("value", &ErrorAtPoint::value, "(6,) mm, rad"),
        field("covariance", &ErrorAtPoint::covariance,
              "(6, 6) mm^2, mm rad, rad^2; NaN where the calibration has none."))
        .def_property_readonly(
            "standard_uncertainty", [](const ErrorAtPoint& e) { return to_numpy_vector(e.standard_uncertainty()); },
            "(6,) mm, rad; NaN where the calibration has no covariance.")
        .def_property_readonly(
            "missing", [](const ErrorAtPoint& e) { return missing_by_name(e.missing, deviation_names); },
            "\"X\" ... \"C\" -> parameters that act in it and are not determined: \"EAX\", \"slope of EXX\".");

    m.def(
        "error_at_point",
        [](const Calibration& calibration, const ArrayLike& point, const std::optional<ArrayLike>& tool) {
            return error_at_point(calibration, to_vector3(point, "point"), to_tool(tool));
        },
        py::arg("calibration"), py::arg("point"), py::kw_only(), py::arg("tool") = std::nullopt,
        "The error at a commanded point (mm) with a tool offset (mm; none: the calibration's), of axes that came in + "
        "direction: e = sum over axes of delta + theta x lever. Raises InvalidArgument for lengths that are not "
        "finite.");

    bind_record(
        m, "DiagonalErrors",
        "Along a body diagonal (ISO 230-6): how much further than commanded the functional point is from where the "
        "diagonal begins.",
        field("point", &DiagonalErrors::point, "(n, 3) mm, commanded"),
        field("travel", &DiagonalErrors::travel, "(n,) mm, commanded, from the first point"),
        field("value", &DiagonalErrors::value, "(n,) mm; NaN where the calibration lacks something."),
        field("covariance", &DiagonalErrors::covariance, "(n, n) mm^2"),
        field("missing", &DiagonalErrors::missing, "Parameters that are not determined."))
        .def_property_readonly(
            "line", [](const DiagonalErrors& d) { return d.line.name(); }, "The body diagonal: \"ppp\", ...")
        .def_property_readonly(
            "standard_uncertainty", [](const DiagonalErrors& d) { return to_numpy_vector(d.standard_uncertainty()); },
            "(n,) mm; NaN where the calibration has no covariance.")
        .def_property_readonly("range", &DiagonalErrors::range,
                               "Largest less smallest value, mm; its uncertainty: volumetric_accuracy.");

    m.def(
        "diagonal_errors",
        [](const Calibration& calibration, const std::optional<ArrayLike>& tool) {
            std::map<std::string, DiagonalErrors> diagonals;
            for (DiagonalErrors& diagonal : diagonal_errors(calibration, to_tool(tool)))
                diagonals.emplace(diagonal.line.name(), std::move(diagonal));
            return diagonals;
        },
        py::arg("calibration"), py::kw_only(), py::arg("tool") = std::nullopt,
        "Of the body diagonals \"ppp\", \"npp\", \"pnp\", \"nnp\". tool: offset (mm); none: the calibration's. Raises "
        "InvalidArgument for an offset that is not finite.");
}

void bind_volume(py::module_& m) {
    const auto column = [](auto member) {
        return [member](const VolumetricAccuracy& v) { return to_numpy_vector(Eigen::VectorXd(v.*member)); };
    };
    bind_record(
        m, "VolumetricAccuracy",
        "ISO 230-1's V_XYZ: the ranges over the volume of the deviations X, Y, Z (mm) of the functional point and A, "
        "B, C (rad) of the tool, and the ranges of the four body diagonals' errors (mm); in the order of `names`. A "
        "range is not linear in the parameters and noise makes it larger: `bias` says about how much larger `value` is "
        "than the true range; `interval` takes that off.",
        field("drawn_interval", &VolumetricAccuracy::drawn_interval,
              "(10, 2) probabilistically symmetric coverage interval of the draws: too large by twice the bias."),
        field("interval", &VolumetricAccuracy::interval,
              "(10, 2) the drawn interval mirrored about the value, 2 value - drawn_interval: takes the bias off to "
              "first "
              "order; not below 0."),
        field("resolution", &VolumetricAccuracy::resolution,
              "By how much V_X, V_Y, V_Z may be too small on either side for want of points between the nodes "
              "of axes that carry the workpiece, mm; 0 with one such axis."),
        field("samples", &VolumetricAccuracy::samples, "Draws of the covariance."))
        .def_property_readonly("names", [](const VolumetricAccuracy&) { return range_names; })
        .def_property_readonly("value", column(&VolumetricAccuracy::value), "(10,) of the calibration's values.")
        .def_property_readonly("mean", column(&VolumetricAccuracy::mean), "(10,) of the draws.")
        .def_property_readonly("standard_uncertainty", column(&VolumetricAccuracy::standard_uncertainty),
                               "(10,) standard deviation of the draws.")
        .def_property_readonly(
            "bias", [](const VolumetricAccuracy& v) { return to_numpy_vector(v.bias()); }, "(10,) mean - value")
        .def_property_readonly("bound", column(&VolumetricAccuracy::bound),
                               "(10,) the true range is within value -+ bound with at least the coverage probability: "
                               "the quantile of the range of noise alone.")
        .def_property_readonly(
            "missing", [](const VolumetricAccuracy& v) { return missing_by_name(v.missing, range_names); },
            "Name -> parameters that act in it and are not determined; its numbers are NaN.");

    m.def(
        "volumetric_accuracy",
        [](const Calibration& calibration, const std::optional<ArrayLike>& tool, double coverage,
           const IntegerLike& samples, const IntegerLike& seed) {
            const auto offset = to_tool(tool);
            const auto count = std::size_t(to_integer(samples, "samples", 1, 1'000'000'000));
            const RangeOptions options{coverage, count, to_seed(seed)};
            py::gil_scoped_release release;
            return volumetric_accuracy(calibration, offset, options);
        },
        py::arg("calibration"), py::kw_only(), py::arg("tool") = std::nullopt,
        py::arg("coverage") = RangeOptions{}.coverage, py::arg("samples") = integer(int(RangeOptions{}.samples)),
        py::arg("seed") = integer(0),
        "By draws from the joint normal distribution of a calibration evaluated with full_covariance. tool: offset "
        "(mm); none: the calibration's. Raises InvalidArgument without a covariance and for fewer samples than "
        "100/(1 - coverage).");

    py::class_<RangeModel, SampleModel>(
        m, "RangeModel",
        "The ranges of VolumetricAccuracy as a model for the Monte Carlo method; those that something is missing for "
        "are no outputs.")
        .def(
            py::init([](const Calibration& calibration, const std::optional<ArrayLike>& tool, const IntegerLike& seed) {
                return std::make_unique<RangeModel>(calibration, to_tool(tool), to_seed(seed));
            }),
            py::arg("calibration"), py::kw_only(), py::arg("tool") = std::nullopt, py::arg("seed") = integer(0),
            "Raises InvalidArgument for a calibration without covariance.");
}

}  // namespace

void bind_volume_errors(py::module_& m);  // bind_volume_errors.cpp

static void bind_derived(py::module_& m) {
    py::class_<DerivedOutput>(m, "DerivedOutput",
                              "A linear combination of a calibration's entries, as an output of virtual calibrations.")
        .def(py::init([](const std::string& name, const std::string& unit, const ArrayLike& row) {
                 return DerivedOutput{name, unit, to_vector(row, "row")};
             }),
             py::arg("name"), py::arg("unit"), py::arg("row"),
             "row: coefficients by entry, in the order of Calibration.covariance_labels. A tuple of the three does as "
             "well where one is expected.")
        .def(py::init([](const py::typing::Tuple<py::str, py::str, ArrayLike>& parts) {
            if (parts.size() != 3) throw InvalidArgument("derived: expected (name, unit, row)");
            return DerivedOutput{parts[0].cast<std::string>(), parts[1].cast<std::string>(),
                                 to_vector(parts[2], "derived")};
        }))
        .def_readonly("name", &DerivedOutput::name)
        .def_readonly("unit", &DerivedOutput::unit)
        .def_property_readonly("row", [](const DerivedOutput& output) { return to_numpy_vector(output.row); });
    py::implicitly_convertible<py::tuple, DerivedOutput>();
    m.def(
        "with_covariance",
        [](const Calibration& calibration, const ArrayLike& covariance) {
            return with_covariance(calibration, to_matrix(covariance, "covariance"));
        },
        py::arg("calibration"), py::arg("covariance"),
        "The calibration with another covariance of its values, such as Propagation.covariance of its entries, and the "
        "standard uncertainties that go with it. Raises InvalidArgument for what is no covariance of these values.");
    m.def(
        "derived_at_point",
        [](const Calibration& calibration, const ArrayLike& point, const std::optional<ArrayLike>& tool) {
            return derived_at_point(calibration, to_vector3(point, "point"), to_tool(tool));
        },
        py::arg("calibration"), py::arg("point"), py::kw_only(), py::arg("tool") = std::nullopt,
        "The deviations of error_at_point as outputs of virtual calibrations with entries like this calibration's: up "
        "to six, those that nothing is missing for.");
    m.def(
        "derived_on_diagonals",
        [](const Calibration& calibration, const std::optional<ArrayLike>& tool) {
            return derived_on_diagonals(calibration, to_tool(tool));
        },
        py::arg("calibration"), py::kw_only(), py::arg("tool") = std::nullopt,
        "The values of diagonal_errors as outputs of virtual calibrations, those that nothing is missing for.");
    bind_points(m);
    bind_volume(m);
    bind_volume_errors(m);
}

// --- virtual calibration ---

namespace {

std::uint64_t to_sample(const IntegerLike& number) {
    return std::uint64_t(to_integer(number, "sample", 0, std::int64_t(1) << 62));
}

// Splits fields by name: those of SimulationOptions, and the others.
std::pair<Fields, Fields> split(const Fields& fields) {
    std::pair<Fields, Fields> parts;
    for (const auto& [name, value] : fields)
        (py::hasattr(py::type::of<SimulationOptions>(), name) ? parts.first : parts.second)[name] = value;
    return parts;
}

std::unique_ptr<VirtualCalibrations> make_virtual_calibrations(
    const Machine& machine, const Plan& plan, const HeadLike& heads, const UncertainInputs& inputs,
    const std::optional<HeadLike>& calibration_heads, const std::string& method, const IntegerLike& seed,
    const std::vector<DerivedOutput>& derived, const std::optional<SimulationOptions>& simulation,
    const std::optional<AdjustmentOptions>& adjustment, const Fields& fields) {
    const auto [of_simulation, of_adjustment] = split(fields);
    const Heads actual = to_heads(heads, plan);
    SimulationOptions simulated = options_of(simulation, of_simulation);
    simulated.noise = {};  // it is drawn together with the inputs
    const VirtualRun run{machine,
                         plan,
                         actual,
                         calibration_heads ? to_heads(*calibration_heads, plan).calibration() : actual.calibration(),
                         std::move(simulated),
                         inputs};
    const BatchOptions evaluation = to_batch_options(method, options_of(adjustment, of_adjustment));
    const std::uint64_t number = to_seed(seed);
    py::gil_scoped_release release;
    return std::make_unique<VirtualCalibrations>(run, evaluation, number, derived);
}

}  // namespace

static void bind_virtual_calibration(py::module_& m) {
    py::class_<VirtualCalibrations, SampleModel>(
        m, "VirtualCalibrations",
        "Whole virtual calibrations: a run with drawn inputs and reading noise, traced by replay and evaluated with "
        "the unperturbed calibration. Outputs are the values of the calibration's tables, then those derived.")
        .def(py::init(&make_virtual_calibrations), py::arg("machine"), py::arg("plan"), py::arg("heads"),
             py::arg("inputs"), py::kw_only(), py::arg("calibration_heads") = std::nullopt,
             py::arg("method") = "enhanced", py::arg("seed") = integer(0),
             py::arg("derived") = std::vector<DerivedOutput>{}, py::arg("simulation") = std::nullopt,
             py::arg("adjustment") = std::nullopt,
             "simulation: SimulationOptions as of simulate(); of their noise nothing is used, it is among the inputs. "
             "calibration_heads: what the evaluation knows the heads as (none: the heads). method: \"conventional\", "
             "\"enhanced\", \"adjustment\" or \"one_step\". adjustment: AdjustmentOptions as of BatchEvaluator. "
             "The fields of both may be given by name instead. verified_share: of the "
             "samples, in each of which one reading of every line is traced again. derived: as derived_at_point gives "
             "them, or (name, unit, coefficients of the values of the tables). Raises InvalidArgument.")
        .def_property_readonly("nominal", &VirtualCalibrations::nominal,
                               "The run with every input at its expectation, without noise.")
        .def_property_readonly(
            "calibration", [](const VirtualCalibrations& v) { return v.evaluator().of_pattern(); },
            "The evaluation of `nominal`.")
        .def_property_readonly("in_lanes", &VirtualCalibrations::is_in_lanes,
                               "Whether samples are replayed, many at once; else each pose of each is traced: cameras, "
                               "coupled modes, sensors with noise or resolution of their own, faces near a beam's way.")
        .def_property_readonly(
            "count",
            [](const VirtualCalibrations& v) {
                const SampleCount count = v.count();
                return std::map<std::string, std::uint64_t>{
                    {"replayed", count.replayed}, {"traced", count.traced}, {"verified", count.verified}};
            },
            "Samples so far: replayed, traced as a whole, and of the replayed ones verified.")
        .def(
            "evaluate_at",
            [](const VirtualCalibrations& v, const ArrayLike& deviations) {
                const Eigen::MatrixXd columns = to_matrix(deviations, "deviations");
                Eigen::MatrixXd outputs;
                {
                    py::gil_scoped_release release;
                    outputs = v.evaluate_at(columns);
                }
                return to_numpy(outputs);
            },
            py::arg("deviations"),
            "(outputs, n) for given deviations (inputs, n) of the inputs, without reading noise. Raises "
            "InvalidArgument.")
        .def(
            "readings",
            [](const VirtualCalibrations& v, const IntegerLike& sample) {
                const std::uint64_t index = to_sample(sample);
                Eigen::VectorXd readings;
                {
                    py::gil_scoped_release release;
                    readings = v.readings(index);
                }
                const auto rows = Eigen::Index(v.nominal().size());
                return to_numpy(Eigen::MatrixXd(
                    Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>(
                        readings.data(), rows, readings.size() / rows)));
            },
            py::arg("sample"), "(rows, channels) of one sample, with noise; NaN where lost.");
    m.def(
        "drawn_inputs",
        [](const UncertainInputs& inputs, const IntegerLike& seed, const IntegerLike& sample) {
            return to_numpy_vector(drawn_inputs(inputs, to_seed(seed), to_sample(sample)));
        },
        py::arg("inputs"), py::arg("seed"), py::arg("sample"),
        "Deviations of one sample's inputs, in their order. Raises InvalidArgument.");
}

// --- propagation ---

namespace {

template <class List>
void check_length(const List& list, std::size_t expected, const char* name) {
    if (std::size_t(list.size()) != expected)
        throw InvalidArgument(std::string(name) + ": expected " + std::to_string(expected) + ", got " +
                              std::to_string(list.size()));
}

using Texts = std::vector<std::string>;

Propagation propagate_linear(const ArrayLike& value, const ArrayLike& sensitivity, const ArrayLike& uncertainty,
                             const std::optional<ArrayLike>& degrees_of_freedom,
                             const std::optional<std::vector<int>>& estimates, const std::optional<Texts>& names,
                             const std::optional<Texts>& groups, const std::optional<Texts>& outputs,
                             const std::optional<ArrayLike>& correlation, bool covariance) {
    LinearModel model;
    model.value = to_vector(value, "value");
    model.sensitivity = to_matrix(sensitivity, "sensitivity");
    const Eigen::VectorXd u = to_vector(uncertainty, "standard_uncertainty");
    const std::size_t count = std::size_t(u.size());
    if (names) check_length(*names, count, "names");
    if (groups) check_length(*groups, count, "groups");
    if (estimates) check_length(*estimates, count, "estimates");
    if (outputs) check_length(*outputs, std::size_t(model.value.size()), "outputs");
    Eigen::VectorXd freedom = Eigen::VectorXd::Constant(u.size(), std::numeric_limits<double>::infinity());
    if (degrees_of_freedom) {
        freedom = to_vector(*degrees_of_freedom, "degrees_of_freedom");
        check_length(freedom, count, "degrees_of_freedom");
    }
    for (std::size_t i = 0; i < count; ++i) {
        const std::string name = names ? (*names)[i] : "x" + std::to_string(i);
        model.inputs.push_back({name, groups ? (*groups)[i] : name, u[Eigen::Index(i)], freedom[Eigen::Index(i)],
                                estimates ? (*estimates)[i] : -1});
    }
    for (Eigen::Index i = 0; i < model.value.size(); ++i)
        model.outputs.push_back({outputs ? (*outputs)[std::size_t(i)] : "y" + std::to_string(i), std::nan(""), "1"});
    if (correlation) model.correlation = to_matrix(*correlation, "correlation");
    py::gil_scoped_release release;
    return propagate(model, covariance);
}

}  // namespace

static void bind_propagated(py::module_& m) {
    bind_record(
        m, "Propagation",
        "Uncertainty of outputs by the law of propagation (GUM, JCGM 100), native units; arrays in the order of "
        "`outputs`.",
        field("outputs", &Propagation::outputs), field("value", &Propagation::value, "(m,)"),
        field("standard_uncertainty", &Propagation::standard_uncertainty, "(m,)"),
        field("degrees_of_freedom", &Propagation::degrees_of_freedom,
              "(m,) effective ones by Welch and Satterthwaite (GUM G.4.1); NaN where that does not apply: correlated "
              "inputs with finite degrees of freedom contribute."),
        field("between_groups", &Propagation::between_groups,
              "(m,) part of the variance by correlation between inputs of two groups."),
        field("first_order", &Propagation::first_order, "(m, inputs) sensitivity x standard uncertainty."),
        field(
            "second_order", &Propagation::second_order,
            "(m, inputs) what the square of a deviation by the standard uncertainty does, (f(+u) + f(-u) - 2 f(0))/2; "
            "linear propagation leaves it out. 0 where not known."),
        field("knows_products", &Propagation::knows_products,
              "Whether strongest_product, product_variance and product_shift are known: of virtual calibrations "
              "with up to 120 inputs."),
        field("product_variance", &Propagation::product_variance,
              "(m,) variance by products of two independent inputs; empty where not known."),
        field("product_shift", &Propagation::product_shift,
              "(m,) by how much products of correlated inputs shift the mean; empty where not known."))
        .def_property_readonly(
            "covariance",
            [](const Propagation& p) {
                return p.covariance.size() > 0 ? std::optional(to_numpy(p.covariance)) : std::nullopt;
            },
            "(m, m); None unless asked for.")
        .def_property_readonly(
            "budget",
            [](const Propagation& p) {
                std::map<std::string, DoubleArray> budget;
                for (std::size_t g = 0; g < p.groups.size(); ++g)
                    budget[p.groups[g]] = to_numpy_vector(p.budget.col(Eigen::Index(g)));
                return budget;
            },
            "group of inputs -> (m,) standard uncertainty of each output by that group alone; with between_groups, "
            "the squares sum to the square of standard_uncertainty.")
        .def_property_readonly(
            "inputs",
            [](const Propagation& p) {
                std::vector<std::string> names;
                for (const PropagatedInput& input : p.inputs) names.push_back(input.name);
                return names;
            },
            "Names of the inputs that are drawn once: columns of first_order and second_order.")
        .def(
            "expanded", [](const Propagation& p, double coverage) { return to_numpy_vector(p.expanded(coverage)); },
            py::arg("coverage") = 0.95,
            "(m,) U = t_p u, of degrees of freedom truncated to whole ones (GUM G.4.1, G.6.4). Raises InvalidArgument "
            "for a probability outside 0 .. 1.")
        .def_property_readonly(
            "strongest_product",
            [](const Propagation& p) {
                std::vector<std::tuple<std::string, std::string, double>> products;
                for (const Propagation::Product& product : p.strongest_product) {
                    const bool is_any = product.first >= 0;
                    products.emplace_back(is_any ? p.inputs[std::size_t(product.first)].name : "",
                                          is_any ? p.inputs[std::size_t(product.second)].name : "", product.value);
                }
                return products;
            },
            "Of each output the two inputs whose product does most when both deviate by their standard uncertainty, "
            "and what it does; empty where not known.")
        .def_property_readonly(
            "second_order_shift", [](const Propagation& p) { return to_numpy_vector(p.second_order_shift()); },
            "(m,) by how much squares of deviations, and products of correlated ones, shift the mean.")
        .def_property_readonly(
            "second_order_uncertainty",
            [](const Propagation& p) { return to_numpy_vector(p.second_order_uncertainty()); },
            "(m,) standard uncertainty with the squares and products of normal, independent inputs.");
}

static void bind_propagate(py::module_& m) {
    m.def("propagate_linear", &propagate_linear, py::arg("value"), py::arg("sensitivity"),
          py::arg("standard_uncertainty"), py::kw_only(), py::arg("degrees_of_freedom") = std::nullopt,
          py::arg("estimates") = std::nullopt, py::arg("names") = std::nullopt, py::arg("groups") = std::nullopt,
          py::arg("outputs") = std::nullopt, py::arg("correlation") = std::nullopt, py::arg("covariance") = false,
          "Cov(y) = C Cov(x) C^T with C = sensitivity (m, n), x of these standard uncertainties (n,), degrees of "
          "freedom (n,; none: infinite) and correlation (n, n; none: independent). estimates: a number for each input; "
          "those with the same number, 0 or more, have their standard uncertainty from one estimate, so that its "
          "degrees of freedom count once; -1: its own. groups: of the budget; none: each input by itself. Least "
          "squares is the case C = A+. Raises InvalidArgument for what makes no sense.");

    m.def(
        "propagate",
        [](const VirtualCalibrations& virtual_calibrations, const std::optional<Calibration>& calibration,
           bool covariance) {
            return calibration ? propagate(*calibration, virtual_calibrations, covariance)
                               : propagate(virtual_calibrations, covariance);
        },
        py::arg("virtual_calibrations"), py::arg("calibration") = std::nullopt, py::kw_only(),
        py::arg("covariance") = false, py::call_guard<py::gil_scoped_release>(),
        "Uncertainty of all outputs of virtual calibrations: every input by central differences of whole calibrations "
        "at its expectation plus and minus its standard uncertainty; reading noise by the evaluation's gain, with its "
        "real covariance. A t distribution counts with its scale and degrees of freedom (GUM 4.2.3). calibration: one "
        "from a measurement, evaluated with full_covariance; values are then its own, the group \"readings\" is its "
        "own covariance (noise, and set-ups that were solved for), and what the inputs of the virtual calibrations "
        "(same plan, head and evaluation) contribute is added; their reading noise is not. Raises InvalidArgument for "
        "a calibration of other parameters or nodes, and where a deviation leaves the evaluation without a result.");
}

static void bind_propagation(py::module_& m) {
    bind_propagated(m);
    bind_propagate(m);
}

// --- validation ---

static void bind_validation(py::module_& m) {
    const auto vector = [](auto member) {
        return [member](const Validation& v) { return to_numpy_vector(v.*member); };
    };
    bind_record(
        m, "Validation",
        "Propagation beside the Monte Carlo method (JCGM 101, 8), arrays in the order of `outputs`, native units: "
        "validated where neither end of y -+ U is further than delta from that of the symmetric coverage interval.",
        field("outputs", &Validation::outputs, "With name, position (mm) and unit."),
        field("coverage", &Validation::coverage, "Of the intervals."),
        field("digits", &Validation::digits, "Significant digits of u that the tolerance comes from."),
        field("validated", &Validation::validated),
        field("reason", &Validation::reason,
              "Where it is not validated, why: which square or distribution, with figures; empty elsewhere."))
        .def_property_readonly("delta", vector(&Validation::delta),
                               "(m,) half a unit of the last significant digit of u.")
        .def_property_readonly("low", vector(&Validation::low), "(m,) y - U")
        .def_property_readonly("high", vector(&Validation::high), "(m,) y + U")
        .def_property_readonly("d_low", vector(&Validation::d_low), "(m,) |y - U - y_low|")
        .def_property_readonly("d_high", vector(&Validation::d_high), "(m,) |y + U - y_high|")
        .def_property_readonly("sampling", vector(&Validation::sampling),
                               "(m,) standard uncertainty of the Monte Carlo interval's ends by the number of samples; "
                               "should be small beside delta.")
        .def_property_readonly("failures", &Validation::failures, "How many outputs are not validated.");

    m.def(
        "compare",
        [](const Propagation& propagation, const MonteCarloResult& monte_carlo,
           const std::optional<IntegerLike>& digits) {
            return digits ? compare(propagation, monte_carlo, to_int(*digits, "digits"))
                          : compare(propagation, monte_carlo);
        },
        py::arg("propagation"), py::arg("monte_carlo"), py::kw_only(), py::arg("digits") = std::nullopt,
        "Validates propagation by the Monte Carlo method at the coverage probability of the latter; digits of u that "
        "matter, 1 to 3 (none: those of the Monte Carlo result). Raises InvalidArgument for results of other outputs.");
}

void bind_uncertainty(py::module_& m) {
    bind_uncertain_inputs(m);
    bind_derived(m);
    bind_virtual_calibration(m);
    bind_propagation(m);
    bind_validation(m);
}

}  // namespace stepdiag::bindings
