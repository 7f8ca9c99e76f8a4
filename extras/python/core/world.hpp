// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "core/arrays.hpp"
#include "core/interrupts.hpp"
#include "core/users.hpp"

namespace jostle_python {

/// Commands may be given at any time. What reads is refused while an update or the like goes on, but not in
/// the function that the update asks; and the other way round.
class World
{
  public:
    World(jostle_space given, double margin, py::object function, std::uint32_t threads,
          const std::vector<std::array<std::uint32_t, 2>>& layers)
        : space(given),
          accept(std::move(function)),
          pending(std::make_shared<Pending>()),
          memory(std::make_shared<Interruptible>())
    {
        const Executor executor = executor_of(threads);
        const jostle_options common = options_of(executor, memory->allocator());
        jostle_world_options options{};
        options.struct_size = sizeof options;
        options.common = &common;
        options.margin = margin;
        std::vector<jostle_query_layer> given_layers;
        for (const auto& [category, mask] : layers)
            given_layers.push_back({category, mask});
        options.layers = given_layers.data();
        options.layer_count = given_layers.size();
        if (!accept.is_none()) {
            asked = std::make_shared<Asks>(Asks{accept, pending.get()});
            options.context = asked.get();
            options.accept = [](void* context, jostle_id a, jostle_id b) {
                auto* const self = static_cast<Asks*>(context);
                const Users::Lent now(*updating);
                return self->pending->call([&] { return truth_of(self->accept(a, b)); });
            };
        }
        handle = make<WorldHandle>(
            [&](auto** out, auto* error) { return jostle_world_new(space, &options, out, error); });
    }
    using Ids = Packed<std::uint64_t>;

    /// While it lasts, the world changes.
    class Updating
    {
      public:
        explicit Updating(World& world) : now_(world.users), outer_(std::exchange(updating, &world.users)) {}
        ~Updating() { updating = outer_; }
        Updating(const Updating&) = delete;

      private:
        Users::Changing now_;
        Users* outer_; // of a world in whose update this one is updated
    };

    template <class F>
    void with_boxes(const Ids& ids, const py::array& boxes, F&& f)
    {
        const Boxes given = boxes_of(boxes, "boxes", space);
        want_length(ids, given.view.count, "ids");
        const std::uint64_t* const first = ids.data();
        memory->call([&](jostle_error* error) { return f(handle.get(), first, &given.view, error); },
                     pending.get());
    }
    template <class F>
    void with_ids(const Ids& ids, F&& f) const
    {
        const std::uint64_t count = length_of(ids, "ids");
        const std::uint64_t* const first = ids.data();
        call([&](jostle_error* error) { return f(handle.get(), first, count, error); });
    }
    template <class T, class F>
    py::array read(const Ids& ids, F&& f) const
    {
        const Users::Reading now(users);
        return read_any_time<T>(ids, f);
    }
    template <class T, class F>
    py::array read_any_time(const Ids& ids, F&& f) const
    {
        Packed<T> out(static_cast<py::ssize_t>(length_of(ids, "ids")));
        T* const data = out.mutable_data();
        with_ids(ids, [&](auto* world, auto* first, auto count, auto* error) {
            return f(world, first, count, data, error);
        });
        return out;
    }
    template <class F>
    py::array read_boxes(const Ids& ids, F&& f) const
    {
        const Users::Reading now(users);
        py::array out(number_of(space), {static_cast<py::ssize_t>(length_of(ids, "ids")), py::ssize_t(2),
                                         py::ssize_t(dim_of(space))});
        void* const data = out.mutable_data();
        with_ids(ids, [&](auto* world, auto* first, auto count, auto* error) {
            return f(world, first, count, data, error);
        });
        return out;
    }
    template <class F>
    py::array listed(F&& f) const
    {
        const Users::Reading now(users);
        jostle_blocks pairs;
        call([&](jostle_error* error) { return f(handle.get(), &pairs, error); });
        return copy_pairs(pairs);
    }
    py::dict stats() const
    {
        const Users::Reading now(users);
        jostle_world_stats s{};
        s.struct_size = sizeof s;
        call([&](jostle_error* error) { return jostle_world_stats_read(handle.get(), &s, error); });
        py::dict stats("objects"_a = s.objects, "resting"_a = s.resting, "active"_a = s.active,
                       "disabled"_a = s.disabled, "refused"_a = s.refused, "commands"_a = s.commands,
                       "dropped"_a = s.dropped, "changed"_a = s.changed, "woken"_a = s.woken,
                       "settled"_a = s.settled, "candidates"_a = s.candidates,
                       "false_positives"_a = s.false_positives, "listed"_a = s.listed, "began"_a = s.began,
                       "persisted"_a = s.persisted, "ended"_a = s.ended,
                       "bytes_reserved"_a = s.bytes_reserved);
        stats["us_total"] = s.us_total;
        stats["us_apply"] = s.us_apply;
        stats["us_active"] = s.us_active;
        stats["us_resting"] = s.us_resting;
        stats["us_events"] = s.us_events;
        stats["us_index"] = s.us_index;
        stats["contested"] = s.contested;
        return stats;
    }

    jostle_space space;
    mutable Users users{"world"};
    py::object accept;
    std::shared_ptr<Pending> pending;
    static inline thread_local Users* updating = nullptr; // of the world whose update goes on on this thread
    struct Asks
    {
        py::handle accept; // which every world that asks it owns: Python's collector has to see each owner
        Pending* pending;
    };
    std::shared_ptr<Asks> asked;           // a fork asks the same
    std::shared_ptr<Interruptible> memory; // a fork's is the same
    WorldHandle handle;
};

/// What is done to objects, and known of them.
void define_objects(py::class_<World>& world);

} // namespace jostle_python
