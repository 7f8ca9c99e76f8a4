// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

// The packaged library holds the double version only; a float one would be compiled here, for minutes.
#include <fcl/broadphase/broadphase_dynamic_AABB_tree.h>

#include "jostle/box.hpp"

namespace jostle_bench {

/// A geometry that is its box: moved by changing it, as a deforming mesh would be, so that FCL compares the
/// very numbers that everyone else does.
class BoxGeometry final : public fcl::CollisionGeometryd
{
  public:
    explicit BoxGeometry(const jostle::Aabb3f& box) { set(box); }
    void set(const jostle::Aabb3f& box)
    {
        aabb_local.min_ = {box.lo[0], box.lo[1], box.lo[2]};
        aabb_local.max_ = {box.hi[0], box.hi[1], box.hi[2]};
    }
    void computeLocalAABB() override {}
};

/// Numbered boxes and FCL's DynamicAABBTreeCollisionManager<double> of them.
class FclBoxes
{
  public:
    fcl::DynamicAABBTreeCollisionManagerd manager;

    [[nodiscard]] static std::uint32_t number(const fcl::CollisionObjectd* object)
    {
        return static_cast<std::uint32_t>(reinterpret_cast<std::uintptr_t>(object->getUserData()));
    }
    [[nodiscard]] std::size_t size() const noexcept { return objects_.size(); }
    /// The next in order; not in the manager yet.
    fcl::CollisionObjectd* add(const jostle::Aabb3f& box, std::uint32_t number)
    {
        geometries_.push_back(std::make_shared<BoxGeometry>(box));
        objects_.push_back(std::make_unique<fcl::CollisionObjectd>(geometries_.back()));
        objects_.back()->setUserData(reinterpret_cast<void*>(std::uintptr_t{number}));
        // The constructor asks the geometry to compute its box, which this one has already.
        objects_.back()->computeAABB();
        return objects_.back().get();
    }
    /// The manager is not told.
    fcl::CollisionObjectd* set(std::size_t i, const jostle::Aabb3f& box)
    {
        geometries_[i]->set(box);
        objects_[i]->computeAABB();
        return objects_[i].get();
    }
    [[nodiscard]] fcl::CollisionObjectd* object(std::size_t i) const { return objects_[i].get(); }

  private:
    std::vector<std::shared_ptr<BoxGeometry>> geometries_;
    std::vector<std::unique_ptr<fcl::CollisionObjectd>> objects_;
};

} // namespace jostle_bench
