#include <memory>

#include "batch_arguments.hpp"
#include "bindings.hpp"
#include "stepdiag/uncertainty/virtual_calibration.hpp"

namespace stepdiag::bindings {
namespace {

std::uint64_t to_sample(const IntegerLike& number) {
    return std::uint64_t(to_integer(number, "sample", 0, std::int64_t(1) << 62));
}

std::unique_ptr<VirtualCalibrations> make(
    const Machine& machine, const Plan& plan, const HeadLike& heads, const UncertainInputs& inputs,
    const std::optional<HeadLike>& calibration_heads, const std::string& method, const IntegerLike& seed,
    const std::map<std::string, Misalignment>& misalignment, const std::optional<Environment>& environment,
    const std::optional<Environment>& assumed, const IntegerLike& repeats, bool backward,
    const std::optional<double>& seconds_per_reading, double verified_share, const ReadingUncertainty& uncertainty,
    const Priors& setup, const std::map<std::string, Priors>& setup_by_line, bool one_setup_per_line, bool reversal,
    bool rotations, const std::optional<Smoothness>& smoothness, const std::vector<DerivedOutput>& derived) {
    const Heads actual = to_heads(heads, plan);
    SimulationOptions simulation;
    simulation.misalignment = misalignment;
    simulation.environment = environment;
    simulation.assumed = assumed;
    simulation.repeats = to_int(repeats, "repeats");
    simulation.backward = backward;
    simulation.seconds_per_reading = seconds_per_reading;
    simulation.verified_share = verified_share;
    const VirtualRun run{
        machine,    plan,
        actual,     calibration_heads ? to_heads(*calibration_heads, plan).calibration() : actual.calibration(),
        simulation, inputs};
    const BatchOptions evaluation = to_batch_options(method, uncertainty, setup, setup_by_line, one_setup_per_line,
                                                     reversal, rotations, smoothness);
    const std::uint64_t number = to_seed(seed);
    py::gil_scoped_release release;
    return std::make_unique<VirtualCalibrations>(run, evaluation, number, derived);
}

Eigen::MatrixXd to_columns(const ArrayLike& object) {
    const DoubleArray array = DoubleArray::ensure(object);
    if (!array || array.ndim() != 2) {
        PyErr_Clear();
        throw InvalidArgument("deviations: expected an array (inputs, n)");
    }
    return Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>(
        array.data(), array.shape(0), array.shape(1));
}

}  // namespace

void bind_virtual_calibration(py::module_& m) {
    py::class_<VirtualCalibrations, SampleModel>(
        m, "VirtualCalibrations",
        "Whole virtual calibrations: a run with drawn inputs and reading noise, traced by replay and evaluated with "
        "the unperturbed calibration. Outputs are the values of the calibration's tables, then those derived.")
        .def(py::init(&make), py::arg("machine"), py::arg("plan"), py::arg("heads"), py::arg("inputs"), py::kw_only(),
             py::arg("calibration_heads") = std::nullopt, py::arg("method") = "enhanced", py::arg("seed") = integer(0),
             py::arg("misalignment") = std::map<std::string, Misalignment>{}, py::arg("environment") = std::nullopt,
             py::arg("assumed_environment") = std::nullopt, py::arg("repeats") = integer(1),
             py::arg("backward") = false, py::arg("seconds_per_reading") = std::nullopt,
             py::arg("verified_share") = SimulationOptions{}.verified_share,
             py::arg("uncertainty") = ReadingUncertainty{}, py::arg("setup") = Priors{},
             py::arg("setup_by_line") = std::map<std::string, Priors>{}, py::arg("one_setup_per_line") = false,
             py::arg("reversal") = true, py::arg("rotations") = true, py::arg("smoothness") = std::nullopt,
             py::arg("derived") = std::vector<DerivedOutput>{},
             "machine to seconds_per_reading as of simulate(); calibration_heads: what the evaluation knows the heads "
             "as (none: the heads). method: \"conventional\", \"enhanced\", \"adjustment\" or \"one_step\", whose "
             "options are uncertainty to smoothness, as of evaluate() and adjust(). verified_share: of the samples, in "
             "each of which one reading of every line is traced again. derived: as derived_at_point gives them, or "
             "(name, unit, coefficients of the "
             "values of the tables). Raises InvalidArgument.")
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
                const Eigen::MatrixXd columns = to_columns(deviations);
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

}  // namespace stepdiag::bindings
