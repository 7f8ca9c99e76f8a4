// SPDX-License-Identifier: MIT
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <span>
#include <utility>
#include <variant>
#include <vector>

#include "c_api/structure.hpp"
#include "jostle/world.hpp"

// What is behind a jostle_world. Its functions are in the files world*.cpp: what makes a world and updates it
// in world.cpp, what is done to objects in world_commands.cpp, what is known of them in world_objects.cpp,
// what an update found in world_pairs.cpp, queries in world_queries.cpp.

namespace jostle::c_api {

// An id in C is a number: the index below, the generation above. Where that is what an ObjectId is in memory,
// arrays of ids are read in place.
inline constexpr bool same_in_memory = std::endian::native == std::endian::little;
static_assert(sizeof(ObjectId) == sizeof(jostle_id) && offsetof(ObjectId, index) == 0);

inline ObjectId from_c(jostle_id id) noexcept
{
    // 0 names nothing, as a default ObjectId does.
    return id == 0 ? ObjectId{}
                   : ObjectId{static_cast<std::uint32_t>(id), static_cast<std::uint32_t>(id >> 32)};
}
inline jostle_id to_c(ObjectId id) noexcept
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

/// A list as C sees it: made once for each update, if it is asked for.
template <class Item>
struct Listed
{
    bool listed = false;
    std::vector<Item> items;
};
struct ListedBlocks
{
    bool listed = false;
    std::vector<jostle_block> table;
    jostle_blocks blocks{};
};
struct UpdateLists
{
    Listed<jostle_id_pair> began;
    Listed<jostle_ended_pair> ended;
    ListedBlocks persisted, changed;
    void forget() noexcept { began.listed = ended.listed = persisted.listed = changed.listed = false; }
};

class WorldContent final : public StructureContent<InSomeSpace<World2f, World3f, World2d, World3d>>
{
  public:
    WorldContent(jostle_space in, const jostle_world_options& given)
        : StructureContent(in, keep(given.common)), accept(given.accept), context(given.context)
    {
        WorldOptions options = kept.options<WorldOptions>();
        options.margin = given.margin;
        for (const jostle_query_layer& layer :
             std::span(wanted_array(given.layers, given.layer_count, "layers"), given.layer_count))
            options.layers.push_back({layer.category, layer.mask});
        if (accept != nullptr)
            options.accept = [call = accept, with = context](ObjectId a, ObjectId b) {
                return agreed(call(with, to_c(a), to_c(b)));
            };
        in_space(space,
                 [&](auto of) { held.emplace<World<decltype(of)::dim, typename decltype(of)::T>>(options); });
    }
    /// A fork of another.
    explicit WorldContent(const WorldContent& other)
        : StructureContent(other.space, other.kept), accept(other.accept), context(other.context)
    {
        other.on([&]<int Dim, Coordinate T>(const World<Dim, T>& typed) {
            held.emplace<World<Dim, T>>(typed.fork());
        });
    }
    /// What was handed out as of the update before is no more.
    void changed() noexcept { lists.forget(); }

    bool clear() override
    {
        StructureContent::clear();
        changed();
        return true;
    }

    jostle_accept_object_pair_function accept;
    void* context;

    // The last update's lists as C sees them, made when they are first asked for: by any thread.
    mutable std::mutex listing;
    mutable UpdateLists lists;
};

template <>
struct Behind<jostle_world> : Kind<WorldContent, 0x05>
{
    static constexpr const char* name = "jostle_world";
};

/// Calls read(world, id, i) for each id, which must be in the world.
template <class F>
void read_each(const jostle_world* world, const jostle_id* ids, std::uint64_t count, F&& read)
{
    const WorldContent& content = open(world);
    const Ids asked(ids, count);
    content.on([&](const auto& typed) {
        for_each_object(asked.size(), [&](std::size_t i) { read(typed, asked[i], i); });
    });
}

} // namespace jostle::c_api
