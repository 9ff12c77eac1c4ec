#include <limits>
#include <variant>

#include "bindings.hpp"
#include "stepdiag/plan/run_order.hpp"
#include "struct_table.hpp"

namespace stepdiag::bindings {
namespace {

std::vector<Line> parse_lines(const std::vector<std::string>& names) {
    std::vector<Line> lines;
    for (const auto& name : names) lines.push_back(Line::parse(name));
    return lines;
}

std::vector<std::string> line_names(const std::vector<Line>& lines) {
    std::vector<std::string> names;
    for (const Line& line : lines) names.push_back(line.name());
    return names;
}

std::string order_name(const StepOrder& order) {
    std::string text;
    for (const Axis axis : order) text += letter(axis);
    return text;
}

std::vector<StepOrder> parse_orders(const std::variant<std::string, std::vector<std::string>>& names) {
    if (const auto* name = std::get_if<std::string>(&names)) return {parse_order(*name)};
    std::vector<StepOrder> orders;
    for (const auto& name : std::get<std::vector<std::string>>(names)) orders.push_back(parse_order(name));
    return orders;
}

DoubleArray positions_of(const std::vector<PlanPoint>& points) {
    Eigen::MatrixXd positions(points.size(), 3);
    for (std::size_t k = 0; k < points.size(); ++k) positions.row(k) = points[k].commanded.transpose();
    return to_numpy(positions);
}

void check_counts(const CheckPoints& points) {
    for (const auto& [name, steps] : {std::pair("every", points.every), std::pair("at", points.at)})
        if (steps < 0 || steps > Plan::largest_step_count)
            throw InvalidArgument(std::string(name) + ": expected a whole number from 0 to " +
                                  std::to_string(Plan::largest_step_count) + ", got " + std::to_string(steps));
}

}  // namespace

static void bind_passes(py::module_& m) {
    bind_record(m, "PlannedPass", "One pass along a line of a plan, as Plan.passes gives it.",
                field("line_index", &PlannedPass::line_index,
                      "The line's place among the plan's lines, then its scale lines, from 0."),
                field("run", &PlannedPass::run),
                field("direction", &PlannedPass::direction, "\"forward\" or \"backward\"."))
        .def_property_readonly("line", [](const PlannedPass& pass) { return pass.line.name(); })
        .def_property_readonly(
            "points",
            [](const PlannedPass& pass) {
                std::vector<int> numbers;
                for (const PlanPoint& point : pass.points) numbers.push_back(point.number);
                return py::array_t<std::int64_t>(py::cast(numbers));
            },
            "Numbers of the points in the order in which they are read, (n,): they descend on a backward pass.")
        .def_property_readonly(
            "positions", [](const PlannedPass& pass) { return positions_of(pass.points); },
            "The commanded positions of these points, (n, 3), mm.")
        .def_property_readonly(
            "approach",
            [](const PlannedPass& pass) {
                std::vector<int> signs;
                for (const Approach approach : approaches(pass.line, pass.direction))
                    signs.push_back(approach == Approach::positive ? 1 : -1);
                return py::array_t<std::int64_t>(py::cast(signs));
            },
            "How the axes X, Y, Z come to every point, the first included: +1 or -1, (3,).");

    bind_options<CheckPoints, 2>(
        m, "CheckPoints",
        "Returns to one point of each line but scale lines, which distinguish a drift from the machine's errors.",
        &check_counts,
        field("every", &CheckPoints::every, "After so many steps, each a move of every axis; 0: there are none."),
        field("at", &CheckPoints::at, "The point is that after so many steps, 0 the line's first."));
}

static void bind_plan_of_lines(py::module_& m) {
    py::class_<Plan>(m, "Plan",
                     "The lines measured through a volume, in single-axis steps. Lines are named by the travel signs "
                     "of X, Y, Z: three of p n 0.")
        .def(py::init([](const ArrayLike& volume, const std::vector<std::string>& lines, const IntegerLike& steps,
                         const std::variant<std::string, std::vector<std::string>>& order,
                         const std::vector<std::string>& scale_lines, const CheckPoints& check_points,
                         const std::string& scale_points, const IntegerLike& block) {
                 const int count = int(to_integer(steps, "steps", 1, Plan::largest_step_count));
                 return Plan(to_vector3(volume, "volume"), parse_lines(lines), count, parse_orders(order),
                             parse_lines(scale_lines), check_points, parse_scale_points(scale_points),
                             int(to_integer(block, "block", 1, Plan::largest_step_count)));
             }),
             py::arg("volume"), py::arg("lines"), py::arg("steps"), py::arg("order") = "XYZ",
             py::arg("scale_lines") = std::vector<std::string>{}, py::kw_only(),
             py::arg("check_points") = CheckPoints{}, py::arg("scale_points") = "ends", py::arg("block") = integer(1),
             "volume: edges in mm. steps: per axis. order: in which a step moves the axes, \"XYZ\" ...; of several, "
             "run r goes in the order r modulo their number. scale_points: where scale lines are read, at their two "
             "\"ends\" or after all \"steps\". block: so many steps of an axis follow "
             "each other before the next axis moves. Raises InvalidArgument for an unknown or doubled line, a volume "
             "without extent, steps outside 1 .. 2000, check points that are outside 0 .. steps, \"steps\" without "
             "scale lines.")
        .def_property_readonly_static("largest_step_count", [](const py::object&) { return Plan::largest_step_count; })
        .def_property_readonly("volume", [](const Plan& plan) { return to_numpy_vector(plan.volume()); })
        .def_property_readonly("lines", [](const Plan& plan) { return line_names(plan.lines()); })
        .def_property_readonly(
            "scale_lines", [](const Plan& plan) { return line_names(plan.scale_lines()); },
            "Single-axis lines whose laser stands along the axis.")
        .def_property_readonly(
            "scale_points", [](const Plan& plan) { return name(plan.scale_points()); },
            "Where scale lines are read: at their two \"ends\", or after all \"steps\".")
        .def_property_readonly("steps", &Plan::steps)
        .def_property_readonly("block", &Plan::block,
                               "So many steps of an axis follow each other before the next axis moves.")
        .def_property_readonly("check_points", &Plan::check_points, "Returns that tell drift.")
        .def_property_readonly(
            "order", [](const Plan& plan) { return order_name(plan.order()); }, "The order of run 0.")
        .def_property_readonly("orders",
                               [](const Plan& plan) {
                                   std::vector<std::string> names;
                                   for (const auto& order : plan.orders()) names.push_back(order_name(order));
                                   return names;
                               })
        .def(
            "points",
            [](const Plan& plan, const std::string& line, const IntegerLike& run) {
                return positions_of(plan.points(Line::parse(line), to_int(run, "run")));
            },
            py::arg("line"), py::arg("run") = integer(0),
            "Commanded points of a line of this plan in the order of travel, returns to its check point included, "
            "(n, 3), mm.")
        .def(
            "check_numbers",
            [](const Plan& plan, const std::string& line) {
                std::vector<int> numbers;
                for (const PlanPoint& point : plan.points(Line::parse(line)))
                    if (point.is_check) numbers.push_back(point.number);
                return numbers;
            },
            py::arg("line"), "Numbers of the points of a line that are returns to its check point.")
        .def(
            "passes",
            [](const Plan& plan, const IntegerLike& repeats, bool backward) {
                return planned_passes(plan, int(to_integer(repeats, "repeats", 1, std::numeric_limits<int>::max())),
                                      backward);
            },
            py::arg("repeats") = integer(1), py::kw_only(), py::arg("backward") = false,
            "The passes of a run in the order in which they are measured: the plan's lines in their order, then its "
            "scale lines; of each line runs 0, 1, 2, ..., `repeats` of them; with `backward` runs 0, 2, ... and after "
            "each its backward run 1, 3, ... Raises InvalidArgument for repeats below 1.")
        .def(
            "nodes", [](const Plan& plan, const std::string& axis) { return to_numpy(plan.nodes(to_axis(axis))); },
            py::arg("axis"), "Node positions of axis \"X\", \"Y\" or \"Z\", (steps + 1,), mm.")
        .def(
            "frame",
            [](const Plan& plan, const std::string& line) {
                return to_numpy(Eigen::MatrixXd(plan.frame(Line::parse(line))));
            },
            py::arg("line"),
            "Local frame of a line in machine coordinates, (3, 3), columns local x, y, z (eq. 2 of the paper).")
        .def(
            "lateral_excursion",
            [](const Plan& plan, const std::string& line) {
                const LateralExcursion excursion = plan.lateral_excursion(Line::parse(line));
                Eigen::MatrixXd rows(2, 2);
                rows << excursion.lowest.transpose(), excursion.highest.transpose();
                return to_numpy(rows);
            },
            py::arg("line"),
            "How far a step leads beside the line in local x and y, mm: rows lowest and highest, (2, 2).")
        .def(
            "smallest_mirror", [](const Plan& plan) { return to_numpy_vector(plan.smallest_mirror()); },
            "Width and height (local x and y) of the smallest mirror, centred on the functional point, (2,), mm; a "
            "beam of finite diameter needs that much more.");
}

void bind_plan(py::module_& m) {
    bind_passes(m);
    bind_plan_of_lines(m);
}

}  // namespace stepdiag::bindings
