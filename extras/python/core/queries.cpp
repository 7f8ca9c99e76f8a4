// SPDX-License-Identifier: MIT
#include "core/queries.hpp"

#include "core/module.hpp"

namespace jostle_python {

void define_queries(py::module_& m)
{
    define_class<Queries>(m, "Queries")
        .def(py::init<jostle_query_kind, const Array&, jostle_space, const std::vector<Array>&, std::uint32_t,
                      const Shapes*, const Maybe&>());
    define_class<AskFilter>(m, "AskFilter")
        .def(py::init<Maybe, Maybe, Maybe, std::optional<std::array<std::uint32_t, 3>>,
                      std::optional<std::uint64_t>, const std::optional<Packed<std::uint64_t>>&,
                      py::object>());
}

} // namespace jostle_python
