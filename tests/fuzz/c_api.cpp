// SPDX-License-Identifier: MIT
// Sequences of calls of the C interface, with handles that are right, freed, of another kind or NULL,
// and arguments that are good or bad. Of each call it is known whether it succeeds; what it leaves is
// held against a plain model.
#include <algorithm>
#include <iterator>
#include <map>
#include <set>

#include "jostle/find_pairs.hpp"
#include "jostle/jostle.h"
#include "target.hpp"

namespace {

using Box = jostle::Aabb3f;

enum Kind : std::uint32_t
{
    executor,
    results,
    finder,
    box_index,
    world,
    shape,
    shapes,
    kinds
};

struct Handle
{
    Kind kind = kinds;
    void* pointer = nullptr;
    bool alive = false;
    std::map<std::uint64_t, Box> objects{}; ///< of an index, by id; of a world, as of the last update
    std::map<std::uint64_t, Box> queued{};  ///< of a world, as the next update will see it
    std::set<std::uint64_t> gone{};         ///< ids that name nothing any more
    std::uint64_t size = 0;                 ///< of a list of shapes
};

class Session
{
  public:
    explicit Session(fuzz::Input& in) : in_(in) {}
    ~Session()
    {
        for (Handle& handle : handles_)
            if (handle.alive) (void)jostle_free(handle.pointer, &error_);
    }

    void go()
    {
        handles_.reserve(200); // so that a Handle stays where it is
        for (int step = 0; step < 96 && in_.left() != 0; ++step)
            act(in_.below(24));
    }

  private:
    /// A handle for a parameter of this kind, and whether it is good.
    struct Choice
    {
        Handle* handle;
        void* pointer;
        bool good;
    };
    Choice choose(Kind kind)
    {
        std::vector<Handle*> right, wrong;
        for (Handle& handle : handles_)
            (handle.alive && handle.kind == kind ? right : wrong).push_back(&handle);
        const auto any = [&](const std::vector<Handle*>& of) {
            return of[in_.below(static_cast<std::uint32_t>(of.size()))];
        };
        const std::uint32_t how = in_.below(16);
        if (how == 15) return {nullptr, nullptr, false};
        if (how == 14 && !wrong.empty()) {
            Handle* const other = any(wrong);
            // A freed one's place may be another's by now.
            const bool taken = std::any_of(handles_.begin(), handles_.end(), [&](const Handle& each) {
                return each.alive && each.kind == kind && each.pointer == other->pointer;
            });
            if (!taken) return {nullptr, other->pointer, false};
        }
        if (right.empty()) return make(kind);
        Handle* const handle = any(right);
        return {handle, handle->pointer, true};
    }
    template <class Type>
    static Type* as(const Choice& choice)
    {
        return static_cast<Type*>(choice.pointer);
    }

    /// The call ended with this status, and was to succeed or not.
    void expect(jostle_status status, bool good, const char* what)
    {
        fuzz::demand(status >= 0 && status != JOSTLE_INTERNAL_ERROR && status != JOSTLE_OUT_OF_MEMORY, what);
        fuzz::demand(error_.status == status &&
                         std::find(std::begin(error_.message), std::end(error_.message), '\0') !=
                             std::end(error_.message),
                     "the error says something else than the status");
        if ((status == JOSTLE_OK) != good)
            fuzz::fail(std::string(what) + (good ? " fails: " : " succeeds: ") + error_.message);
    }

    Choice make(Kind kind)
    {
        void* made = &made; // not to be written by a call that fails
        const bool null = in_.below(16) == 15;
        const auto out = [&]<class Type>(Type**) { return null ? nullptr : reinterpret_cast<Type**>(&made); };
        jostle_status status = JOSTLE_OK;
        switch (kind) {
        case executor:
            status = jostle_executor_serial(out(static_cast<jostle_executor**>(nullptr)), &error_);
            break;
        case results:
            status = jostle_results_new(nullptr, out(static_cast<jostle_results**>(nullptr)), &error_);
            break;
        case finder:
            status = jostle_finder_new(nullptr, out(static_cast<jostle_finder**>(nullptr)), &error_);
            break;
        case box_index:
            status = jostle_index_new(JOSTLE_3F, nullptr, out(static_cast<jostle_index**>(nullptr)), &error_);
            break;
        case world:
            status = jostle_world_new(JOSTLE_3F, nullptr, out(static_cast<jostle_world**>(nullptr)), &error_);
            break;
        case shape:
            status = jostle_shape_sphere(3, 1, out(static_cast<jostle_shape**>(nullptr)), &error_);
            break;
        default:
            status = jostle_shapes_new(3, out(static_cast<jostle_shapes**>(nullptr)), &error_);
        }
        expect(status, !null, "making a handle");
        if (null) return {nullptr, nullptr, false};
        handles_.push_back({kind, made, true});
        return {&handles_.back(), made, true};
    }

    struct Boxes
    {
        std::vector<Box> boxes;
        jostle_boxes view{};
        bool good = true;
    };
    /// As many, or some; now and then a bad one, or none where there should be some.
    Boxes some_boxes(std::size_t count)
    {
        Boxes made;
        for (std::size_t k = 0; k < count; ++k)
            made.boxes.push_back(in_.box<3, float>(in_.below(32) == 31));
        for (const Box& box : made.boxes)
            for (int d = 0; d < 3; ++d)
                made.good &= box.lo[d] <= box.hi[d];
        const auto* const lo = reinterpret_cast<const float*>(made.boxes.data());
        for (int d = 0; d < 3; ++d) {
            made.view.lo[d] = lo == nullptr ? nullptr : lo + d;
            made.view.hi[d] = lo == nullptr ? nullptr : lo + 3 + d;
        }
        made.view.count = count;
        made.view.stride = sizeof(Box);
        if (count > 0 && in_.below(32) == 31) {
            made.view.lo[in_.below(3)] = nullptr;
            made.good = false;
        }
        return made;
    }
    /// Ids of an index or a world, each once, or, where bad ones are wanted now and then, some twice or
    /// gone.
    template <class Id>
    std::vector<Id> some_ids(const Handle* handle, bool& good)
    {
        std::vector<Id> ids;
        if (handle == nullptr) return ids;
        const auto& objects = handle->kind == world ? handle->queued : handle->objects;
        for (const auto& each : objects)
            if (ids.size() < 8 && in_.below(2) == 0) ids.push_back(static_cast<Id>(each.first));
        if (in_.below(16) == 15) {
            good = false;
            ids.push_back(handle->gone.empty() ? static_cast<Id>(0xfffffff)
                                               : static_cast<Id>(*handle->gone.begin()));
        }
        return ids;
    }

    void act(std::uint32_t what)
    {
        if (handles_.size() >= 150) return;
        switch (what) {
        case 0:
            (void)make(static_cast<Kind>(in_.below(kinds)));
            return;
        case 1: {
            const Choice choice = choose(static_cast<Kind>(in_.below(kinds)));
            const auto freed = std::find_if(handles_.begin(), handles_.end(), [&](const Handle& each) {
                return each.alive && each.pointer == choice.pointer; // of any kind
            });
            const jostle_status status = jostle_free(choice.pointer, &error_);
            expect(status, choice.pointer == nullptr || freed != handles_.end(), "freeing a handle");
            if (freed != handles_.end()) freed->alive = false;
            return;
        }
        case 2:
        case 3:
            return find();
        case 4:
        case 5:
        case 6:
            return insert();
        case 7:
            return erase();
        case 8:
            return ask_index();
        case 9:
        case 10:
        case 11:
        case 12:
            return add();
        case 13:
            return move();
        case 14:
            return remove();
        case 15:
        case 16:
        case 17:
            return update();
        case 18:
            return look_at_world();
        case 19:
            return save_and_restore();
        case 20:
        case 21:
            return add_shapes();
        case 22:
            return bounds();
        default:
            return read_results();
        }
    }

    void find()
    {
        const Choice with = choose(finder), to = choose(results);
        const Boxes boxes = some_boxes(in_.below(24));
        const bool known_space = in_.below(32) != 31;
        const jostle_order order = static_cast<jostle_order>(in_.below(16) == 15 ? 7 : 1);
        const bool good = with.good && to.good && boxes.good && known_space && order == 1;
        expect(jostle_finder_take(as<jostle_finder>(with), known_space ? JOSTLE_3F : 9, &boxes.view, nullptr,
                                  nullptr, order, as<jostle_results>(to), &error_),
               good, "finding pairs");
        if (!good) return;
        jostle_blocks found{};
        expect(jostle_results_blocks(as<jostle_results>(to), &found, &error_), true, "reading pairs");
        std::vector<jostle::Pair> pairs(found.count);
        expect(jostle_blocks_copy(&found, found.count, pairs.data(), &error_), true, "copying pairs");
        fuzz::demand(pairs == jostle::find_pairs_brute_force(jostle::BoxView<3, float>(boxes.boxes)),
                     "other pairs than by brute force");
        fuzz::count_boxes(boxes.boxes.size());
    }

    void insert()
    {
        const Choice into = choose(box_index);
        std::vector<std::uint32_t> ids;
        for (std::uint32_t k = in_.below(8); k > 0; --k)
            ids.push_back(in_.below(64));
        const Boxes boxes = some_boxes(ids.size());
        bool good = into.good && boxes.good;
        std::set<std::uint32_t> once(ids.begin(), ids.end());
        good &= once.size() == ids.size();
        for (const std::uint32_t id : ids)
            good &= into.handle != nullptr && into.handle->objects.count(id) == 0;
        good |= into.good && boxes.good && ids.empty();
        expect(jostle_index_insert(as<jostle_index>(into), ids.data(), &boxes.view, &error_), good,
               "inserting boxes");
        for (std::size_t k = 0; good && k < ids.size(); ++k)
            into.handle->objects[ids[k]] = boxes.boxes[k];
        check_index(into);
    }
    void erase()
    {
        const Choice from = choose(box_index);
        bool good = from.good;
        const auto ids = some_ids<std::uint32_t>(from.handle, good);
        expect(jostle_index_erase(as<jostle_index>(from), ids.data(), ids.size(), &error_), good,
               "erasing boxes");
        for (std::size_t k = 0; good && k < ids.size(); ++k)
            from.handle->objects.erase(ids[k]);
        check_index(from);
    }
    void check_index(const Choice& of)
    {
        if (!of.good) return;
        std::uint64_t size = 0;
        expect(jostle_size(as<jostle_index>(of), &size, &error_), true, "the size of an index");
        fuzz::demand(size == of.handle->objects.size(), "another number of boxes");
    }
    void ask_index()
    {
        const Choice from = choose(box_index), to = choose(results);
        const Boxes boxes = some_boxes(1 + in_.below(3));
        const bool good = from.good && to.good && boxes.good;
        // Of its boxes JOSTLE_BOX reads them one behind the other.
        const bool valid = std::all_of(boxes.boxes.begin(), boxes.boxes.end(), [](const Box& box) {
            return box.lo[0] <= box.hi[0] && box.lo[1] <= box.hi[1] && box.lo[2] <= box.hi[2];
        });
        if (!good && valid) return;
        jostle_queries queries{};
        queries.kind = JOSTLE_BOX;
        queries.values = {boxes.boxes.data(), boxes.boxes.size(), sizeof boxes.boxes[0]};
        expect(jostle_query_all(as<void>(from), &queries, nullptr, nullptr, UINT64_MAX,
                                as<jostle_results>(to), &error_),
               good, "asking an index");
        if (!good) return;
        jostle_lists lists{};
        expect(jostle_results_lists(as<jostle_results>(to), &lists, &error_), true, "reading lists");

        std::uint64_t next = 0;
        fuzz::demand(lists.queries == boxes.boxes.size(), "another number of lists");
        for (std::size_t q = 0; q < boxes.boxes.size(); ++q) {
            fuzz::demand(lists.first[q] == next, "a list begins elsewhere");
            for (const auto& [id, box] : from.handle->objects) {
                if (!overlaps(box, boxes.boxes[q])) continue;
                fuzz::demand(next < lists.count && lists.ids[next] == id, "other answers of an index");
                ++next;
            }
        }
        fuzz::demand(next == lists.count, "more answers of an index");
        fuzz::count_boxes(from.handle->objects.size());
    }

    void add()
    {
        const Choice to = choose(world);
        const Boxes boxes = some_boxes(in_.below(8));
        std::vector<jostle_id> ids(boxes.boxes.size(), 77);
        const bool good = to.good && boxes.good;
        expect(jostle_world_add(as<jostle_world>(to), &boxes.view, nullptr, ids.data(), &error_), good,
               "adding objects");
        for (std::size_t k = 0; k < ids.size(); ++k)
            if (good)
                to.handle->queued[ids[k]] = boxes.boxes[k];
            else
                fuzz::demand(ids[k] == 77, "a call that failed has written ids");
    }
    void move()
    {
        const Choice of = choose(world);
        bool good = of.good;
        const auto ids = some_ids<jostle_id>(of.handle, good);
        const Boxes boxes = some_boxes(ids.size());
        good &= boxes.good;
        expect(jostle_world_move(as<jostle_world>(of), ids.data(), &boxes.view, nullptr, 0, &error_), good,
               "moving objects");
        for (std::size_t k = 0; good && k < ids.size(); ++k)
            of.handle->queued[ids[k]] = boxes.boxes[k];
    }
    void remove()
    {
        const Choice of = choose(world);
        bool good = of.good;
        const auto ids = some_ids<jostle_id>(of.handle, good);
        expect(jostle_world_remove(as<jostle_world>(of), ids.data(), ids.size(), &error_), good,
               "removing objects");
        for (std::size_t k = 0; good && k < ids.size(); ++k)
            of.handle->queued.erase(ids[k]);
    }
    void update()
    {
        const Choice of = choose(world);
        expect(jostle_world_update(as<jostle_world>(of), &error_), of.good, "an update");
        if (!of.good) return;
        for (const auto& each : of.handle->objects)
            if (of.handle->queued.count(each.first) == 0) of.handle->gone.insert(each.first);
        of.handle->objects = of.handle->queued;
        std::uint64_t size = 0;
        expect(jostle_size(as<jostle_world>(of), &size, &error_), true, "the size of a world");
        fuzz::demand(size == of.handle->objects.size(), "another number of objects");
    }
    void look_at_world()
    {
        const Choice of = choose(world), to = choose(results);
        const bool good = of.good && to.good;
        expect(jostle_world_pairs(as<jostle_world>(of), as<jostle_results>(to), &error_), good,
               "pairs of a world");
        if (!good) return;
        jostle_blocks found{};
        expect(jostle_results_blocks(as<jostle_results>(to), &found, &error_), true, "reading pairs");
        std::uint64_t count = 0;
        const auto& objects = of.handle->objects;
        for (auto a = objects.begin(); a != objects.end(); ++a)
            for (auto b = std::next(a); b != objects.end(); ++b)
                count += overlaps(a->second, b->second);
        fuzz::demand(found.count == count, "another number of pairs in a world");
        for (const auto& [id, box] : objects) {
            Box kept;
            expect(jostle_world_boxes(as<jostle_world>(of), &id, 1, &kept, &error_), true,
                   "the box of an object");
            fuzz::demand(kept.lo == box.lo && kept.hi == box.hi, "another box of an object");
        }
        fuzz::count_boxes(objects.size());
    }
    void save_and_restore()
    {
        const Choice of = choose(world), to = choose(results), other = choose(world);
        const bool good = of.good && to.good;
        expect(jostle_world_save(as<jostle_world>(of), as<jostle_results>(to), &error_), good,
               "saving a world");
        if (!good || !other.good) return;
        const void* bytes = nullptr;
        std::uint64_t size = 0;
        expect(jostle_results_bytes(as<jostle_results>(to), &bytes, &size, &error_), true, "reading bytes");
        const bool cut = in_.below(8) == 7;
        expect(jostle_world_restore(as<jostle_world>(other), bytes, cut ? size / 2 : size, &error_), !cut,
               "restoring a world");
        if (cut) return;
        const Handle saved = *of.handle;
        // Of its own ids nothing is known any more: an id may have come back.
        other.handle->objects = other.handle->queued = saved.objects;
        other.handle->gone.clear();
    }

    void add_shapes()
    {
        const Choice to = choose(shapes), one = choose(shape);
        const std::uint64_t count = in_.below(4);
        const bool good = to.good && one.good;
        expect(jostle_shapes_add(as<jostle_shapes>(to), as<jostle_shape>(one), count, &error_), good,
               "adding shapes");
        if (good) to.handle->size += count;
        if (!to.good) return;
        std::uint64_t size = 0;
        expect(jostle_size(as<jostle_shapes>(to), &size, &error_), true, "the number of shapes");
        fuzz::demand(size == to.handle->size, "another number of shapes");
        const std::uint64_t at = in_.below(8);
        const Choice other = choose(shape);
        expect(jostle_shapes_set(as<jostle_shapes>(to), at, as<jostle_shape>(other), &error_),
               other.good && at < to.handle->size, "setting a shape");
    }
    void bounds()
    {
        const Choice of = choose(shapes);
        const std::uint64_t count = of.handle == nullptr ? 0 : of.handle->size;
        std::vector<float> poses(7 * count);
        for (std::size_t k = 0; k < poses.size(); ++k)
            poses[k] = k % 7 == 6 ? 1.0f : 0.0f;
        const jostle_objects objects{as<jostle_shapes>(of), {poses.data(), count, 7 * sizeof(float)}};
        std::vector<Box> boxes(count);
        expect(jostle_bounds(JOSTLE_3F, &objects, 0, nullptr, boxes.data(), &error_), of.good, "bounds");
        for (std::size_t k = 0; of.good && k < count; ++k)
            fuzz::demand(boxes[k].lo[0] <= -1 && boxes[k].hi[2] >= 1 && boxes[k].hi[2] < 1.001f,
                         "other bounds of a sphere");
    }
    void read_results()
    {
        const Choice of = choose(results);
        jostle_blocks blocks{};
        jostle_lists lists{};
        const void* bytes = nullptr;
        std::uint64_t size = 0;
        // What it hasn't is an error as well.
        for (const jostle_status status :
             {jostle_results_blocks(as<jostle_results>(of), &blocks, &error_),
              jostle_results_lists(as<jostle_results>(of), &lists, &error_),
              jostle_results_bytes(as<jostle_results>(of), &bytes, &size, &error_)})
            fuzz::demand(status == JOSTLE_OK ? of.good : status == JOSTLE_INVALID_ARGUMENT || !of.good,
                         "reading a result");
        expect(jostle_results_blocks(as<jostle_results>(of), nullptr, &error_), false,
               "reading into nothing");
    }

    fuzz::Input& in_;
    std::vector<Handle> handles_;
    jostle_error error_{};
};

} // namespace

JOSTLE_FUZZ_TARGET(c_api)
{
    Session(in).go();
}
