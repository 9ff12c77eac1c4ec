#include "options.hpp"
#include "stepdiag/simulation/simulate.hpp"
#include "stepdiag/simulation/virtual_readout.hpp"
#include "struct_table.hpp"

namespace stepdiag::bindings {
namespace {

void check_finite(const Misalignment& misalignment) {
    for (const auto& [key, pair] :
         {std::pair("reflector", misalignment.reflector), std::pair("laser", misalignment.laser),
          std::pair("psd_zero", misalignment.psd_zero), std::pair("lateral", misalignment.lateral)})
        if (!pair.allFinite())
            throw InvalidArgument("misalignment " + std::string(key) + ": expected two finite numbers");
}

}  // namespace

static void bind_simulation_options(py::module_& m) {
    bind_options<Misalignment, 5>(
        m, "Misalignment", "How head and mirror are out of true on a line.", &check_finite,
        field("reflector", &Misalignment::reflector, "(2,) angles of the mirror a, b, rad"),
        field("laser", &Misalignment::laser, "(2,) angles of the laser a, b, rad"),
        field("psd_zero", &Misalignment::psd_zero, "(2,) zero offset of the position sensing device, mm"),
        field("distance_constant", &Misalignment::distance_constant, "Constant error of all distances, mm."),
        field("beam_constants", &Misalignment::beam_constants, "Constant errors of d1, d2, ..., mm."),
        field("lateral", &Misalignment::lateral, "(2,) offset of the beam's origin, mm"),
        field("roll", &Misalignment::roll, "Of the head, rad."),
        field("gain", &Misalignment::gain,
              "Relative error of tilts and spots; beams are at 1 + gain times their offsets."),
        field("drift", &Misalignment::drift, "Of the distances, mm/s."));

    bind_options<Noise, 5>(m, "Noise", "Standard deviations of an independent Gaussian per reading.", &check_noise,
                           field("distance", &Noise::distance, "mm; also of d1, ..."),
                           field("tilt", &Noise::tilt, "rad"), field("spot", &Noise::spot, "mm"),
                           field("seed", &Noise::seed, "0 to 2^64 - 1"),
                           field("common", &Noise::common, "mm: one draw a row, added to all of its distances"));

    bind_options<ScaleTemperatures, 3>(
        m, "ScaleTemperatures",
        "How warm the scales of the axes are, and how they expand. Makes the channels temperature_x, temperature_y and "
        "temperature_z, or temperature alone of one sensor. simulate() checks it.",
        nullptr, required("expansion", &ScaleTemperatures::expansion, "Of the scales."),
        required("start", &ScaleTemperatures::start, "(3,) of X, Y, Z at the run's first reading, degrees Celsius"),
        field("rate", &ScaleTemperatures::rate, "(3,) K/s"),
        field("one_sensor", &ScaleTemperatures::one_sensor, "Whether one sensor measures for all axes."));

    m.attr("largest_repeat_count") = SimulationOptions::largest_repeat_count;
    bind_options<SimulationOptions>(
        m, "SimulationOptions", "What simulate() takes beside machine, plan and head, and checks.", nullptr,
        field("misalignment", &SimulationOptions::misalignment, "By line name; a line without an entry is aligned."),
        field("noise", &SimulationOptions::noise, "Of the readings."),
        field("environment", &SimulationOptions::environment,
              "The air of the trace; None: of 20 degrees Celsius for a head with a design, an index of 1 for others."),
        field("assumed_environment", &SimulationOptions::assumed,
              "What the readings are reduced with; None: the same."),
        field("verified_share", &SimulationOptions::verified_share,
              "Of a traced head's replayed poses, traced again and compared."),
        field("repeats", &SimulationOptions::repeats, "How often each line is measured: runs 0, 1, 2, ..."),
        field("backward", &SimulationOptions::backward,
              "Runs 0, 2, ... are each followed by one in reverse order, 1, 3, ..."),
        field("seconds_per_reading", &SimulationOptions::seconds_per_reading,
              "Makes the channel time; None: no times."),
        field("scales", &SimulationOptions::scales, "They expand, and their temperatures are recorded."),
        field("machine_drift", &SimulationOptions::machine_drift,
              "(3,) of the functional point along the axes since the first reading, mm/s"));
}

static void bind_simulate(py::module_& m) {
    m.def(
        "simulate",
        [](const Machine& machine, const Plan& plan, const HeadLike& head,
           const std::optional<SimulationOptions>& given, const Fields& fields) {
            const Heads heads = to_heads(head, plan);
            const SimulationOptions options = options_of(given, fields);
            py::gil_scoped_release release;
            return simulate(machine, plan, heads, options);
        },
        py::arg("machine"), py::arg("plan"), py::arg("head"), py::arg("options") = std::nullopt,
        "A run on the virtual machine: lines of the plan, then its scale lines. head: one, or a dict with one for each "
        "line. The options are SimulationOptions, or its fields by name. Points of a visit are approached in the "
        "direction of its own travel. Readings whose beam misses the mirror or does not come back are lost (NaN). "
        "Raises InvalidArgument; RuntimeError where a replay and its trace differ.");

    py::class_<VirtualReadout>(
        m, "VirtualReadout",
        "The virtual head set up on one line, read with the axes at any position: the row that simulate makes there.")
        .def(py::init([](const Machine& machine, const Plan& plan, const HeadLike& head, const std::string& line,
                         const std::optional<SimulationOptions>& given, const Fields& fields) {
                 return VirtualReadout(machine, plan, to_heads(head, plan), Line::parse(line),
                                       options_of(given, fields));
             }),
             py::arg("machine"), py::arg("plan"), py::arg("head"), py::arg("line"), py::arg("options") = std::nullopt,
             "Arguments as those of simulate. Raises InvalidArgument as it does, and for a line that is not in the "
             "plan.")
        .def(
            "read",
            [](const VirtualReadout& readout, const ArrayLike& position, const std::string& approach,
               const IntegerLike& row, double elapsed) {
                const Eigen::Vector3d at = to_vector3(position, "position");
                if (!at.allFinite()) throw InvalidArgument("position: expected three finite numbers");
                const Approaches came = to_approaches(approach);
                const auto number = std::uint64_t(to_integer(row, "row", 0, std::int64_t(1) << 47));
                const SignalRow signals = [&] {
                    py::gil_scoped_release release;
                    return readout.read(at, came, number, elapsed);
                }();
                return to_numpy(signals);
            },
            py::arg("position"), py::arg("approach") = "+++", py::kw_only(), py::arg("row") = integer(0),
            py::arg("elapsed") = 0.0,
            "The head's signals (n,), mm and rad, NaN where lost, with the axes at `position` (mm). approach: the "
            "directions that the axes came from, + or - of each. row: which draws the noise takes, as the number of a "
            "simulated row; elapsed: seconds since the set-up's first reading.");
}

void bind_simulation(py::module_& m) {
    bind_simulation_options(m);
    bind_simulate(m);
}

}  // namespace stepdiag::bindings
