// SPDX-License-Identifier: MIT
#include <cstring>
#include <string>

#include "core/arrays.hpp"
#include "core/interrupts.hpp"
#include "core/module.hpp"

namespace jostle_python {

namespace {

/// What is added up.
struct Sum
{
    jostle_responses* responses;
    const std::uint32_t* objects;
    const char* values;
    std::uint64_t row; // bytes
    Interruptible& memory;

    static std::int32_t add(void* context, std::uint64_t begin, std::uint64_t end, jostle_work work)
    {
        const auto* const self = static_cast<const Sum*>(context);
        if (!self->memory.may_go_on()) return -1;
        const jostle_status status =
            jostle_responses_add(self->responses, work, end - begin, self->objects + begin,
                                 self->values + begin * self->row, nullptr);
        return status == JOSTLE_OK ? 0 : -1;
    }
};

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
    jostle_responses_options options{};
    options.struct_size = sizeof options;
    options.common = &common;
    const auto width = static_cast<std::uint32_t>(values.shape(1));
    const ResponsesHandle responses = make<ResponsesHandle>(
        [&](auto** out, auto* error) { return jostle_responses_new(number, width, &options, out, error); });
    const auto count = static_cast<std::uint64_t>(values.shape(0));
    Sum sum{responses.get(), objects.data(), static_cast<const char*>(values.data()),
            std::uint64_t{width} * static_cast<std::uint64_t>(values.itemsize()), memory};
    const void* sums = nullptr;
    // As jostle_responses_sum does it, but with a look for signals in each block.
    memory.call([&](jostle_error* error) {
        jostle_process_options work{};
        work.struct_size = sizeof work;
        work.executor = executor.get();
        jostle_work_plan plan{};
        std::uint64_t merged = 0;
        jostle_status status = jostle_plan_work(count, &work, &plan, error);
        if (status == JOSTLE_OK) status = jostle_responses_start(sum.responses, object_count, &plan, error);
        if (status == JOSTLE_OK) status = jostle_process_items(count, Sum::add, &sum, &work, error);
        if (status == JOSTLE_OK)
            return jostle_responses_merge(sum.responses, nullptr, nullptr, &sums, &merged, error);
        if (!memory.may_go_on()) return status;
        // A mistake: its number counts from the first response.
        return jostle_responses_sum(sum.responses, object_count, sum.objects, sum.values, count, &sums,
                                    error);
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
