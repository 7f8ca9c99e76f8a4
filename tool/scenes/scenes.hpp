// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "jostle/box.hpp"

/// Moving boxes to test and measure with: the only input of the tests, the tool and the benchmarks.
namespace jostle_scenes {

struct SceneInfo
{
    std::string_view name;
    std::string_view summary;
    /// What the scene's world is sized for, on average; 0 where the scene has no such aim.
    double pairs_per_object;
    /// Made to break or slow an engine down, rather than to resemble somebody's data.
    bool hostile;
};

/// Every scene there is; first the seven that are measured by default, then the hostile ones.
[[nodiscard]] std::span<const SceneInfo> scene_list() noexcept;

/// Throws std::invalid_argument, listing the names there are, if `name` is none of them.
[[nodiscard]] const SceneInfo& scene_info(std::string_view name);

/// Seeded boxes that move. The boxes of a (name, dimension, coordinate type, size, seed, frame) are the same
/// bits on every platform: own random numbers, no library maths but square roots, no fused multiply-add.
///
/// Units    an ordinary box has edges of about 1.
/// Motion   each axis at its own constant speed, at most 0.1 a frame, reflected at the walls of the world.
/// Sizing   the world is as big as the stated pairs per object want for the sizes that were drawn, so that
///          the work per object is the same at 1,000 and at 10,000,000 objects.
/// Threads  `boxes` from any thread, but not during `step`.
/// Cost     linear; 10 million objects take 120 bytes each in 3D float.
template <int Dim, jostle::Coordinate T>
class Scene
{
  public:
    /// Throws std::invalid_argument for an unknown name or more than 2^32 - 1 objects.
    Scene(std::string_view name, std::size_t objects, std::uint64_t seed = 1);

    [[nodiscard]] const SceneInfo& info() const noexcept { return *info_; }
    /// The boxes of the present frame, in memory that stays where it is for the life of the scene.
    [[nodiscard]] std::span<const jostle::Aabb<Dim, T>> boxes() const noexcept { return boxes_; }
    /// On to the next frame.
    void step();

  private:
    struct Body
    {
        T centre[Dim];
        T half[Dim];
        T velocity[Dim];
    };
    void place_box(std::size_t i) noexcept;

    const SceneInfo* info_;
    std::vector<Body> bodies_;
    std::vector<jostle::Aabb<Dim, T>> boxes_;
    T extent_[Dim] = {}; // centres live in [0, extent]
    T offset_ = 0;       // of the world from the origin
};

extern template class Scene<2, float>;
extern template class Scene<2, double>;
extern template class Scene<3, float>;
extern template class Scene<3, double>;

} // namespace jostle_scenes
