// SPDX-License-Identifier: MIT
#include <cstdint>
#include <optional>

#include "core/interrupts.hpp"
#include "core/module.hpp"
#include "core/queries.hpp"
#include "core/users.hpp"

namespace jostle_python {

namespace {

class BoxIndex
{
  public:
    BoxIndex(jostle_space space, std::uint32_t threads) : space(space)
    {
        const Executor executor = executor_of(threads);
        const jostle_options options = options_of(executor, memory.allocator());
        handle = make<IndexHandle>(
            [&](auto** out, auto* error) { return jostle_index_new(space, &options, out, error); });
    }
    template <class F>
    void change(const std::optional<Packed<std::uint32_t>>& ids, const py::array& boxes, F&& f)
    {
        const Boxes given = boxes_of(boxes, "boxes", space);
        if (ids) want_length(*ids, given.view.count, "ids");
        const std::uint32_t* const first = ids ? ids->data() : nullptr;
        const Users::Changing now(users);
        memory.call([&](jostle_error* error) { return f(handle.get(), first, &given.view, error); });
    }
    template <class F>
    void change(F&& f)
    {
        const Users::Changing now(users);
        call([&](jostle_error* error) { return f(handle.get(), error); });
    }
    /// What f(index) returns, which asks and changes nothing.
    template <class F>
    auto read(F&& f) const
    {
        const Users::Reading now(users);
        return f(static_cast<const jostle_index*>(handle.get()));
    }
    /// The same, which also asks another index, or none.
    template <class F>
    auto read(const BoxIndex* other, F&& f) const
    {
        if (other == nullptr)
            return read([&](const jostle_index* index) {
                return f(index, static_cast<const jostle_index*>(nullptr));
            });
        return read([&](const jostle_index* index) {
            return other->read([&](const jostle_index* others) { return f(index, others); });
        });
    }
    py::dict stats() const
    {
        jostle_index_stats s{};
        s.struct_size = sizeof s;
        read([&](auto* index) {
            call([&](jostle_error* error) { return jostle_index_stats_read(index, &s, error); });
        });
        return py::dict("objects"_a = s.objects, "pages"_a = s.pages, "leaves"_a = s.leaves,
                        "nodes"_a = s.nodes, "depth"_a = s.depth, "bytes"_a = s.bytes, "sorts"_a = s.sorts,
                        "splits"_a = s.splits);
    }

    jostle_space space;
    Interruptible memory;
    mutable Users users{"index"};
    Users joining{"index's join"};
    IndexHandle handle;
};

} // namespace

void define_index(py::module_& m)
{
    auto index = define_class<BoxIndex>(m, "BoxIndex");
    define_verbs<BoxIndex>(index);
    index.def(py::init<jostle_space, std::uint32_t>())
        .def("build", [](BoxIndex& self, const std::optional<U32>& ids,
                         const Array& boxes) { self.change(ids, boxes, jostle_index_build); })
        .def("insert", [](BoxIndex& self, const U32& ids,
                          const Array& boxes) { self.change(ids, boxes, jostle_index_insert); })
        .def("move", [](BoxIndex& self, const U32& ids,
                        const Array& boxes) { self.change(ids, boxes, jostle_index_move); })
        .def("erase",
             [](BoxIndex& self, const U32& ids) {
                 const std::uint64_t count = length_of(ids, "ids");
                 const std::uint32_t* const first = ids.data();
                 self.change([&](auto* index, auto* error) {
                     return jostle_index_erase(index, first, count, error);
                 });
             })
        .def("clear", [](BoxIndex& self) { self.change(jostle_clear); })
        .def("release_memory", [](BoxIndex& self) { self.change(jostle_release_memory); })
        .def("size",
             [](const BoxIndex& self) {
                 std::uint64_t size = 0;
                 self.read([&](auto* index) {
                     call([&](jostle_error* error) { return jostle_size(index, &size, error); });
                 });
                 return size;
             })
        .def("contains",
             [](const BoxIndex& self, const U32& ids) {
                 Packed<std::uint8_t> out(static_cast<py::ssize_t>(length_of(ids, "ids")));
                 const std::uint32_t* const first = ids.data();
                 std::uint8_t* const data = out.mutable_data();
                 const auto count = static_cast<std::uint64_t>(out.shape(0));
                 self.read([&](auto* index) {
                     call([&](jostle_error* error) {
                         return jostle_index_contains(index, first, count, data, error);
                     });
                 });
                 return out;
             })
        .def("boxes",
             [](const BoxIndex& self, const U32& ids) {
                 const std::uint64_t count = length_of(ids, "ids");
                 Array out(number_of(self.space), {static_cast<py::ssize_t>(count), py::ssize_t(2),
                                                   py::ssize_t(dim_of(self.space))});
                 const std::uint32_t* const first = ids.data();
                 void* const data = out.mutable_data();
                 self.read([&](auto* index) {
                     call([&](jostle_error* error) {
                         return jostle_index_boxes(index, first, count, data, error);
                     });
                 });
                 return out;
             })
        .def("stats", &BoxIndex::stats)
        .def("join",
             [](BoxIndex& self, const Array& boxes) {
                 const Boxes given = boxes_of(boxes, "boxes", self.space);
                 const Results results = new_results(self.memory.allocator());
                 const Users::Reading now(self.users);
                 const Users::Changing alone(self.joining); // it works in memory of the index's
                 self.memory.call([&](jostle_error* error) {
                     return jostle_query_join(self.handle.get(), &given.view, nullptr, results.get(), error);
                 });
                 return copy_pairs(results);
             })
        .def("visit_pairs",
             [](const BoxIndex& self, const BoxIndex* other, py::object visit, std::uint64_t chunk) {
                 Pending pending;
                 Visitor visitor(std::move(visit), chunk, 2, true, pending);
                 return self.read(other, [&](auto* index, auto* others) {
                     return visitor.run([&](void* context, auto* finished, auto* error) {
                         return jostle_index_pairs(index, others, Visitor::take_pair, context, finished,
                                                   error);
                     });
                 });
             })
        .def("visit_closest_pairs", [](const BoxIndex& self, const BoxIndex* other, double max_distance,
                                       py::object visit, std::uint64_t chunk) {
            return self.read(other, [&](auto* index, auto* others) {
                return Verbs::closest_pairs(index, others, max_distance, std::move(visit), chunk, true);
            });
        });
}

} // namespace jostle_python
