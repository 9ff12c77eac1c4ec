#include <algorithm>
#include <cmath>
#include <utility>

#include "options.hpp"
#include "stepdiag/adjustment/fit_quality.hpp"
#include "stepdiag/adjustment/line_information.hpp"
#include "stepdiag/evaluation/thresholds.hpp"
#include "struct_table.hpp"

namespace stepdiag::bindings {
namespace {

// None, "free", "fixed" or a standard uncertainty.
class PriorLike : public py::object {
    PYBIND11_OBJECT_DEFAULT(PriorLike, py::object, PyObject_Type)
};

std::optional<PriorUncertainty> to_prior(const PriorLike& prior, const std::string& quantity) {
    if (prior.is_none()) return std::nullopt;
    if (py::isinstance<py::str>(prior)) {
        const auto text = prior.cast<std::string>();
        if (text == "free") return free_unknown;
        if (text == "fixed") return fixed_unknown;
    } else if (PyNumber_Check(prior.ptr()) && !PyBool_Check(prior.ptr())) {
        const double number = py::float_(prior).cast<double>();
        if (std::isfinite(number) && number > 0.0) return number;
    }
    throw InvalidArgument(quantity + ": expected None, \"free\", \"fixed\" or a positive standard uncertainty, got " +
                          std::string(py::repr(prior)));
}

struct Outlier {
    std::size_t row;
    int run;
    std::string line;
    int point;
    std::string channel;
    double residual;
    double normalised;
    int number;
};

// In Python, an adjustment knows the rows of its run.
struct AdjustmentOfRun : Adjustment {
    std::vector<Station> stations;

    template <typename Value>
    py::dict by_channel(double missing, const Value& value) const {
        py::dict channels;
        for (const ReadingResidual& residual : residuals) {
            const py::str name(residual.channel);
            if (!channels.contains(name)) {
                py::array_t<double> empty(py::ssize_t(stations.size()));
                std::fill_n(empty.mutable_data(), stations.size(), missing);
                channels[name] = empty;
            }
            channels[name].cast<py::array_t<double>>().mutable_data()[residual.row] = value(residual);
        }
        return channels;
    }
};

using ChannelArrays = py::typing::Dict<py::str, DoubleArray>;

void bind_thresholds(py::module_& m) {
    bind_record(
        m, "Thresholds",
        "Every limit that a verdict, or the search for faults and mistakes, is made with. "
        "thresholds has the values in force.",
        field("largest_noise_factor", &Thresholds::largest_noise_factor, "Beyond it a fit is rejected."),
        field("misfit_rejected", &Thresholds::misfit_rejected,
              "Probability of a misfit below which a fit is rejected, where the misfit also differs between lines, "
              "channels "
              "or times."),
        field("misfit_doubtful", &Thresholds::misfit_doubtful,
              "Probability of a misfit below which a fit is doubtful."),
        field("noise_component", &Thresholds::noise_component,
              "Probability below which the scatter of a channel is taken for its noise."),
        field("widest_component", &Thresholds::widest_component,
              "Largest relative standard uncertainty of a noise factor that is used."),
        field("no_misfit_doubtful", &Thresholds::no_misfit_doubtful,
              "The same above which there is less noise than stated."),
        field("pattern", &Thresholds::pattern,
              "Probability of a pattern of residuals, where chi-square finds a misfit."),
        field("pattern_alone", &Thresholds::pattern_alone, "The same, where it finds none."),
        field("rounding_alone", &Thresholds::rounding_alone, "Rms of residuals in units of their rounding."),
        field("far_below_stated", &Thresholds::far_below_stated,
              "Noise factor below which such residuals are no noise."),
        field("farthest_prior", &Thresholds::farthest_prior,
              "Distance of a set-up value from its prior, in sqrt(u_prior^2 - u^2), beyond which a fit is rejected."),
        field("prior_scatter_rejected", &Thresholds::prior_scatter_rejected,
              "Probability of set-up values that scatter more than their priors, below which a fit is rejected."),
        field("fault", &Thresholds::fault, "Least gain of a fault in chi-square."),
        field("most_faults", &Thresholds::most_faults, "Of a channel, by its redundancy; one in any case."),
        field("fault_cost", &Thresholds::fault_cost,
              "How many times as large uncertainties what was done about faults may make the largest of a family."),
        field("alternative", &Thresholds::alternative, "What is less behind the best fault or mistake may be it."),
        field("second_order", &Thresholds::second_order, "Gain from which second order may distinguish faults."),
        field("gross_scatter", &Thresholds::gross_scatter, "Of the square sum a reading: values far from any machine."),
        field("mistake", &Thresholds::mistake, "Least gain of a mistake in the whole run."),
        field("chance", &Thresholds::chance,
              "Difference in chi-square that does not make one mistake better than another."),
        field("faults_of_mistake", &Thresholds::faults_of_mistake,
              "Number of faults from which one mistake that explains as much is the likelier."),
        field("lines_of_mistake", &Thresholds::lines_of_mistake, "The same of lines that have faults."),
        field("found_with_99_percent", &Thresholds::found_with_99_percent,
              "Size of a fault, in its standard uncertainties, that is found with a probability of 99 %."))
        .def_property_readonly("largest_variance_factor", &Thresholds::largest_variance_factor,
                               "Square of largest_noise_factor.");
    m.attr("thresholds") = thresholds;
}

PriorLike none() { return py::reinterpret_borrow<PriorLike>(py::none()); }

}  // namespace
}  // namespace stepdiag::bindings

namespace pybind11::detail {
template <>
struct handle_type_name<stepdiag::bindings::PriorLike> {
    static constexpr auto name = const_name("float | str | None");
};
}  // namespace pybind11::detail

namespace stepdiag::bindings {

template <>
Slips parsed<Slips>(const std::string& word) {
    for (const Slips choice : {Slips::report, Slips::estimate})
        if (word == name(choice)) return choice;
    throw InvalidArgument("adjustment slips: expected \"report\" or \"estimate\", got \"" + word + "\"");
}

// In Python, SetupPriors are what constructors made: an object of their own.
template <>
struct InPython<SetupPriors> {
    static constexpr bool is_plain = false;
    using Argument = Priors;
    static const SetupPriors& from(const Priors& given, const char*) { return given.value; }
    static Priors of(const SetupPriors& value) { return {value}; }
    static Priors usual(const SetupPriors& value) { return {value}; }
};
template <>
struct InPython<std::map<std::string, SetupPriors>> {
    static constexpr bool is_plain = false;
    using Argument = std::map<std::string, Priors>;
    static std::map<std::string, SetupPriors> from(const Argument& given, const char*) {
        std::map<std::string, SetupPriors> by_line;
        for (const auto& [line, priors] : given) by_line[line] = priors.value;
        return by_line;
    }
    static Argument of(const std::map<std::string, SetupPriors>& value) {
        Argument by_line;
        for (const auto& [line, priors] : value) by_line[line] = {priors};
        return by_line;
    }
    static Argument usual(const std::map<std::string, SetupPriors>& value) { return of(value); }
};

namespace {

// One keyword for each unknown, with its name in the table.
template <std::size_t... quantity>
void bind_priors(py::module_& m, std::index_sequence<quantity...>) {
    py::class_<Priors>(m, "SetupPriors",
                       "How each unknown of a line's set-up is taken: \"free\", \"fixed\" at 0, or the standard "
                       "uncertainty with which it is known to be 0 (rad, mm, 1 for gain, mm/s for drift); None: the "
                       "default.")
        .def(py::init([](const decltype(quantity, PriorLike())&... given) {
                 return Priors{{to_prior(given, name(SetupQuantity(quantity)))...}};
             }),
             py::kw_only(), (py::arg(setup_quantities[quantity].name.data()) = none())..., "Raises InvalidArgument.");
}

void bind_adjustment_options(py::module_& m) {
    bind_priors(m, std::make_index_sequence<adjusted_quantity_count>());

    bind_options<Smoothness>(
        m, "Smoothness",
        "Standard deviations with which second differences of neighbouring nodes are known to be 0; 0: no such "
        "knowledge.",
        nullptr, field("translation", &Smoothness::translation, "mm"), field("rotation", &Smoothness::rotation, "rad"),
        field("cross_validated", &Smoothness::cross_validated, "They are found for each function, not below these."));

    bind_options<MachineDrift, 1>(
        m, "MachineDrift",
        "A drift of the functional point along the axes that is no expansion of scales, in proportion to a record "
        "since "
        "the run's first reading: its rates are unknowns. adjust() checks it.",
        nullptr,
        required("standard_uncertainty", &MachineDrift::standard_uncertainty,
                 "(3,) of the rates along X, Y, Z about 0, mm/s, or mm/K with a temperature; 0: no drift"),
        field("record", &MachineDrift::record,
              "\"time\", or the channel of a temperature: \"temperature\", \"temperature_x\", ..., "
              "\"air_temperature\"."));

    bind_options<AdjustmentOptions>(
        m, "AdjustmentOptions", "What adjust() takes for known and unknown, and checks.", nullptr,
        field("uncertainty", &AdjustmentOptions::uncertainty, "Of readings where the run states none."),
        field("setup", &AdjustmentOptions::setup, "How the set-up of all lines is known."),
        field("setup_by_line", &AdjustmentOptions::setup_by_line,
              "Line -> SetupPriors that replace the quantities that they name."),
        field("one_setup_per_line", &AdjustmentOptions::one_setup_per_line, "All runs of a line share its set-up."),
        field("reversal", &AdjustmentOptions::reversal,
              "Tables of their own for nodes that are approached in - direction."),
        field("rotations", &AdjustmentOptions::rotations, "False: the machine has no angular errors."),
        field("smoothness", &AdjustmentOptions::smoothness, "None: errors of neighbouring nodes are independent."),
        field("outlier_probability", &AdjustmentOptions::outlier_probability,
              "Of a false alarm among a thousand tests for faults; 0: faults are named and not corrected."),
        field("slips", &AdjustmentOptions::slips,
              "\"report\" rejects a run with a slip, \"estimate\" makes it an unknown and accepts that."),
        field("scale_uncertainty", &AdjustmentOptions::scale_uncertainty,
              "Where the variance factor is above 1, its root multiplies all stated uncertainties, and the fit is "
              "doubtful at best."),
        field("full_covariance", &AdjustmentOptions::full_covariance,
              "Whether the calibration has the covariance of all its entries."),
        field("plausible", &AdjustmentOptions::plausible, "What a machine can be."),
        field("expansion", &AdjustmentOptions::expansion,
              "Of the scales; coefficients that are uncertain are unknowns."),
        field("machine_drift", &AdjustmentOptions::machine_drift, "Its rates are unknowns."),
        field("reliability", &AdjustmentOptions::reliability, "Also which faults the readings control."),
        field("search_faults", &AdjustmentOptions::search_faults,
              "False: it is known already what is wrong with the run as a whole. Faults are not looked for; where the "
              "minimum is not reached soon, values are those that were, and rejected."),
        field("distance_scale_uncertainty", &AdjustmentOptions::distance_scale_uncertainty,
              "Relative standard uncertainty of all distances in common, by the instrument's scale; it counts in the "
              "uncertainties only."),
        field("air_index_uncertainty", &AdjustmentOptions::air_index_uncertainty, "The same, by the index of the air."),
        field("variance_components", &AdjustmentOptions::variance_components,
              "Estimates how much each channel scatters, and takes that for its noise where it is more than is "
              "stated."));
}

void bind_estimates(py::module_& m) {
    bind_record(
        m, "SetupEstimate", "One unknown of a line's set-up as it was found; rad, mm, 1, mm/s.",
        field("run", &SetupEstimate::run, "The first run that has this set-up."),
        field("line", &SetupEstimate::line, "Such as \"ppp\"."),
        field("quantity", &SetupEstimate::quantity, "\"reflector\", \"laser\", ..."),
        field("component", &SetupEstimate::component, "0 or 1 of pairs; of beam_constants 1 for d2, ..."),
        field("value", &SetupEstimate::value, "None where it is not determined."),
        field("standard_uncertainty", &SetupEstimate::standard_uncertainty, "In the unit of the value."),
        field("prior", &SetupEstimate::prior,
              "Standard uncertainty of its prior; infinite where it is free (1 m, 1 rad, 1 for a free lateral offset, "
              "roll, gain)."));

    bind_record(m, "ExpansionEstimate", "An expansion coefficient as it was found, 1/K.",
                field("axes", &ExpansionEstimate::axes, "That have it in common: 0, 1, 2 of X, Y, Z."),
                field("value", &ExpansionEstimate::value, "1/K"),
                field("standard_uncertainty", &ExpansionEstimate::standard_uncertainty, "1/K"),
                field("stated", &ExpansionEstimate::stated, "Value of its prior."),
                field("prior", &ExpansionEstimate::prior, "Standard uncertainty of its prior."));

    bind_record(
        m, "RoundedChannel",
        "What took the place of a channel's stated uncertainties, which were too small; mm or "
        "rad.",
        field("channel", &RoundedChannel::channel, "\"distance\", ..."),
        field("stated", &RoundedChannel::stated, "Standard uncertainty."),
        field("used", &RoundedChannel::used, "Standard uncertainty in its place."),
        field("step", &RoundedChannel::step, "Of the decimals; 0: more of them than count."),
        field(
            "cause", &RoundedChannel::cause,
            "\"doubles\": rounding of numbers; \"decimals\": of the file; \"weights\": tilts or the laser are known so "
            "much worse that double precision could not weigh both."));

    bind_record(m, "DriftEstimate", "A rate of the machine's drift as it was found, mm/s or mm/K.",
                field("axis", &DriftEstimate::axis, "0, 1, 2 of X, Y, Z."),
                field("value", &DriftEstimate::value, "mm/s"),
                field("standard_uncertainty", &DriftEstimate::standard_uncertainty, "mm/s"),
                field("prior", &DriftEstimate::prior, "Standard uncertainty of its prior."));

    bind_record(
        m, "VarianceComponent", "How much the readings of a channel scatter, as their residuals tell it.",
        field("standard_uncertainty", &VarianceComponent::standard_uncertainty, "Of the factor."),
        field("used", &VarianceComponent::used, "Stated uncertainties were multiplied by it; otherwise they stayed."))
        .def_property_readonly(
            "channel", [](const VarianceComponent& c) { return c.noise.channel; },
            "\"distance\" (of beams, too), \"alpha\", ...")
        .def_property_readonly(
            "line", [](const VarianceComponent& c) { return c.noise.line; },
            "Of a line that scatters unlike the channel's others; empty: all others.")
        .def_property_readonly(
            "factor", [](const VarianceComponent& c) { return c.noise.factor; },
            "Root of the component: times the noise that is stated.");
}

void bind_faults(py::module_& m) {
    bind_record(
        m, "Outlier", "A reading that was left out.", field("row", &Outlier::row, "Row of the measurement, from 0."),
        field("run", &Outlier::run, "Of the line, from 0."), field("line", &Outlier::line, "Such as \"ppp\"."),
        field("point", &Outlier::point, "On the line, from 0."),
        field("channel", &Outlier::channel, "\"distance\", ..."), field("residual", &Outlier::residual, "mm or rad"),
        field("normalised", &Outlier::normalised, "In its standard uncertainties."),
        field("number", &Outlier::number, "Of its class in Adjustment.faults, from 1."));

    bind_record(
        m, "Fault", "A fault that explains the readings, if it is the one.",
        field("kind", &Fault::kind,
              "\"reading\", \"slip\": an offset of its channel from this reading on, or \"factor\": distances of its "
              "line "
              "too long by a part of the travel."),
        field("row", &Fault::row, "Row of the measurement, from 0."), field("run", &Fault::run, "Of the line, from 0."),
        field("line", &Fault::line, "Such as \"ppp\"."), field("point", &Fault::point, "On the line, from 0."),
        field("channel", &Fault::channel, "\"distance\", ..."),
        field("size", &Fault::size, "Error of the reading, mm or rad."),
        field("standard_uncertainty", &Fault::standard_uncertainty, "Of the size."),
        field("chi_square_gain", &Fault::chi_square_gain, "How much chi-square falls without it."));
    bind_record(
        m, "FaultClass", "Faults of which the readings do not tell which one happened.",
        field("members", &FaultClass::members, "The best first."),
        field("treatment", &FaultClass::treatment,
              "\"left_out\": all readings that may be the wrong one; \"estimated\": their sizes are unknowns, which "
              "share "
              "the fault between them, so that the spread of the alternatives is in the uncertainties; \"none\"."),
        field("corrected", &FaultClass::corrected, "Whether the verdict is that of the fit after its treatment."),
        field("widest", &FaultClass::widest,
              "The parameter that estimated alternatives differ in most; empty where there are none."),
        field("spread", &FaultClass::spread, "By how much they differ in it, mm or rad."),
        field("plausible", &FaultClass::plausible, "The plausible limit of that parameter."))
        .def_property_readonly("distinguished", &FaultClass::is_distinguished,
                               "Whether the readings determine which one it was.");
}

void bind_verdict(py::module_& m) {
    bind_record(
        m, "FitReason", "Why a fit is not accepted, or what its residuals have in common.",
        field(
            "finding", &FitReason::finding,
            "\"no_redundancy\"; \"no_noise\": rms of the residuals in units of their rounding; \"noise_factor\", "
            "\"misfit\", \"no_misfit\": root of the variance factor, or the noise factor of `channel` on `line`, not "
            "credible, or larger or smaller than chance explains; \"uneven_misfit\": noise factor of one group of "
            "readings, and as the limit that of the others; \"trend\": what residuals of one channel run by, from the "
            "first reading to the last (mm or rad); "
            "\"prior\": distance of a set-up value from its prior, in sqrt(u_prior^2 - u^2); \"fault\": what "
            "a fault that was not corrected takes off chi-square; \"fault_cost\": what the uncertainty of `parameter` "
            "is multiplied by because of corrected faults; \"undetermined\": they leave `parameter` undetermined; "
            "\"alternatives\": by how much alternative faults differ in `parameter`; \"scaled\": what the "
            "uncertainties were multiplied by; \"mistake\": `parameter` "
            "says which one would explain the readings; \"implausible_input\": `parameter` says what no workshop "
            "has."),
        field("value", &FitReason::value, "Of a trend mm or rad."),
        field("limit", &FitReason::limit,
              "Of an uneven misfit the value of the other readings; of noise, trends and scatter what is expected."),
        field("standard_uncertainty", &FitReason::standard_uncertainty,
              "Of the value of a misfit, no_misfit, trend, scaled; else 0."),
        field("line", &FitReason::line, "Of an uneven misfit, a trend or a prior; empty: all."),
        field("channel", &FitReason::channel,
              "Of an uneven misfit or a trend; empty: all. Of a prior or prior_scatter the set-up quantity."),
        field("component", &FitReason::component, "Of a prior: as of SetupEstimate."),
        field("fault", &FitReason::fault, "Of a fault or alternatives: its class, from 1; else 0."),
        field("parameter", &FitReason::parameter,
              "Of alternatives; of a mistake or an input its sentence; else empty."),
        field("run", &FitReason::run, "Of an uneven misfit: the run; -1: all."),
        field("aspect", &FitReason::aspect,
              "Of an uneven misfit \"second_half\" of the run or \"far_half\" of the lines; of a trend what it runs "
              "with: \"time\" (the order of the rows, where there is no time), \"position\" along the line, "
              "\"time_or_position\", which are alike in this run; else empty."),
        field("alternative", &FitReason::alternative,
              "Of a trend: it is there instead of the one before; the readings do not tell which."));
    bind_record(m, "Verdict",
                "Whether the readings of an adjustment agree with each other, with their uncertainties and with "
                "the priors. It does not see what the parameters absorb: a wrong wavelength, tool or place of b in the "
                "chain.",
                field("fit", &Verdict::fit, "\"accepted\", \"doubtful\", \"rejected\" or \"unchecked\"."),
                field("reasons", &Verdict::reasons, "A FitReason for each; empty of an accepted fit without remarks."));

    bind_record(m, "KnownCombination",
                "A sum of unknowns that are not determined one by one: of slopes of positioning "
                "errors and straightnesses, or of two unknowns of one set-up.",
                field("component", &KnownCombination::component, "Of a set-up: as in SetupEstimate."),
                field("run", &KnownCombination::run, "Of a set-up: the first run that has it."),
                field("line", &KnownCombination::line, "Of a set-up; empty for slopes."),
                field("value", &KnownCombination::value, "rad; of slopes mm/mm."),
                field("standard_uncertainty", &KnownCombination::standard_uncertainty, "rad; of slopes mm/mm."))
        .def_property_readonly(
            "terms",
            [](const KnownCombination& c) {
                std::vector<std::pair<double, std::string>> terms;
                for (const auto& term : c.terms) terms.emplace_back(term.weight, term.parameter);
                return terms;
            },
            "(weight, parameter) each; of a set-up its quantities, as in SetupEstimate.");
}

void bind_fault_control(py::module_& m) {
    const auto by_family = [](double FaultControl::Effect::* effect) {
        return [effect](const FaultControl& c) {
            return std::map<std::string, double>{{"positioning", c.positioning.*effect},
                                                 {"straightness", c.straightness.*effect},
                                                 {"angle", c.angle.*effect},
                                                 {"squareness", c.squareness.*effect}};
        };
    };
    bind_record(
        m, "FaultControl",
        "Which faults of one kind the readings control (reliability, W. Baarda 1968). One is found "
        "with a probability of 99 % where it is 7.6 times as large as the standard uncertainty of "
        "its size, and distinguished from another one where that makes chi-square larger by 25. Twins are "
        "not distinguished at any size: their effects have a correlation of 0.999 and more, but the calibration "
        "differs.",
        field(
            "kind", &FaultControl::kind,
            "\"reading\", \"slip\": an offset of its channel from a reading on, or \"factor\" on a line's distances."),
        field("channel", &FaultControl::channel, "\"distance\", \"tilt\" or \"spot\"."),
        field("count", &FaultControl::count, "Of controlled faults, one a place (of long runs: evenly spaced)."),
        field("uncontrolled", &FaultControl::uncontrolled, "More of them, which no other reading controls."),
        field("twins", &FaultControl::twins, "Those of `count` that have a twin."),
        field("found_from", &FaultControl::found_from, "All of `count` are found from here on; mm or rad."),
        field("distinguished_from", &FaultControl::distinguished_from,
              "Those without a twin are distinguished from all others from this size on; mm or rad."))
        .def_property_readonly("hidden", by_family(&FaultControl::Effect::hidden),
                               "Kind of parameter -> largest effect of a fault just not found, mm or rad; infinite: of "
                               "one that nothing controls.")
        .def_property_readonly("shared", by_family(&FaultControl::Effect::shared),
                               "Kind of parameter -> by how much it differs, by the size of a fault, if its twin was "
                               "it; in mm or rad each.");

    bind_record(
        m, "UnseenFault",
        "What the faults of one kind may do to a calibration without being seen, one at a time: the worst of them.",
        field("kind", &UnseenFault::kind, "As of FaultControl."),
        field("channel", &UnseenFault::channel, "\"distance\", \"tilt\" or \"spot\"."),
        field("size", &UnseenFault::size,
              "From here on all that are controlled are found with 99 %; mm or rad; 0: none is controlled."),
        field("controlled", &UnseenFault::controlled, "Whether all are; otherwise some may have any size."))
        .def_property_readonly(
            "hidden",
            [](const UnseenFault& f) {
                return std::map<std::string, double>{{"positioning", f.positioning},
                                                     {"straightness", f.straightness},
                                                     {"angle", f.angle},
                                                     {"squareness", f.squareness}};
            },
            "Kind of parameter -> largest effect of a fault just not found, mm or rad; infinite: of one that nothing "
            "controls.");
}

std::vector<Outlier> outliers_of(const AdjustmentOfRun& found) {
    std::vector<Outlier> list;
    for (const ReadingResidual& x : found.residuals) {
        if (x.used()) continue;
        const Station& s = found.stations[x.row];
        list.push_back({x.row, s.run, s.line.name(), s.point, x.channel, x.residual, x.normalised, x.outlier});
    }
    std::stable_sort(list.begin(), list.end(), [](const Outlier& a, const Outlier& b) { return a.number < b.number; });
    return list;
}

void bind_adjustment_of_run(py::module_& m) {
    using Result = AdjustmentOfRun;
    const auto by_reading = [](double ReadingResidual::* value) {
        return [value](const Result& r) -> ChannelArrays {
            return r.by_channel(NAN, [value](const ReadingResidual& x) { return x.*value; });
        };
    };
    add_properties(
        py::class_<Result>(m, "Adjustment",
                           "What an adjustment found: calibration, set-ups, and how the readings fit."),
        field("calibration", &Adjustment::calibration, "With fit and variance factor."),
        field("setup", &Adjustment::setup, "A SetupEstimate for each set-up unknown."),
        field("expansion", &Adjustment::expansion, "Expansion coefficients that were unknowns."),
        field("variance_components", &Adjustment::variance_components,
              "VarianceComponent of each channel, and of its lines that scatter otherwise; of what others control."),
        field("rounded", &Adjustment::rounded,
              "Channels of which the stated uncertainties are below what their numbers, or double precision, can bear; "
              "that took their place."),
        field("machine_drift", &Adjustment::machine_drift, "Rates of the machine's drift that were unknowns."),
        field("faults", &Adjustment::faults, "Classes of faults that were found, and what was done about them."),
        field("reliability", &Adjustment::reliability, "If it was asked for."),
        field("unseen", &Adjustment::unseen, "By kind of fault, what may be in it unseen."),
        field("verdict", &Adjustment::verdict, "Whether the readings agree with each other and with the priors."),
        field("weighted_square_sum", &Adjustment::weighted_square_sum, "Of residuals and priors."),
        field("degrees_of_freedom", &Adjustment::degrees_of_freedom, "Readings and priors more than unknowns."),
        field("chi_square_probability", &Adjustment::chi_square_probability,
              "Of a larger square sum, if model and uncertainties are right."),
        field("iterations", &Adjustment::iterations, "Gauss-Newton steps from zero."),
        field("combinations", &Adjustment::combinations,
              "What is known of unknowns that are not determined one by one."))
        .def_property_readonly("variance_factor", &Adjustment::variance_factor,
                               "weighted_square_sum/degrees_of_freedom; 1 without freedom.")
        .def_property_readonly(
            "residuals", by_reading(&ReadingResidual::residual),
            "channel -> (n,) read minus adjusted, mm or rad, by row of the measurement; NaN where nothing was read.")
        .def_property_readonly(
            "redundancy", by_reading(&ReadingResidual::redundancy),
            "channel -> (n,): 0 where nothing controls a reading, 1 where all others know it better.")
        .def_property_readonly("normalised_residuals", by_reading(&ReadingResidual::normalised),
                               "channel -> (n,): residuals by their own standard uncertainty.")
        .def_property_readonly(
            "used",
            [](const Result& r) {
                py::dict used = r.by_channel(0.0, [](const ReadingResidual& x) { return x.used() ? 1.0 : 0.0; });
                for (const auto& item : used) used[item.first] = item.second.attr("astype")("bool");
                return py::typing::Dict<py::str, py::array_t<bool>>(used);
            },
            "channel -> (n,) whether a reading was used: it was there, and is no outlier.")
        .def_property_readonly("outliers", &outliers_of, "Readings that were left out.")
        .def_property_readonly(
            "smoothness",
            [](const Result& r) {
                std::map<std::string, double> deviations;
                for (int i = 0; i < function_count; ++i)
                    if (r.smoothness[i] > 0.0) deviations[FunctionId::at(i).name()] = r.smoothness[i];
                return deviations;
            },
            "function -> standard deviation of its second differences (mm or rad) in force.")
        .def(
            "with_calibration",
            [](Result found, const Calibration& calibration) {
                found.calibration = calibration;
                return found;
            },
            py::arg("calibration"), "The same, with this calibration: its own, with more words.");
}

AdjustmentOfRun adjust_run(const Measurement& measurement, const Plan& plan, const HeadLike& head,
                           const ChainLike& chain, const ArrayLike& tool, const std::optional<AdjustmentOptions>& given,
                           const Fields& fields) {
    const AdjustmentOptions options = options_of(given, fields);
    const Eigen::Vector3d offset = to_vector3(tool, "tool");
    const Chain kinematics = to_chain(chain);
    const HeadCalibrations heads = to_heads(head, plan).calibration();
    const auto result = [&] {
        const py::gil_scoped_release release;
        return adjust(measurement, plan, kinematics, offset, heads, options);
    };
    return {result(), measurement.stations()};
}

std::optional<FitQuality> fit_quality_of_run(const Measurement& measurement, const Plan& plan, const HeadLike& head,
                                             const ChainLike& chain, const ArrayLike& tool,
                                             const AdjustmentOptions& options, int most_steps) {
    const Eigen::Vector3d offset = to_vector3(tool, "tool");
    const Chain kinematics = to_chain(chain);
    const HeadCalibrations heads = to_heads(head, plan).calibration();
    const py::gil_scoped_release release;
    return fit_quality(measurement, plan, kinematics, offset, heads, options, most_steps);
}

std::string parameter_name(int i) {
    return i < function_count ? FunctionId::at(i).name() : name(Squareness(i - function_count));
}

void bind_line_information(py::module_& m) {
    bind_record(m, "KnownByLines", "What the adjustment of a run of some lines would know.",
                field("volume", &KnownByLines::volume,
                      "(grid^3,) variances of the functional point's error, summed over X, Y and Z, mm^2, at commanded "
                      "positions, Z changing fastest; NaN where something that acts there is not determined."))
        .def_property_readonly(
            "largest",
            [](const KnownByLines& known) {
                std::map<std::string, double> largest;
                for (int i = 0; i < KnownByLines::parameters; ++i)
                    if (!std::isnan(known.largest[i])) largest[parameter_name(i)] = known.largest[i];
                return largest;
            },
            "parameter -> largest standard uncertainty of its values, mm or rad.")
        .def_property_readonly(
            "determined",
            [](const KnownByLines& known) {
                std::vector<std::string> names;
                for (int i = 0; i < KnownByLines::parameters; ++i)
                    if (known.whole[i]) names.push_back(parameter_name(i));
                return names;
            },
            "Parameters that are determined as a whole.");
    m.def(
        "known_by_run",
        [](const Measurement& measurement, const Plan& plan, const HeadLike& head, const ChainLike& chain,
           const ArrayLike& tool, const AdjustmentOptions& options, int grid) {
            return known_by_run(measurement, plan, to_chain(chain), to_vector3(tool, "tool"),
                                to_heads(head, plan).calibration(), options, grid);
        },
        py::arg("measurement"), py::arg("plan"), py::arg("head"), py::arg("chain"), py::arg("tool"), py::arg("options"),
        py::kw_only(), py::arg("grid"),
        "What adjust() knows by a run without noise (KnownByLines), without its tests of the readings. Raises "
        "InvalidArgument as LineInformation does, and where nothing is determined.");
    py::class_<LineInformation>(
        m, "LineInformation",
        "What each line of a run tells of a machine, for comparing thousands of choices of lines with the same "
        "settings: known_by() of some of them gives the uncertainties of adjust() within a hundredth or so, in a "
        "small part of its time.")
        .def(py::init([](const Measurement& measurement, const Plan& plan, const HeadLike& head, const ChainLike& chain,
                         const ArrayLike& tool, const AdjustmentOptions& options, int grid) {
                 return LineInformation(measurement, plan, to_chain(chain), to_vector3(tool, "tool"),
                                        to_heads(head, plan).calibration(), options, grid);
             }),
             py::arg("measurement"), py::arg("plan"), py::arg("head"), py::arg("chain"), py::arg("tool"),
             py::arg("options"), py::kw_only(), py::arg("grid"),
             "Of a run without noise, in which lines visit every node that any line visits. grid: positions of each "
             "axis "
             "in the grid of KnownByLines. Raises InvalidArgument.")
        .def(
            "add",
            [](LineInformation& lines, const Measurement& measurement, const Plan& plan, const HeadLike& head,
               const AdjustmentOptions& options) {
                lines.add(measurement, plan, to_heads(head, plan).calibration(), options);
            },
            py::arg("measurement"), py::arg("plan"), py::arg("head"), py::arg("options"),
            "Lines of another run of as many steps, but for those that there are already. Raises InvalidArgument.")
        .def(
            "known_by",
            [](LineInformation& lines, const std::vector<std::string>& chosen,
               const std::vector<std::string>& scale_lines) {
                std::vector<ChosenLine> all;
                for (const std::string& line : chosen) all.push_back({line, false});
                for (const std::string& line : scale_lines) all.push_back({line, true});
                return lines.known_by(all);
            },
            py::arg("lines"), py::arg("scale_lines"), "Raises InvalidArgument for a line that no run has.");
}

}  // namespace

void bind_adjustment(py::module_& m) {
    bind_thresholds(m);
    bind_adjustment_options(m);
    bind_estimates(m);
    bind_faults(m);
    bind_verdict(m);
    bind_fault_control(m);
    bind_adjustment_of_run(m);
    bind_line_information(m);
    m.def("adjust", &adjust_run, py::arg("measurement"), py::arg("plan"), py::arg("head"), py::arg("chain"),
          py::arg("tool") = zeros(3), py::arg("options") = std::nullopt,
          "The exact adjustment of all readings of a run, with the set-up of every line among the unknowns. "
          "The options are AdjustmentOptions, or its fields by name. Findings are data; methods.adjust gives them in "
          "words, too. Raises InvalidArgument.");
    m.def(
        "judge",
        [](AdjustmentOfRun found, const std::string& mistake, const std::vector<std::string>& implausible_inputs) {
            static_cast<Adjustment&>(found) = judge(found, {mistake, implausible_inputs});
            return found;
        },
        py::arg("adjustment"), py::kw_only(), py::arg("mistake") = "",
        py::arg("implausible_inputs") = std::vector<std::string>{},
        "The same, rejected where a mistake would explain the readings; at best doubtful where there are inputs that "
        "no workshop has, a sentence each.");
    bind_record(m, "FitQuality", "How well a run fits, and nothing else.",
                field("weighted_square_sum", &FitQuality::weighted_square_sum),
                field("degrees_of_freedom", &FitQuality::degrees_of_freedom));
    m.def("fit_quality", &fit_quality_of_run, py::arg("measurement"), py::arg("plan"), py::arg("head"),
          py::arg("chain"), py::arg("tool"), py::arg("options"), py::arg("most_steps"),
          "How well a run fits, without search for faults and without uncertainties, in a tenth of the time of adjust: "
          "the least square sum that so many plain steps of Gauss-Newton meet; None where no number comes out. Raises "
          "InvalidArgument.");
}

}  // namespace stepdiag::bindings
