// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <memory_resource>
#include <vector>

#include "jostle/version.hpp"

JOSTLE_NAMESPACE_BEGIN

/// Items for the time of one call: as many as `size` bytes hold lie on the stack, and more take memory.
template <class Item, std::size_t size = 2048>
class ItemsOnStack
{
    alignas(Item) std::byte room_[size];
    std::pmr::monotonic_buffer_resource memory_;

  public:
    explicit ItemsOnStack(std::pmr::memory_resource* more = std::pmr::new_delete_resource())
        : memory_(room_, size, more)
    {
        found.reserve(size / sizeof(Item));
    }

    std::pmr::vector<Item> found{&memory_};
};

JOSTLE_NAMESPACE_END
