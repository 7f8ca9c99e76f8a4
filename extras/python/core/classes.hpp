// SPDX-License-Identifier: MIT
#pragma once

#include <pybind11/pybind11.h>

// pybind11 needs memory of its own in every call, and there are places where it isn't prepared to get none.

namespace py = pybind11;

namespace jostle_python {

/// As py::class_. pybind11 keeps a list of all objects, and an object for which that has no room is half
/// made: its memory would be given back without a call of its destructor or, where a unique_ptr still owns
/// it, twice.
template <class T, class... Extra>
py::class_<T> define_class(py::module_& m, const char* name, const char* doc = "", const Extra&... extra)
{
    py::class_<T> made(m, name, doc, extra...);
    py::detail::type_info* const type = py::detail::get_type_info(typeid(T));
    static auto* const init = type->init_instance;
    type->init_instance = [](py::detail::instance* object, const void* holder) {
        try {
            init(object, holder);
        } catch (...) {
            auto place = object->get_value_and_holder(py::detail::get_type_info(typeid(T)));
            if (holder == nullptr) delete place.template value_ptr<T>();
            place.value_ptr() = nullptr;
            throw;
        }
    };
    return made;
}

/// Makes all functions and methods of a module raise MemoryError where pybind11 itself runs out of memory.
/// It catches what is thrown while it converts arguments and calls, but not when it lists an object that a
/// constructor has made, or writes the message that arguments fit no function: std::bad_alloc would go
/// through Python's own code, which ends the program.
void guard_functions(const py::module_& m);

} // namespace jostle_python
