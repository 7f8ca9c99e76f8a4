// SPDX-License-Identifier: MIT
#pragma once

#include <variant>

#include "c_api/handles.hpp"
#include "c_api/working_memory.hpp"
#include "jostle/contact.hpp"
#include "jostle/query.hpp"

namespace jostle::c_api {

/// Lists of answers as C sees them.
struct Lists
{
    std::vector<std::uint64_t> first, ids;
    std::vector<double> at;
    std::vector<std::uint8_t> more;
    bool has_at = false;

    /// Before the first list.
    void start()
    {
        first.assign(1, 0);
        ids.clear();
        at.clear();
        more.clear();
        has_at = false;
    }
};

/// What one call found.
class ResultsContent final : public Content
{
  public:
    explicit ResultsContent(Kept given) : kept(std::move(given)), joined(kept.resource()) {}

    Kept kept;
    Lists lists;
    std::pmr::vector<Pair> joined; // memory for joins, used again
    std::vector<Pair> pairs;
    std::vector<std::byte> bytes; // a text's zero isn't counted
    std::uint64_t byte_count = 0;
    WorkingMemory memory; // of the calls that fill it
    // A buffer's memory resource came with it, from the finder that filled it.
    std::shared_ptr<std::pmr::memory_resource> buffer_memory;
    std::variant<std::monostate, PairBuffer, ContactBuffer<2, float>, ContactBuffer<3, float>,
                 ContactBuffer<2, double>, ContactBuffer<3, double>, PointContactBuffer<2, float>,
                 PointContactBuffer<3, float>, PointContactBuffer<2, double>, PointContactBuffer<3, double>>
        buffer;
    std::vector<jostle_block> table;
    jostle_blocks blocks{};
    enum class Holds
    {
        nothing,
        blocks,
        lists,
        lists_and_blocks,
        bytes
    } holds = Holds::nothing;

    /// Before a call fills it: whatever becomes of that, nothing old is left.
    void begin() noexcept;
    template <class Item>
    void take(BlockBuffer<Item>&& given, const std::shared_ptr<std::pmr::memory_resource>& its_memory)
    {
        buffer.template emplace<BlockBuffer<Item>>(std::move(given));
        buffer_memory = its_memory;
        const auto& taken = std::get<BlockBuffer<Item>>(buffer);
        blocks = list_blocks<Item>(taken.blocks(), taken.size(), table);
        holds = Holds::blocks;
    }
    /// The items of an array that lives in here.
    template <class Item>
    void show(std::span<const Item> items)
    {
        const std::span<const Item> all[] = {items};
        blocks = list_blocks<Item>(std::span(all, items.empty() ? 0 : 1), items.size(), table);
        holds = Holds::blocks;
    }
    /// All bytes that are here.
    void show_bytes() noexcept
    {
        byte_count = bytes.size();
        holds = Holds::bytes;
    }
};

template <>
struct Behind<jostle_results> : Kind<ResultsContent, 0x02>
{
    static constexpr const char* name = "jostle_results";
};
template <>
struct Behind<jostle_executor> : Kind<ExecutorContent, 0x01>
{
    static constexpr const char* name = "jostle_executor";
};

} // namespace jostle::c_api
