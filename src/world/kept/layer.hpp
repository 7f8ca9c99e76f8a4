// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory_resource>
#include <optional>
#include <span>
#include <vector>

#include "world/kept/active_index.hpp"
#include "world/update/writer.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace world {

/// The objects that count for a declared category and mask, in indexes of their own, which are brought up to
/// date when somebody asks. Where these objects lie among many others, each leaf of the main indexes has some
/// of both, so only an index without the others avoids visiting them. No answer depends on layers.
template <int Dim, class T>
class Layer
{
  public:
    Layer(const QueryLayer& asker, const IndexOptions& options);

    [[nodiscard]] bool is_for(std::uint32_t category, std::uint32_t mask) const noexcept
    {
        return asker_.category == category && asker_.mask == mask;
    }
    /// What rests, as the last update has left it. `applied`: what apply() has changed since.
    const BoxIndex<Dim, T>& resting(const State<Dim, T>& state,
                                    const std::optional<Applied<Dim, T>>& applied);
    /// Of so many resting objects these rest no more, elsewhere or anew: after an update.
    void note_resting(std::span<const std::uint32_t> rested, std::span<const std::uint32_t> settling,
                      std::size_t resting) noexcept;
    /// All may lie elsewhere.
    void forget() noexcept;

    ActiveIndex<Dim, T> active; // those of them that are active

  private:
    void follow(const State<Dim, T>& state, const std::optional<Applied<Dim, T>>& applied);

    const QueryLayer asker_;
    OnDemand up_to_date_;
    BoxIndex<Dim, T> resting_;
    bool knows_moved_ = false;                    // else it has to look at all
    std::pmr::vector<std::uint32_t> moved_;       // who came to rest, shifted or woke up since it was fresh
    std::pmr::vector<std::uint32_t> gone_, come_; // working memory
    std::pmr::vector<Aabb<Dim, T>> boxes_;
};

} // namespace world
JOSTLE_NAMESPACE_END
