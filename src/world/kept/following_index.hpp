// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <memory_resource>
#include <optional>
#include <vector>

#include "jostle/box_index.hpp"
#include "jostle/function_ref.hpp"
#include "jostle/world.hpp"
#include "world/kept/on_demand.hpp"
#include "world/objects/state.hpp"
#include "world/update/writer.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace world {

/// An index of some of a world's objects, which the first query after an update or apply() brings up to date.
template <int Dim, class T>
class FollowingIndex
{
  public:
    /// Returns the bounds of an object, or null if it isn't one of these. Called by several threads.
    using Where = FunctionRef<const Aabb<Dim, T>*(Index)>;
    /// Visits all objects that may be among these, each once.
    using Each = FunctionRef<void(FunctionRef<void(Index)>)>;

    explicit FollowingIndex(const IndexOptions& options)
        : index_(options),
          moved_(options.memory),
          gone_(options.memory),
          come_(options.memory),
          boxes_(options.memory)
    {
    }
    const BoxIndex<Dim, T>& of(const Where& where, const Each& each)
    {
        up_to_date_.ensure([&] { follow(where, each); });
        return index_;
    }
    /// These objects may have moved, been added or removed.
    template <class Indices>
    void note(const Indices& indices) noexcept
    {
        constexpr std::size_t worth = 8; // moving one object costs as much as visiting this many
        up_to_date_.forget();
        knows_moved_ = knows_moved_ && worth * (moved_.size() + indices.size()) <= index_.size();
        if (!knows_moved_) return;
        try {
            for (const auto index : indices)
                moved_.push_back(static_cast<std::uint32_t>(index));
        } catch (...) {
            knows_moved_ = false;
        }
    }
    /// All objects may have.
    void forget() noexcept
    {
        up_to_date_.forget();
        knows_moved_ = false;
    }

  private:
    void follow(const Where& where, const Each& each);
    void follow_moved(const Where& where);
    void follow_all(const Where& where, const Each& each);

    OnDemand up_to_date_;
    BoxIndex<Dim, T> index_;
    bool knows_moved_ = false;                    // otherwise it has to visit all
    std::pmr::vector<std::uint32_t> moved_;       // noted since it was last up to date
    std::pmr::vector<std::uint32_t> gone_, come_; // working memory
    std::pmr::vector<Aabb<Dim, T>> boxes_;
};

/// Separate indexes of the objects that a declared category and mask select. If these objects are spread
/// among many others, each leaf of the main indexes has some of both, so only an index without the others
/// avoids visiting them. No answer depends on layers.
template <int Dim, class T>
struct Layer
{
    Layer(const QueryLayer& selects, const IndexOptions& options)
        : asker(selects), resting(options), active(options)
    {
    }
    const QueryLayer asker;
    FollowingIndex<Dim, T> resting, active;
};

/// Whether queries with this category and mask select objects with such a filter.
[[nodiscard]] inline bool counts(const ObjectFilter& object, const QueryLayer& asker) noexcept
{
    return ((object.category & asker.mask) != 0) & ((asker.category & object.mask) != 0);
}

/// The index of what queries see besides resting objects: active objects and those that apply() has written
/// to, with a layer those that it selects. Null if there are none.
template <int Dim, class T>
const BoxIndex<Dim, T>* active_of(FollowingIndex<Dim, T>& index, const State<Dim, T>& state,
                                  const QueryLayer* layer = nullptr);
/// The index of the resting objects that a layer selects, as of the last update. `applied`: what apply() has
/// changed since.
template <int Dim, class T>
const BoxIndex<Dim, T>& resting_of(Layer<Dim, T>& layer, const State<Dim, T>& state,
                                   const std::optional<Applied<Dim, T>>& applied);

} // namespace world
JOSTLE_NAMESPACE_END
