// SPDX-License-Identifier: MIT
// The hierarchical grid: thesis, ch. 4.1, Alg. 6 to 10.
#include <cassert>
#include <cmath>
#include <string>

#include "base/checks.hpp"
#include "jostle/chapter.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace chapter {

template <Coordinate T>
std::int64_t cell_index(T position, T cell_size) noexcept
{
    // 2^62 leaves room for the neighbours' +-1, and converting anything up to it is defined. Negated tests,
    // so that the NaN of 0 / 0 (a host that flushes tiny cell sizes to 0) ends up somewhere too.
    constexpr std::int64_t limit = std::int64_t{1} << 62;
    const T index = std::floor(position / cell_size);
    if (!(index < static_cast<T>(limit))) return limit;
    if (!(index > -static_cast<T>(limit))) return -limit;
    return static_cast<std::int64_t>(index);
}

namespace {

// Alg. 7. Sums wrap around in unsigned arithmetic, as far-away cells make them too large for a signed one.
template <int Dim>
std::uint32_t printed_hash(const Cell<Dim>& cell, std::uint32_t level, std::uint32_t buckets) noexcept
{
    std::uint64_t sum = level;
    for (const std::int64_t coordinate : cell)
        sum += static_cast<std::uint64_t>(coordinate);
    std::int64_t index = static_cast<std::int64_t>(sum) % std::int64_t{buckets};
    if (index < 0) index = -index;
    return static_cast<std::uint32_t>(index);
}

// Multiply to carry low bits up, shift to bring high bits down, once per coordinate; the constant is 2^64
// divided by the golden ratio (Knuth, TAOCP 3, sec. 6.4).
template <int Dim>
std::uint32_t mixing_hash(const Cell<Dim>& cell, std::uint32_t level, std::uint32_t buckets) noexcept
{
    constexpr std::uint64_t golden = 0x9e3779b97f4a7c15u;
    std::uint64_t h = level * golden;
    for (const std::int64_t coordinate : cell) {
        h = (h ^ static_cast<std::uint64_t>(coordinate)) * golden;
        h ^= h >> 32;
    }
    h *= golden;
    return static_cast<std::uint32_t>(((h >> 32) * buckets) >> 32); // the high bits scaled: no division
}

} // namespace

template <int Dim>
std::uint32_t bucket_index(const Cell<Dim>& cell, std::uint32_t level, std::uint32_t buckets,
                           Hash hash) noexcept
{
    return hash == Hash::as_printed ? printed_hash<Dim>(cell, level, buckets)
                                    : mixing_hash<Dim>(cell, level, buckets);
}

// What one processor finds; on cache lines of its own, for sec. 4.2 d's reason.
template <int Dim, Coordinate T>
struct alignas(cache_line) Grid<Dim, T>::ProcessorResult
{
    std::vector<Pair> pairs;
    GridStats stats;
};

template <int Dim, Coordinate T>
Grid<Dim, T>::Grid(GridOptions<T> options) : options_(std::move(options))
{
    const auto refuse = [](const std::string& message) { throw Error(ErrorCode::invalid_argument, message); };
    T last = 0;
    for (std::size_t level = 0; level < options_.cell_sizes.size(); ++level) {
        const T size = options_.cell_sizes[level];
        if (!(size > last) || size > std::numeric_limits<T>::max())
            refuse("cell_sizes[" + std::to_string(level) + "] = " + std::to_string(size) +
                   "; give finite sizes above 0, each greater than the one before");
        last = size;
    }
    if (options_.buckets == 0) refuse("buckets = 0; give at least 1, best about as many as objects");
    grid_.assign(std::size_t{options_.buckets} + 1, none);
    level_size_.assign(options_.cell_sizes.size() + 1, 0);
}

template <int Dim, Coordinate T>
typename Grid<Dim, T>::Place Grid<Dim, T>::place_of(const Aabb<Dim, T>& box) const noexcept
{
    // Alg. 6, lines 1-5. The width of a box at infinity (inf - inf) is 0 like any point's.
    T greater_size = 0;
    for (int d = 0; d < Dim; ++d)
        if (box.lo[d] != box.hi[d]) greater_size = std::max(greater_size, box.hi[d] - box.lo[d]);
    Place place{0, 0, {}};
    for (; place.level < oversize_level(); ++place.level) {
        const T cell_size = options_.cell_sizes[place.level];
        if (cell_size < greater_size) continue;
        // A box no wider than a cell lies over at most two of them per axis, except for the rounding of the
        // subtraction and of the divisions. The neighbour rule stands on the two, so they are made sure of.
        bool at_most_two = true;
        for (int d = 0; d < Dim; ++d) {
            place.cell[static_cast<std::size_t>(d)] = cell_index(box.lo[d], cell_size);
            at_most_two = at_most_two &&
                          cell_index(box.hi[d], cell_size) <= place.cell[static_cast<std::size_t>(d)] + 1;
        }
        if (at_most_two) {
            place.bucket =
                bucket_index<Dim>(place.cell, place.level, options_.buckets, options_.hash); // Alg. 6, line 8
            return place;
        }
    }
    // Larger than all cells: the one cell of a level of their own, in a bucket of its own.
    place.cell = {};
    place.bucket = options_.buckets;
    return place;
}

// Alg. 6, lines 7-13.
template <int Dim, Coordinate T>
void Grid<Dim, T>::link(std::uint32_t object) noexcept
{
    Object& record = records_[object];
    std::uint32_t& first = grid_[record.place.bucket];
    record.previous = none;
    if (first != none) records_[first].previous = object;
    record.next = first;
    first = object;
    ++level_size_[record.place.level];
}

// Alg. 8, lines 1-6.
template <int Dim, Coordinate T>
void Grid<Dim, T>::unlink(std::uint32_t object) noexcept
{
    const Object& record = records_[object];
    if (record.previous != none)
        records_[record.previous].next = record.next;
    else
        grid_[record.place.bucket] = record.next; // missing as printed: the bucket kept a removed object
    if (record.next != none) records_[record.next].previous = record.previous;
    --level_size_[record.place.level];
}

template <int Dim, Coordinate T>
std::uint32_t Grid<Dim, T>::add(const Aabb<Dim, T>& box)
{
    const bool reuse = first_removed_ != none;
    if (!reuse && records_.size() >= none)
        throw Error(ErrorCode::too_many_objects, "the grid holds 4294967295 objects; remove some first");
    const std::uint32_t object = reuse ? first_removed_ : static_cast<std::uint32_t>(records_.size());
    check_box(box, object, "");

    const auto position = static_cast<std::uint32_t>(objects_.size());
    objects_.push_back(object); // Alg. 6, line 14
    if (reuse) {
        first_removed_ = records_[object].next;
    } else {
        try {
            records_.emplace_back();
        } catch (...) {
            objects_.pop_back();
            throw;
        }
    }
    records_[object] = {box, place_of(box), none, none, position};
    link(object);
    return object;
}

template <int Dim, Coordinate T>
void Grid<Dim, T>::remove(std::uint32_t object)
{
    check_known(object);
    unlink(object);
    Object& record = records_[object];
    // Alg. 8, line 7, in O(1): the last object takes the place of the removed one.
    objects_[record.position] = objects_.back();
    records_[objects_.back()].position = record.position;
    objects_.pop_back();
    record.place.bucket = none;
    record.next = first_removed_;
    first_removed_ = object;
}

template <int Dim, Coordinate T>
void Grid<Dim, T>::move(std::uint32_t object, const Aabb<Dim, T>& box)
{
    check_known(object);
    check_box(box, object, "");
    Object& record = records_[object];
    const Place place = place_of(box);
    record.box = box;
    if (place.level == record.place.level && place.cell == record.place.cell) return;
    unlink(object);
    record.place = place;
    link(object);
}

template <int Dim, Coordinate T>
bool Grid<Dim, T>::contains(std::uint32_t object) const noexcept
{
    return object < records_.size() && records_[object].place.bucket != none;
}

template <int Dim, Coordinate T>
void Grid<Dim, T>::check_known(std::uint32_t object) const
{
    if (!contains(object))
        throw Error(ErrorCode::invalid_argument,
                    "object " + std::to_string(object) + " isn't in the grid; give a number that add() " +
                        "returned and that wasn't removed since",
                    object);
}

template <int Dim, Coordinate T>
const Aabb<Dim, T>& Grid<Dim, T>::box(std::uint32_t object) const
{
    check_known(object);
    return records_[object].box;
}

template <int Dim, Coordinate T>
std::uint32_t Grid<Dim, T>::level(std::uint32_t object) const
{
    check_known(object);
    return records_[object].place.level;
}

namespace {

// True for the object's own cell and those ahead of it: the last axis on which they differ rises. Of two
// neighbouring cells one is ahead of the other, so a pair within a level is found from one side alone. In 2D
// these are the chapter's cells: the four that the object may lie over, and the southwest one (fig. 4.4).
template <int Dim>
bool own_or_ahead(const Cell<Dim>& cell, const Cell<Dim>& own) noexcept
{
    for (std::size_t d = Dim; d-- > 0;)
        if (cell[d] != own[d]) return cell[d] > own[d];
    return true;
}

// The next cell of [first, last] with the first axis running fastest; false after the last one.
template <int Dim>
bool advance(Cell<Dim>& cell, const Cell<Dim>& first, const Cell<Dim>& last) noexcept
{
    for (std::size_t d = 0; d < Dim; ++d) {
        if (cell[d] < last[d]) {
            ++cell[d];
            return true;
        }
        cell[d] = first[d];
    }
    return false;
}

} // namespace

// Alg. 10, with three corrections.
// 1. On coarser levels every cell from x1-1 to x2 is probed. Whatever overlaps the object has its min corner
//    there: not right of x2, as it begins before the object ends; not left of x1-1, as it lies over at most
//    two cells and ends after the object begins. As printed, the own level's rule was used; but a coarser
//    object in the west or north, which isn't probed, doesn't probe downwards either, and the pair is lost.
// 2. From a bucket only objects of the probed cell count, as other cells share it and are probed themselves.
// 3. A pair within a level is reported by the object whose cell is behind the other's, within a cell by the
//    one that is earlier in the list. Together: each pair once, with nothing to remember.
template <int Dim, Coordinate T>
void Grid<Dim, T>::detect_proximity_thread(Interval interval, ProcessorResult& result) const
{
    GridStats stats;
    for (std::uint32_t i = interval.begin; i < interval.end; ++i) {
        const std::uint32_t object = objects_[i];
        const Object& obj = records_[object];
        for (std::uint32_t level = obj.place.level; level <= oversize_level(); ++level) {
            if (level_size_[level] == 0) continue;
            const bool own_level = level == obj.place.level;
            Cell<Dim> own{}, first{}, last{}; // the oversize level has one cell
            if (level < oversize_level())
                for (int d = 0; d < Dim; ++d) {
                    const auto axis = static_cast<std::size_t>(d);
                    own[axis] = cell_index(obj.box.lo[d], options_.cell_sizes[level]);
                    first[axis] = own[axis] - 1;
                    last[axis] = cell_index(obj.box.hi[d], options_.cell_sizes[level]);
                }
            Cell<Dim> cell = first;
            do {
                if (own_level && !own_or_ahead<Dim>(cell, own)) continue;
                ++stats.cells;
                std::uint32_t p;
                if (own_level && cell == own)
                    p = obj.next;
                else if (level < oversize_level())
                    p = grid_[bucket_index<Dim>(cell, level, options_.buckets, options_.hash)];
                else
                    p = grid_[options_.buckets];
                for (; p != none; p = records_[p].next) {
                    const Object& other = records_[p];
                    ++stats.visited;
                    if (other.place.level != level || other.place.cell != cell) continue;
                    ++stats.tests;
                    if (overlaps(obj.box, other.box)) // IsClose
                        result.pairs.push_back({std::min(object, p), std::max(object, p)});
                }
            } while (advance<Dim>(cell, first, last));
        }
    }
    result.stats = stats;
}

template <int Dim, Coordinate T>
std::span<const Pair> Grid<Dim, T>::detect_proximity(Executor& executor)
{
    close_pairs_.clear();
    std::vector<ProcessorResult> results(executor.concurrency());
    const auto object_count = static_cast<std::uint32_t>(objects_.size());
    on_all_processors(executor, [&](std::uint32_t processor, std::uint32_t) {
        const auto processors = static_cast<std::uint32_t>(results.size());
        detect_proximity_thread(work_interval(processor, processors, object_count), results[processor]);
    });
    // Intervals follow each other, so the order of their pairs doesn't tell where they were cut.
    std::size_t total = 0;
    for (const ProcessorResult& result : results)
        total += result.pairs.size();
    close_pairs_.reserve(total);
    stats_ = {};
    stats_.bytes = records_.capacity() * sizeof(Object) +
                   (grid_.capacity() + level_size_.capacity() + objects_.capacity()) * sizeof(std::uint32_t);
    for (const ProcessorResult& result : results) {
        close_pairs_.insert(close_pairs_.end(), result.pairs.begin(), result.pairs.end());
        stats_.cells += result.stats.cells;
        stats_.visited += result.stats.visited;
        stats_.tests += result.stats.tests;
    }
    return close_pairs_;
}

template <int Dim, Coordinate T>
void Grid<Dim, T>::process_collision_detection(
    Executor& executor, FunctionRef<void(std::uint32_t processor, const Pair& pair)> test, Batching batching,
    std::uint32_t batch)
{
    detect_proximity(executor);
    test_collisions(close_pairs_, executor, test, batching, batch);
}

template <int Dim, Coordinate T>
bool Grid<Dim, T>::validate() const
{
    std::vector<std::uint32_t> level_size(level_size_.size(), 0);
    std::size_t linked = 0;
    for (std::uint32_t bucket = 0; bucket < grid_.size(); ++bucket) {
        std::uint32_t previous = none;
        for (std::uint32_t object = grid_[bucket]; object != none; object = records_[object].next) {
            if (object >= records_.size() || ++linked > objects_.size()) return false;
            const Object& record = records_[object];
            const Place place = place_of(record.box);
            if (record.place.bucket != bucket || record.previous != previous || place.bucket != bucket ||
                place.level != record.place.level || place.cell != record.place.cell ||
                record.position >= objects_.size() || objects_[record.position] != object)
                return false;
            ++level_size[record.place.level];
            previous = object;
        }
    }
    std::size_t removed = 0;
    for (std::uint32_t object = first_removed_; object != none; object = records_[object].next)
        if (object >= records_.size() || contains(object) || ++removed > records_.size()) return false;
    return linked == objects_.size() && linked + removed == records_.size() && level_size == level_size_;
}

template JOSTLE_API std::int64_t cell_index(float, float) noexcept;
template JOSTLE_API std::int64_t cell_index(double, double) noexcept;
template JOSTLE_API std::uint32_t bucket_index<2>(const Cell<2>&, std::uint32_t, std::uint32_t,
                                                  Hash) noexcept;
template JOSTLE_API std::uint32_t bucket_index<3>(const Cell<3>&, std::uint32_t, std::uint32_t,
                                                  Hash) noexcept;
template class Grid<2, float>;
template class Grid<2, double>;
template class Grid<3, float>;
template class Grid<3, double>;

} // namespace chapter
JOSTLE_NAMESPACE_END
