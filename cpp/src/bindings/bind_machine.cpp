#include "stepdiag/machine/machine.hpp"
#include "struct_table.hpp"

namespace stepdiag::bindings {
namespace {

using FunctionArrays = std::map<std::string, std::pair<ArrayLike, ArrayLike>>;

using FunctionTables = std::array<std::optional<FunctionTable>, function_count>;

FunctionTables to_tables(const FunctionArrays& functions, const std::string& argument) {
    FunctionTables tables;
    for (const auto& [name, arrays] : functions) {
        const auto id = FunctionId::parse(name);
        if (!id) throw InvalidArgument(argument + ": expected names EXX ... ECZ, got \"" + name + "\"");
        const Eigen::VectorXd position = to_vector(arrays.first, (name + " position").c_str());
        const Eigen::VectorXd value = to_vector(arrays.second, (name + " value").c_str());
        tables[id->index()] = FunctionTable{{position.begin(), position.end()},
                                            {value.begin(), value.end()},
                                            std::vector<std::optional<double>>(position.size())};
    }
    return tables;
}

std::map<std::string, std::pair<DoubleArray, DoubleArray>> to_arrays(const FunctionTables& tables) {
    std::map<std::string, std::pair<DoubleArray, DoubleArray>> functions;
    for (int i = 0; i < function_count; ++i)
        if (const auto& table = tables[i])
            functions[FunctionId::at(i).name()] = {to_numpy(table->position), to_numpy(table->value)};
    return functions;
}

ErrorMap make_error_map(const FunctionArrays& functions, const std::map<std::string, double>& squareness,
                        const FunctionArrays& negative_functions) {
    ParameterTable table;
    table.functions = to_tables(functions, "functions");
    table.negative_functions = to_tables(negative_functions, "negative_functions");
    for (const auto& [text, value] : squareness) {
        const auto id = parse_squareness(text);
        if (!id) throw InvalidArgument("squareness: expected names C0Y, B0Z, A0Z, got \"" + text + "\"");
        table.squarenesses[static_cast<int>(*id)] = SquarenessValue{value, std::nullopt};
    }
    return ErrorMap(std::move(table));
}

Points to_commanded(const ArrayLike& array) {
    const Points points = to_points(array, "commanded");
    if (!points.allFinite()) throw InvalidArgument("commanded: expected finite positions in mm");
    return points;
}

template <class Map>
DoubleArray map_points(const Points& commanded, Map&& map) {
    DoubleArray result({commanded.rows(), Eigen::Index(3)});
    double* out = result.mutable_data();
    py::gil_scoped_release release;
    for (Eigen::Index i = 0; i < commanded.rows(); ++i)
        Eigen::Map<Eigen::Vector3d>(out + 3 * i) = map(commanded.row(i).transpose());
    return result;
}

}  // namespace

Approaches to_approaches(const std::string& text) {
    const bool valid = text.size() == 3 && text.find_first_not_of("+-") == std::string::npos;
    if (!valid) throw InvalidArgument("approach: expected + or - of X, Y, Z such as \"++-\", got \"" + text + "\"");
    Approaches approaches = all_positive;
    for (int a = 0; a < 3; ++a)
        if (text[a] == '-') approaches[a] = Approach::negative;
    return approaches;
}

static void bind_chain(py::module_& m) {
    py::class_<Chain>(m, "Chain",
                      "Kinematic chain in ISO 10791 style, workpiece to tool, such as \"[w X' b Y Z t]\"; a prime "
                      "marks an axis before the bed.")
        .def(py::init(&Chain::parse), py::arg("text"),
             "Raises InvalidArgument when a link is missing, doubled, or primed on the wrong side of b.")
        .def_property_readonly("name", &Chain::name, "As it is written: \"[w X' b Y Z t]\".")
        .def(
            "carries_workpiece",
            [](const Chain& chain, const std::string& axis) { return chain.carries_workpiece(to_axis(axis)); },
            py::arg("axis"), "Whether the axis \"X\", \"Y\" or \"Z\" stands before the bed.")
        .def(
            "__eq__", [](const Chain& a, const Chain& b) { return a == b; }, py::is_operator())
        .def("__hash__", [](const Chain& chain) { return py::hash(py::str(chain.name())); })
        .def("__str__", &Chain::name)
        .def("__repr__", [](const Chain& chain) { return "Chain(\"" + chain.name() + "\")"; });
}

static void bind_error_map(py::module_& m) {
    py::class_<ErrorMap>(
        m, "ErrorMap",
        "The 21 geometric errors as tables (ISO 230-1 names): functions in mm or rad over positions in mm, linear "
        "between nodes, end values held outside; squarenesses in rad. A missing parameter is 0. A function may have "
        "another table for positions approached in - direction; its other one then is of the + direction.")
        .def(py::init(&make_error_map), py::arg("functions") = FunctionArrays{},
             py::arg("squareness") = std::map<std::string, double>{}, py::kw_only(),
             py::arg("negative_functions") = FunctionArrays{},
             "functions: name -> (position, value), one-dimensional and of one length, positions ascending. "
             "negative_functions: the same of the - direction, where it has others. Raises InvalidArgument.")
        .def_property_readonly("functions", [](const ErrorMap& map) { return to_arrays(map.table().functions); })
        .def_property_readonly(
            "negative_functions", [](const ErrorMap& map) { return to_arrays(map.table().negative_functions); },
            "The functions that have another table for the - direction: that table.")
        .def_property_readonly("squareness",
                               [](const ErrorMap& map) {
                                   std::map<std::string, double> values;
                                   for (const Squareness s : all_squarenesses)
                                       if (map.table().squarenesses[static_cast<int>(s)])
                                           values[name(s)] = map.squareness(s);
                                   return values;
                               })
        .def_property_readonly(
            "header", [](const ErrorMap& map) { return map.table().header; },
            "The leading \"# key=value\" lines of the file it came from.")
        .def(
            "function",
            [](const ErrorMap& map, const std::string& name, const ArrayLike& position, const std::string& approach) {
                const auto id = FunctionId::parse(name);
                if (!id) throw InvalidArgument("name: expected EXX ... ECZ, got \"" + name + "\"");
                if (approach != "+" && approach != "-")
                    throw InvalidArgument("approach: expected \"+\" or \"-\", got \"" + approach + "\"");
                const Approach came = approach == "+" ? Approach::positive : Approach::negative;
                Eigen::VectorXd value = to_vector(position, "position");
                if (!value.allFinite()) throw InvalidArgument("position: expected finite positions in mm");
                for (double& p : value) p = map.function(*id, p, came);
                return to_numpy_vector(value);
            },
            py::arg("name"), py::arg("position"), py::arg("approach") = "+",
            "Values (mm or rad) of one error function at positions (mm), shape (n,), approached in the direction \"+\" "
            "or \"-\".")
        .def(
            "frame_deviations",
            [](const ErrorMap& map, const ArrayLike& volume) {
                std::vector<std::tuple<std::string, double, double>> deviations;
                for (const auto& [function, position, value] : map.frame_deviations(to_vector3(volume, "volume")))
                    deviations.emplace_back(function.name(), position, value);
                return deviations;
            },
            py::arg("volume"),
            "Where the map breaks the frame choice (0 at home, straightness 0 at both ends of travel, approached in "
            "+ direction): (function, position in mm, value in mm or rad) each.")
        .def(
            "write",
            [](const ErrorMap& map, const PathLike& path, const std::optional<ChainLike>& chain,
               const std::optional<ArrayLike>& volume, const std::optional<ArrayLike>& tool) {
                ParameterTable table = map.table();
                for (const char* key :
                     {"method", "undetermined", "undetermined_slopes", "undetermined_reversal_constants"})
                    table.header.erase(key);
                table.header["format"] = error_map_format;
                if (chain) table.header["chain"] = to_chain(*chain).name();
                if (volume) table.header["volume_mm"] = format_lengths(to_vector3(*volume, "volume"));
                if (tool) table.header["tool_mm"] = format_lengths(to_vector3(*tool, "tool"));
                write_parameter_table(table, to_path(path));
            },
            py::arg("path"), py::kw_only(), py::arg("chain") = std::nullopt, py::arg("volume") = std::nullopt,
            py::arg("tool") = std::nullopt,
            "Writes the error-map CSV; numbers are read back to the same bits. What a calibration says of its method "
            "and of "
            "what it left undetermined is not kept. Raises InvalidArgument when it cannot "
            "be written.");
    m.def(
        "read_error_map", [](const PathLike& path) { return read_error_map(to_path(path)); }, py::arg("path"),
        "Reads an error map or calibration CSV. Raises InvalidArgument naming file and line.");
    m.def(
        "random_error_map",
        [](const ArrayLike& volume, const IntegerLike& seed, double translation, double rotation, double squareness,
           const IntegerLike& intervals, double screw_pitch, double screw_amplitude) {
            return make_random_error_map(to_vector3(volume, "volume"),
                                         {to_seed(seed), translation, rotation, squareness,
                                          to_int(intervals, "intervals"), screw_pitch, screw_amplitude});
        },
        py::arg("volume"), py::kw_only(), py::arg("seed"), py::arg("translation") = RandomErrorMap{}.translation,
        py::arg("rotation") = RandomErrorMap{}.rotation, py::arg("squareness") = RandomErrorMap{}.squareness,
        py::arg("intervals") = integer(RandomErrorMap{}.intervals), py::arg("screw_pitch") = 0.0,
        py::arg("screw_amplitude") = 0.0,
        "A random machine with peaks of `translation` mm and `rotation` rad at equidistant nodes, squarenesses uniform "
        "within +-`squareness` rad, in the frame choice of the conventions. Same arguments, same bits.");
}

static void bind_expansion(py::module_& m) {
    bind_options<Expansion, 1>(
        m, "Expansion",
        "Thermal expansion of the axes' scales: position p stands at p + coefficient (T - reference)(p - fixed_point).",
        &check, required("coefficient", &Expansion::coefficient, "(3,) of X, Y, Z, 1/K, 1e-3 at most"),
        field("fixed_point", &Expansion::fixed_point, "(3,) mm"),
        field("reference", &Expansion::reference, "degrees Celsius"))
        .def(
            "shift",
            [](const Expansion& e, const ArrayLike& commanded, const ArrayLike& temperature) {
                return to_numpy_vector(
                    e.shift(to_vector3(commanded, "commanded"), to_vector3(temperature, "temperature")));
            },
            py::arg("commanded"), py::arg("temperature"),
            "What the expansion adds to the positions of X, Y, Z (3,), mm, at the scales' temperatures (3,), degrees "
            "Celsius.");
}

static void bind_virtual_machine(py::module_& m) {
    py::class_<Machine>(m, "Machine", "A three-axis machine: chain, the 21 errors, tool offset (mm).")
        .def(py::init([](const ChainLike& chain, const ErrorMap& errors, const ArrayLike& tool) {
                 return Machine(to_chain(chain), errors, to_vector3(tool, "tool"));
             }),
             py::arg("chain"), py::arg("errors") = ErrorMap(), py::arg("tool") = zeros(3))
        .def_property_readonly("chain", &Machine::chain)
        .def_property_readonly("errors", &Machine::errors)
        .def_property_readonly("tool", [](const Machine& machine) { return to_numpy_vector(machine.tool()); })
        .def(
            "pose",
            [](const Machine& machine, const ArrayLike& commanded, const std::string& approach,
               const ArrayLike& scale_expansion) {
                const Points points = to_commanded(commanded);
                const Approaches came = to_approaches(approach);
                const Eigen::Vector3d expansion = to_vector3(scale_expansion, "expansion");
                if (!expansion.allFinite()) throw InvalidArgument("expansion: expected three finite lengths in mm");
                DoubleArray rotation({points.rows(), Eigen::Index(3), Eigen::Index(3)}),
                    position({points.rows(), Eigen::Index(3)});
                double *r = rotation.mutable_data(), *p = position.mutable_data();
                {
                    py::gil_scoped_release release;
                    for (Eigen::Index i = 0; i < points.rows(); ++i) {
                        const Pose pose = machine.pose(points.row(i).transpose(), came, expansion);
                        Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(r + 9 * i) = pose.rotation;
                        Eigen::Map<Eigen::Vector3d>(p + 3 * i) = pose.position;
                    }
                }
                return std::make_pair(rotation, position);
            },
            py::arg("commanded"), py::arg("approach") = "+++", py::arg("expansion") = zeros(3),
            "Exact pose of the tool in the machine frame: (rotation (n, 3, 3), functional point (n, 3), mm) at "
            "commanded positions (n, 3), mm. approach: the direction + or - in which X, Y, Z came there. expansion: "
            "what that of the scales adds to the positions of X, Y, Z, mm (Expansion.shift).")
        .def(
            "error",
            [](const Machine& machine, const ArrayLike& commanded, const std::string& approach) {
                return map_points(
                    to_commanded(commanded),
                    [&, came = to_approaches(approach)](const Eigen::Vector3d& p) { return machine.error(p, came); });
            },
            py::arg("commanded"), py::arg("approach") = "+++",
            "Actual minus nominal functional point (n, 3), mm, exact.")
        .def(
            "first_order_error",
            [](const Machine& machine, const ArrayLike& commanded, const std::string& approach) {
                return map_points(to_commanded(commanded),
                                  [&, came = to_approaches(approach)](const Eigen::Vector3d& p) {
                                      return machine.first_order_error(p, came);
                                  });
            },
            py::arg("commanded"), py::arg("approach") = "+++",
            "The same to first order in the errors: sum over axes of delta + theta x L.");
}

void bind_machine(py::module_& m) {
    bind_chain(m);
    bind_error_map(m);
    bind_expansion(m);
    bind_virtual_machine(m);
}

}  // namespace stepdiag::bindings
