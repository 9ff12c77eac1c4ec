#include "bindings.hpp"
#include "stepdiag/uncertainty/volume_draws.hpp"
#include "stepdiag/uncertainty/volume_errors.hpp"
#include "struct_table.hpp"

namespace stepdiag::bindings {
namespace {

GridPositions to_grid(const ArrayLike& x, const ArrayLike& y, const ArrayLike& z) {
    GridPositions grid;
    const std::array<std::pair<const ArrayLike*, const char*>, 3> axes = {{{&x, "x"}, {&y, "y"}, {&z, "z"}}};
    for (std::size_t a = 0; a < 3; ++a) {
        const Eigen::VectorXd positions = to_vector(*axes[a].first, axes[a].second);
        grid[a].assign(positions.begin(), positions.end());
    }
    return grid;
}

int to_parameter(const std::string& name) {
    if (const auto id = FunctionId::parse(name)) return id->index();
    if (const auto id = parse_squareness(name)) return function_count + static_cast<int>(*id);
    throw InvalidArgument("without: expected names EXX ... ECZ, C0Y, B0Z, A0Z, got \"" + name + "\"");
}

// Without a copy, which would take as long as computing the errors.
DoubleArray to_rows(SixRows&& rows) {
    auto* kept = new SixRows(std::move(rows));
    const py::capsule owner(kept, [](void* matrix) { delete static_cast<SixRows*>(matrix); });
    return DoubleArray({kept->rows(), Eigen::Index(6)}, kept->data(), owner);
}

}  // namespace

static void bind_volume_summary(py::module_& m) {
    bind_record(
        m, "VolumeSummary",
        "Errors e of the functional point (mm) and tilts of the tool (rad) on a grid, by the exact "
        "pose, of axes that came in + direction.",
        field("largest", &VolumeSummary::largest, "Largest |e|, mm."),
        field("largest_at", &VolumeSummary::largest_at, "(3,) where, mm"),
        field("components", &VolumeSummary::components, "(3,) e there, mm"),
        field("rms", &VolumeSummary::rms, "Root of the mean of |e|^2 over the box, by the trapezoidal rule, mm."),
        field("lowest", &VolumeSummary::lowest, "(3,) of e by component, mm"),
        field("highest", &VolumeSummary::highest, "(3,) of e by component, mm"),
        field("tilt_lowest", &VolumeSummary::tilt_lowest, "(3,) A, B, C, rad"),
        field("tilt_highest", &VolumeSummary::tilt_highest, "(3,) A, B, C, rad"));
    m.def(
        "summarise_volume",
        [](const Machine& machine, const ArrayLike& x, const ArrayLike& y, const ArrayLike& z,
           const std::vector<std::string>& without, bool tilts) {
            const GridPositions grid = to_grid(x, y, z);
            std::vector<int> parameters;
            for (const std::string& name : without) parameters.push_back(to_parameter(name));
            py::gil_scoped_release release;
            return summarise_volume(without_parameters(machine, parameters), grid, tilts);
        },
        py::arg("machine"), py::arg("x"), py::arg("y"), py::arg("z"), py::kw_only(),
        py::arg("without") = std::vector<std::string>{}, py::arg("tilts") = true,
        "On the grid of all combinations of these ascending positions (mm). without: names of parameters to be set to "
        "0. tilts: whether to compute them, which takes most of the time. Raises InvalidArgument for positions that do "
        "not ascend and unknown names.");
    m.def(
        "errors_at",
        [](const Machine& machine, const ArrayLike& points) {
            const PointRows rows = to_points(points, "points");
            py::gil_scoped_release release;
            SixRows errors = errors_at(machine, rows);
            py::gil_scoped_acquire acquire;
            return to_rows(std::move(errors));
        },
        py::arg("machine"), py::arg("points"),
        "Error of the functional point (mm) and rotation vector of the tool (rad) at commanded points (n, 3), mm: "
        "(n, 6), exact, of axes that came in + direction.");
    m.def(
        "error_uncertainties_at",
        [](const Calibration& calibration, const ArrayLike& points, const std::optional<ArrayLike>& tool) {
            const PointRows rows = to_points(points, "points");
            const Eigen::Vector3d offset = tool ? to_vector3(*tool, "tool") : calibration.tool;
            py::gil_scoped_release release;
            SixRows uncertainties = error_uncertainties_at(calibration, offset, rows);
            py::gil_scoped_acquire acquire;
            return to_rows(std::move(uncertainties));
        },
        py::arg("calibration"), py::arg("points"), py::kw_only(), py::arg("tool") = std::nullopt,
        "Standard uncertainties of errors_at from the covariance of a calibration, (n, 6), mm and rad; NaN where a "
        "parameter is missing. Raises InvalidArgument without a covariance.");
    m.def(
        "error_changes_at",
        [](const Calibration& calibration, const ArrayLike& points, const ArrayLike& changes) {
            const PointRows rows = to_points(points, "points");
            return to_numpy(error_changes_at(calibration, calibration.tool, rows, to_matrix(changes, "changes")));
        },
        py::arg("calibration"), py::arg("points"), py::arg("changes"),
        "How errors_at change with the values of a calibration, to first order, (6 n, k), mm and rad, six rows a "
        "point: "
        "for changes (entries, k) of all its entries in the order of the covariance; NaN where a parameter is missing. "
        "Raises InvalidArgument.");
}

static void bind_volume_draws(py::module_& m) {
    py::class_<VolumeDraws>(m, "VolumeDraws",
                            "Draws of figures over a volume from the joint normal distribution of a calibration's "
                            "values, to first order.")
        .def(py::init([](const Calibration& calibration, const ArrayLike& x, const ArrayLike& y, const ArrayLike& z,
                         const std::optional<ArrayLike>& tool, const IntegerLike& seed) {
                 const auto offset = tool ? std::optional(to_vector3(*tool, "tool")) : std::nullopt;
                 const GridPositions grid = to_grid(x, y, z);
                 const std::uint64_t number = to_seed(seed);
                 py::gil_scoped_release release;
                 return std::make_unique<VolumeDraws>(calibration, grid, offset, number);
             }),
             py::arg("calibration"), py::arg("x"), py::arg("y"), py::arg("z"), py::kw_only(),
             py::arg("tool") = std::nullopt, py::arg("seed") = integer(0),
             "On the grid of all combinations of these ascending positions (mm). Raises InvalidArgument for a "
             "calibration without covariance.")
        .def_static(
            "names", [] { return std::vector<std::string>(volume_figures.begin(), volume_figures.end()); },
            "Columns of draw, without the last five.")
        .def_property_readonly(
            "values", [](const VolumeDraws& draws) { return to_numpy_vector(draws.values()); },
            "(20,) as a draw, of the calibration's own values, of which nothing is drawn.")
        .def(
            "draw",
            [](const VolumeDraws& draws, const IntegerLike& first, const IntegerLike& count) {
                const auto begin = std::uint64_t(to_integer(first, "first", 0, std::int64_t(1) << 62));
                const auto samples = std::size_t(to_integer(count, "count", 1, 1'000'000'000));
                py::gil_scoped_release release;
                const Eigen::MatrixXd figures = draws.draw(begin, samples);
                py::gil_scoped_acquire acquire;
                return to_numpy(figures);
            },
            py::arg("first"), py::arg("count"),
            "(count, 20) mm and rad, of the draws first, first + 1, ...: the same bits on any number of threads. The "
            "last five columns are of the place and the direction of the draw's largest error: the calibration's error "
            "e there along that direction, the length of e less what was drawn there, the standard uncertainty of e "
            "along the direction, and the traces of its covariance V and of V V.");
}

void bind_volume_errors(py::module_& m) {
    bind_volume_summary(m);
    bind_volume_draws(m);
}

}  // namespace stepdiag::bindings
