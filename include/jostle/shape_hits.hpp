// SPDX-License-Identifier: MIT
#pragma once

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory_resource>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

#include "jostle/cast.hpp"
#include "jostle/contact.hpp"
#include "jostle/function_ref.hpp"
#include "jostle/process.hpp"
#include "jostle/shapes.hpp"
#include "jostle/version.hpp"
#include "jostle/world.hpp"

// What shape_query.hpp is asked, and what it answers.

JOSTLE_NAMESPACE_BEGIN

/// A shape that moves by `displacement` from where it is, without turning.
template <int Dim, Coordinate T>
struct ShapeSweep
{
    Shape<Dim> shape;
    Pose<Dim, T> pose;
    Vec<Dim, T> displacement;
};

/// Asks for the shape that is nearest to this one, and no further away than `max_distance`.
template <int Dim, Coordinate T>
struct NearestShape
{
    Shape<Dim> shape; ///< Shape() is a point
    Pose<Dim, T> pose;
    T max_distance = std::numeric_limits<T>::infinity();
};

/// What an object is.
template <int Dim, Coordinate T>
struct PosedShape
{
    Shape<Dim> shape;
    Pose<Dim, T> pose;
};

using ShapeSweep2f = ShapeSweep<2, float>;
using ShapeSweep3f = ShapeSweep<3, float>;
using ShapeSweep2d = ShapeSweep<2, double>;
using ShapeSweep3d = ShapeSweep<3, double>;
using NearestShape2f = NearestShape<2, float>;
using NearestShape3f = NearestShape<3, float>;
using NearestShape2d = NearestShape<2, double>;
using NearestShape3d = NearestShape<3, double>;
using PosedShape2f = PosedShape<2, float>;
using PosedShape3f = PosedShape<3, float>;
using PosedShape2d = PosedShape<2, double>;
using PosedShape3d = PosedShape<3, double>;

namespace detail {

/// The `Error` where an id has no shape or no pose of its own.
[[noreturn]] JOSTLE_API void throw_no_shape(std::uint32_t id, std::size_t shapes, std::size_t poses);

} // namespace detail

/// Shape and pose of each object, found by its id in a BoxIndex or the index of its id in a World: arrays,
/// vectors, spans or members of structs, or a function that is given the id.
///
/// Lifetime  it refers to what it is made of: write it where it is used, {shapes, poses} or a lambda.
template <int Dim, Coordinate T>
class PosedShapes
{
  public:
    PosedShapes(StridedView<Shape<Dim>> shapes, StridedView<Pose<Dim, T>> poses)
        : shapes_(shapes), poses_(poses)
    {
    }
    /// PosedShape<Dim, T> of(std::uint32_t id); called by several threads at a time in a batch.
    template <class F>
        requires(!std::same_as<std::remove_cvref_t<F>, PosedShapes> &&
                 std::is_invocable_r_v<PosedShape<Dim, T>, F&, std::uint32_t>)
    PosedShapes(F&& of) : of_(std::forward<F>(of))
    {
    }
    /// Calls use(shape, pose) with those of an object.
    template <class F>
    void with(std::uint32_t id, F&& use) const
    {
        if (of_) {
            const PosedShape<Dim, T> object = of_(id);
            use(object.shape, object.pose);
        } else {
            if (id >= shapes_.size() || id >= poses_.size())
                detail::throw_no_shape(id, shapes_.size(), poses_.size());
            use(shapes_[id], poses_[id]);
        }
    }

  private:
    StridedView<Shape<Dim>> shapes_;
    StridedView<Pose<Dim, T>> poses_;
    FunctionRef<PosedShape<Dim, T>(std::uint32_t id)> of_;
};

/// Where a ray, or a shape on its way, meets an object's shape. `point` counts from the position of that
/// object's pose. `Id` is ObjectId in a World, std::uint32_t in a BoxIndex.
template <int Dim, Coordinate T, class Id = ObjectId>
struct ShapeHit : CastHit<Dim, T>
{
    Id id;
};

/// How far an object's shape is from the one asked about, which is a, and where; see Distance.
template <int Dim, Coordinate T, class Id = ObjectId>
struct ShapeDistance : Distance<Dim, T>
{
    Id id;
};

/// The answers of a batch: list i belongs to question i. The next call refills it and uses its memory again.
/// `Hit` is a ShapeHit.
template <class Hit>
class HitLists
{
  public:
    explicit HitLists(std::pmr::memory_resource* memory = std::pmr::get_default_resource())
        : first_(memory), hits_(memory), more_(memory), found_(memory)
    {
    }

    [[nodiscard]] std::size_t size() const noexcept { return size_; }
    [[nodiscard]] std::span<const Hit> operator[](std::size_t i) const noexcept
    {
        return std::span<const Hit>(hits_).subspan(first_[i], first_[i + 1] - first_[i]);
    }
    /// Whether question i has more hits than `max_results`, which list i was cut to.
    [[nodiscard]] bool more(std::size_t i) const noexcept { return more_[i] != 0; }
    /// All lists, one behind the other.
    [[nodiscard]] std::span<const Hit> hits() const noexcept { return hits_; }

    /// Refills the lists with what append(i, hits) appends for question i; it returns whether there is more.
    template <class F>
    void fill(std::size_t questions, const ProcessOptions& options, const F& append)
    {
        const std::size_t blocks = plan_work(questions, options).blocks;
        size_ = 0; // also where something throws
        hits_.clear();
        first_.assign(questions + 1, 0);
        more_.assign(questions, 0);
        if (found_.size() < blocks) found_.resize(blocks);
        const auto fill_block = [&](std::uint64_t begin, std::uint64_t end, Work work) {
            auto& found = found_[work.block];
            found.clear();
            for (std::uint64_t i = begin; i < end; ++i) {
                const std::size_t before = found.size();
                more_[i] = append(i, found) ? 1 : 0;
                first_[i + 1] = found.size() - before;
            }
        };
        process_items(questions, fill_block, options);
        for (std::size_t i = 0; i < questions; ++i)
            first_[i + 1] += first_[i];
        hits_.reserve(first_.back());
        for (std::size_t block = 0; block < blocks; ++block)
            hits_.insert(hits_.end(), found_[block].begin(), found_[block].end());
        size_ = questions;
    }

  private:
    std::size_t size_ = 0;
    std::pmr::vector<std::size_t> first_;
    std::pmr::vector<Hit> hits_;
    std::pmr::vector<std::uint8_t> more_;
    std::pmr::vector<std::pmr::vector<Hit>> found_; // by block of questions
};

using ShapeHit2f = ShapeHit<2, float>;
using ShapeHit3f = ShapeHit<3, float>;
using ShapeHit2d = ShapeHit<2, double>;
using ShapeHit3d = ShapeHit<3, double>;
using IndexShapeHit2f = ShapeHit<2, float, std::uint32_t>;
using IndexShapeHit3f = ShapeHit<3, float, std::uint32_t>;
using IndexShapeHit2d = ShapeHit<2, double, std::uint32_t>;
using IndexShapeHit3d = ShapeHit<3, double, std::uint32_t>;
using ShapeDistance2f = ShapeDistance<2, float>;
using ShapeDistance3f = ShapeDistance<3, float>;
using ShapeDistance2d = ShapeDistance<2, double>;
using ShapeDistance3d = ShapeDistance<3, double>;
using IndexShapeDistance2f = ShapeDistance<2, float, std::uint32_t>;
using IndexShapeDistance3f = ShapeDistance<3, float, std::uint32_t>;
using IndexShapeDistance2d = ShapeDistance<2, double, std::uint32_t>;
using IndexShapeDistance3d = ShapeDistance<3, double, std::uint32_t>;

JOSTLE_NAMESPACE_END
