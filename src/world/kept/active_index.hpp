// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <memory_resource>
#include <optional>
#include <span>
#include <vector>

#include "jostle/box_index.hpp"
#include "jostle/world.hpp"
#include "world/kept/on_demand.hpp"
#include "world/objects/state.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace world {

/// Whether queries of this category and mask are about objects with such a filter.
[[nodiscard]] inline bool counts(const ObjectFilter& object, const QueryLayer& asker) noexcept
{
    return ((object.category & asker.mask) != 0) & ((asker.category & object.mask) != 0);
}

/// What queries see and the index of resting objects doesn't have: the active objects and those that
/// apply() has written to, indexed when the first query after an update or apply() is asked. With a layer:
/// those of them that count for it.
template <int Dim, class T>
class ActiveIndex
{
  public:
    explicit ActiveIndex(const IndexOptions& options, std::optional<QueryLayer> layer = std::nullopt)
        : layer_(layer),
          index_(options),
          moved_(options.memory),
          gone_(options.memory),
          come_(options.memory),
          boxes_(options.memory)
    {
    }
    /// Null if there are no active objects.
    BoxIndex<Dim, T>* of(const State<Dim, T>& state);
    /// These may lie elsewhere: after an update or apply(), or because it is taken back.
    void note(std::span<const Index> changed, std::span<const std::uint32_t> settling) noexcept;
    /// All may lie elsewhere.
    void forget() noexcept;

  private:
    [[nodiscard]] bool is_here(const State<Dim, T>& state, Index index) const noexcept;
    void follow(const State<Dim, T>& state);
    void follow_moved(const State<Dim, T>& state);
    void follow_all(const State<Dim, T>& state);

    const std::optional<QueryLayer> layer_;
    OnDemand up_to_date_;
    BoxIndex<Dim, T> index_;
    bool knows_moved_ = false;                    // else it has to look at all
    std::pmr::vector<std::uint32_t> moved_;       // objects that changed or came to rest since it was fresh
    std::pmr::vector<std::uint32_t> gone_, come_; // working memory
    std::pmr::vector<Aabb<Dim, T>> boxes_;
};

} // namespace world
JOSTLE_NAMESPACE_END
