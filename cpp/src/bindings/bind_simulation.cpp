#include "options.hpp"
#include "stepdiag/simulation/simulate.hpp"
#include "stepdiag/simulation/virtual_readout.hpp"

namespace stepdiag::bindings {
namespace {

Eigen::Vector2d to_finite_pair(const ArrayLike& array, const char* key) {
    const Eigen::Vector2d pair = to_vector2(array, key);
    if (!pair.allFinite()) throw InvalidArgument("misalignment " + std::string(key) + ": expected two finite numbers");
    return pair;
}

}  // namespace

void bind_simulation(py::module_& m) {
    py::class_<Misalignment>(
        m, "Misalignment",
        "How head and mirror are out of true on a line: reflector and laser angles (a, b) in rad, psd_zero in mm, "
        "a constant of all distances and one of each beam d1 ... dn in mm, lateral offset of the beam's origin (mm), "
        "roll of the head (rad), gain (tilts and spots read 1 + gain times themselves, beams stand at 1 + gain times "
        "their offsets), drift of the distances (mm/s).")
        .def(py::init([](const ArrayLike& reflector, const ArrayLike& laser, const ArrayLike& psd_zero,
                         double distance_constant, const std::vector<double>& beam_constants, const ArrayLike& lateral,
                         double roll, double gain, double drift) {
                 return Misalignment{to_finite_pair(reflector, "reflector"),
                                     to_finite_pair(laser, "laser"),
                                     to_finite_pair(psd_zero, "psd_zero"),
                                     distance_constant,
                                     beam_constants,
                                     to_finite_pair(lateral, "lateral"),
                                     roll,
                                     gain,
                                     drift};
             }),
             py::arg("reflector") = zeros(2), py::arg("laser") = zeros(2), py::arg("psd_zero") = zeros(2),
             py::arg("distance_constant") = 0.0, py::arg("beam_constants") = std::vector<double>{}, py::kw_only(),
             py::arg("lateral") = zeros(2), py::arg("roll") = 0.0, py::arg("gain") = 0.0, py::arg("drift") = 0.0,
             "Raises InvalidArgument for what is no pair of finite numbers.")
        .def_readonly("distance_constant", &Misalignment::distance_constant, "What all distances read too much, mm.")
        .def_readonly("beam_constants", &Misalignment::beam_constants, "What d1, d2, ... read too much, mm.")
        .def_readonly("roll", &Misalignment::roll)
        .def_readonly("gain", &Misalignment::gain)
        .def_readonly("drift", &Misalignment::drift)
        .def_property_readonly("lateral", [](const Misalignment& m) { return to_numpy_vector(m.lateral); })
        .def_property_readonly("reflector", [](const Misalignment& m) { return to_numpy_vector(m.reflector); })
        .def_property_readonly("laser", [](const Misalignment& m) { return to_numpy_vector(m.laser); })
        .def_property_readonly("psd_zero", [](const Misalignment& m) { return to_numpy_vector(m.psd_zero); });

    py::class_<Noise>(m, "Noise",
                      "Standard deviations of an independent Gaussian per reading: distance (mm; also d1 ...), tilt "
                      "(rad), spot (mm); common (mm): one draw a row, added to all of its distances.")
        .def(py::init([](double distance, double tilt, double spot, const IntegerLike& seed, double common) {
                 const Noise noise{distance, tilt, spot, to_seed(seed), common};
                 check_noise(noise);
                 return noise;
             }),
             py::arg("distance") = 0.0, py::arg("tilt") = 0.0, py::arg("spot") = 0.0, py::arg("seed") = integer(0),
             py::arg("common") = 0.0,
             "Raises InvalidArgument for a deviation that is negative or not finite, and for a seed outside 0 .. 2^64 "
             "- 1.")
        .def_readonly("distance", &Noise::distance)
        .def_readonly("tilt", &Noise::tilt)
        .def_readonly("spot", &Noise::spot)
        .def_readonly("common", &Noise::common)
        .def_readonly("seed", &Noise::seed);

    py::class_<ScaleTemperatures>(
        m, "ScaleTemperatures",
        "How warm the scales of the axes are, and how they expand. Makes the channels temperature_x, temperature_y and "
        "temperature_z, or temperature alone of one sensor.")
        .def(py::init([](const Expansion& expansion, const ArrayLike& start, const ArrayLike& rate, bool one_sensor) {
                 return ScaleTemperatures{expansion, to_vector3(start, "start"), to_vector3(rate, "rate"), one_sensor};
             }),
             py::arg("expansion"), py::arg("start"), py::arg("rate") = zeros(3), py::kw_only(),
             py::arg("one_sensor") = false,
             "start (3,): of X, Y, Z at the run's first reading, degrees Celsius; rate (3,), K/s. simulate() checks "
             "them.")
        .def_readonly("expansion", &ScaleTemperatures::expansion, "Of the scales.")
        .def_property_readonly("start", [](const ScaleTemperatures& s) { return to_numpy_vector(s.start); })
        .def_property_readonly("rate", [](const ScaleTemperatures& s) { return to_numpy_vector(s.rate); })
        .def_readonly("one_sensor", &ScaleTemperatures::one_sensor, "Whether one sensor measures for all axes.");

    m.attr("largest_repeat_count") = SimulationOptions::largest_repeat_count;
    py::class_<SimulationOptions>(
        m, "SimulationOptions",
        "What simulate() takes beside machine, plan and head. misalignment: by line name; a line without an entry is "
        "aligned. environment: the air of the trace (none: of 20 degrees Celsius for a head with a design, an index of "
        "1 for the others); assumed_environment: what the readings are reduced with (none: the same). verified_share: "
        "of a traced head's replayed poses, traced again and compared. repeats: how often each line is measured, runs "
        "0, 1, 2, ...; backward: runs 0, 2, ... are each followed by one in reverse order, 1, 3, ...; "
        "seconds_per_reading: makes the channel time; scales: they expand, and their temperatures are recorded; "
        "machine_drift (3,): of the functional point along the axes since the first reading, mm/s.")
        .def(py::init([](const std::map<std::string, Misalignment>& misalignment, const Noise& noise,
                         const std::optional<Environment>& environment, const std::optional<Environment>& assumed,
                         double verified_share, const IntegerLike& repeats, bool backward,
                         const std::optional<double>& seconds_per_reading,
                         const std::optional<ScaleTemperatures>& scales, const ArrayLike& machine_drift) {
                 return SimulationOptions{misalignment,   noise,
                                          environment,    assumed,
                                          verified_share, to_int(repeats, "repeats"),
                                          backward,       seconds_per_reading,
                                          scales,         to_vector3(machine_drift, "machine_drift")};
             }),
             py::kw_only(), py::arg("misalignment") = std::map<std::string, Misalignment>{}, py::arg("noise") = Noise{},
             py::arg("environment") = std::nullopt, py::arg("assumed_environment") = std::nullopt,
             py::arg("verified_share") = SimulationOptions{}.verified_share, py::arg("repeats") = integer(1),
             py::arg("backward") = false, py::arg("seconds_per_reading") = std::nullopt,
             py::arg("scales") = std::nullopt, py::arg("machine_drift") = zeros(3),
             "Raises InvalidArgument for repeats that are no small number; simulate() checks the rest.")
        .def_readonly("misalignment", &SimulationOptions::misalignment)
        .def_readonly("noise", &SimulationOptions::noise, "Of the readings.")
        .def_readonly("environment", &SimulationOptions::environment)
        .def_readonly("assumed_environment", &SimulationOptions::assumed)
        .def_readonly("verified_share", &SimulationOptions::verified_share)
        .def_readonly("repeats", &SimulationOptions::repeats)
        .def_readonly("backward", &SimulationOptions::backward)
        .def_readonly("seconds_per_reading", &SimulationOptions::seconds_per_reading)
        .def_readonly("scales", &SimulationOptions::scales)
        .def_property_readonly("machine_drift",
                               [](const SimulationOptions& o) { return to_numpy_vector(o.machine_drift); });

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

}  // namespace stepdiag::bindings
