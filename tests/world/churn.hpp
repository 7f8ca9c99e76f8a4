// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <functional>
#include <limits>
#include <memory>

#include "twin.hpp"

namespace world_tests {

using jostle_scenes::Random;

/// Boxes that touch now and then, with many bounds in common, and some that are hard on everybody. Of many
/// objects none should be a giant that touches most others.
template <int Dim, class T, class Source>
Aabb<Dim, T> random_box(Source& random, double extent, bool giants = true)
{
    Aabb<Dim, T> box;
    const std::uint32_t kind = giants ? random.below(64) : random.below(17);
    for (int d = 0; d < Dim; ++d) {
        double lo = random.uniform(0, extent), size = random.uniform(0.5, 1.5);
        if (kind < 16) lo = random.below(static_cast<std::uint32_t>(extent) + 1), size = 1;
        if (kind == 16) size = 0;
        if (kind == 17) size = extent / 4;
        if (kind == 18) lo += 1e9;
        if (kind == 19) lo = extent / 2;
        box.lo[d] = static_cast<T>(lo);
        box.hi[d] = static_cast<T>(lo + size);
        if (kind == 20 && random.below(2) == 0) box.lo[d] = -std::numeric_limits<T>::infinity();
        if (kind == 20 && random.below(2) == 0) box.hi[d] = std::numeric_limits<T>::infinity();
    }
    return box;
}

/// Where there are many owners, all objects have one.
template <class Source>
ObjectFilter random_filter(Source& random, std::uint32_t owners = 6)
{
    ObjectFilter filter;
    if (random.below(3) == 0) {
        filter.category = 1u << random.below(3);
        filter.mask = random.below(3) == 0 ? ~0u : random.below(8);
    }
    if (random.below(owners < 100 ? 4 : 1) == 0) filter.owner = random.below(owners);
    filter.is_static = random.below(4) == 0;
    return filter;
}

/// What an `accept` that is told to throw throws.
struct Refusal
{
};

/// A world and its twin under commands that are drawn from a Source: at random, or from a fuzzer's bytes.
template <int Dim, class T, class Source = Random>
class Churn
{
  public:
    using Box = Aabb<Dim, T>;
    using World = jostle::World<Dim, T>;
    jostle::WorldOptions options;
    std::unique_ptr<World> world;
    std::vector<std::unique_ptr<World>> beside; ///< others that are told the same
    Twin<Dim, T> twin;
    Source random;
    double extent;
    bool giants = true;
    std::uint32_t owners = 6;
    static constexpr std::uint64_t never = ~std::uint64_t{0};
    std::uint64_t questions_until_refusal = never; ///< that `accept` answers before it throws
    std::uint64_t asked = 0; ///< how often `accept` was, by the last update of the world
    std::uint64_t operations = 0;
    static constexpr std::size_t end_reason_count = std::size_t{1} + static_cast<int>(EndReason::filtered);
    std::uint64_t began = 0, persisted = 0, ended[end_reason_count] = {}; ///< ended: by reason

    Churn(std::uint64_t seed, double space, bool callback, jostle::WorldOptions with = {})
        : Churn(Source(seed), space, callback, with)
    {
    }
    Churn(Source source, double space, bool callback, jostle::WorldOptions with = {})
        : options(with), random(source), extent(space)
    {
        twin.has_callback = callback;
        if (callback)
            options.accept = [this](ObjectId a, ObjectId b) {
                if (questions_until_refusal != never && questions_until_refusal-- == 0) throw Refusal{};
                ++asked;
                return accepts(twin.salt, a, b);
            };
        world = std::make_unique<World>(options);
    }

    /// If set, takes what is to be said about an object instead of it being said at once.
    std::function<void(ObjectId, std::function<void()>)> dispatch;
    /// call(world) for each world.
    template <class Call>
    void say(ObjectId id, const Call& call)
    {
        const auto to_all = [this, call] {
            call(*world);
            for (const auto& other : beside)
                call(*other);
        };
        if (dispatch)
            dispatch(id, to_all);
        else
            to_all();
    }

    typename Twin<Dim, T>::Thing& any_thing()
    {
        auto at = twin.things.lower_bound(random.below(twin.things.rbegin()->first + 1));
        return at->second;
    }

    void add()
    {
        typename Twin<Dim, T>::Thing thing;
        thing.box = random_box<Dim, T>(random, extent, giants);
        jostle::ObjectOptions<T> with;
        with.filter = thing.filter = random_filter(random, owners);
        with.enabled = thing.enabled = random.below(8) != 0;
        if (random.below(8) == 0) with.margin = T(0.25);
        thing.plain = options.margin == 0 && with.margin == 0;
        thing.margin = static_cast<T>(options.margin) + with.margin;
        thing.id = world->add(thing.box, with);
        for (const auto& other : beside)
            EXPECT_EQ(other->add(thing.box, with), thing.id);
        twin.things[thing.id.index] = thing;
    }
    void remove()
    {
        const ObjectId id = any_thing().id;
        say(id, [id](World& each) { each.remove(id); });
        twin.things.erase(id.index);
    }
    Box nudged(Box box)
    {
        for (int d = 0; d < Dim; ++d) {
            const T by = static_cast<T>(random.uniform(-0.3, 0.3));
            box.lo[d] += by;
            box.hi[d] += by;
            if (!(box.lo[d] <= box.hi[d])) return random_box<Dim, T>(random, extent, giants);
        }
        return box;
    }
    void move()
    {
        auto& thing = any_thing();
        thing.displacement = {};
        switch (random.below(8)) {
        case 0:
        case 1:
            thing.box = random_box<Dim, T>(random, extent, giants);
            say(thing.id, [id = thing.id, box = thing.box](World& each) { each.move(id, box); });
            break;
        case 2: {
            thing.box = nudged(thing.box);
            thing.plain = false;
            for (std::size_t d = 0; d < Dim; ++d)
                thing.displacement[d] = static_cast<T>(random.uniform(-2, 2));
            say(thing.id, [id = thing.id, box = thing.box, move_by = thing.displacement](World& each) {
                each.move(id, box, move_by);
            });
            break;
        }
        case 3: // the same again: nothing changes
            say(thing.id, [id = thing.id, box = thing.box](World& each) { each.move(id, box); });
            break;
        default:
            thing.box = nudged(thing.box);
            say(thing.id, [id = thing.id, box = thing.box](World& each) { each.move(id, box); });
        }
    }
    void resize()
    {
        auto& thing = any_thing();
        std::array<T, Dim> sizes{};
        for (int d = 0; d < Dim; ++d) {
            const T size = sizes[static_cast<std::size_t>(d)] = static_cast<T>(random.uniform(0, 2));
            if (!std::isfinite(thing.box.lo[d]) || !std::isfinite(thing.box.hi[d])) continue;
            const T centre = thing.box.lo[d] + (thing.box.hi[d] - thing.box.lo[d]) / 2;
            thing.box.lo[d] = centre - size / 2;
            thing.box.hi[d] = centre + size / 2;
        }
        say(thing.id, [id = thing.id, sizes](World& each) { each.resize(id, sizes); });
    }
    void set_filter()
    {
        auto& thing = any_thing();
        if (random.below(4) != 0) thing.filter = random_filter(random, owners);
        say(thing.id, [id = thing.id, filter = thing.filter](World& each) { each.set_filter(id, filter); });
        twin.filter_was_set.insert(thing.id.index);
    }
    void set_margin()
    {
        auto& thing = any_thing();
        const T own = random.below(2) == 0 ? T(0) : T(0.5);
        thing.plain = false;
        thing.margin = static_cast<T>(options.margin) + own;
        say(thing.id, [id = thing.id, own](World& each) { each.set_margin(id, own); });
    }
    void set_enabled()
    {
        auto& thing = any_thing();
        thing.enabled = random.below(2) != 0;
        say(thing.id, [id = thing.id, on = thing.enabled](World& each) { each.set_enabled(id, on); });
    }

    void report_again()
    {
        const ObjectId id = any_thing().id, other = any_thing().id;
        if (random.below(3) == 0) {
            say(id, [id](World& each) { each.report_again(id); });
            twin.again.insert(id.index);
        } else {
            say(id, [id, other](World& each) { each.report_again(id, other); });
            twin.again_pairs.insert(std::minmax(id.index, other.index));
            twin.named_first.insert(id.index);
        }
    }

    /// One command, so that there are about `target` objects in the long run.
    void operate(std::size_t target)
    {
        ++operations;
        const std::uint32_t kind = random.below(32);
        if (twin.things.empty() || (twin.things.size() < target && kind < 12)) return add();
        if (kind < (twin.things.size() < target ? 14u : 4u)) return remove();
        if (kind < 26) return move();
        if (kind < 28) return resize();
        if (kind < 30) return set_filter();
        if (kind < 31) return random.below(2) == 0 ? set_margin() : report_again();
        return set_enabled();
    }

    testing::AssertionResult update(bool with_pairs = true)
    {
        asked = 0;
        world->update();
        return follow(with_pairs);
    }
    /// After an update of the world.
    testing::AssertionResult follow(bool with_pairs)
    {
        twin.update();
        began += twin.began.size();
        persisted += twin.persisted.size();
        for (const EndedPair& pair : twin.ended)
            if (const auto reason = static_cast<std::size_t>(pair.reason); reason < end_reason_count)
                ++ended[reason];
            else
                return testing::AssertionFailure() << "end_reason_count lacks a reason, number " << reason;
        if (asked != twin.asked)
            return testing::AssertionFailure()
                   << "accept was asked " << asked << " times, by the twin " << twin.asked;
        return agree(*world, twin, with_pairs);
    }
};

} // namespace world_tests
