// Arguments that no function takes: one line that says which one, in place of pybind11's list of signatures.
//
// pybind11 calls every function through one function of its own. Here each is called through answer() instead, which
// asks `words` for the line where that one refused the arguments. Nothing else changes: signatures, documentation and
// stubs are pybind11's, and a call that succeeds costs one call more.
#include "wrong_arguments.hpp"

namespace stepdiag::bindings {
namespace {

// pybind11's own function, of 3.0 and from 3.1 on.
PyCFunctionWithKeywords pybind_call = nullptr;
PyObject* (*pybind_fast_call)(PyObject*, PyObject* const*, Py_ssize_t, PyObject*) = nullptr;

py::object& words() {
    static auto* function = new py::object;  // lives as long as the process: objects cannot be released at its end
    return *function;
}

// No exception leaves this: Python calls it.
void explain(const py::object& arguments, const py::object& keywords) {
    py::error_already_set refusal;
    try {
        const auto text = py::str(refusal.value()).cast<std::string>();
        if (words() && text.find("arguments. The following argument types are supported") != std::string::npos) {
            PyErr_SetObject(PyExc_TypeError, words()(text, arguments, keywords).ptr());
            return;
        }
    } catch (const std::exception&) {  // the words failed: pybind11's own line remains
        PyErr_Clear();
    }
    refusal.restore();
}

bool is_refused(const PyObject* result) { return !result && PyErr_ExceptionMatches(PyExc_TypeError); }

PyObject* answer(PyObject* self, PyObject* arguments, PyObject* keywords) {
    PyObject* result = pybind_call(self, arguments, keywords);
    if (is_refused(result))
        explain(py::reinterpret_borrow<py::object>(arguments),
                keywords ? py::reinterpret_borrow<py::object>(keywords) : py::dict());
    return result;
}

PyObject* answer_fast(PyObject* self, PyObject* const* arguments, Py_ssize_t count, PyObject* names) {
    PyObject* result = pybind_fast_call(self, arguments, count, names);
    if (!is_refused(result)) return result;
    const Py_ssize_t placed = PyVectorcall_NARGS(std::size_t(count));
    py::tuple by_place(placed);
    for (Py_ssize_t i = 0; i < placed; ++i) by_place[std::size_t(i)] = py::handle(arguments[i]);
    py::dict by_name;
    for (Py_ssize_t i = 0; names && i < PyTuple_GET_SIZE(names); ++i)
        by_name[py::handle(PyTuple_GET_ITEM(names, i))] = py::handle(arguments[placed + i]);
    explain(by_place, by_name);
    return nullptr;
}

// Of all functions that pybind11 calls by one function of its own; the first that is seen says which.
template <class Call>
void exchange(PyMethodDef& definition, Call& own, Call other) {
    const auto call = reinterpret_cast<Call>(reinterpret_cast<void (*)()>(definition.ml_meth));
    if (!own) own = call;
    if (call == own) definition.ml_meth = reinterpret_cast<PyCFunction>(reinterpret_cast<void (*)()>(other));
}

void answer_for(py::handle object) {
    py::object function = py::reinterpret_borrow<py::object>(object);
    if (PyInstanceMethod_Check(object.ptr()))
        function = py::reinterpret_borrow<py::object>(PyInstanceMethod_GET_FUNCTION(object.ptr()));
    if (Py_TYPE(object.ptr()) == &PyStaticMethod_Type) function = object.attr("__func__");
    if (!PyCFunction_Check(function.ptr())) return;
    PyMethodDef& definition = *reinterpret_cast<PyCFunctionObject*>(function.ptr())->m_ml;
    if (definition.ml_flags == (METH_VARARGS | METH_KEYWORDS)) exchange(definition, pybind_call, &answer);
    if (definition.ml_flags == (METH_FASTCALL | METH_KEYWORDS)) exchange(definition, pybind_fast_call, &answer_fast);
}

}  // namespace

void bind_wrong_arguments(py::module_& m) {
    m.def(
        "word_wrong_arguments_with", [](py::object function) { words() = std::move(function); }, py::arg("words"),
        "Sets the function that makes the line for arguments that a function does not take; the package does so.");
    for (const auto& [name, value] : m.attr("__dict__").cast<py::dict>()) {
        answer_for(value);
        if (py::isinstance<py::type>(value))
            for (const auto& item : py::dict(value.attr("__dict__"))) answer_for(item.second);
    }
}

}  // namespace stepdiag::bindings
