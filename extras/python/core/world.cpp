// SPDX-License-Identifier: MIT
#include "core/world.hpp"

#include <cstring>
#include <optional>
#include <string>
#include <vector>

#include "core/module.hpp"
#include "core/queries.hpp"

namespace jostle_python {

namespace {

/// What one of the functions that save says.
template <class Save, class Handle>
py::bytes saved(const Save& save, Handle* of)
{
    const Results results = new_results();
    const void* bytes = nullptr;
    std::uint64_t count = 0;
    call([&](jostle_error* error) { return save(of, results.get(), error); });
    call([&](jostle_error* error) { return jostle_results_bytes(results.get(), &bytes, &count, error); });
    return py::bytes(static_cast<const char*>(bytes), count);
}

template <class Restore, class Handle>
void restore(const Restore& function, Handle* into, const py::bytes& snapshot)
{
    char* bytes = nullptr;
    py::ssize_t count = 0;
    PyBytes_AsStringAndSize(snapshot.ptr(), &bytes, &count);
    call(
        [&](jostle_error* error) { return function(into, bytes, static_cast<std::uint64_t>(count), error); });
}

/// The world of an object that Python's collector looks at, null before and after its life.
World* world_of(PyObject* object)
{
    const auto place = reinterpret_cast<py::detail::instance*>(object)->get_value_and_holder();
    return place.holder_constructed() ? place.value_ptr<World>() : nullptr;
}

/// Shows Python's collector that a world owns the function that it asks, which may own the world.
void collect_functions(PyHeapTypeObject* heap_type)
{
    PyTypeObject& type = heap_type->ht_type;
    type.tp_flags |= Py_TPFLAGS_HAVE_GC;
    type.tp_traverse = [](PyObject* object, visitproc visit, void* arg) -> int {
        Py_VISIT(Py_TYPE(object));
        if (const World* const world = world_of(object)) Py_VISIT(world->accept.ptr());
        return 0;
    };
    type.tp_clear = [](PyObject* object) -> int {
        if (World* const world = world_of(object)) {
            world->handle.reset(); // it would ask the function
            world->accept = py::none();
        }
        return 0;
    };
}

/// join(), where a function in Python is asked: box by box, each on this thread.
py::array join_one_by_one(World& self, const Boxes& boxes, AskFilter& filter)
{
    std::vector<jostle_pair> found;
    const jostle_query_filter* const one = filter.one();
    const Results results = new_results();
    ask_in_parts(boxes.view.count, filter, [&](std::uint64_t first, std::uint64_t number, auto* error) {
        jostle_boxes some = boxes.view;
        some.count = number;
        const auto skipped = static_cast<std::ptrdiff_t>(first) * some.stride;
        for (int d = 0; d < dim_of(self.space); ++d) {
            some.lo[d] = static_cast<const char*>(some.lo[d]) + skipped;
            some.hi[d] = static_cast<const char*>(some.hi[d]) + skipped;
        }
        jostle_blocks pairs;
        jostle_status status = jostle_query_join(self.handle.get(), &some, one, results.get(), error);
        if (status == JOSTLE_OK) status = jostle_results_blocks(results.get(), &pairs, error);
        if (status != JOSTLE_OK) return status;
        const std::size_t before = found.size();
        found.resize(before + pairs.count);
        status = jostle_blocks_copy(&pairs, pairs.count, found.data() + before, error);
        for (std::size_t i = before; i < found.size(); ++i)
            found[i].a += static_cast<std::uint32_t>(first);
        return status;
    });
    Packed<std::uint32_t> out({static_cast<py::ssize_t>(found.size()), py::ssize_t(2)});
    std::memcpy(out.mutable_data(), found.data(), found.size() * sizeof found[0]);
    return out;
}

/// Rows of two ids.
std::uint64_t want_id_pairs(const U64& pairs, const char* name)
{
    if (pairs.ndim() != 2 || pairs.shape(1) != 2)
        refuse(std::string(name) + " has the shape " + shape_text(pairs) + ": it must be (m, 2)");
    return static_cast<std::uint64_t>(pairs.shape(0));
}

using PairSlotsHandle = Owned<jostle_pair_slots>;

class PairSlots
{
  public:
    struct Lists
    {
        const std::uint32_t *began = nullptr, *ended = nullptr;
        std::uint64_t began_count = 0, ended_count = 0;
        std::uint32_t end = 0;
    };
    Lists lists() const
    {
        Lists of;
        call([&](jostle_error* error) {
            return jostle_pair_slots_lists(handle.get(), &of.began, &of.began_count, &of.ended,
                                           &of.ended_count, &of.end, error);
        });
        return of;
    }
    void update(const U64& began, const U64& ended)
    {
        const std::uint64_t began_count = want_id_pairs(began, "began"),
                            ended_count = want_id_pairs(ended, "ended");
        std::vector<jostle_id_pair> begin(began_count);
        std::vector<jostle_ended_pair> finish(ended_count);
        for (std::uint64_t k = 0; k < began_count; ++k)
            begin[k] = {began.data()[2 * k], began.data()[2 * k + 1]};
        for (std::uint64_t k = 0; k < ended_count; ++k)
            finish[k] = {ended.data()[2 * k], ended.data()[2 * k + 1], JOSTLE_MOVED_APART, 0};
        const Users::Changing now(users);
        call([&](jostle_error* error) {
            return jostle_pair_slots_update(handle.get(), begin.data(), began_count, finish.data(),
                                            ended_count, error);
        });
    }
    U32 find(const U32& given) const
    {
        const Pairs pairs(given);
        U32 found(static_cast<py::ssize_t>(pairs.block.count));
        std::uint32_t* const out = found.mutable_data();
        const Users::Reading now(users);
        call([&](jostle_error* error) {
            return jostle_pair_slots_find(handle.get(), static_cast<const jostle_pair*>(pairs.block.items),
                                          pairs.block.count, out, error);
        });
        return found;
    }

    mutable Users users{"slots of pairs"};
    PairSlotsHandle handle = make<PairSlotsHandle>(jostle_pair_slots_new);
};

} // namespace

void define_pair_slots(py::module_& m)
{
    define_class<PairSlots>(m, "PairSlots")
        .def(py::init<>())
        .def("update", &PairSlots::update)
        .def("began_slots",
             [](const PairSlots& self) {
                 const Users::Reading now(self.users);
                 const PairSlots::Lists lists = self.lists();
                 return copy_array(lists.began, lists.began_count);
             })
        .def("ended_slots",
             [](const PairSlots& self) {
                 const Users::Reading now(self.users);
                 const PairSlots::Lists lists = self.lists();
                 return copy_array(lists.ended, lists.ended_count);
             })
        .def("slots_of", &PairSlots::find)
        .def("end",
             [](const PairSlots& self) {
                 const Users::Reading now(self.users);
                 return self.lists().end;
             })
        .def("save",
             [](const PairSlots& self) {
                 const Users::Reading now(self.users);
                 return saved(jostle_pair_slots_save, self.handle.get());
             })
        .def("restore", [](PairSlots& self, const py::bytes& bytes) {
            const Users::Changing now(self.users);
            restore(jostle_pair_slots_restore, self.handle.get(), bytes);
        });
}

void define_world(py::module_& m)
{
    py::class_<World> world = define_class<World>(m, "World", "", py::custom_type_setup(collect_functions));
    world
        .def(py::init<jostle_space, double, py::object, std::uint32_t,
                      std::vector<std::array<std::uint32_t, 2>>>())
        .def("touching",
             [](const World& self, const U64& ids) {
                 const Users::Reading now(self.users);

                 const Results results = new_results();
                 jostle_lists lists;
                 self.with_ids(ids, [&](auto* world, auto* first, auto count, auto* error) {
                     return jostle_world_touching(world, first, count, results.get(), error);
                 });
                 call(
                     [&](jostle_error* error) { return jostle_results_lists(results.get(), &lists, error); });
                 return py::make_tuple(copy_array(lists.first, lists.queries + 1),
                                       copy_array(lists.ids, lists.count));
             })
        .def("update",
             [](World& self) {
                 const World::Updating now(self);

                 self.memory->call(
                     [&](jostle_error* error) { return jostle_world_update(self.handle.get(), error); },
                     self.pending.get());
             })
        .def("apply",
             [](World& self) {
                 const World::Updating now(self);

                 self.memory->call(
                     [&](jostle_error* error) { return jostle_world_apply(self.handle.get(), error); });
             })
        .def("update_moves",
             [](World& self, const U64& ids, const Array& boxes) {
                 const World::Updating now(self);

                 self.with_boxes(ids, boxes, jostle_world_update_moves);
             })
        .def("began",
             [](const World& self) {
                 const Users::Reading now(self.users);

                 const jostle_id_pair* pairs = nullptr;
                 std::uint64_t count = 0;
                 call([&](jostle_error* error) {
                     return jostle_world_began(self.handle.get(), &pairs, &count, error);
                 });
                 U64 out({static_cast<py::ssize_t>(count), py::ssize_t(2)});
                 if (count != 0) std::memcpy(out.mutable_data(), pairs, count * sizeof *pairs);
                 return out;
             })
        .def("ended",
             [](const World& self) {
                 const Users::Reading now(self.users);

                 const jostle_ended_pair* pairs = nullptr;
                 std::uint64_t count = 0;
                 call([&](jostle_error* error) {
                     return jostle_world_ended(self.handle.get(), &pairs, &count, error);
                 });
                 U64 out({static_cast<py::ssize_t>(count), py::ssize_t(2)});
                 Packed<std::uint8_t> reasons(static_cast<py::ssize_t>(count));
                 for (std::uint64_t i = 0; i < count; ++i) {
                     out.mutable_data()[2 * i] = pairs[i].a;
                     out.mutable_data()[2 * i + 1] = pairs[i].b;
                     reasons.mutable_data()[i] = static_cast<std::uint8_t>(pairs[i].reason);
                 }
                 return py::make_tuple(out, reasons);
             })
        .def("persisted", [](const World& self) { return self.listed(jostle_world_persisted); })
        .def("changed_pairs", [](const World& self) { return self.listed(jostle_world_changed_pairs); })
        .def("pairs",
             [](const World& self) {
                 const Users::Reading now(self.users);

                 const Results results = new_results();
                 self.memory->call([&](jostle_error* error) {
                     return jostle_world_pairs(self.handle.get(), results.get(), error);
                 });
                 return copy_pairs(results);
             })
        .def("visit_pairs",
             [](const World& self, py::object visit, std::uint64_t chunk) {
                 const Users::Reading now(self.users);

                 Pending pending;
                 Visitor visitor(std::move(visit), chunk, 2, false, pending);
                 return visitor.run([&](void* context, auto* finished, auto* error) {
                     return jostle_world_visit_pairs(self.handle.get(), Visitor::take_touching_pair, context,
                                                     finished, error);
                 });
             })
        .def("visit_closest_pairs",
             [](const World& self, const World* other, double max_distance, py::object visit,
                std::uint64_t chunk) {
                 const Users::Reading now(self.users);
                 const Users::Reading others(other == nullptr ? self.users : other->users);

                 return Verbs::closest_pairs(self.handle.get(),
                                             other == nullptr ? nullptr : other->handle.get(), max_distance,
                                             std::move(visit), chunk, false);
             })
        .def("join",
             [](World& self, const Array& boxes, AskFilter& filter) {
                 const Users::Reading now(self.users);

                 const Boxes given = boxes_of(boxes, "boxes", self.space);
                 if (filter.asks_python()) return join_one_by_one(self, given, filter);
                 const jostle_query_filter* const one = filter.one();
                 const Results results = new_results(self.memory->allocator());
                 self.memory->call(
                     [&](jostle_error* error) {
                         return jostle_query_join(self.handle.get(), &given.view, one, results.get(), error);
                     },
                     &filter.pending);
                 return copy_pairs(results);
             })
        .def("save",
             [](const World& self) {
                 const Users::Reading now(self.users);
                 return saved(jostle_world_save, self.handle.get());
             })
        .def("restore",
             [](World& self, const py::bytes& snapshot) {
                 const World::Updating now(self);

                 restore(jostle_world_restore, self.handle.get(), snapshot);
             })
        .def("save_base",
             [](World& self) {
                 const Users::Reading now(self.users);
                 return saved(jostle_world_save_base, self.handle.get());
             })
        .def("save_changes",
             [](World& self) {
                 const Users::Reading now(self.users);
                 return saved(jostle_world_save_changes, self.handle.get());
             })
        .def("restore_changes",
             [](World& self, const py::bytes& changes) {
                 const World::Updating now(self);

                 restore(jostle_world_restore_changes, self.handle.get(), changes);
             })
        .def("follow",
             [](World& self, const World& other) {
                 const World::Updating now(self);
                 std::optional<Users::Reading> others;
                 if (&self != &other) others.emplace(other.users); // else the library says what is wrong

                 call([&](jostle_error* error) {
                     return jostle_world_follow(self.handle.get(), other.handle.get(), error);
                 });
             })
        .def("fork",
             [](const World& self) {
                 const Users::Reading now(self.users);

                 auto fork = std::make_unique<World>(self.space, 0, py::none(), 1,
                                                     std::vector<std::array<std::uint32_t, 2>>());
                 fork->handle = make<WorldHandle>([&](auto** out, auto* error) {
                     return jostle_world_fork(self.handle.get(), out, error);
                 });
                 fork->memory = self.memory;
                 fork->accept = self.accept;
                 fork->pending = self.pending;
                 fork->asked = self.asked;
                 return fork;
             })
        .def("stats", &World::stats)
        .def("explain",
             [](const World& self) {
                 const Users::Reading now(self.users);

                 const Results results = new_results();
                 const void* bytes = nullptr;
                 std::uint64_t count = 0;
                 call([&](jostle_error* error) {
                     return jostle_world_explain(self.handle.get(), results.get(), error);
                 });
                 call([&](jostle_error* error) {
                     return jostle_results_bytes(results.get(), &bytes, &count, error);
                 });
                 return py::str(static_cast<const char*>(bytes), count);
             })
        .def_readonly("accept", &World::accept);
    define_verbs<World>(world);
    define_objects(world);
}

} // namespace jostle_python
