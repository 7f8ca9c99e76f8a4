// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <mutex>
#include <unordered_set>
#include <vector>

#include "jostle/chapter.hpp"

namespace jostle_ladder {

/// Algorithms 6 to 10 to the letter, faults included, so that what they lose, and the objects that they pair
/// with themselves, can be counted.
///
/// As printed   the bucket is (x + y + level) % MAX_BUCKETS, negated where that is negative; a bucket's
///              objects are compared whatever their cell and level; the object itself is passed over in the
///              four cells, not in the southwest one; a pair is added unless it is there already.
/// Not printed  how the quotient is rounded: it is truncated, as C does. The southwest cell in 3D: also the
///              cells before the first one on x or y that come later in the order of z, y, x; in 2D that is
///              the chapter's fifth cell. How "already added" is known: by a hash table. The lock around
///              both: the text has none (see tests/chapter/printed_test.cpp).
/// Mended       one processor, for which Alg. 9 reads intervals[-1]. Pairs are kept as (lesser, greater)
///              number, and the southwest cell is probed before the rest of its row: the set of pairs is the
///              same.
/// Refused      std::invalid_argument for an object larger than the largest cell, for which Alg. 6 reads past
///              the end of cellSize.
template <int Dim, jostle::Coordinate T>
class Printed
{
  public:
    using Box = jostle::Aabb<Dim, T>;
    using Cell = jostle::chapter::Cell<Dim>;

    Printed(std::vector<T> cell_size, std::uint32_t max_buckets,
            jostle::chapter::Hash hash = jostle::chapter::Hash::as_printed);

    void add_object(const Box& box); ///< Alg. 6
    /// Alg. 9, lines 1 to 16, for every `stride`-th object. Coordinates have to be far below 2^62 cells.
    void detect_proximity(jostle::Executor& executor, std::uint32_t stride = 1);

    std::vector<jostle::Pair> close_pairs; ///< a <= b; equal where an object was found to touch itself
    std::uint64_t probes = 0, candidates = 0, again = 0, selves = 0;
    [[nodiscard]] std::uint64_t bytes() const;
    [[nodiscard]] std::uint32_t level(std::uint32_t object) const { return objects_[object].level; }

  private:
    struct Object
    {
        Box box;
        std::uint32_t level, bucket;
        Object *previous, *next;
    };
    struct Tally
    {
        std::uint64_t probes = 0, candidates = 0;
    };
    [[nodiscard]] std::uint32_t bucket_of(const Cell& cell, std::uint32_t level) const; // Alg. 7
    void detect_proximity_thread(jostle::chapter::Interval interval, std::uint32_t stride);
    void test_bucket(const Object& obj, const Cell& cell, std::uint32_t level, bool passes_itself,
                     Tally& tally);
    void add_pair(const Object& obj, const Object& p);

    std::vector<T> cell_size_;
    jostle::chapter::Hash hash_;
    std::vector<Object*> grid_;
    std::vector<Object> objects_;
    std::mutex close_pairs_mutex_;
    std::unordered_set<std::uint64_t> added_;
};

} // namespace jostle_ladder
