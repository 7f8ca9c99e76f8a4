// SPDX-License-Identifier: MIT
#pragma once

#include <utility>

#include "c_api/handles.hpp"
#include "c_api/working_memory.hpp"
#include "jostle/box_index.hpp"

// What is behind a jostle_index.

namespace jostle::c_api {

class IndexContent final : public Content
{
  public:
    IndexContent(jostle_space in, Kept given) : kept(std::move(given)), space(in)
    {
        in_space(space, [&](auto of) {
            index.emplace<BoxIndex<decltype(of)::dim, typename decltype(of)::T>>(
                kept.options<IndexOptions>());
        });
    }
    template <class F>
    void on(F&& inside)
    {
        on_held(index, inside);
    }
    template <class F>
    void on(F&& inside) const
    {
        on_held(index, inside);
    }

    bool clear() override
    {
        on([](auto& typed) { typed.clear(); });
        return true;
    }
    bool release_memory() override
    {
        on([](auto& typed) { typed.release_memory(); });
        memories.release();
        return true;
    }
    [[nodiscard]] std::optional<std::uint64_t> size() const override
    {
        std::uint64_t size = 0;
        on([&](const auto& typed) { size = typed.size(); });
        return size;
    }

    Kept kept;
    jostle_space space;
    mutable WorkingMemories memories; // of queries
    InSomeSpace<BoxIndex2f, BoxIndex3f, BoxIndex2d, BoxIndex3d> index;
};

template <>
struct Behind<jostle_index>
{
    using type = IndexContent;
    static constexpr std::uint64_t mark = 0x6a6f73746c650004U;
    static constexpr const char* name = "jostle_index";
};

} // namespace jostle::c_api
