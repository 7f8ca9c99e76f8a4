// SPDX-License-Identifier: MIT
#pragma once

#include <pybind11/pybind11.h>

#include "core/classes.hpp"

// Each adds one subject to the module, with its types. A type is added before the functions that take it.

namespace py = pybind11;

namespace jostle_python {

void define_pairs(py::module_& m);
void define_spheres(py::module_& m);
void define_neighbors(py::module_& m);
void define_surfaces(py::module_& m);
void define_pair_stream(py::module_& m);
void define_queries(py::module_& m);
void define_index(py::module_& m);
void define_world(py::module_& m);
void define_pair_slots(py::module_& m);
void define_shapes(py::module_& m);
void define_closed_mesh(py::module_& m);
void define_contacts(py::module_& m);
void define_responses(py::module_& m);

} // namespace jostle_python
