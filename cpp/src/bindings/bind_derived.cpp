#include <pybind11/typing.h>

#include "bindings.hpp"
#include "stepdiag/uncertainty/volumetric_accuracy.hpp"

namespace stepdiag::bindings {
namespace {

std::optional<Eigen::Vector3d> to_tool(const std::optional<ArrayLike>& tool) {
    return tool ? std::optional(to_vector3(*tool, "tool")) : std::nullopt;
}

// Name -> what is missing for it, where something is.
template <std::size_t Size>
std::map<std::string, std::vector<std::string>> missing_by_name(
    const std::array<std::vector<std::string>, Size>& missing, const std::array<const char*, Size>& names) {
    std::map<std::string, std::vector<std::string>> named;
    for (std::size_t i = 0; i < Size; ++i)
        if (!missing[i].empty()) named[names[i]] = missing[i];
    return named;
}

void bind_points(py::module_& m) {
    py::class_<ErrorAtPoint>(
        m, "ErrorAtPoint",
        "The deviations X, Y, Z (mm) of the functional point and A, B, C (rad) of the tool at a commanded point, to "
        "first order, with covariance from the calibration's. NaN where the calibration lacks something that acts "
        "there.")
        .def_property_readonly(
            "point", [](const ErrorAtPoint& e) { return to_numpy_vector(e.point); }, "(3,) mm")
        .def_property_readonly(
            "tool", [](const ErrorAtPoint& e) { return to_numpy_vector(e.tool); }, "(3,) mm")
        .def_property_readonly(
            "value", [](const ErrorAtPoint& e) { return to_numpy_vector(e.value); }, "(6,) mm, rad")
        .def_property_readonly(
            "standard_uncertainty", [](const ErrorAtPoint& e) { return to_numpy_vector(e.standard_uncertainty()); },
            "(6,) mm, rad; NaN where the calibration has no covariance.")
        .def_property_readonly(
            "covariance", [](const ErrorAtPoint& e) { return to_numpy(Eigen::MatrixXd(e.covariance)); },
            "(6, 6) mm^2, mm rad, rad^2; NaN where the calibration has none.")
        .def_property_readonly(
            "missing", [](const ErrorAtPoint& e) { return missing_by_name(e.missing, deviation_names); },
            "\"X\" ... \"C\" -> parameters that act in it and are not determined: \"EAX\", \"slope of EXX\".");

    m.def(
        "error_at_point",
        [](const Calibration& calibration, const ArrayLike& point, const std::optional<ArrayLike>& tool) {
            return error_at_point(calibration, to_vector3(point, "point"), to_tool(tool));
        },
        py::arg("calibration"), py::arg("point"), py::kw_only(), py::arg("tool") = std::nullopt,
        "The error at a commanded point (mm) with a tool offset (mm; none: the calibration's), of axes that came in + "
        "direction: e = sum over axes of delta + theta x lever. Raises InvalidArgument for lengths that are not "
        "finite.");

    py::class_<DiagonalErrors>(
        m, "DiagonalErrors",
        "Along a body diagonal (ISO 230-6): how much further than commanded the functional point is from where the "
        "diagonal begins.")
        .def_property_readonly("line", [](const DiagonalErrors& d) { return d.line.name(); })
        .def_property_readonly(
            "point", [](const DiagonalErrors& d) { return to_numpy(Eigen::MatrixXd(d.point)); }, "(n, 3) mm, commanded")
        .def_property_readonly(
            "travel", [](const DiagonalErrors& d) { return to_numpy_vector(d.travel); },
            "(n,) mm, commanded, from the first point")
        .def_property_readonly(
            "value", [](const DiagonalErrors& d) { return to_numpy_vector(d.value); },
            "(n,) mm; NaN where the calibration lacks something.")
        .def_property_readonly(
            "standard_uncertainty", [](const DiagonalErrors& d) { return to_numpy_vector(d.standard_uncertainty()); },
            "(n,) mm; NaN where the calibration has no covariance.")
        .def_property_readonly(
            "covariance", [](const DiagonalErrors& d) { return to_numpy(d.covariance); }, "(n, n) mm^2")
        .def_property_readonly("range", &DiagonalErrors::range,
                               "Largest less smallest value, mm; its uncertainty: volumetric_accuracy.")
        .def_readonly("missing", &DiagonalErrors::missing, "Parameters that are not determined.");

    m.def(
        "diagonal_errors",
        [](const Calibration& calibration, const std::optional<ArrayLike>& tool) {
            std::map<std::string, DiagonalErrors> diagonals;
            for (DiagonalErrors& diagonal : diagonal_errors(calibration, to_tool(tool)))
                diagonals.emplace(diagonal.line.name(), std::move(diagonal));
            return diagonals;
        },
        py::arg("calibration"), py::kw_only(), py::arg("tool") = std::nullopt,
        "Of the body diagonals \"ppp\", \"npp\", \"pnp\", \"nnp\". tool: offset (mm); none: the calibration's. Raises "
        "InvalidArgument for an offset that is not finite.");
}

void bind_volume(py::module_& m) {
    const auto column = [](auto member) {
        return [member](const VolumetricAccuracy& v) { return to_numpy_vector(Eigen::VectorXd(v.*member)); };
    };
    py::class_<VolumetricAccuracy>(
        m, "VolumetricAccuracy",
        "ISO 230-1's V_XYZ: the ranges over the volume of the deviations X, Y, Z (mm) of the functional point and A, "
        "B, C (rad) of the tool, and the ranges of the four body diagonals' errors (mm); in the order of `names`. A "
        "range is not linear in the parameters and noise makes it larger: `bias` says about how much larger `value` is "
        "than the true range; `interval` takes that off.")
        .def_property_readonly("names", [](const VolumetricAccuracy&) { return range_names; })
        .def_property_readonly("value", column(&VolumetricAccuracy::value), "(10,) of the calibration's values.")
        .def_property_readonly("mean", column(&VolumetricAccuracy::mean), "(10,) of the draws.")
        .def_property_readonly("standard_uncertainty", column(&VolumetricAccuracy::standard_uncertainty),
                               "(10,) standard deviation of the draws.")
        .def_property_readonly(
            "bias", [](const VolumetricAccuracy& v) { return to_numpy_vector(v.bias()); }, "(10,) mean - value")
        .def_property_readonly(
            "drawn_interval", [](const VolumetricAccuracy& v) { return to_numpy(Eigen::MatrixXd(v.drawn_interval)); },
            "(10, 2) probabilistically symmetric coverage interval of the draws: too large by twice the bias.")
        .def_property_readonly(
            "interval", [](const VolumetricAccuracy& v) { return to_numpy(Eigen::MatrixXd(v.interval)); },
            "(10, 2) the drawn interval mirrored about the value, 2 value - drawn_interval: takes the bias off to "
            "first "
            "order; not below 0.")
        .def_property_readonly("bound", column(&VolumetricAccuracy::bound),
                               "(10,) the true range is within value -+ bound with at least the coverage probability: "
                               "the quantile of the range of noise alone.")
        .def_readonly("resolution", &VolumetricAccuracy::resolution,
                      "By how much V_X, V_Y, V_Z may be too small on either side for want of points between the nodes "
                      "of axes that carry the workpiece, mm; 0 with one such axis.")
        .def_property_readonly(
            "missing", [](const VolumetricAccuracy& v) { return missing_by_name(v.missing, range_names); },
            "Name -> parameters that act in it and are not determined; its numbers are NaN.")
        .def_readonly("samples", &VolumetricAccuracy::samples);

    m.def(
        "volumetric_accuracy",
        [](const Calibration& calibration, const std::optional<ArrayLike>& tool, double coverage,
           const IntegerLike& samples, const IntegerLike& seed) {
            const auto offset = to_tool(tool);
            const auto count = std::size_t(to_integer(samples, "samples", 1, 1'000'000'000));
            const RangeOptions options{coverage, count, to_seed(seed)};
            py::gil_scoped_release release;
            return volumetric_accuracy(calibration, offset, options);
        },
        py::arg("calibration"), py::kw_only(), py::arg("tool") = std::nullopt,
        py::arg("coverage") = RangeOptions{}.coverage, py::arg("samples") = integer(int(RangeOptions{}.samples)),
        py::arg("seed") = integer(0),
        "By draws from the joint normal distribution of a calibration evaluated with full_covariance. tool: offset "
        "(mm); none: the calibration's. Raises InvalidArgument without a covariance and for fewer samples than "
        "100/(1 - coverage).");

    py::class_<RangeModel, SampleModel>(
        m, "RangeModel",
        "The ranges of VolumetricAccuracy as a model for the Monte Carlo method; those that something is missing for "
        "are no outputs.")
        .def(
            py::init([](const Calibration& calibration, const std::optional<ArrayLike>& tool, const IntegerLike& seed) {
                return std::make_unique<RangeModel>(calibration, to_tool(tool), to_seed(seed));
            }),
            py::arg("calibration"), py::kw_only(), py::arg("tool") = std::nullopt, py::arg("seed") = integer(0),
            "Raises InvalidArgument for a calibration without covariance.");
}

}  // namespace

void bind_derived(py::module_& m) {
    py::class_<DerivedOutput>(m, "DerivedOutput",
                              "A linear combination of a calibration's entries, as an output of virtual calibrations.")
        .def(py::init([](const std::string& name, const std::string& unit, const ArrayLike& row) {
                 return DerivedOutput{name, unit, to_vector(row, "row")};
             }),
             py::arg("name"), py::arg("unit"), py::arg("row"),
             "row: coefficients by entry, in the order of Calibration.covariance_labels. A tuple of the three does as "
             "well where one is expected.")
        .def(py::init([](const py::typing::Tuple<py::str, py::str, ArrayLike>& parts) {
            if (parts.size() != 3) throw InvalidArgument("derived: expected (name, unit, row)");
            return DerivedOutput{parts[0].cast<std::string>(), parts[1].cast<std::string>(),
                                 to_vector(parts[2], "derived")};
        }))
        .def_readonly("name", &DerivedOutput::name)
        .def_readonly("unit", &DerivedOutput::unit)
        .def_property_readonly("row", [](const DerivedOutput& output) { return to_numpy_vector(output.row); });
    py::implicitly_convertible<py::tuple, DerivedOutput>();
    m.def(
        "with_covariance",
        [](const Calibration& calibration, const ArrayLike& covariance) {
            const DoubleArray array = DoubleArray::ensure(covariance);
            if (!array || array.ndim() != 2) {
                PyErr_Clear();
                throw InvalidArgument("covariance: expected a matrix of numbers");
            }
            using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
            return with_covariance(calibration,
                                   Eigen::Map<const RowMajor>(array.data(), array.shape(0), array.shape(1)));
        },
        py::arg("calibration"), py::arg("covariance"),
        "The calibration with another covariance of its values, such as Propagation.covariance of its entries, and the "
        "standard uncertainties that go with it. Raises InvalidArgument for what is no covariance of these values.");
    m.def(
        "derived_at_point",
        [](const Calibration& calibration, const ArrayLike& point, const std::optional<ArrayLike>& tool) {
            return derived_at_point(calibration, to_vector3(point, "point"), to_tool(tool));
        },
        py::arg("calibration"), py::arg("point"), py::kw_only(), py::arg("tool") = std::nullopt,
        "The deviations of error_at_point as outputs of virtual calibrations with entries like this calibration's: up "
        "to six, those that nothing is missing for.");
    m.def(
        "derived_on_diagonals",
        [](const Calibration& calibration, const std::optional<ArrayLike>& tool) {
            return derived_on_diagonals(calibration, to_tool(tool));
        },
        py::arg("calibration"), py::kw_only(), py::arg("tool") = std::nullopt,
        "The values of diagonal_errors as outputs of virtual calibrations, those that nothing is missing for.");
    bind_points(m);
    bind_volume(m);
}

}  // namespace stepdiag::bindings
