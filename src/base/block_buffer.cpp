// SPDX-License-Identifier: MIT
#include "jostle/block_buffer.hpp"

#include <string>

#include "jostle/error.hpp"

JOSTLE_NAMESPACE_BEGIN

void detail::throw_no_room(std::uint64_t room, std::uint64_t size)
{
    throw Error(ErrorCode::size_mismatch,
                "room for " + std::to_string(room) + " items, but there are " + std::to_string(size));
}

void detail::throw_no_item(std::uint64_t number, std::uint64_t size)
{
    throw Error(ErrorCode::invalid_argument,
                "there is no item " + std::to_string(number) + ": there are " + std::to_string(size));
}

JOSTLE_NAMESPACE_END
