// SPDX-License-Identifier: MIT
#include <string>

#include "core/arrays.hpp"
#include "core/interrupts.hpp"
#include "core/module.hpp"

namespace jostle_python {

namespace {

py::array sum_by_object(const Packed<std::uint32_t>& objects, const py::array& values,
                        std::uint32_t object_count, std::uint32_t threads)
{
    const py::dtype type = values.dtype();
    const jostle_number number = type.equal(py::dtype::of<float>())    ? JOSTLE_FLOAT
                                 : type.equal(py::dtype::of<double>()) ? JOSTLE_DOUBLE
                                                                       : JOSTLE_INT64;
    if (number == JOSTLE_INT64 && !type.equal(py::dtype::of<std::int64_t>()))
        refuse("values must be float32, float64 or int64, not " + std::string(py::str(py::handle(type))));
    if (values.ndim() != 2 || (values.flags() & py::array::c_style) == 0)
        refuse("values must be contiguous rows");
    want_length(objects, static_cast<std::uint64_t>(values.shape(0)), "objects");
    const Executor executor = executor_of(threads);
    Interruptible memory;
    const jostle_options common = options_of(executor, memory.allocator());
    const auto width = static_cast<std::uint32_t>(values.shape(1));
    py::array out(type, {static_cast<py::ssize_t>(object_count), values.shape(1)});
    memory.call([&](jostle_error* error) {
        return jostle_sum_by_object(number, width, objects.data(), values.data(),
                                    static_cast<std::uint64_t>(values.shape(0)), &common, object_count,
                                    out.mutable_data(), error);
    });
    return out;
}

} // namespace

void define_responses(py::module_& m)
{
    m.def("sum_by_object", &sum_by_object);
}

} // namespace jostle_python
