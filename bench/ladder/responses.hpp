// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string_view>
#include <vector>

#include "jostle/executor.hpp"
#include "jostle/pair_buffer.hpp"

/// Ways to add up what collisions do to each object, from all cores (chapter 4.2 c).
namespace jostle_ladder {

/// A response is a whole number here, so that every order of additions gives the same sum.
using Push = std::uint64_t;

class ResponseWay
{
  public:
    virtual ~ResponseWay() = default;
    /// The sum of push_of(object, other) over the pairs of each object. The same executor each time.
    virtual std::vector<Push> sum(std::span<const jostle::Pair> pairs, jostle::Executor& executor) = 0;
};

struct ResponseInfo
{
    std::string_view name;
    std::unique_ptr<ResponseWay> (*make)(std::uint32_t objects);
};

[[nodiscard]] std::span<const ResponseInfo> response_ways();

/// Stands for the response of an object to its collision with another one.
[[nodiscard]] inline Push push_of(std::uint32_t object, std::uint32_t other) noexcept
{
    return (std::uint64_t{object} << 8 ^ other) * 0x9e3779b97f4a7c15u >> 32;
}

} // namespace jostle_ladder
