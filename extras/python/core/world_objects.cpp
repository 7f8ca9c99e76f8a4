// SPDX-License-Identifier: MIT
#include <optional>
#include <span>
#include <vector>

#include "core/world.hpp"

namespace jostle_python {
namespace {

/// Rows of category, mask, owner, and whether it is static.
std::span<const jostle_object_filter> filters_of(const U32& filters)
{
    static_assert(sizeof(jostle_object_filter) == 16);
    if (filters.ndim() != 2 || filters.shape(1) != 4) refuse("filters must be (n, 4)");
    return {reinterpret_cast<const jostle_object_filter*>(filters.data()),
            static_cast<std::size_t>(filters.shape(0))};
}

} // namespace

void define_objects(py::class_<World>& world)
{
    world
        .def("set_user_data",
             [](World& self, const U64& ids, const U64& data) {
                 want_length(data, length_of(ids, "ids"), "data");
                 const std::uint64_t* const all = data.data();
                 self.with_ids(ids, [&](auto*, auto* first, auto count, auto* error) {
                     return jostle_world_set_user_data(self.handle.get(), first, count, all, error);
                 });
             })
        .def("user_data",
             [](const World& self, const U64& ids) {
                 return self.read_any_time<std::uint64_t>(ids, jostle_world_user_data);
             })
        .def("add",
             [](World& self, const Array& boxes, const U32& filters, const F64& margins,
                const Packed<std::uint8_t>& enabled) {
                 const Boxes given = boxes_of(boxes, "boxes", self.space);
                 const auto of = filters_of(filters); // of all boxes if there is one, else of each
                 want_length(margins, of.size(), "margins");
                 want_length(enabled, of.size(), "enabled");
                 std::vector<jostle_object_options> options(of.size());
                 for (std::size_t i = 0; i < of.size(); ++i) {
                     options[i].struct_size = sizeof options[i];
                     options[i].filter = &of[i];
                     options[i].margin = margins.data()[i];
                     options[i].disabled = enabled.data()[i] != 0 ? 0 : 1;
                     options[i].count = of.size();
                 }
                 U64 ids(static_cast<py::ssize_t>(given.view.count));
                 std::uint64_t* const out = ids.mutable_data();
                 const auto* const first = options.empty() ? nullptr : options.data();
                 call([&](jostle_error* error) {
                     return jostle_world_add(self.handle.get(), &given.view, first, out, error);
                 });
                 return ids;
             })
        .def("remove",
             [](World& self, const U64& ids) {
                 self.with_ids(ids, [&](auto*, auto* first, auto count, auto* error) {
                     return jostle_world_remove(self.handle.get(), first, count, error);
                 });
             })
        .def("move",
             [](World& self, const U64& ids, const Array& boxes, const Maybe& displacements,
                std::uint32_t sequence) {
                 const void* by = nullptr;
                 if (displacements) {
                     want_rows(*displacements, self.space, dim_of(self.space),
                               static_cast<std::uint64_t>(boxes.ndim() > 0 ? boxes.shape(0) : 0),
                               "displacements");
                     by = displacements->data();
                 }
                 self.with_boxes(ids, boxes, [&](auto* world, auto* first, auto* given, auto* error) {
                     return jostle_world_move(world, first, given, by, sequence, error);
                 });
             })
        .def("resize",
             [](World& self, const U64& ids, const Array& sizes, std::uint32_t sequence) {
                 want_rows(sizes, self.space, dim_of(self.space), length_of(ids, "ids"), "sizes");
                 const void* const data = sizes.data();
                 self.with_ids(ids, [&](auto*, auto* first, auto count, auto* error) {
                     return jostle_world_resize(self.handle.get(), first, count, data, sequence, error);
                 });
             })
        .def("set_filter",
             [](World& self, const U64& ids, const U32& filters, std::uint32_t sequence) {
                 const auto of = filters_of(filters);
                 if (of.size() != length_of(ids, "ids")) refuse("filters must be as many as ids");
                 const jostle_object_filter* const data = of.data();
                 self.with_ids(ids, [&](auto*, auto* first, auto count, auto* error) {
                     return jostle_world_set_filter(self.handle.get(), first, count, data, sequence, error);
                 });
             })
        .def("set_margin",
             [](World& self, const U64& ids, const F64& margins, std::uint32_t sequence) {
                 want_length(margins, length_of(ids, "ids"), "margins");
                 const double* const data = margins.data();
                 self.with_ids(ids, [&](auto*, auto* first, auto count, auto* error) {
                     return jostle_world_set_margin(self.handle.get(), first, count, data, sequence, error);
                 });
             })
        .def("set_enabled",
             [](World& self, const U64& ids, const Packed<std::uint8_t>& enabled, std::uint32_t sequence) {
                 want_length(enabled, length_of(ids, "ids"), "enabled");
                 const std::uint8_t* const data = enabled.data();
                 self.with_ids(ids, [&](auto*, auto* first, auto count, auto* error) {
                     return jostle_world_set_enabled(self.handle.get(), first, count, data, sequence, error);
                 });
             })
        .def("report_again",
             [](World& self, const U64& ids, const std::optional<U64>& others) {
                 if (others) want_length(*others, length_of(ids, "ids"), "others");
                 const std::uint64_t* const second = others ? others->data() : nullptr;
                 self.with_ids(ids, [&](auto*, auto* first, auto count, auto* error) {
                     return jostle_world_report_again(self.handle.get(), first, second, count, error);
                 });
             })
        .def("clear",
             [](World& self) {
                 const World::Updating now(self);
                 call([&](jostle_error* error) { return jostle_clear(self.handle.get(), error); });
             })
        .def("bounds_of_all",
             [](const World& self) -> py::object {
                 const Users::Reading now(self.users);
                 Array out(number_of(self.space), {py::ssize_t(2), py::ssize_t(dim_of(self.space))});
                 void* const data = out.mutable_data();
                 std::int32_t any = 0;
                 call([&](jostle_error* error) {
                     return jostle_query_bounds(self.handle.get(), &any, data, error);
                 });
                 return any != 0 ? py::object(out) : py::object(py::none());
             })
        .def("size",
             [](const World& self) {
                 const Users::Reading now(self.users);
                 std::uint64_t size = 0;
                 call([&](jostle_error* error) { return jostle_size(self.handle.get(), &size, error); });
                 return size;
             })
        .def("index_end",
             [](const World& self) {
                 const Users::Reading now(self.users);
                 std::uint32_t end = 0;
                 call([&](jostle_error* error) {
                     return jostle_world_index_end(self.handle.get(), &end, error);
                 });
                 return end;
             })
        .def("contains", [](const World& self,
                            const U64& ids) { return self.read<std::uint8_t>(ids, jostle_world_contains); })
        .def("ids",
             [](const World& self, const U32& indices) {
                 const Users::Reading now(self.users);
                 U64 out(static_cast<py::ssize_t>(length_of(indices, "indices")));
                 const std::uint32_t* const first = indices.data();
                 std::uint64_t* const data = out.mutable_data();
                 const auto count = static_cast<std::uint64_t>(out.shape(0));
                 call([&](jostle_error* error) {
                     return jostle_world_ids(self.handle.get(), first, count, data, error);
                 });
                 return out;
             })
        .def("boxes",
             [](const World& self, const U64& ids) { return self.read_boxes(ids, jostle_world_boxes); })
        .def("bounds",
             [](const World& self, const U64& ids) { return self.read_boxes(ids, jostle_world_bounds); })
        .def("filters",
             [](const World& self, const U64& ids) {
                 const Users::Reading now(self.users);
                 U32 out({static_cast<py::ssize_t>(length_of(ids, "ids")), py::ssize_t(4)});
                 auto* const data = reinterpret_cast<jostle_object_filter*>(out.mutable_data());
                 self.with_ids(ids, [&](auto* world, auto* first, auto count, auto* error) {
                     return jostle_world_filters(world, first, count, data, error);
                 });
                 return out;
             })
        .def("enabled", [](const World& self,
                           const U64& ids) { return self.read<std::uint8_t>(ids, jostle_world_enabled); })
        .def("margins",
             [](const World& self, const U64& ids) { return self.read<double>(ids, jostle_world_margins); });
}

} // namespace jostle_python
