// SPDX-License-Identifier: MIT
#pragma once

#include <utility>

#include "c_api/structure.hpp"
#include "jostle/box_index.hpp"

// What is behind a jostle_index.

namespace jostle::c_api {

class IndexContent final
    : public StructureContent<InSomeSpace<BoxIndex2f, BoxIndex3f, BoxIndex2d, BoxIndex3d>>
{
  public:
    IndexContent(jostle_space in, Kept given) : StructureContent(in, std::move(given))
    {
        in_space(space, [&](auto of) {
            held.emplace<BoxIndex<decltype(of)::dim, typename decltype(of)::T>>(kept.options<IndexOptions>());
        });
    }
    bool release_memory() override
    {
        on([](auto& typed) { typed.release_memory(); });
        memories.release();
        return true;
    }
};

template <>
struct Behind<jostle_index> : Kind<IndexContent, 0x04>
{
    static constexpr const char* name = "jostle_index";
};

} // namespace jostle::c_api
