// SPDX-License-Identifier: MIT
#include "core/classes.hpp"

#include <new>

namespace jostle_python {

namespace {

PyCFunctionWithKeywords dispatcher = nullptr; // pybind11's, the same for all functions

PyObject* guarded(PyObject* self, PyObject* arguments, PyObject* keywords)
{
    try {
        return dispatcher(self, arguments, keywords);
    } catch (const std::bad_alloc&) {
        return PyErr_NoMemory();
    }
}

template <class To, class From>
To function_cast(From* function)
{
    return reinterpret_cast<To>(reinterpret_cast<void (*)()>(function)); // as compilers want it
}

/// The C function behind a function or method, or null.
PyMethodDef* definition_of(py::handle function)
{
    PyObject* inner = function.ptr();
    if (PyInstanceMethod_Check(inner)) inner = PyInstanceMethod_GET_FUNCTION(inner);
    return PyCFunction_Check(inner) ? reinterpret_cast<PyCFunctionObject*>(inner)->m_ml : nullptr;
}

void guard(py::handle function)
{
    PyMethodDef* const definition = definition_of(function);
    if (definition != nullptr && definition->ml_meth == function_cast<PyCFunction>(dispatcher))
        definition->ml_meth = function_cast<PyCFunction>(guarded);
}

} // namespace

void guard_functions(const py::module_& m)
{
    dispatcher = function_cast<PyCFunctionWithKeywords>(definition_of(m.attr("version"))->ml_meth);
    const py::dict functions = m.attr("__dict__");
    for (const auto& [name, value] : functions) {
        guard(value);
        if (!PyType_Check(value.ptr())) continue;
        const py::dict methods(value.attr("__dict__"));
        for (const auto& [method, of] : methods) {
            guard(of);
            if (PyObject_TypeCheck(of.ptr(), &PyProperty_Type)) guard(of.attr("fget"));
        }
    }
}

} // namespace jostle_python
