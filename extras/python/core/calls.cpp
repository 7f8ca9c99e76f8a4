// SPDX-License-Identifier: MIT
#include "core/calls.hpp"

namespace jostle_python {

void raise_error(const std::string& status, const std::string& message, const py::object& index)
{
    const py::object exception = py::module_::import("jostle._errors").attr("make")(status, message, index);
    PyErr_SetObject(reinterpret_cast<PyObject*>(Py_TYPE(exception.ptr())), exception.ptr());
    throw py::error_already_set();
}
void refuse(const std::string& message)
{
    raise_error("invalid_argument", message, py::none());
}
void raise(const jostle_error& error)
{
    if (error.status == JOSTLE_OUT_OF_MEMORY) {
        PyErr_SetString(PyExc_MemoryError, error.message);
        throw py::error_already_set();
    }
    const char* name = "unknown";
    jostle_status_name(error.status, &name, nullptr);
    const py::object index =
        error.index == UINT64_MAX ? py::object(py::none()) : py::object(py::int_(error.index));
    raise_error(name, error.message, index);
}

Results new_results(const jostle_allocator* allocator)
{
    const jostle_options options = options_of(nullptr, allocator);
    return make<Results>([&](auto** out, auto* error) { return jostle_results_new(&options, out, error); });
}

Executor executor_of(std::uint32_t threads)
{
    if (threads == 0) return nullptr;
    return make<Executor>([&](auto** out, auto* error) {
        return threads == 1 ? jostle_executor_serial(out, error)
                            : jostle_executor_threads(threads, out, error);
    });
}

jostle_options options_of(const Executor& executor, const jostle_allocator* allocator)
{
    jostle_options options{};
    options.struct_size = sizeof options;
    options.executor = executor.get();
    options.allocator = allocator;
    return options;
}

} // namespace jostle_python
