#include <cmath>

#include "options.hpp"
#include "stepdiag/recheck/changes_seen.hpp"
#include "stepdiag/recheck/recheck.hpp"
#include "stepdiag/recheck/verification.hpp"
#include "struct_table.hpp"

namespace stepdiag::bindings {
namespace {

// In Python, a verification knows the rows of its run.
struct VerificationOfRun : Verification {
    std::size_t rows;

    template <typename Value>
    py::typing::Dict<py::str, DoubleArray> by_channel(const Value& value) const {
        py::typing::Dict<py::str, DoubleArray> channels;
        for (const PredictedReading& reading : readings) {
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

MotorShifts to_shifts(const py::handle& array) {
    const Points points = to_points(array, "sent");
    MotorShifts shifts;
    for (Eigen::Index i = 0; i < points.rows(); ++i) shifts.push_back(points.row(i).transpose());
    return shifts;
}

VerificationOfRun verify_run(const Calibration& calibration, const Measurement& measurement, const Plan& plan,
                             const HeadLike& head, const ChainLike& chain, const ArrayLike& tool,
                             const std::optional<AdjustmentOptions>& given, const std::optional<ArrayLike>& sent,
                             const Fields& fields) {
    const AdjustmentOptions options = options_of(given, fields);
    const MotorShifts shifts = sent ? to_shifts(*sent) : MotorShifts{};
    const Eigen::Vector3d offset = to_vector3(tool, "tool");
    const Chain kinematics = to_chain(chain);
    const HeadCalibrations heads = to_heads(head, plan).calibration();
    const py::gil_scoped_release release;
    return {verify(calibration, measurement, plan, kinematics, offset, heads, options, shifts), measurement.size()};
}

Recheck recheck_run(const Calibration& baseline, const Measurement& measurement, const Plan& plan, const HeadLike& head,
                    const ChainLike& chain, const ArrayLike& tool, const std::optional<AdjustmentOptions>& given,
                    const ChangePriors& priors) {
    const AdjustmentOptions options = given.value_or(AdjustmentOptions{});
    const Eigen::Vector3d offset = to_vector3(tool, "tool");
    const Chain kinematics = to_chain(chain);
    const HeadCalibrations heads = to_heads(head, plan).calibration();
    const py::gil_scoped_release release;
    return recheck(baseline, measurement, plan, kinematics, offset, heads, options, priors);
}

DoubleArray seen(const Recheck& recheck, double alpha, double power) {
    return to_numpy_vector(smallest_changes_seen(recheck, alpha, power));
}

static void bind_changes(py::module_& m) {
    bind_options<ChangePriors>(
        m, "ChangePriors",
        "Standard uncertainties with which changes of a machine are known to be 0; 0: there is none of it.", nullptr,
        field("scale", &ChangePriors::scale, "Of a positioning deviation, mm/mm."),
        field("bow", &ChangePriors::bow, "Of a straightness, in the middle of the travel, mm."),
        field("slope", &ChangePriors::slope, "Of an angle, from end to end of the travel, rad."),
        field("squareness", &ChangePriors::squareness, "rad"));
    bind_record(m, "ChangeTerm", "How a parameter of the machine has changed.",
                field("parameter", &ChangeTerm::parameter),
                field("kind", &ChangeTerm::kind,
                      "\"scale\" (mm/mm), \"bow\" (mm, in the middle), \"slope\" (rad, from end to end) or "
                      "\"squareness\" (rad)."),
                field("value", &ChangeTerm::value),
                field("standard_uncertainty", &ChangeTerm::standard_uncertainty, "With the prior."),
                field("prior", &ChangeTerm::prior, "Standard uncertainty with which it was known to be 0."),
                field("determined", &ChangeTerm::determined,
                      "How much of it the readings determine, 0 to 1: near 1 by itself; in between only in sums."));
    bind_record(m, "ChangeCombination", "A sum of changes, by their priors, that readings determine.",
                field("weight", &ChangeCombination::weight, "By term; the square sum is 1."),
                field("value", &ChangeCombination::value, "In units of the priors."),
                field("standard_uncertainty", &ChangeCombination::standard_uncertainty,
                      "Of the readings and the calibration alone."));
    bind_record(m, "PredictedReading", "A reading against what was to be read.",
                field("row", &PredictedReading::row, "Of the measurement, from 0."),
                field("channel", &PredictedReading::channel, "\"distance\", ..."),
                field("deviation", &PredictedReading::deviation, "Read minus predicted, mm or rad."),
                field("standard_uncertainty", &PredictedReading::standard_uncertainty, "Of the deviation."));
}

static void bind_recheck_of_run(py::module_& m) {
    bind_record(m, "Recheck", "Whether a machine has changed since its calibration, and by what.",
                field("chi_square", &Recheck::chi_square, "Of no change at all."),
                field("degrees_of_freedom", &Recheck::degrees_of_freedom,
                      "Directions of change that the readings tell better than the priors."),
                field("probability", &Recheck::probability, "Of a larger chi-square, if nothing has changed."),
                field("fit_chi_square", &Recheck::fit_chi_square, "Of all readings, with the change."),
                field("fit_degrees_of_freedom", &Recheck::fit_degrees_of_freedom, "Of all readings, with the change."),
                field("fit_probability", &Recheck::fit_probability,
                      "Of a larger one, if such a change, of any size, explains the readings."),
                field("covariance", &Recheck::covariance, "(n, n) of the terms."),
                field("shape", &Recheck::shape,
                      "(entries of the calibration's covariance, n): what a change of 1 of each term adds to them."),
                field("updated", &Recheck::updated, "The calibration with the change, and their joint covariance."))
        .def_property_readonly(
            "terms", [](const Recheck& r) { return to_tuple(r.terms); },
            "A ChangeTerm for each way in which the machine may change.")
        .def_property_readonly(
            "combinations", [](const Recheck& r) { return to_tuple(r.combinations); }, "The best determined first.")
        .def("smallest_changes_seen", &seen, py::kw_only(), py::arg("alpha") = 0.001, py::arg("power") = 0.95,
             "(n,) smallest change of each term, alone, that such readings show with the probability `power` if an "
             "unchanged machine is said to have changed with the probability `alpha`; inf where they tell nothing of "
             "it. Raises InvalidArgument unless 0 < alpha < power < 1.")
        .def_property_readonly(
            "left_out", [](const Recheck& r) { return to_tuple(r.left_out); },
            "A FaultClass for each fault that an adjustment of the run by itself finds, where the readings do not go "
            "with the baseline. The readings that they may have spoilt are left out of everything.")
        .def_property_readonly(
            "misfits", [](const Recheck& r) { return to_tuple(r.misfits); },
            "Where no such change explains the readings, a PredictedReading for those that are farthest from the "
            "machine with the change, the worst first.");

    m.def(
        "recheck", &recheck_run, py::arg("baseline"), py::arg("measurement"), py::arg("plan"), py::arg("head"),
        py::arg("chain"), py::arg("tool") = zeros(3), py::arg("options") = std::nullopt,
        py::arg("priors") = ChangePriors{},
        "Whether the machine has changed since its calibration `baseline`, by readings of a short run; plan, head and "
        "options (AdjustmentOptions) are those of the readings. Raises InvalidArgument as verify does.");
}

SeenChanges seen_by(ChangesSeen& changes, const std::vector<std::string>& lines,
                    const std::vector<std::string>& scale_lines, int repeats, double alpha, double power) {
    std::vector<ChosenLine> chosen;
    for (const std::string& line : lines) chosen.push_back({line, false});
    for (const std::string& line : scale_lines) chosen.push_back({line, true});
    return changes.by(chosen, repeats, alpha, power);
}

static void bind_changes_seen(py::module_& m) {
    bind_record(m, "SeenChanges", "What a recheck by some lines would know of the changes of a machine.",
                field("smallest", &SeenChanges::smallest,
                      "(n,) smallest change of each term that is seen, as Recheck.smallest_changes_seen."),
                field("covariance", &SeenChanges::covariance, "(n, n) of the terms, with their priors."));
    py::class_<ChangesSeen>(
        m, "ChangesSeen",
        "Which changes of a machine short runs would show, before anyone measures: by() of some lines gives the "
        "figures of recheck(), for many choices of lines with the same steps.")
        .def(py::init([](const Calibration& baseline, const Measurement& measurement, const Plan& plan,
                         const HeadLike& head, const ChainLike& chain, const ArrayLike& tool,
                         const AdjustmentOptions& options, const ChangePriors& priors) {
                 return ChangesSeen(baseline, measurement, plan, to_chain(chain), to_vector3(tool, "tool"),
                                    to_heads(head, plan).calibration(), options, priors);
             }),
             py::arg("baseline"), py::arg("measurement"), py::arg("plan"), py::arg("head"), py::arg("chain"),
             py::arg("tool"), py::arg("options"), py::arg("priors"),
             "Of readings without noise of a machine as the baseline has it, at temperatures that stay, each line "
             "measured once. Raises InvalidArgument as recheck.")
        .def_property_readonly(
            "terms", [](const ChangesSeen& c) { return to_tuple(c.terms()); },
            "A ChangeTerm for each way in which the machine may change; their values are not estimated.")
        .def_property_readonly(
            "shape", [](const ChangesSeen& c) { return to_numpy(c.shape()); }, "As Recheck.shape.")
        .def("by", &seen_by, py::arg("lines"), py::arg("scale_lines"), py::kw_only(), py::arg("repeats") = 1,
             py::arg("alpha") = 0.001, py::arg("power") = 0.95,
             "SeenChanges of lines of the run, measured `repeats` times. Raises InvalidArgument, also where so few "
             "readings would tell nothing of the machine.");
}

void bind_rechecking(py::module_& m) {
    bind_changes(m);
    bind_recheck_of_run(m);
    bind_changes_seen(m);
}

}  // namespace

void bind_recheck(py::module_& m) {
    bind_rechecking(m);
    bind_record(m, "LineDeviation", "Deviation of the length of a line of one run from end to end.",
                field("run", &LineDeviation::run, "Of the line, from 0."),
                field("line", &LineDeviation::line, "Such as \"ppp\"."),
                field("deviation", &LineDeviation::deviation, "Read minus predicted, mm; of beams their mean."),
                field("standard_uncertainty", &LineDeviation::standard_uncertainty, "Of the deviation, mm."))
        .def_property_readonly(
            "direction", [](const LineDeviation& d) { return d.backward ? "backward" : "forward"; },
            "\"forward\" or \"backward\".")
        .def_property_readonly("normalised", &LineDeviation::normalised,
                               "E_n: the deviation by its expanded uncertainty (k = 2).");

    using Result = VerificationOfRun;
    const auto by_reading = [](double PredictedReading::* value) {
        return
            [value](const Result& r) { return r.by_channel([value](const PredictedReading& x) { return x.*value; }); };
    };
    add_properties(
        py::class_<Result>(m, "Verification", "How readings agree with a calibration that was made without them."),
        field("chi_square", &Verification::chi_square, "Of all deviations."),
        field("degrees_of_freedom", &Verification::degrees_of_freedom, "Of chi_square."),
        field("probability", &Verification::probability,
              "Of a larger chi-square, if calibration, readings and uncertainties are right."))
        .def_property_readonly(
            "lines", [](const Result& r) { return to_tuple(r.lines); },
            "A LineDeviation for each pass of a line that has two distances.")
        .def_property_readonly(
            "deviations", by_reading(&PredictedReading::deviation),
            "channel -> (n,) read minus predicted, mm or rad, by row of the measurement; NaN where nothing was read.")
        .def_property_readonly("standard_uncertainties", by_reading(&PredictedReading::standard_uncertainty),
                               "channel -> (n,): of the deviations.")
        .def_property_readonly(
            "normalised",
            [](const Result& r) { return r.by_channel([](const PredictedReading& x) { return x.normalised(); }); },
            "channel -> (n,) E_n: deviations by their expanded uncertainties (k = 2); 0 for a reading that only shows "
            "how head and mirror stood.")
        .def_property_readonly(
            "left_out", [](const Result& r) { return to_tuple(r.left_out); },
            "A FaultClass for each fault that an adjustment of the run by itself finds, where the readings do not "
            "agree. The readings that they may have spoilt are left out of everything.")
        .def_property_readonly(
            "worst",
            [](const Result& r) {
                const PredictedReading& worst = r.readings[r.worst];
                return std::pair(worst.row, worst.channel);
            },
            "Row and channel of the reading with the largest |E_n|.");

    m.def("verify", &verify_run, py::arg("calibration"), py::arg("measurement"), py::arg("plan"), py::arg("head"),
          py::arg("chain"), py::arg("tool") = zeros(3), py::arg("options") = std::nullopt,
          py::arg("sent") = std::nullopt,
          "Predicts readings from a calibration that was made without them, with uncertainty, and judges the "
          "deviations. Plan, head and options (AdjustmentOptions, or its fields by name) are those of the readings. "
          "sent (n, 3), mm: where a table sent the motors less the commanded positions, by row of a run with a "
          "compensation in force. "
          "Raises InvalidArgument, also for a calibration without covariance, of another chain, volume or tool, or "
          "without all 21 parameters.");
}

}  // namespace stepdiag::bindings
