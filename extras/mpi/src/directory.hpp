// SPDX-License-Identifier: MIT
#pragma once

#include <memory_resource>
#include <string>
#include <unordered_set>
#include <vector>

#include "object.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace mpi {

/// The ids of the scene. For each id one rank, not always the object's owner, knows whether it exists, so
/// that no two ranks can add the same.
class Directory
{
  public:
    explicit Directory(std::pmr::memory_resource* memory) : ids_(memory), added_(memory), removed_(memory) {}

    [[nodiscard]] static int rank_of(std::uint64_t id, int ranks) noexcept
    {
        return static_cast<int>(mixed(id) % static_cast<unsigned>(ranks));
    }

    void add(std::uint64_t id)
    {
        make_room(added_);
        if (!ids_.insert(id).second)
            throw Error(ErrorCode::invalid_argument,
                        "object " + std::to_string(id) + " is added, and the scene has it already", id);
        added_.push_back(id);
    }
    void remove(std::uint64_t id) { removed_.push_back(id); }

    void keep() noexcept
    {
        for (const std::uint64_t id : removed_)
            ids_.erase(id);
        forget();
    }
    void undo() noexcept
    {
        for (const std::uint64_t id : added_)
            ids_.erase(id);
        forget();
    }

  private:
    void forget() noexcept
    {
        added_.clear();
        removed_.clear();
    }

    std::pmr::unordered_set<std::uint64_t, MixedHash> ids_;
    std::pmr::vector<std::uint64_t> added_, removed_; // in this update
};

} // namespace mpi
JOSTLE_NAMESPACE_END
