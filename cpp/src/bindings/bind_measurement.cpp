#include <algorithm>
#include <cmath>
#include <map>

#include "bindings.hpp"
#include "stepdiag/measurement/measurement.hpp"
#include "stepdiag/measurement/setup_quantity.hpp"
#include "struct_table.hpp"

namespace stepdiag::bindings {
namespace {

using ChannelArrays = std::map<std::string, ArrayLike>;

std::vector<std::optional<double>> to_fields(const ArrayLike& array, const std::string& name) {
    const Eigen::VectorXd values = to_vector(array, name.c_str());
    std::vector<std::optional<double>> fields(values.size());
    for (Eigen::Index i = 0; i < values.size(); ++i)
        if (!std::isnan(values[i])) fields[i] = values[i];
    return fields;
}

Measurement make_measurement(const std::vector<std::string>& line, const std::vector<IntegerLike>& point,
                             const ArrayLike& position, const py::typing::Dict<py::str, ArrayLike>& channels,
                             const std::optional<std::vector<IntegerLike>>& run,
                             const std::optional<std::vector<std::string>>& direction,
                             const ChannelArrays& standard_uncertainty) {
    const Points positions = to_points(position, "position");
    const auto check_size = [&](std::size_t size, const char* name) {
        if (size != line.size())
            throw InvalidArgument(std::string(name) + ": expected " + std::to_string(line.size()) +
                                  " entries, one a row, got " + std::to_string(size));
    };
    check_size(point.size(), "point");
    check_size(std::size_t(positions.rows()), "position");
    if (run) check_size(run->size(), "run");
    if (direction) check_size(direction->size(), "direction");
    std::vector<Station> stations;
    for (std::size_t i = 0; i < line.size(); ++i) {
        Station station{run ? to_int((*run)[i], "run") : 0, Line::parse(line[i]), to_int(point[i], "point"),
                        Direction::forward, positions.row(Eigen::Index(i)).transpose()};
        if (direction) {
            if ((*direction)[i] != "forward" && (*direction)[i] != "backward")
                throw InvalidArgument("direction: expected \"forward\" or \"backward\", got \"" + (*direction)[i] +
                                      "\"");
            if ((*direction)[i] == "backward") station.direction = Direction::backward;
        }
        stations.push_back(station);
    }
    std::vector<Channel> list;
    for (const auto& [key, value] : channels) {
        const auto name = py::cast<std::string>(key);
        list.push_back({name, to_fields(py::reinterpret_borrow<ArrayLike>(value), name), {}});
    }
    for (const auto& [name, array] : standard_uncertainty) {
        const auto channel =
            std::find_if(list.begin(), list.end(), [&name = name](const Channel& c) { return c.name == name; });
        if (channel == list.end()) throw InvalidArgument("standard_uncertainty: there is no channel \"" + name + "\"");
        channel->standard_uncertainty = to_fields(array, "standard_uncertainty of " + name);
    }
    return Measurement(std::move(stations), std::move(list));
}

}  // namespace

static void bind_setup_quantities(py::module_& m) {
    using Quantity = SetupQuantityRecord;
    bind_record(m, "SetupQuantity", "What a line's set-up is made of: a row of setup_quantities().",
                field("name", &Quantity::name, "In options and files."),
                field("key", &Quantity::key, "In scenarios, with its unit."),
                field("symbol", &Quantity::symbol, "Over a column of a report."),
                field("unit", &Quantity::unit, "Of the library: rad, mm, 1, mm s-1."),
                field("report_unit", &Quantity::report_unit, "As in keys."),
                field("components", &Quantity::components, "A letter each; empty: a single one without a letter."),
                field("of_beams", &Quantity::of_beams, "Whether there is one for each of d1 ... dn."),
                field("prior", &Quantity::prior,
                      "Its prior in an adjustment by default: infinite: free; 0: fixed at 0; else the standard "
                      "uncertainty with which it is known to be 0."),
                field("scale_line_prior", &Quantity::scale_line_prior, "The same on scale lines."),
                field("usual", &Quantity::usual,
                      "How far from 0 it usually is, where readings do not tell; infinite: they always do."),
                field("scale_line_usual", &Quantity::scale_line_usual,
                      "The same on scale lines whose readings do not tell it."),
                field("meaning", &Quantity::meaning))
        .def_property_readonly(
            "layout", [](const Quantity& q) { return q.layout ? std::optional(name(*q.layout)) : std::nullopt; },
            "The only layout of heads that has it.");
    m.attr("adjusted_quantity_count") = adjusted_quantity_count;
    m.def(
        "setup_quantities", [] { return to_tuple(setup_quantities); },
        "The table of set-up quantities. The first adjusted_quantity_count of them are unknowns of an adjustment.");
}

static void bind_run(py::module_& m) {
    py::class_<Measurement>(m, "Measurement",
                            "A run's readings, row by row: line, point, run, direction, commanded position (mm), and "
                            "channels in native units (mm, rad; NaN where a reading was lost).")
        .def(py::init(&make_measurement), py::arg("line"), py::arg("point"), py::arg("position"), py::arg("channels"),
             py::kw_only(), py::arg("run") = std::nullopt, py::arg("direction") = std::nullopt,
             py::arg("standard_uncertainty") = ChannelArrays{},
             "channels: name -> (n,) with names distance, alpha, beta, spot_x, spot_y, d1 ..., time, temperature. "
             "Raises InvalidArgument.")
        .def("__len__", &Measurement::size)
        .def_property_readonly("line",
                               [](const Measurement& run) {
                                   std::vector<std::string> names;
                                   for (const Station& s : run.stations()) names.push_back(s.line.name());
                                   return names;
                               })
        .def_property_readonly("point",
                               [](const Measurement& run) {
                                   py::array_t<int> points(py::ssize_t(run.size()));
                                   for (std::size_t i = 0; i < run.size(); ++i)
                                       points.mutable_data()[i] = run.stations()[i].point;
                                   return points;
                               })
        .def_property_readonly("run",
                               [](const Measurement& run) {
                                   py::array_t<int> runs(py::ssize_t(run.size()));
                                   for (std::size_t i = 0; i < run.size(); ++i)
                                       runs.mutable_data()[i] = run.stations()[i].run;
                                   return runs;
                               })
        .def_property_readonly("direction",
                               [](const Measurement& run) {
                                   std::vector<std::string> names;
                                   for (const Station& s : run.stations()) names.push_back(name(s.direction));
                                   return names;
                               })
        .def_property_readonly("position",
                               [](const Measurement& run) {
                                   Eigen::MatrixXd positions(run.size(), 3);
                                   for (std::size_t i = 0; i < run.size(); ++i)
                                       positions.row(i) = run.stations()[i].commanded.transpose();
                                   return to_numpy(positions);
                               })
        .def_property_readonly("channels",
                               [](const Measurement& run) {
                                   py::typing::Dict<py::str, DoubleArray> channels;
                                   for (const Channel& channel : run.channels())
                                       channels[py::str(channel.name)] = to_numpy(channel.value);
                                   return channels;
                               })
        .def_property_readonly("standard_uncertainty",
                               [](const Measurement& run) {
                                   py::typing::Dict<py::str, DoubleArray> uncertainties;
                                   for (const Channel& channel : run.channels())
                                       if (!channel.standard_uncertainty.empty())
                                           uncertainties[py::str(channel.name)] =
                                               to_numpy(channel.standard_uncertainty);
                                   return uncertainties;
                               })
        .def(
            "write_csv", [](const Measurement& run, const PathLike& path) { write_measurement(run, to_path(path)); },
            py::arg("path"),
            "Writes the measurement CSV; numbers are read back to the same bits. Raises InvalidArgument when it cannot "
            "be written.");
    m.def(
        "read_measurement", [](const PathLike& path) { return read_measurement(to_path(path)); }, py::arg("path"),
        "Reads a measurement CSV. Raises InvalidArgument naming file and line.");
    m.def("without_lost_marks", &without_lost_marks, py::arg("measurement"),
          "The measurement without distances of 0 that stand for a lost beam, as read_measurement gives it. Raises "
          "InvalidArgument naming the row of another such mark.");
}

void bind_measurement(py::module_& m) {
    bind_setup_quantities(m);
    bind_run(m);
}

}  // namespace stepdiag::bindings
