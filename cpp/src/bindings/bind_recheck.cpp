#include <cmath>

#include "options.hpp"
#include "stepdiag/recheck/verification.hpp"

namespace stepdiag::bindings {
namespace {

// In Python, a verification knows the rows of its run.
struct VerificationOfRun {
    Verification verification;
    std::size_t rows;

    template <typename Value>
    py::typing::Dict<py::str, DoubleArray> by_channel(const Value& value) const {
        py::typing::Dict<py::str, DoubleArray> channels;
        for (const PredictedReading& reading : verification.readings) {
            const py::str name(reading.channel);
            if (!channels.contains(name)) {
                py::array_t<double> empty((py::ssize_t(rows)));
                std::fill_n(empty.mutable_data(), rows, NAN);
                channels[name] = empty;
            }
            channels[name].template cast<py::array_t<double>>().mutable_data()[reading.row] = value(reading);
        }
        return channels;
    }
};

VerificationOfRun verify_run(const Calibration& calibration, const Measurement& measurement, const Plan& plan,
                             const HeadLike& head, const ChainLike& chain, const ArrayLike& tool,
                             const std::optional<AdjustmentOptions>& given, const Fields& fields) {
    const AdjustmentOptions options = options_of(given, fields);
    const Eigen::Vector3d offset = to_vector3(tool, "tool");
    const Chain kinematics = to_chain(chain);
    const HeadCalibrations heads = to_heads(head, plan).calibration();
    const py::gil_scoped_release release;
    return {verify(calibration, measurement, plan, kinematics, offset, heads, options), measurement.size()};
}

}  // namespace

void bind_recheck(py::module_& m) {
    py::class_<LineDeviation>(m, "LineDeviation", "What a line of one run reads too much from end to end.")
        .def_readonly("run", &LineDeviation::run)
        .def_readonly("line", &LineDeviation::line)
        .def_property_readonly(
            "direction", [](const LineDeviation& d) { return d.backward ? "backward" : "forward"; },
            "\"forward\" or \"backward\".")
        .def_readonly("deviation", &LineDeviation::deviation, "Read minus predicted, mm; of beams their mean.")
        .def_readonly("standard_uncertainty", &LineDeviation::standard_uncertainty, "Of the deviation, mm.")
        .def_property_readonly("normalised", &LineDeviation::normalised,
                               "E_n: the deviation by its expanded uncertainty (k = 2).");

    using Result = VerificationOfRun;
    py::class_<Result>(m, "Verification", "How readings agree with a calibration that was made without them.")
        .def_property_readonly(
            "lines", [](const Result& r) { return to_tuple(r.verification.lines); },
            "A LineDeviation for each pass of a line that has two distances.")
        .def_property_readonly(
            "deviations",
            [](const Result& r) { return r.by_channel([](const PredictedReading& x) { return x.deviation; }); },
            "channel -> (n,) read minus predicted, mm or rad, by row of the measurement; NaN where nothing was read.")
        .def_property_readonly(
            "standard_uncertainties",
            [](const Result& r) {
                return r.by_channel([](const PredictedReading& x) { return x.standard_uncertainty; });
            },
            "channel -> (n,): of the deviations.")
        .def_property_readonly(
            "normalised",
            [](const Result& r) { return r.by_channel([](const PredictedReading& x) { return x.normalised(); }); },
            "channel -> (n,) E_n: deviations by their expanded uncertainties (k = 2); 0 for a reading that only tells "
            "how head and mirror stood.")
        .def_property_readonly("chi_square", [](const Result& r) { return r.verification.chi_square; })
        .def_property_readonly("degrees_of_freedom", [](const Result& r) { return r.verification.degrees_of_freedom; })
        .def_property_readonly(
            "probability", [](const Result& r) { return r.verification.probability; },
            "Of a larger chi-square, if calibration, readings and uncertainties are right.")
        .def_property_readonly(
            "worst",
            [](const Result& r) {
                const PredictedReading& worst = r.verification.readings[r.verification.worst];
                return std::pair(worst.row, worst.channel);
            },
            "Row and channel of the reading with the largest |E_n|.");

    m.def("verify", &verify_run, py::arg("calibration"), py::arg("measurement"), py::arg("plan"), py::arg("head"),
          py::arg("chain"), py::arg("tool") = zeros(3), py::arg("options") = std::nullopt,
          "Predicts readings from a calibration that was made without them, with uncertainty, and judges the "
          "deviations. Plan, head and options (AdjustmentOptions, or its fields by name) are those of the readings. "
          "Raises InvalidArgument, also for a calibration without covariance, of another chain, volume or tool, or "
          "without all 21 parameters.");
}

}  // namespace stepdiag::bindings
