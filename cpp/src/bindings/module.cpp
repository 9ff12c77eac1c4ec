// stepdiag._core: the C++ library in Python. Each part checks shapes, releases the interpreter lock, and calls the
// library.
#include <limits>

#include "bindings.hpp"
#include "stepdiag/version.hpp"
#include "wrong_arguments.hpp"

namespace stepdiag::bindings {

namespace {

DoubleArray to_array(const py::handle& object, const char* name) {
    DoubleArray array = DoubleArray::ensure(object);
    if (!array) {
        PyErr_Clear();
        throw InvalidArgument(std::string(name) + ": expected an array of numbers, got " +
                              std::string(py::str(py::type::handle_of(object))));
    }
    return array;
}

Eigen::VectorXd to_vector_of(const py::handle& object, const char* name, py::ssize_t size) {
    const DoubleArray array = to_array(object, name);
    if (array.ndim() != 1 || array.shape(0) != size)
        throw InvalidArgument(std::string(name) + ": expected " + std::to_string(size) + " numbers, got shape " +
                              std::string(py::str(py::object(array.attr("shape")))));
    return Eigen::Map<const Eigen::VectorXd>(array.data(), size);
}

[[noreturn]] void refuse_integer(const py::handle& number, const std::string& name, const std::string& range) {
    throw InvalidArgument(name + ": expected a whole number of " + range + ", got " + std::string(py::repr(number)));
}

// A bool is an int in Python, but here it is always a mistake.
py::int_ to_python_int(const IntegerLike& number, const std::string& name, const std::string& range) {
    if (py::isinstance<py::bool_>(number)) refuse_integer(number, name, range);
    const auto integer = py::reinterpret_steal<py::int_>(PyNumber_Index(number.ptr()));
    if (!integer) {
        PyErr_Clear();
        refuse_integer(number, name, range);
    }
    return integer;
}

}  // namespace

std::int64_t to_integer(const IntegerLike& number, const std::string& name, std::int64_t lowest, std::int64_t highest) {
    const std::string range = std::to_string(lowest) + " to " + std::to_string(highest);
    const py::int_ integer = to_python_int(number, name, range);
    int overflow = 0;
    const std::int64_t value = PyLong_AsLongLongAndOverflow(integer.ptr(), &overflow);
    if (overflow != 0 || value < lowest || value > highest) refuse_integer(integer, name, range);
    return value;
}

int to_int(const IntegerLike& number, const std::string& name) {
    return int(to_integer(number, name, std::numeric_limits<int>::min(), std::numeric_limits<int>::max()));
}

std::uint64_t to_seed(const IntegerLike& number) {
    const char* range = "0 to 2^64 - 1";
    const py::int_ integer = to_python_int(number, "seed", range);
    const std::uint64_t seed = PyLong_AsUnsignedLongLong(integer.ptr());
    if (PyErr_Occurred()) {
        PyErr_Clear();
        refuse_integer(integer, "seed", range);
    }
    return seed;
}

Eigen::VectorXd to_vector(const py::handle& object, const char* name) {
    const DoubleArray array = to_array(object, name);
    if (array.ndim() != 1)
        throw InvalidArgument(std::string(name) + ": expected one dimension, got shape " +
                              std::string(py::str(py::object(array.attr("shape")))));
    return Eigen::Map<const Eigen::VectorXd>(array.data(), array.shape(0));
}

Eigen::Vector3d to_vector3(const py::handle& object, const char* name) { return to_vector_of(object, name, 3); }
Eigen::Vector2d to_vector2(const py::handle& object, const char* name) { return to_vector_of(object, name, 2); }

Points to_points(const py::handle& object, const char* name) {
    const DoubleArray array = to_array(object, name);
    if (array.ndim() != 2 || array.shape(1) != 3)
        throw InvalidArgument(std::string(name) + ": expected shape (n, 3), got " +
                              std::string(py::str(py::object(array.attr("shape")))));
    return Eigen::Map<const Points>(array.data(), array.shape(0), 3);
}

Eigen::MatrixXd to_matrix(const py::handle& object, const char* name) {
    const DoubleArray array = to_array(object, name);
    if (array.ndim() != 2)
        throw InvalidArgument(std::string(name) + ": expected two dimensions, got shape " +
                              std::string(py::str(py::object(array.attr("shape")))));
    return Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>(
        array.data(), array.shape(0), array.shape(1));
}

std::string to_path(const PathLike& path) {
    // A file name may have any bytes except the one that ends strings in C.
    const auto name = py::module_::import("os").attr("fsencode")(path).cast<std::string>();
    if (name.find('\0') != std::string::npos)
        throw InvalidArgument("path: expected the name of a file, got one with a NUL byte");
    return name;
}

Chain to_chain(const ChainLike& chain) {
    if (py::isinstance<Chain>(chain)) return chain.cast<Chain>();
    if (py::isinstance<py::str>(chain)) return Chain::parse(chain.cast<std::string>());
    throw InvalidArgument("chain: expected a Chain or its text, got " +
                          std::string(py::str(py::type::handle_of(chain))));
}

Axis to_axis(const std::string& name) {
    for (const Axis axis : all_axes)
        if (name == std::string(1, letter(axis))) return axis;
    throw InvalidArgument("axis: expected \"X\", \"Y\" or \"Z\", got \"" + name + "\"");
}

DoubleArray to_numpy(const std::vector<double>& values) {
    return DoubleArray(py::ssize_t(values.size()), values.data());
}

DoubleArray to_numpy(const std::vector<std::optional<double>>& values) {
    DoubleArray array(py::ssize_t(values.size()));
    for (std::size_t i = 0; i < values.size(); ++i)
        array.mutable_data()[i] = values[i].value_or(std::numeric_limits<double>::quiet_NaN());
    return array;
}

DoubleArray to_numpy(const Eigen::MatrixXd& matrix) {
    DoubleArray array({matrix.rows(), matrix.cols()});
    Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>(
        array.mutable_data(), matrix.rows(), matrix.cols()) = matrix;
    return array;
}

DoubleArray to_numpy_vector(const Eigen::VectorXd& vector) { return DoubleArray(vector.size(), vector.data()); }

// The message may quote a path, which need not be UTF-8.
void bind_exception(py::module_& m) {
    static py::exception<InvalidArgument> type(m, "InvalidArgument", PyExc_ValueError);
    type.doc() = "Bad input: the message names the argument, file and line, or key, what was expected and what came.";
    py::register_exception_translator([](std::exception_ptr thrown) {
        try {
            if (thrown) std::rethrow_exception(thrown);
        } catch (const NothingDetermined& refusal) {
            const py::object& make = type;
            const py::object error = make(refusal.evaluation() + ": nothing can be determined");
            if (!refusal.findings().empty()) error.attr("finding") = refusal.findings().front();
            PyErr_SetObject(type.ptr(), error.ptr());
        } catch (const InvalidArgument& error) {
            const std::string_view text = error.what();
            const auto message = py::reinterpret_steal<py::object>(
                PyUnicode_DecodeUTF8(text.data(), py::ssize_t(text.size()), "surrogateescape"));
            PyErr_SetObject(type.ptr(), message.ptr());
        }
    });
}

}  // namespace stepdiag::bindings

PYBIND11_MODULE(_core, m) {
    using namespace stepdiag::bindings;
    m.doc() = "The C++ core of stepdiag. Native units: mm, rad, nm.";
    m.attr("__version__") = stepdiag::version();
    bind_exception(m);
    bind_core(m);
    bind_machine(m);
    bind_plan(m);
    bind_measurement(m);
    bind_optics(m);
    bind_head(m);
    bind_simulation(m);
    bind_evaluation(m);
    bind_adjustment(m);
    bind_calibration(m);
    bind_recheck(m);
    bind_batch(m);
    bind_monte_carlo(m);
    bind_uncertainty(m);
    bind_controller(m);
    bind_wrong_arguments(m);
}
