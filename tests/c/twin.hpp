// SPDX-License-Identifier: MIT
#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <vector>

#include "jostle/jostle.h"
#include "jostle/jostle.hpp"

// What goes into the C interface and comes out of it is held against the C++ interface, its twin: every
// number in its place.

namespace c_twin {

using jostle::Aabb3d;
using jostle::Aabb3f;
using jostle::ObjectId;

class Random
{
  public:
    explicit Random(std::uint64_t seed) : state_(seed) {}
    std::uint32_t below(std::uint32_t end)
    {
        state_ = state_ * 6364136223846793005u + 1442695040888963407u;
        return static_cast<std::uint32_t>((state_ >> 33) % end);
    }
    double unit() { return below(1u << 24) * 0x1p-24; }

  private:
    std::uint64_t state_;
};

inline std::vector<Aabb3f> random_boxes(Random& random, std::size_t count, double range = 10)
{
    std::vector<Aabb3f> boxes(count);
    for (Aabb3f& box : boxes)
        for (int d = 0; d < 3; ++d) {
            box.lo[d] = static_cast<float>(range * random.unit());
            box.hi[d] = box.lo[d] + static_cast<float>(2 * random.unit());
        }
    return boxes;
}

/// A call that must succeed.
#define OK(call) ASSERT_EQ((call), JOSTLE_OK) << error.message

template <class Options>
Options options_of()
{
    Options options{};
    options.struct_size = sizeof options;
    return options;
}

template <class T>
jostle_values values_of(const std::vector<T>& values)
{
    return {values.data(), values.size(), sizeof(T)};
}

/// Queries that lie one behind the other.
template <class Item>
jostle_queries queries_of(jostle_query_kind kind, const Item* first, std::uint64_t count)
{
    jostle_queries queries{};
    queries.kind = kind;
    queries.values = {first, count, sizeof(Item)};
    return queries;
}

template <class Item>
std::vector<Item> items_of(const jostle_blocks& blocks)
{
    std::vector<Item> items;
    for (std::uint64_t i = 0; i < blocks.block_count; ++i) {
        const auto* const first = static_cast<const Item*>(blocks.blocks[i].items);
        items.insert(items.end(), first, first + blocks.blocks[i].count);
    }
    EXPECT_EQ(items.size(), blocks.count);
    EXPECT_EQ(sizeof(Item), blocks.item_size);
    return items;
}
using Pairs = std::vector<jostle::Pair>;

/// Handles of the C interface, freed at the end.
class CTwin : public testing::Test
{
  protected:
    CTwin() { EXPECT_EQ(jostle_results_new(nullptr, &results, &error), JOSTLE_OK); }
    ~CTwin() override
    {
        jostle_free(world, nullptr);
        jostle_free(index, nullptr);
        jostle_free(finder, nullptr);
        jostle_free(contact_finder, nullptr);
        jostle_free(shapes, nullptr);
        jostle_free(more_shapes, nullptr);
        jostle_free(executor, nullptr);
        jostle_free(results, nullptr);
    }

    [[nodiscard]] jostle_boxes view(const std::vector<Aabb3f>& boxes)
    {
        return jostle_boxes_strided(JOSTLE_3F, boxes.data()->lo.data(), boxes.data()->hi.data(), boxes.size(),
                                    sizeof(Aabb3f));
    }
    [[nodiscard]] Pairs pairs_of_results()
    {
        jostle_blocks blocks{};
        EXPECT_EQ(jostle_results_blocks(results, &blocks, &error), JOSTLE_OK) << error.message;
        return items_of<jostle::Pair>(blocks);
    }

    jostle_error error{};
    jostle_results* results = nullptr;
    jostle_world* world = nullptr;
    jostle_index* index = nullptr;
    jostle_finder* finder = nullptr;
    jostle_contact_finder* contact_finder = nullptr;
    jostle_shapes *shapes = nullptr, *more_shapes = nullptr;
    jostle_executor* executor = nullptr;
};

/// A filter's column for each of its three properties.
struct Columns
{
    std::vector<std::uint32_t> category, mask, owner;
    Columns(Random& random, std::size_t count)
    {
        for (std::size_t i = 0; i < count; ++i) {
            category.push_back(1u << random.below(3));
            mask.push_back(random.below(8));
            owner.push_back(random.below(4) == 0 ? UINT32_MAX : random.below(3));
        }
    }
    /// Puts the columns into a filter of the C interface.
    template <class Filter>
    void give(Filter& filter) const
    {
        filter.category = {category.data(), category.size(), sizeof(std::uint32_t)};
        filter.mask = {mask.data(), mask.size(), sizeof(std::uint32_t)};
        filter.owner = {owner.data(), owner.size(), sizeof(std::uint32_t)};
    }
    /// The same for one of the C++ interface.
    template <class Filter>
    void give_twin(Filter& filter) const
    {
        filter.category = category;
        filter.mask = mask;
        filter.owner = owner;
    }
};

} // namespace c_twin
