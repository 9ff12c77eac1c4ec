#include <algorithm>
#include <cmath>
#include <limits>

#include "bindings.hpp"
#include "stepdiag/controller/compensator.hpp"
#include "stepdiag/evaluation/calibration.hpp"

namespace stepdiag::bindings {

// The file of a table, or its content.
class TableLike : public py::object {
    PYBIND11_OBJECT_DEFAULT(TableLike, py::object, PyObject_Type)
};

}  // namespace stepdiag::bindings

namespace pybind11::detail {
template <>
struct handle_type_name<stepdiag::bindings::TableLike> {
    static constexpr auto name = const_name("str | os.PathLike[str] | Calibration | ErrorMap");
};
}  // namespace pybind11::detail

namespace stepdiag::bindings {
namespace {

using Position = std::array<double, 3>;

constexpr double no_answer = std::numeric_limits<double>::quiet_NaN();

template <class Choice>
Choice one_of(const char* argument, const std::string& name, const std::vector<std::pair<const char*, Choice>>& known) {
    std::string names;
    for (const auto& [text, choice] : known) {
        if (name == text) return choice;
        names += (names.empty() ? "\"" : ", \"") + std::string(text) + "\"";
    }
    throw InvalidArgument(std::string(argument) + ": expected one of " + names + ", got \"" + name + "\"");
}

Position to_position(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

void warn(const std::string& text) {
    if (PyErr_WarnEx(PyExc_UserWarning, text.c_str(), 1) < 0) throw py::error_already_set();
}

void warn_of_table(const Compensator& compensator) {
    const std::string& fit = compensator.fit();
    if (!fit.empty() && fit != "accepted") warn("the compensation's table has a fit that is " + fit);
    if (compensator.is_unverified())
        warn("the compensation's table is unverified: its checksum was absent, its values may have been changed");
}

Compensator make_compensator(const TableLike& table, const ChainLike& chain, const ArrayLike& origin,
                             const std::string& outside, double margin, double largest_correction,
                             const std::string& approach, double largest_tool, bool accept_rejected,
                             bool accept_unverified, const std::optional<std::array<double, 2>>& temperatures) {
    CompensatorOptions options;
    options.origin = to_position(to_vector3(origin, "origin"));
    options.outside = one_of<Outside>(
        "outside", outside, {{"hold", Outside::hold}, {"linear", Outside::linear}, {"refuse", Outside::refuse}});
    options.margin = margin;
    options.largest_correction = largest_correction;
    options.approach = one_of<CompensatedApproach>("approach", approach,
                                                   {{"mean", CompensatedApproach::mean},
                                                    {"positive", CompensatedApproach::positive},
                                                    {"negative", CompensatedApproach::negative}});
    options.largest_tool = largest_tool;
    options.accept_rejected = accept_rejected;
    options.accept_unverified = accept_unverified;
    if (temperatures) options.temperatures = *temperatures;
    const std::string name = to_chain(chain).name();
    const auto made = [&] {
        if (py::isinstance<Calibration>(table))
            return Compensator(to_parameter_table(table.cast<Calibration>()), "calibration", name, options);
        if (py::isinstance<ErrorMap>(table))
            return Compensator(table.cast<ErrorMap>().table(), "error map", name, options);
        return Compensator::load(to_path(py::reinterpret_borrow<PathLike>(table)), name, options);
    };
    Compensator compensator = made();
    warn_of_table(compensator);
    return compensator;
}

// Temperatures of the scales of a call, or none.
class Scales {
public:
    explicit Scales(const std::optional<ArrayLike>& temperature) : given_(temperature.has_value()) {
        if (temperature) temperature_ = to_position(to_vector3(*temperature, "temperature"));
    }
    operator const double*() const { return given_ ? temperature_.data() : nullptr; }

private:
    bool given_;
    Position temperature_ = {};
};

Position tool_of(const Compensator& compensator, const std::optional<ArrayLike>& tool) {
    return tool ? to_position(to_vector3(*tool, "tool")) : compensator.tool();
}

// `ask(rows, tool, temperature, answers, statuses)` answers rows of positions; NaN where it refuses one.
template <class Ask>
DoubleArray answers(const Compensator& compensator, const ArrayLike& positions, const char* name,
                    const std::optional<ArrayLike>& tool, const std::optional<ArrayLike>& temperature, Ask&& ask) {
    const Points points = to_points(positions, name);
    const Position offset = tool_of(compensator, tool);
    const Scales scales(temperature);
    const auto count = std::size_t(points.rows());
    DoubleArray result({points.rows(), Eigen::Index(3)});
    double* out = result.mutable_data();
    py::gil_scoped_release release;
    std::vector<unsigned> statuses(count);
    const unsigned flags = ask(count, points.data(), offset.data(), scales, out, statuses.data());
    if (flags & compensation_refused)
        for (std::size_t i = 0; i < count; ++i)
            if (statuses[i] & compensation_refused) std::fill_n(out + 3 * i, 3, no_answer);
    return result;
}

py::array_t<int> status(const Compensator& compensator, const ArrayLike& positions,
                        const std::optional<ArrayLike>& tool, const std::optional<ArrayLike>& temperature) {
    const Points points = to_points(positions, "positions");
    const Position offset = tool_of(compensator, tool);
    const Scales scales(temperature);
    py::array_t<int> result(points.rows());
    int* out = result.mutable_data();
    py::gil_scoped_release release;
    std::vector<double> errors(std::size_t(points.size()));
    std::vector<unsigned> statuses(std::size_t(points.rows()));
    compensator.errors(statuses.size(), points.data(), offset.data(), scales, errors.data(), nullptr, statuses.data());
    std::copy(statuses.begin(), statuses.end(), out);
    return result;
}

}  // namespace

void bind_controller(py::module_& m) {
    py::class_<Compensator>(
        m, "Compensator",
        "Volumetric compensation as a controller does it (the C++ library stepdiag::controller): forward(c) = c + "
        "error(c) is where the tool is when the axes stand at c, command(t) where they must stand for it to be at t. "
        "Positions (n, 3) are axis positions in the controller's coordinates, mm; tool: offset of the functional point "
        "(3,), mm, by default that of the calibration; temperature: of the scales of X, Y, Z (3,), degrees Celsius, by "
        "default none: the error is that of the table. NaN where there is no answer: outside with \"refuse\", beyond "
        "the margin, a position that is not finite, a tool longer than largest_tool, a temperature outside "
        "`temperatures`.")
        .def(py::init(&make_compensator), py::arg("table"), py::arg("chain"), py::kw_only(),
             py::arg("origin") = zeros(3), py::arg("outside") = "hold", py::arg("margin") = CompensatorOptions{}.margin,
             py::arg("largest_correction") = CompensatorOptions{}.largest_correction, py::arg("approach") = "mean",
             py::arg("largest_tool") = CompensatorOptions{}.largest_tool, py::arg("accept_rejected") = false,
             py::arg("accept_unverified") = false, py::arg("temperatures") = std::nullopt,
             "table: a file, a Calibration or an ErrorMap that carries chain, volume and tool. chain: the "
             "controller's. origin: home in the controller's coordinates. outside the calibrated volume: \"hold\" the "
             "error of its nearest point, go on \"linear\" up to `margin`, or \"refuse\". largest_correction: command "
             "and forward shorten a longer error to this length. approach: \"mean\", \"positive\" or \"negative\", of "
             "a table with reversal. accept_rejected: take a table whose fit was rejected. accept_unverified: take a "
             "calibration whose checksum was absent when it was read. "
             "temperatures: lowest and highest of a scale that calls may state, degrees Celsius; needs a table that "
             "is referred to a temperature by a known expansion. Warns (UserWarning) of "
             "a fit that is not accepted, and of an unverified table. Raises InvalidArgument for a table or options "
             "that a controller should not "
             "use.")
        .def(
            "error",
            [](const Compensator& c, const ArrayLike& positions, const std::optional<ArrayLike>& tool,
               const std::optional<ArrayLike>& temperature) {
                return answers(
                    c, positions, "positions", tool, temperature,
                    [&c](std::size_t count, const double* p, const double* offset, const double* scales, double* errors,
                         unsigned* statuses) { return c.errors(count, p, offset, scales, errors, nullptr, statuses); });
            },
            py::arg("positions"), py::arg("tool") = std::nullopt, py::arg("temperature") = std::nullopt,
            "Error of the functional point (n, 3), mm: exact, and the whole of it where corrections are capped.")
        .def(
            "orientation",
            [](const Compensator& c, const ArrayLike& positions, const std::optional<ArrayLike>& tool,
               const std::optional<ArrayLike>& temperature) {
                return answers(c, positions, "positions", tool, temperature,
                               [&c](std::size_t count, const double* p, const double* offset, const double* scales,
                                    double* orientations, unsigned* statuses) {
                                   std::vector<double> errors(3 * count);
                                   return c.errors(count, p, offset, scales, errors.data(), orientations, statuses);
                               });
            },
            py::arg("positions"), py::arg("tool") = std::nullopt, py::arg("temperature") = std::nullopt,
            "Rotation vectors of the tool (n, 3), rad.")
        .def(
            "command",
            [](const Compensator& c, const ArrayLike& targets, const std::optional<ArrayLike>& tool,
               const std::optional<ArrayLike>& temperature) {
                return answers(c, targets, "targets", tool, temperature,
                               [&c](std::size_t count, const double* p, const double* offset, const double* scales,
                                    double* commands, unsigned* statuses) {
                                   return c.commands(count, p, offset, scales, commands, statuses);
                               });
            },
            py::arg("targets"), py::arg("tool") = std::nullopt, py::arg("temperature") = std::nullopt,
            "Where the axes must stand (n, 3), mm, for the tool to be at the targets (n, 3).")
        .def(
            "forward",
            [](const Compensator& c, const ArrayLike& commands, const std::optional<ArrayLike>& tool,
               const std::optional<ArrayLike>& temperature) {
                return answers(c, commands, "commands", tool, temperature,
                               [&c](std::size_t count, const double* p, const double* offset, const double* scales,
                                    double* actual, unsigned* statuses) {
                                   unsigned flags = 0;
                                   for (std::size_t i = 0; i < count; ++i)
                                       flags |= statuses[i] = c.forward(p + 3 * i, offset, scales, actual + 3 * i);
                                   return flags;
                               });
            },
            py::arg("commands"), py::arg("tool") = std::nullopt, py::arg("temperature") = std::nullopt,
            "Where the tool is (n, 3), mm, when the axes stand at the commands (n, 3).")
        .def("status", &status, py::arg("positions"), py::arg("tool") = std::nullopt,
             py::arg("temperature") = std::nullopt,
             "Of the error at positions (n, 3): 0, or the sum of 1 outside the volume, 2 longer than "
             "largest_correction, 4 refused, 16 (with 4) a temperature that is not taken; shape (n,).")
        .def_property_readonly(
            "fingerprint", &Compensator::fingerprint,
            "The table in force: a hash of chain, volume, tool, nodes, values and expansion, 64 bit.")
        .def_property_readonly("inverse_bound", &Compensator::inverse_bound,
                               "|forward(command(t)) - t| never exceeds this, mm.")
        .def_property_readonly("volume",
                               [](const Compensator& c) { return to_numpy_vector(Eigen::Vector3d(c.volume().data())); })
        .def_property_readonly(
            "tool", [](const Compensator& c) { return to_numpy_vector(Eigen::Vector3d(c.tool().data())); },
            "Of the calibration, mm.")
        .def_property_readonly(
            "temperature_reference",
            [](const Compensator& c) {
                const double reference = c.temperature_reference();
                return std::isnan(reference) ? std::nullopt : std::optional(reference);
            },
            "Temperature of the scales at which they add nothing, degrees Celsius; None: none may be stated.")
        .def_property_readonly(
            "fit",
            [](const Compensator& c) { return c.fit().empty() ? std::nullopt : std::optional<std::string>(c.fit()); },
            "Verdict of the table's fit: \"accepted\", \"doubtful\", \"rejected\", \"unchecked\"; None where it has "
            "none.")
        .def_property_readonly("unverified", &Compensator::is_unverified,
                               "Whether the table is a calibration whose checksum was absent when it was read.")
        .def_property_readonly("uncompensated", &Compensator::uncompensated,
                               "What the table does not tell: \"EXX\", \"EYX (slope)\", \"EXX (above 784.0 mm)\" ...");
}

}  // namespace stepdiag::bindings
