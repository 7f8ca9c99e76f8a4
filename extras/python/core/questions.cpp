// SPDX-License-Identifier: MIT
#include "core/questions.hpp"

#include "core/module.hpp"

namespace jostle_python {

void define_questions(py::module_& m)
{
    define_class<Questions>(m, "Questions")
        .def(py::init<jostle_question, const Array&, jostle_space, const std::vector<Array>&,
                      std::uint32_t>());
    define_class<AskFilter>(m, "AskFilter")
        .def(py::init<Maybe, Maybe, Maybe, std::optional<std::array<std::uint32_t, 3>>,
                      std::optional<std::uint64_t>, const std::optional<Packed<std::uint64_t>>&,
                      py::object>());
}

} // namespace jostle_python
