// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <limits>

#include "jostle/box.hpp"
#include "jostle/query.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace index {

/// How many boxes are tested at once: one AVX-512 register of floats.
inline constexpr std::uint32_t lanes = 16;
/// The most objects of a page: 16 leaves of 16.
inline constexpr std::uint32_t page_capacity = lanes * lanes;
inline constexpr std::uint32_t no_id = ~std::uint32_t{0};

/// 16 boxes, one array per bound. An empty lane begins at +infinity and ends at -infinity: no test with
/// finite numbers lets it pass, and other tests recognise it by its id or child.
template <int Dim, class T>
struct Bounds
{
    T lo[Dim][lanes];
    T hi[Dim][lanes];

    void clear(std::uint32_t lane) noexcept
    {
        for (int d = 0; d < Dim; ++d) {
            lo[d][lane] = std::numeric_limits<T>::infinity();
            hi[d][lane] = -std::numeric_limits<T>::infinity();
        }
    }
    void clear() noexcept
    {
        for (std::uint32_t lane = 0; lane < lanes; ++lane)
            clear(lane);
    }
    void set(std::uint32_t lane, const Aabb<Dim, T>& box) noexcept
    {
        for (int d = 0; d < Dim; ++d) {
            lo[d][lane] = box.lo[d];
            hi[d][lane] = box.hi[d];
        }
    }
    [[nodiscard]] Aabb<Dim, T> get(std::uint32_t lane) const noexcept
    {
        Aabb<Dim, T> box;
        for (int d = 0; d < Dim; ++d) {
            box.lo[d] = lo[d][lane];
            box.hi[d] = hi[d][lane];
        }
        return box;
    }
    /// The smallest box around all lanes.
    [[nodiscard]] Aabb<Dim, T> hull() const noexcept
    {
        Aabb<Dim, T> box;
        for (int d = 0; d < Dim; ++d) {
            // By halves, so that compilers recognise independent lanes.
            T low[lanes / 2], high[lanes / 2];
            for (std::uint32_t k = 0; k < lanes / 2; ++k) {
                low[k] = lo[d][k] < lo[d][k + lanes / 2] ? lo[d][k] : lo[d][k + lanes / 2];
                high[k] = hi[d][k] > hi[d][k + lanes / 2] ? hi[d][k] : hi[d][k + lanes / 2];
            }
            for (std::uint32_t half = lanes / 4; half > 0; half /= 2)
                for (std::uint32_t k = 0; k < half; ++k) {
                    low[k] = low[k] < low[k + half] ? low[k] : low[k + half];
                    high[k] = high[k] > high[k + half] ? high[k] : high[k + half];
                }
            box.lo[d] = low[0];
            box.hi[d] = high[0];
        }
        return box;
    }
};

/// An object that moves from one page to another.
template <int Dim, class T>
struct Record
{
    Aabb<Dim, T> box;
    std::uint32_t id;
};

/// Objects to be put into a page, one array per bound.
template <int Dim, class T>
struct Gathered
{
    alignas(64) T lo[Dim][page_capacity];
    alignas(64) T hi[Dim][page_capacity];
    alignas(64) std::uint32_t id[page_capacity];
    std::uint32_t count = 0;

    Gathered() {} // not worth initialising
    void add(const Aabb<Dim, T>& box, std::uint32_t new_id) noexcept
    {
        for (int d = 0; d < Dim; ++d) {
            lo[d][count] = box.lo[d];
            hi[d][count] = box.hi[d];
        }
        id[count++] = new_id;
    }
    [[nodiscard]] Aabb<Dim, T> box(std::uint32_t k) const noexcept
    {
        Aabb<Dim, T> result;
        for (int d = 0; d < Dim; ++d) {
            result.lo[d] = lo[d][k];
            result.hi[d] = hi[d][k];
        }
        return result;
    }
};

/// Up to 16 objects.
template <int Dim, class T>
struct alignas(64) Leaf
{
    Bounds<Dim, T> bounds;
    std::uint32_t id[lanes];

    /// The lanes that hold an object.
    [[nodiscard]] unsigned live() const noexcept
    {
        unsigned bits = 0;
        for (std::uint32_t lane = 0; lane < lanes; ++lane)
            bits |= static_cast<unsigned>(id[lane] != no_id) << lane;
        return bits;
    }
};

template <int Dim, class T>
struct Node;

/// A node, a leaf, or null.
template <int Dim, class T>
class Child
{
  public:
    Child() = default;
    Child(const Node<Dim, T>* node) noexcept : bits_(reinterpret_cast<std::uintptr_t>(node)) {}
    Child(const Leaf<Dim, T>* leaf) noexcept : bits_(reinterpret_cast<std::uintptr_t>(leaf) | 1) {}
    explicit operator bool() const noexcept { return bits_ != 0; }
    [[nodiscard]] bool is_leaf() const noexcept { return (bits_ & 1) != 0; }
    [[nodiscard]] const Node<Dim, T>* node() const noexcept
    {
        return reinterpret_cast<const Node<Dim, T>*>(bits_);
    }
    [[nodiscard]] const Leaf<Dim, T>* leaf() const noexcept
    {
        return reinterpret_cast<const Leaf<Dim, T>*>(bits_ - 1);
    }
    friend bool operator==(Child a, Child b) noexcept { return a.bits_ == b.bits_; }

  private:
    std::uintptr_t bits_ = 0;
};

/// Up to 16 nodes or leaves and the bounds of all objects in each.
template <int Dim, class T>
struct alignas(64) Node
{
    Bounds<Dim, T> bounds;
    Child<Dim, T> child[lanes];
};

} // namespace index
JOSTLE_NAMESPACE_END
