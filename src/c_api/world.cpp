// SPDX-License-Identifier: MIT
#include <bit>
#include <cstring>
#include <mutex>
#include <variant>

#include "c_api/questions.hpp"
#include "jostle/world.hpp"

namespace jostle::c_api {
namespace {

// An id in C is a number: the index below, the generation above. Where that is what an ObjectId is in memory,
// arrays of ids are read in place.
constexpr bool same_in_memory = std::endian::native == std::endian::little;
static_assert(sizeof(ObjectId) == sizeof(jostle_id) && offsetof(ObjectId, index) == 0);

ObjectId from_c(jostle_id id) noexcept
{
    // 0 names nothing, as a default ObjectId does.
    return id == 0 ? ObjectId{}
                   : ObjectId{static_cast<std::uint32_t>(id), static_cast<std::uint32_t>(id >> 32)};
}
jostle_id to_c(ObjectId id) noexcept
{
    return id.generation == 0 ? 0 : static_cast<jostle_id>(id.generation) << 32 | id.index;
}

/// An array of the caller's ids as the C++ interface wants it.
class Ids
{
  public:
    Ids(const jostle_id* ids, std::uint64_t count)
    {
        wanted_array(ids, count, "ids");
        const auto size = static_cast<std::size_t>(count);
        if constexpr (same_in_memory) {
            span_ = std::span(reinterpret_cast<const ObjectId*>(ids), size);
        } else {
            swapped_.reserve(size);
            for (std::size_t i = 0; i < size; ++i)
                swapped_.push_back(from_c(ids[i]));
            span_ = swapped_;
        }
    }
    operator std::span<const ObjectId>() const noexcept { return span_; }
    [[nodiscard]] std::size_t size() const noexcept { return span_.size(); }
    ObjectId operator[](std::size_t i) const noexcept { return span_[i]; }

  private:
    std::vector<ObjectId> swapped_;
    std::span<const ObjectId> span_;
};

class WorldContent final : public Content
{
  public:
    WorldContent(jostle_space in, const jostle_world_options& given)
        : kept(keep(given.common)), accept(given.accept), context(given.context), space(in)
    {
        WorldOptions options = kept.options<WorldOptions>();
        options.margin = given.margin;
        if (accept != nullptr)
            options.accept = [call = accept, with = context](ObjectId a, ObjectId b) {
                return agreed(call(with, to_c(a), to_c(b)));
            };
        in_space(space, [&](auto of) {
            world.emplace<World<decltype(of)::dim, typename decltype(of)::T>>(options);
        });
    }
    /// A fork of another.
    explicit WorldContent(const WorldContent& other)
        : Content(), kept(other.kept), accept(other.accept), context(other.context), space(other.space)
    {
        other.on([&]<int Dim, Coordinate T>(const World<Dim, T>& typed) {
            world.emplace<World<Dim, T>>(typed.fork());
        });
    }
    template <class F>
    void on(F&& inside)
    {
        std::visit(
            [&](auto& typed) {
                if constexpr (!std::same_as<decltype(typed), std::monostate&>) inside(typed);
            },
            world);
    }
    template <class F>
    void on(F&& inside) const
    {
        std::visit(
            [&](const auto& typed) {
                if constexpr (!std::same_as<decltype(typed), const std::monostate&>) inside(typed);
            },
            world);
    }
    /// What was handed out as of the update before is no more.
    void changed() noexcept { began_listed = ended_listed = persisted_listed = changed_listed = false; }

    Kept kept;
    jostle_accept_object_pair_function accept;
    void* context;
    jostle_space space;
    std::variant<std::monostate, World2f, World3f, World2d, World3d> world;

    // The last update's lists as C sees them, made when they are first asked for: by any thread.
    mutable std::mutex listing;
    mutable bool began_listed = false, ended_listed = false, persisted_listed = false, changed_listed = false;
    mutable std::vector<jostle_id_pair> began;
    mutable std::vector<jostle_ended_pair> ended;
    mutable std::vector<jostle_block> persisted_table, changed_table;
    mutable jostle_blocks persisted{}, changed_pairs{};
};

class WorldFilter
{
  public:
    explicit WorldFilter(const jostle_query_filter* given)
        : given_(read_options(given, "jostle_query_filter"))
    {
        if (given_.category.count != 0 || given_.mask.count != 0 || given_.owner.count != 0)
            refuse("a world knows its objects' filters: give no category, mask or owner but the asker's");
        if (given_.asker != nullptr) {
            filter.category = given_.asker->category;
            filter.mask = given_.asker->mask;
            filter.owner = given_.asker->owner;
        }
        if (given_.exclude != nullptr) filter.exclude = from_c(*given_.exclude);
        if (given_.accept != nullptr) filter.accept = accept_;
    }
    WorldFilter(const WorldFilter&) = delete;
    WorldFilter& operator=(const WorldFilter&) = delete;

    ObjectQueryFilter filter;

  private:
    struct Accept
    {
        const jostle_query_filter* given;
        bool operator()(std::uint32_t question, ObjectId id) const
        {
            return agreed(given->accept(given->context, question, to_c(id)));
        }
    };
    jostle_query_filter given_;
    Accept accept_{&given_};
};

ObjectFilter filter_of(const jostle_object_filter& filter) noexcept
{
    return {filter.category, filter.mask, filter.owner, filter.is_static != 0};
}

/// Calls queue(i) for each of `count` commands; an error names the one at fault.
template <class F>
void queue_each(std::size_t count, F&& queue)
{
    for (std::size_t i = 0; i < count; ++i)
        try {
            queue(i);
        } catch (const Error& error) {
            throw Failure{static_cast<jostle_status>(error.code()), error.what(), i};
        }
}

static_assert(JOSTLE_FILTERED == static_cast<int>(EndReason::filtered) &&
              JOSTLE_DRAW_ENDED == static_cast<int>(DrawKind::ended));

} // namespace

template <>
struct Behind<jostle_world>
{
    using type = WorldContent;
    static constexpr std::uint64_t mark = 0x6a6f73746c650005U;
    static constexpr const char* name = "jostle_world";
};

namespace {

template <class F>
void ask(const jostle_world* world, jostle_question kind, const void* questions, std::uint64_t count,
         const jostle_query_filter* filter, unsigned kinds, F&& inside)
{
    const WorldContent& content = open(world);
    const WorldFilter wish(filter);
    content.on([&]<int Dim, Coordinate T>(const World<Dim, T>& typed) {
        with_questions<Dim, T>(kind, questions, count, kinds,
                               [&](auto asked) { inside(typed, asked, wish.filter); });
    });
}

/// Calls read(world, id, i) for each id, which must be in the world.
template <class F>
void read_each(const jostle_world* world, const jostle_id* ids, std::uint64_t count, F&& read)
{
    const WorldContent& content = open(world);
    const Ids asked(ids, count);
    content.on([&](const auto& typed) {
        queue_each(asked.size(), [&](std::size_t i) { read(typed, asked[i], i); });
    });
}

} // namespace
} // namespace jostle::c_api

using namespace jostle;
using namespace jostle::c_api;

extern "C" {

jostle_status jostle_world_new(jostle_space space, const jostle_world_options* options, jostle_world** out,
                               jostle_error* error)
{
    return guarded(error, [&] {
        wanted(out, "out");
        hand_out(out, std::make_unique<WorldContent>(space, read_options(options, "jostle_world_options")));
    });
}
jostle_status jostle_world_free(jostle_world* world, jostle_error* error)
{
    return guarded(error, [&] { release(world); });
}
jostle_status jostle_world_space(const jostle_world* world, jostle_space* space, jostle_error* error)
{
    return guarded(error, [&] {
        const WorldContent& content = open(world);
        wanted(space, "space") = content.space;
    });
}

// --- Commands ---

jostle_status jostle_world_add(jostle_world* world, const jostle_boxes* boxes,
                               const jostle_object_options* options, jostle_id* ids, jostle_error* error)
{
    return guarded(error, [&] {
        open(world).on([&]<int Dim, Coordinate T>(World<Dim, T>& typed) {
            const jostle_object_options given = read_options(options, "jostle_object_options");
            ObjectOptions<T> wish;
            if (given.filter != nullptr) wish.filter = filter_of(*given.filter);
            wish.margin = static_cast<T>(given.margin);
            wish.enabled = given.disabled == 0;
            const BoxView<Dim, T> all = view<Dim, T>(boxes, "boxes");
            wanted_array(ids, all.size(), "ids");
            if constexpr (same_in_memory) {
                typed.add(all, std::span(reinterpret_cast<ObjectId*>(ids), all.size()), wish);
            } else {
                std::vector<ObjectId> added(all.size());
                typed.add(all, added, wish);
                for (std::size_t i = 0; i < added.size(); ++i)
                    ids[i] = to_c(added[i]);
            }
        });
    });
}
jostle_status jostle_world_remove(jostle_world* world, const jostle_id* ids, uint64_t count,
                                  jostle_error* error)
{
    return guarded(error, [&] {
        open(world).on([&](auto& typed) { typed.remove(std::span<const ObjectId>(Ids(ids, count))); });
    });
}
jostle_status jostle_world_report_again(jostle_world* world, const jostle_id* ids, const jostle_id* others,
                                        uint64_t count, jostle_error* error)
{
    return guarded(error, [&] {
        const Ids objects(ids, count);
        open(world).on([&](auto& typed) {
            if (others == nullptr)
                return queue_each(objects.size(), [&](std::size_t i) { typed.report_again(objects[i]); });
            const Ids second(others, count);
            queue_each(objects.size(), [&](std::size_t i) { typed.report_again(objects[i], second[i]); });
        });
    });
}
jostle_status jostle_world_clear(jostle_world* world, jostle_error* error)
{
    return guarded(error, [&] {
        WorldContent& content = open(world);
        content.on([](auto& typed) { typed.clear(); });
        content.changed();
    });
}
jostle_status jostle_world_move(jostle_world* world, const jostle_id* ids, const jostle_boxes* boxes,
                                const void* displacements, uint32_t sequence, jostle_error* error)
{
    return guarded(error, [&] {
        open(world).on([&]<int Dim, Coordinate T>(World<Dim, T>& typed) {
            const BoxView<Dim, T> all = view<Dim, T>(boxes, "boxes");
            const Ids moved(ids, all.size());
            if (displacements == nullptr) {
                typed.move(moved, all, sequence);
                return;
            }
            const auto* const by = wanted_array_of<Vec<Dim, T>>(displacements, all.size(), "displacements");
            queue_each(all.size(), [&](std::size_t i) { typed.move(moved[i], all[i], by[i], sequence); });
        });
    });
}
jostle_status jostle_world_teleport(jostle_world* world, const jostle_id* ids, const jostle_boxes* boxes,
                                    uint32_t sequence, jostle_error* error)
{
    return guarded(error, [&] {
        open(world).on([&]<int Dim, Coordinate T>(World<Dim, T>& typed) {
            const BoxView<Dim, T> all = view<Dim, T>(boxes, "boxes");
            const Ids moved(ids, all.size());
            queue_each(all.size(), [&](std::size_t i) { typed.teleport(moved[i], all[i], sequence); });
        });
    });
}
jostle_status jostle_world_resize(jostle_world* world, const jostle_id* ids, uint64_t count,
                                  const void* sizes, uint32_t sequence, jostle_error* error)
{
    return guarded(error, [&] {
        open(world).on([&]<int Dim, Coordinate T>(World<Dim, T>& typed) {
            const Ids resized(ids, count);
            const auto* const all = wanted_array_of<Vec<Dim, T>>(sizes, count, "sizes");
            queue_each(resized.size(), [&](std::size_t i) { typed.resize(resized[i], all[i], sequence); });
        });
    });
}
jostle_status jostle_world_set_filter(jostle_world* world, const jostle_id* ids, uint64_t count,
                                      const jostle_object_filter* filters, uint32_t sequence,
                                      jostle_error* error)
{
    return guarded(error, [&] {
        open(world).on([&](auto& typed) {
            const Ids of(ids, count);
            wanted_array(filters, count, "filters");
            queue_each(of.size(),
                       [&](std::size_t i) { typed.set_filter(of[i], filter_of(filters[i]), sequence); });
        });
    });
}
jostle_status jostle_world_set_margin(jostle_world* world, const jostle_id* ids, uint64_t count,
                                      const double* margins, uint32_t sequence, jostle_error* error)
{
    return guarded(error, [&] {
        open(world).on([&]<int Dim, Coordinate T>(World<Dim, T>& typed) {
            const Ids of(ids, count);
            wanted_array(margins, count, "margins");
            queue_each(of.size(),
                       [&](std::size_t i) { typed.set_margin(of[i], static_cast<T>(margins[i]), sequence); });
        });
    });
}
jostle_status jostle_world_set_enabled(jostle_world* world, const jostle_id* ids, uint64_t count,
                                       const uint8_t* enabled, uint32_t sequence, jostle_error* error)
{
    return guarded(error, [&] {
        open(world).on([&](auto& typed) {
            const Ids of(ids, count);
            wanted_array(enabled, count, "enabled");
            queue_each(of.size(),
                       [&](std::size_t i) { typed.set_enabled(of[i], enabled[i] != 0, sequence); });
        });
    });
}

// --- Update, and its pairs ---

jostle_status jostle_world_update(jostle_world* world, jostle_error* error)
{
    return guarded(error, [&] {
        WorldContent& content = open(world);
        content.on([](auto& typed) { typed.update(); });
        content.changed();
    });
}
jostle_status jostle_world_update_moves(jostle_world* world, const jostle_id* ids, const jostle_boxes* boxes,
                                        jostle_error* error)
{
    return guarded(error, [&] {
        WorldContent& content = open(world);
        content.on([&]<int Dim, Coordinate T>(World<Dim, T>& typed) {
            const BoxView<Dim, T> all = view<Dim, T>(boxes, "boxes");
            typed.update(Ids(ids, all.size()), all);
        });
        content.changed();
    });
}

jostle_status jostle_world_began(const jostle_world* world, const jostle_id_pair** pairs, uint64_t* count,
                                 jostle_error* error)
{
    return guarded(error, [&] {
        const WorldContent& content = open(world);
        wanted(pairs, "pairs");
        wanted(count, "count");
        const std::lock_guard lock(content.listing);
        if (!content.began_listed)
            content.on([&](const auto& typed) {
                content.began.clear();
                content.began.reserve(typed.began().size());
                for (const ObjectPair& pair : typed.began())
                    content.began.push_back({to_c(pair.a), to_c(pair.b)});
            });
        content.began_listed = true;
        *pairs = content.began.data();
        *count = content.began.size();
    });
}
jostle_status jostle_world_ended(const jostle_world* world, const jostle_ended_pair** pairs, uint64_t* count,
                                 jostle_error* error)
{
    return guarded(error, [&] {
        const WorldContent& content = open(world);
        wanted(pairs, "pairs");
        wanted(count, "count");
        const std::lock_guard lock(content.listing);
        if (!content.ended_listed)
            content.on([&](const auto& typed) {
                content.ended.clear();
                content.ended.reserve(typed.ended().size());
                for (const EndedPair& pair : typed.ended())
                    content.ended.push_back(
                        {to_c(pair.a), to_c(pair.b), static_cast<jostle_end_reason>(pair.reason), 0});
            });
        content.ended_listed = true;
        *pairs = content.ended.data();
        *count = content.ended.size();
    });
}
jostle_status jostle_world_persisted(const jostle_world* world, jostle_blocks* pairs, jostle_error* error)
{
    return guarded(error, [&] {
        const WorldContent& content = open(world);
        wanted(pairs, "pairs");
        const std::lock_guard lock(content.listing);
        if (!content.persisted_listed)
            content.on([&](const auto& typed) {
                const PairBuffer& found = typed.persisted();
                content.persisted = list_blocks<Pair>(found.blocks(), found.size(), content.persisted_table);
            });
        content.persisted_listed = true;
        *pairs = content.persisted;
    });
}
jostle_status jostle_world_changed_pairs(const jostle_world* world, jostle_blocks* pairs, jostle_error* error)
{
    return guarded(error, [&] {
        const WorldContent& content = open(world);
        wanted(pairs, "pairs");
        const std::lock_guard lock(content.listing);
        if (!content.changed_listed)
            content.on([&](const auto& typed) {
                const PairBuffer& found = typed.changed_pairs();
                content.changed_pairs =
                    list_blocks<Pair>(found.blocks(), found.size(), content.changed_table);
            });
        content.changed_listed = true;
        *pairs = content.changed_pairs;
    });
}
jostle_status jostle_world_pairs(const jostle_world* world, jostle_results* results, jostle_error* error)
{
    return guarded(error, [&] {
        const WorldContent& content = open(world);
        ResultsContent& into = open(results);
        into.begin();
        content.on([&](const auto& typed) { into.take(typed.pairs(), content.kept.memory); });
    });
}

jostle_status jostle_world_touching(const jostle_world* world, const jostle_id* ids, uint64_t count,
                                    jostle_results* results, jostle_error* error)
{
    return guarded(error, [&] {
        ResultsContent& into = open(results);
        into.begin();
        start(into.lists, false);
        std::vector<ObjectId> others;
        read_each(world, ids, count, [&](const auto& typed, ObjectId id, std::size_t) {
            typed.touching(id, others);
            append(into.lists, std::span<const ObjectId>(others), false, to_c);
        });
        into.holds = ResultsContent::Holds::lists;
    });
}

jostle_status jostle_world_visit_pairs(const jostle_world* world, jostle_visit_pair_function visit,
                                       void* context, int32_t* finished, jostle_error* error)
{
    return guarded(error, [&] {
        const WorldContent& content = open(world);
        wanted_function(visit, "visit");
        wanted(finished, "finished");
        const auto hand_over = [&](ObjectId a, ObjectId b) {
            return agreed(visit(context, to_c(a), to_c(b)));
        };
        content.on([&](const auto& typed) { *finished = typed.pairs(hand_over) ? 1 : 0; });
    });
}

// --- Questions ---

jostle_status jostle_world_first(const jostle_world* world, jostle_question kind, const void* questions,
                                 uint64_t count, const jostle_query_filter* filter, jostle_hit* hits,
                                 jostle_error* error)
{
    return guarded(error, [&] {
        ask(world, kind, questions, count, filter, lines,
            [&]<int Dim, Coordinate T>(const World<Dim, T>& typed, auto asked,
                                       const ObjectQueryFilter& wish) {
                if constexpr (is_line<typename decltype(asked)::value_type>)
                    ask_first<ObjectHit<T>>(typed, asked, wish, hits, to_c);
            });
    });
}
jostle_status jostle_world_all(const jostle_world* world, jostle_question kind, const void* questions,
                               uint64_t count, const jostle_query_filter* filter, uint64_t max_results,
                               jostle_results* results, jostle_error* error)
{
    return guarded(error, [&] {
        ResultsContent& into = open(results);
        ask(world, kind, questions, count, filter, any_kind,
            [&]<int Dim, Coordinate T>(const World<Dim, T>& typed, auto asked,
                                       const ObjectQueryFilter& wish) {
                ask_all<ObjectHit<T>, ObjectId>(typed, asked, wish, max_results, into, to_c);
            });
    });
}
jostle_status jostle_world_any(const jostle_world* world, jostle_question kind, const void* questions,
                               uint64_t count, const jostle_query_filter* filter, uint8_t* any,
                               jostle_error* error)
{
    return guarded(error, [&] {
        ask(world, kind, questions, count, filter, lines | regions,
            [&](const auto& typed, auto asked, const ObjectQueryFilter& wish) {
                ask_any(typed, asked, wish, any);
            });
    });
}
jostle_status jostle_world_count(const jostle_world* world, jostle_question kind, const void* questions,
                                 uint64_t count, const jostle_query_filter* filter, uint64_t* counts,
                                 jostle_error* error)
{
    return guarded(error, [&] {
        ask(world, kind, questions, count, filter, lines | regions,
            [&](const auto& typed, auto asked, const ObjectQueryFilter& wish) {
                ask_count(typed, asked, wish, counts);
            });
    });
}
jostle_status jostle_world_join(jostle_world* world, const jostle_boxes* boxes,
                                const jostle_query_filter* filter, jostle_results* results,
                                jostle_error* error)
{
    return guarded(error, [&] {
        WorldContent& content = open(world);
        ResultsContent& into = open(results);
        const WorldFilter wish(filter);
        content.on([&]<int Dim, Coordinate T>(World<Dim, T>& typed) {
            const BoxView<Dim, T> all = view<Dim, T>(boxes, "boxes");
            into.begin();
            typed.join(all, into.joined, wish.filter);
            into.show(std::span<const Pair>(into.joined));
        });
    });
}

// --- The objects ---

jostle_status jostle_world_size(const jostle_world* world, uint64_t* size, jostle_error* error)
{
    return guarded(error, [&] {
        const WorldContent& content = open(world);
        wanted(size, "size");
        content.on([&](const auto& typed) { *size = typed.size(); });
    });
}
jostle_status jostle_world_index_end(const jostle_world* world, uint32_t* end, jostle_error* error)
{
    return guarded(error, [&] {
        const WorldContent& content = open(world);
        wanted(end, "end");
        content.on([&](const auto& typed) { *end = typed.index_end(); });
    });
}
jostle_status jostle_world_contains(const jostle_world* world, const jostle_id* ids, uint64_t count,
                                    uint8_t* contains, jostle_error* error)
{
    return guarded(error, [&] {
        wanted_array(contains, count, "contains");
        read_each(world, ids, count, [&](const auto& typed, ObjectId id, std::size_t i) {
            contains[i] = typed.contains(id) ? 1 : 0;
        });
    });
}
jostle_status jostle_world_ids(const jostle_world* world, const uint32_t* indices, uint64_t count,
                               jostle_id* ids, jostle_error* error)
{
    return guarded(error, [&] {
        const WorldContent& content = open(world);
        wanted_array(indices, count, "indices");
        wanted_array(ids, count, "ids");
        content.on([&](const auto& typed) {
            for (std::uint64_t i = 0; i < count; ++i)
                ids[i] = to_c(typed.id(indices[i]));
        });
    });
}
jostle_status jostle_world_boxes(const jostle_world* world, const jostle_id* ids, uint64_t count, void* boxes,
                                 jostle_error* error)
{
    return guarded(error, [&] {
        read_each(world, ids, count,
                  [&]<int Dim, Coordinate T>(const World<Dim, T>& typed, ObjectId id, std::size_t i) {
                      wanted_array_of<Aabb<Dim, T>>(boxes, count, "boxes")[i] = typed.box(id);
                  });
    });
}
jostle_status jostle_world_bounds(const jostle_world* world, const jostle_id* ids, uint64_t count,
                                  void* boxes, jostle_error* error)
{
    return guarded(error, [&] {
        read_each(world, ids, count,
                  [&]<int Dim, Coordinate T>(const World<Dim, T>& typed, ObjectId id, std::size_t i) {
                      wanted_array_of<Aabb<Dim, T>>(boxes, count, "boxes")[i] = typed.bounds(id);
                  });
    });
}
jostle_status jostle_world_bounds_of_all(const jostle_world* world, int32_t* any, void* box,
                                         jostle_error* error)
{
    return guarded(error, [&] {
        const WorldContent& content = open(world);
        wanted(any, "any");
        content.on([&]<int Dim, Coordinate T>(const World<Dim, T>& typed) {
            auto* const out = wanted_array_of<Aabb<Dim, T>>(box, 1, "box");
            const auto found = typed.bounds();
            if (found) *out = *found;
            *any = found ? 1 : 0;
        });
    });
}
jostle_status jostle_world_filters(const jostle_world* world, const jostle_id* ids, uint64_t count,
                                   jostle_object_filter* filters, jostle_error* error)
{
    return guarded(error, [&] {
        wanted_array(filters, count, "filters");
        read_each(world, ids, count, [&](const auto& typed, ObjectId id, std::size_t i) {
            const ObjectFilter filter = typed.filter(id);
            filters[i] = {filter.category, filter.mask, filter.owner, filter.is_static ? 1 : 0};
        });
    });
}
jostle_status jostle_world_enabled(const jostle_world* world, const jostle_id* ids, uint64_t count,
                                   uint8_t* enabled, jostle_error* error)
{
    return guarded(error, [&] {
        wanted_array(enabled, count, "enabled");
        read_each(world, ids, count, [&](const auto& typed, ObjectId id, std::size_t i) {
            enabled[i] = typed.enabled(id) ? 1 : 0;
        });
    });
}
jostle_status jostle_world_margins(const jostle_world* world, const jostle_id* ids, uint64_t count,
                                   double* margins, jostle_error* error)
{
    return guarded(error, [&] {
        wanted_array(margins, count, "margins");
        read_each(world, ids, count,
                  [&](const auto& typed, ObjectId id, std::size_t i) { margins[i] = typed.margin(id); });
    });
}

// --- Snapshots ---

jostle_status jostle_world_save(const jostle_world* world, jostle_results* results, jostle_error* error)
{
    return guarded(error, [&] {
        const WorldContent& content = open(world);
        ResultsContent& into = open(results);
        into.begin();
        content.on([&](const auto& typed) { into.bytes = typed.save(); });
        into.byte_count = into.bytes.size();
        into.holds = ResultsContent::Holds::bytes;
    });
}
jostle_status jostle_world_restore(jostle_world* world, const void* snapshot, uint64_t size,
                                   jostle_error* error)
{
    return guarded(error, [&] {
        WorldContent& content = open(world);
        const auto* const bytes = wanted_array_of<std::byte>(snapshot, size, "snapshot");
        content.on([&](auto& typed) { typed.restore(std::span(bytes, static_cast<std::size_t>(size))); });
        content.changed();
    });
}
jostle_status jostle_world_fork(const jostle_world* world, jostle_world** out, jostle_error* error)
{
    return guarded(error, [&] {
        const WorldContent& content = open(world);
        wanted(out, "out");
        hand_out(out, std::make_unique<WorldContent>(content));
    });
}

// --- Seeing inside ---

jostle_status jostle_world_stats_read(const jostle_world* world, jostle_world_stats* stats,
                                      jostle_error* error)
{
    return guarded(error, [&] {
        const WorldContent& content = open(world);
        content.on([&](const auto& typed) {
            const WorldStats& s = typed.stats();
            write_stats(
                stats,
                jostle_world_stats{0,           s.objects,    s.resting,         s.active,   s.disabled,
                                   s.refused,   s.commands,   s.dropped,         s.changed,  s.woken,
                                   s.settled,   s.candidates, s.false_positives, s.listed,   s.began,
                                   s.persisted, s.ended,      s.bytes_reserved,  s.us_total, s.us_apply,
                                   s.us_active, s.us_resting, s.us_events,       s.us_index},
                "jostle_world_stats");
        });
    });
}
jostle_status jostle_world_explain(const jostle_world* world, jostle_results* results, jostle_error* error)
{
    return guarded(error, [&] {
        const WorldContent& content = open(world);
        ResultsContent& into = open(results);
        into.begin();
        std::string text;
        content.on([&](const auto& typed) { text = typed.explain(); });
        into.bytes.resize(text.size() + 1);
        std::memcpy(into.bytes.data(), text.c_str(), text.size() + 1);
        into.byte_count = text.size();
        into.holds = ResultsContent::Holds::bytes;
    });
}
jostle_status jostle_world_draw(const jostle_world* world, jostle_draw_function box,
                                jostle_draw_function line, void* context, jostle_error* error)
{
    return guarded(error, [&] {
        const WorldContent& content = open(world);
        content.on([&]<int Dim, Coordinate T>(const World<Dim, T>& typed) {
            const auto draw_box = [&](const Aabb<Dim, T>& drawn, DrawKind kind) {
                if (box != nullptr)
                    agreed(box(context, drawn.lo.data(), static_cast<jostle_draw_kind>(kind)));
            };
            const auto draw_line = [&](const Vec<Dim, T>& from, const Vec<Dim, T>& to, DrawKind kind) {
                const Aabb<Dim, T> both{from, to};
                agreed(line(context, both.lo.data(), static_cast<jostle_draw_kind>(kind)));
            };
            if (line != nullptr)
                typed.draw(draw_box, draw_line);
            else
                typed.draw(draw_box);
        });
    });
}

} // extern "C"
