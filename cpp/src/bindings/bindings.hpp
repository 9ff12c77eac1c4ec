// Shared by the parts of the extension: argument types that give correct signatures, and their conversion.
#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>
#include <pybind11/typing.h>

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "stepdiag/core/error.hpp"
#include "stepdiag/diagnosis/adjust.hpp"
#include "stepdiag/machine/chain.hpp"
#include "stepdiag/optics/body.hpp"
#include "stepdiag/simulation/simulate.hpp"

namespace py = pybind11;

namespace stepdiag::bindings {

using DoubleArray = py::array_t<double, py::array::c_style | py::array::forcecast>;
using Points = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>;

// Anything that NumPy converts to an array. The shape is checked here, so that a wrong one is an InvalidArgument.
class ArrayLike : public py::object {
    PYBIND11_OBJECT_DEFAULT(ArrayLike, py::object, PyObject_Type)
};
// Any integer of Python. The range is checked here, so that a value beyond it is an InvalidArgument.
class IntegerLike : public py::object {
    PYBIND11_OBJECT_DEFAULT(IntegerLike, py::object, PyIndex_Check)
};
class ChainLike : public py::object {
    PYBIND11_OBJECT_DEFAULT(ChainLike, py::object, PyObject_Type)
};
class HeadLike : public py::object {
    PYBIND11_OBJECT_DEFAULT(HeadLike, py::object, PyObject_Type)
};
class MaterialLike : public py::object {
    PYBIND11_OBJECT_DEFAULT(MaterialLike, py::object, PyObject_Type)
};
class PathLike : public py::object {
    PYBIND11_OBJECT_DEFAULT(PathLike, py::object, PyObject_Type)
};

// SetupPriors in Python.
struct Priors {
    SetupPriors value;
};

Eigen::VectorXd to_vector(const py::handle& array, const char* name);  // any length
Eigen::Vector3d to_vector3(const py::handle& array, const char* name);
Eigen::Vector2d to_vector2(const py::handle& array, const char* name);
Points to_points(const py::handle& array, const char* name);  // (n, 3)
Eigen::MatrixXd to_matrix(const py::handle& array, const char* name);
std::int64_t to_integer(const IntegerLike& number, const std::string& name, std::int64_t lowest, std::int64_t highest);
int to_int(const IntegerLike& number, const std::string& name);  // any value of an int
std::uint64_t to_seed(const IntegerLike& number);
std::string to_path(const PathLike& path);
Chain to_chain(const ChainLike& chain);  // a Chain, or its text
Axis to_axis(const std::string& name);
Approaches to_approaches(const std::string& text);                             // "++-"
Placement to_placement(const ArrayLike& position, const ArrayLike& rotation);  // a rotation vector
Heads to_heads(const HeadLike& heads, const Plan& plan);                       // a Head, or one for each line

DoubleArray to_numpy(const std::vector<double>& values);
DoubleArray to_numpy(const std::vector<std::optional<double>>& values);  // NaN where there is no value
DoubleArray to_numpy(const Eigen::MatrixXd& matrix);
DoubleArray to_numpy_vector(const Eigen::VectorXd& vector);

template <class Records>
py::typing::Tuple<typename Records::value_type, py::ellipsis> to_tuple(const Records& records) {
    py::tuple tuple(records.size());
    for (std::size_t i = 0; i < records.size(); ++i) tuple[i] = records[i];
    return tuple;
}

inline IntegerLike integer(int number) { return py::reinterpret_steal<IntegerLike>(py::int_(number).release()); }
inline ArrayLike zeros(int size) {
    return py::reinterpret_borrow<ArrayLike>(py::make_tuple(0.0, 0.0, 0.0)[py::slice(0, size, 1)]);
}

// In the order of the rooms: a type must be bound before signatures name it.
void bind_core(py::module_& m);
void bind_machine(py::module_& m);
void bind_plan(py::module_& m);
void bind_measurement(py::module_& m);
void bind_optics(py::module_& m);
void bind_head(py::module_& m);
void bind_simulation(py::module_& m);
void bind_evaluation(py::module_& m);
void bind_adjustment(py::module_& m);
void bind_calibration(py::module_& m);  // after bind_evaluation
void bind_recheck(py::module_& m);      // after bind_calibration
void bind_batch(py::module_& m);        // after bind_calibration
void bind_monte_carlo(py::module_& m);
void bind_uncertainty(py::module_& m);
void bind_controller(py::module_& m);  // after bind_evaluation

}  // namespace stepdiag::bindings

namespace pybind11::detail {
template <>
struct handle_type_name<stepdiag::bindings::ArrayLike> {
    static constexpr auto name = const_name("numpy.typing.ArrayLike");
};
template <>
struct handle_type_name<stepdiag::bindings::IntegerLike> {
    static constexpr auto name = const_name("typing.SupportsIndex");
};
template <>
struct handle_type_name<stepdiag::bindings::ChainLike> {
    static constexpr auto name = const_name("Chain | str");
};
template <>
struct handle_type_name<stepdiag::bindings::HeadLike> {
    static constexpr auto name = const_name("Head | collections.abc.Mapping[str, Head]");
};
template <>
struct handle_type_name<stepdiag::bindings::MaterialLike> {
    static constexpr auto name = const_name("str | float");
};
template <>
struct handle_type_name<stepdiag::bindings::PathLike> {
    static constexpr auto name = const_name("str | os.PathLike[str]");
};
}  // namespace pybind11::detail
