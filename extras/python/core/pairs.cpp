// SPDX-License-Identifier: MIT
#include "core/pairs.hpp"

#include <cstring>

#include "core/interrupts.hpp"
#include "core/module.hpp"
#include "core/users.hpp"

namespace jostle_python {

namespace {

/// Searches in memory that it keeps. Where a function in Python is to be asked, on the thread that calls.
class PairFinder
{
  public:
    explicit PairFinder(std::uint32_t threads)
        : threads_(threads), handle_(make_handle(threads)), last_(handle_.get())
    {
    }
    /// As find() in pairs.hpp.
    py::array find(const py::array& boxes, const std::optional<py::array>& other, PairFilter& filter,
                   bool sorted, jostle_accept_pair_function accept = nullptr, void* context = nullptr)
    {
        const Boxes a = boxes_of(boxes, "boxes");
        std::optional<Boxes> b;
        if (other) b = boxes_of(*other, "other", a.space);
        jostle_filter wish = filter.filter;
        if (accept != nullptr) {
            wish.accept = accept;
            wish.context = context;
        }
        const Users::Changing now(users_); // until the pairs are copied
        if (!filter.accept.is_none() && threads_ != 1) {
            if (serial_ == nullptr) serial_ = make_handle(1);
            last_ = serial_.get();
        } else {
            last_ = handle_.get();
        }
        jostle_blocks pairs{};
        const auto search = [&](jostle_error* error) {
            return jostle_finder_find(last_, a.space, &a.view, b ? &b->view : nullptr, &wish,
                                      sorted ? JOSTLE_SORTED : JOSTLE_CANONICAL, &pairs, error);
        };
        memory_.call(search, &filter.pending);
        return copy_pairs(pairs);
    }
    /// Of the last search.
    py::dict stats()
    {
        const Users::Changing now(users_);
        jostle_stats s{};
        s.struct_size = sizeof s;
        call([&](jostle_error* error) { return jostle_finder_stats(last_, &s, error); });
        py::dict stats("objects"_a = s.objects, "pairs"_a = s.pairs, "records"_a = s.records,
                       "candidates"_a = s.candidates, "ties"_a = s.ties, "bricks"_a = s.bricks,
                       "nested_grids"_a = s.nested_grids, "bytes_reserved"_a = s.bytes_reserved);
        stats["ms_total"] = s.ms_total;
        stats["ms_tune"] = s.ms_tune;
        stats["ms_scatter"] = s.ms_scatter;
        stats["ms_sweep"] = s.ms_sweep;
        stats["ms_finish"] = s.ms_finish;
        return stats;
    }
    void release_memory()
    {
        const Users::Changing now(users_);
        for (jostle_finder* const finder : {handle_.get(), serial_.get()})
            if (finder != nullptr)
                call([&](jostle_error* error) { return jostle_release_memory(finder, error); });
    }

  private:
    [[nodiscard]] FinderHandle make_handle(std::uint32_t threads)
    {
        const Executor executor = executor_of(threads);
        const jostle_options options = options_of(executor, memory_.allocator());
        return make<FinderHandle>(
            [&](auto** out, auto* error) { return jostle_finder_new(&options, out, error); });
    }

    std::uint32_t threads_;
    Users users_{"pair finder"};
    Interruptible memory_;
    FinderHandle handle_, serial_; // the latter is made when it is needed
    jostle_finder* last_;
};

} // namespace

py::array find(const py::array& boxes, const std::optional<py::array>& other, PairFilter& filter, bool sorted,
               std::uint32_t threads, jostle_accept_pair_function accept, void* context)
{
    return PairFinder(threads).find(boxes, other, filter, sorted, accept, context);
}

namespace {

/// Pairs of periodic space: objects, and what the second is shifted by.
py::tuple find_periodic(const py::array& boxes, const Packed<double>& period, PairFilter& filter, bool sorted,
                        std::uint32_t threads)
{
    const Boxes given = boxes_of(boxes, "boxes");
    const auto dim = static_cast<std::uint64_t>(dim_of(given.space));
    want_length(period, dim, "period");
    const Executor executor = executor_of(threads);
    Interruptible memory;
    const jostle_options options = options_of(executor, memory.allocator());
    const ImagesHandle images = make<ImagesHandle>(
        [&](auto** out, auto* error) { return jostle_images_new(given.space, &options, out, error); });
    const FinderHandle finder =
        make<FinderHandle>([&](auto** out, auto* error) { return jostle_finder_new(&options, out, error); });
    float single[3] = {};
    for (std::uint64_t d = 0; d < dim; ++d)
        single[d] = static_cast<float>(period.data()[d]);
    const void* const lengths =
        is_float(given.space) ? static_cast<const void*>(single) : static_cast<const void*>(period.data());
    jostle_images_view view{};
    jostle_blocks found{};
    const auto search = [&](jostle_error* error) {
        jostle_status status = jostle_images_build(images.get(), &given.view, lengths, error);
        jostle_filter wish{};
        if (status == JOSTLE_OK) status = jostle_images_view_read(images.get(), &view, error);
        if (status == JOSTLE_OK) status = jostle_images_filter(images.get(), &filter.filter, &wish, error);
        if (status != JOSTLE_OK) return status;
        return jostle_finder_find(finder.get(), given.space, &view.boxes, nullptr, &wish,
                                  sorted ? JOSTLE_SORTED : JOSTLE_CANONICAL, &found, error);
    };
    memory.call(search, &filter.pending);
    py::array pairs = copy_pairs(found);
    py::array shifts(number_of(given.space), {pairs.shape(0), static_cast<py::ssize_t>(dim)});
    auto* const objects = static_cast<std::uint32_t*>(pairs.mutable_data());
    auto* const out = static_cast<char*>(shifts.mutable_data());
    const std::size_t row = dim * static_cast<std::size_t>(shifts.itemsize());
    for (std::uint64_t i = 0; i < found.count; ++i) {
        const std::uint32_t image = objects[2 * i + 1];
        objects[2 * i + 1] = view.origin[image];
        std::memcpy(out + i * row, static_cast<const char*>(view.shift) + image * row, row);
    }
    return py::make_tuple(pairs, shifts);
}

/// Returns the pairs of all scenes, one scene's behind the other's, and where each scene's begin.
py::tuple find_scenes(const py::array& boxes, const Packed<std::uint64_t>& offsets,
                      const std::optional<py::array>& category, const std::optional<py::array>& mask,
                      const std::optional<py::array>& owner, const py::object& accept, std::uint32_t threads)
{
    const Boxes all = boxes_of(boxes, "boxes");
    const std::uint64_t count = length_of(offsets, "offsets");
    if (count == 0)
        refuse("offsets is empty: it must have one number for each scene's first box, and the end");
    const Executor executor = executor_of(threads);
    Interruptible memory;
    const jostle_options options = options_of(executor, memory.allocator());
    struct Asked
    {
        const py::object& accept;
        Pending pending;
    } asked{accept, {}};
    jostle_scene_filter filter{};
    filter.struct_size = sizeof filter;
    filter.category = values_of<std::uint32_t>(category, "category");
    filter.mask = values_of<std::uint32_t>(mask, "mask");
    filter.owner = values_of<std::uint32_t>(owner, "owner");
    if (!accept.is_none()) {
        filter.context = &asked;
        filter.accept = [](void* context, std::uint64_t scene, std::uint32_t a, std::uint32_t b) {
            auto* const self = static_cast<Asked*>(context);
            return self->pending.call([&] { return truth_of(self->accept(scene, a, b)); });
        };
    }
    const FinderHandle finder =
        make<FinderHandle>([&](auto** out, auto* error) { return jostle_finder_new(&options, out, error); });
    jostle_blocks pairs{};
    const std::uint64_t* const places = offsets.data();
    const auto search = [&](jostle_error* error) {
        return jostle_finder_find_scenes(finder.get(), all.space, &all.view, places, count - 1, &filter,
                                         &pairs, error);
    };
    memory.call(search, &asked.pending);
    Packed<std::int64_t> first(static_cast<py::ssize_t>(count));
    std::int64_t* const out = first.mutable_data();
    out[0] = 0;
    for (std::uint64_t scene = 0; scene + 1 < count; ++scene)
        out[scene + 1] = out[scene] + static_cast<std::int64_t>(pairs.blocks[scene].count);
    return py::make_tuple(copy_pairs(pairs), first);
}

py::array spatial_order(const py::array& boxes, std::uint32_t threads)
{
    const Boxes given = boxes_of(boxes, "boxes");
    const Executor executor = executor_of(threads);
    Interruptible memory;
    const jostle_options options = options_of(executor, memory.allocator());
    Packed<std::uint32_t> order(static_cast<py::ssize_t>(given.view.count));
    std::uint32_t* const to = order.mutable_data();
    memory.call([&](jostle_error* error) {
        return jostle_spatial_order(given.space, &given.view, &options, to, error);
    });
    return order;
}

} // namespace

void define_pairs(py::module_& m)
{
    define_class<PairFilter>(m, "PairFilter")
        .def(py::init<Maybe, Maybe, Maybe, Maybe, Maybe, Maybe, std::uint64_t, Maybe, py::object>());
    define_class<PairFinder>(m, "PairFinder")
        .def(py::init<std::uint32_t>())
        .def("find", [](PairFinder& self, const Array& boxes, const Maybe& other, PairFilter& filter,
                        bool sorted) { return self.find(boxes, other, filter, sorted); })
        .def("stats", &PairFinder::stats)
        .def("release_memory", &PairFinder::release_memory);
    m.def("find", [](const Array& boxes, const Maybe& other, PairFilter& filter, bool sorted,
                     std::uint32_t threads) { return find(boxes, other, filter, sorted, threads); });
    m.def("find_periodic", &find_periodic);
    m.def("find_scenes", &find_scenes);
    m.def("spatial_order", &spatial_order);
}

} // namespace jostle_python
