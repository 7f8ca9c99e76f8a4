// SPDX-License-Identifier: MIT
#include <cstring>
#include <string>

#include "core/arrays.hpp"
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
    const jostle_options common = options_of(executor);
    jostle_responses_options options{};
    options.struct_size = sizeof options;
    options.common = &common;
    const ResponsesHandle responses = make<ResponsesHandle>([&](auto** out, auto* error) {
        return jostle_responses_new(number, static_cast<std::uint32_t>(values.shape(1)), &options, out,
                                    error);
    });
    const void* sums = nullptr;
    const std::uint32_t* const of = objects.data();
    const void* const given = values.data();
    const auto count = static_cast<std::uint64_t>(values.shape(0));
    call([&](jostle_error* error) {
        return jostle_responses_sum(responses.get(), object_count, of, given, count, &sums, error);
    });
    py::array out(type, {static_cast<py::ssize_t>(object_count), values.shape(1)});
    if (out.nbytes() != 0) std::memcpy(out.mutable_data(), sums, static_cast<std::size_t>(out.nbytes()));
    return out;
}

} // namespace

void define_responses(py::module_& m)
{
    m.def("sum_by_object", &sum_by_object);
}

} // namespace jostle_python
