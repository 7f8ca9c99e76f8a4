// SPDX-License-Identifier: MIT
// Rungs 1 and 2: thesis, ch. 4, Alg. 6 to 10.
#include "bench/ladder/printed.hpp"

#include <algorithm>
#include <array>
#include <stdexcept>
#include <string>

namespace jostle_ladder {

namespace chapter = jostle::chapter;

template <int Dim, jostle::Coordinate T>
Printed<Dim, T>::Printed(std::vector<T> cell_size, std::uint32_t max_buckets, chapter::Hash hash)
    : cell_size_(std::move(cell_size)), hash_(hash), grid_(max_buckets, nullptr)
{
}

// Alg. 6. Objects are linked when all are there (see detect_proximity), so that the buffer may move as it
// grows.
template <int Dim, jostle::Coordinate T>
void Printed<Dim, T>::add_object(const Box& box)
{
    T greater_size = 0;
    for (int d = 0; d < Dim; ++d)
        greater_size = std::max(greater_size, box.hi[d] - box.lo[d]);
    std::uint32_t level = 0;
    while (level < cell_size_.size() && cell_size_[level] < greater_size)
        ++level;
    if (level == cell_size_.size())
        throw std::invalid_argument("object " + std::to_string(objects_.size()) + " has an edge of " +
                                    std::to_string(greater_size) + ", more than the largest cell, " +
                                    std::to_string(cell_size_.empty() ? T{} : cell_size_.back()));
    objects_.push_back({box, level, 0, nullptr, nullptr});
}

// Eq. 1 and 2: the quotient, truncated as C truncates it.
template <class T>
static std::int64_t truncated(T position, T cell_size)
{
    return static_cast<std::int64_t>(position / cell_size);
}

template <int Dim, jostle::Coordinate T>
std::uint32_t Printed<Dim, T>::bucket_of(const Cell& cell, std::uint32_t level) const
{
    const auto buckets = static_cast<std::int64_t>(grid_.size());
    if (hash_ == chapter::Hash::mixing)
        return chapter::bucket_index<Dim>(cell, level, static_cast<std::uint32_t>(buckets), hash_);
    std::int64_t index = level;
    for (const std::int64_t coordinate : cell)
        index += coordinate;
    index %= buckets;
    if (index < 0) index = -index;
    return static_cast<std::uint32_t>(index);
}

template <int Dim, jostle::Coordinate T>
void Printed<Dim, T>::detect_proximity(jostle::Executor& executor, std::uint32_t stride)
{
    std::fill(grid_.begin(), grid_.end(), nullptr);
    for (Object& object : objects_) { // Alg. 6, lines 7 to 13
        Cell cell;
        for (int d = 0; d < Dim; ++d)
            cell[static_cast<std::size_t>(d)] = truncated(object.box.lo[d], cell_size_[object.level]);
        object.bucket = bucket_of(cell, object.level);
        object.previous = nullptr;
        if (grid_[object.bucket] != nullptr) grid_[object.bucket]->previous = &object;
        object.next = grid_[object.bucket];
        grid_[object.bucket] = &object;
    }
    close_pairs.clear();
    added_.clear();
    probes = candidates = again = selves = 0;
    chapter::on_all_processors(executor, [&](std::uint32_t processor, std::uint32_t processors) {
        detect_proximity_thread(
            chapter::work_interval(processor, processors, static_cast<std::uint32_t>(objects_.size())),
            stride);
    });
}

// Alg. 10.
template <int Dim, jostle::Coordinate T>
void Printed<Dim, T>::detect_proximity_thread(chapter::Interval interval, std::uint32_t stride)
{
    Tally tally;
    for (std::uint32_t i = (interval.begin + stride - 1) / stride * stride; i < interval.end; i += stride) {
        const Object& obj = objects_[i];
        for (std::uint32_t level = obj.level; level < cell_size_.size(); ++level) {
            std::array<std::int64_t, 3> first{}, last{}, cell{};
            for (int d = 0; d < Dim; ++d) {
                first[static_cast<std::size_t>(d)] = truncated(obj.box.lo[d], cell_size_[level]);
                last[static_cast<std::size_t>(d)] = truncated(obj.box.hi[d], cell_size_[level]);
            }
            for (cell[2] = first[2]; cell[2] <= last[2]; ++cell[2]) {
                const bool later = cell[2] > first[2];
                for (cell[1] = first[1] - (later ? 1 : 0); cell[1] <= last[1]; ++cell[1]) {
                    const bool southwest = cell[1] == last[1] && last[1] > first[1];
                    for (cell[0] = first[0] - (later || southwest ? 1 : 0); cell[0] <= last[0]; ++cell[0]) {
                        Cell probed;
                        std::copy_n(cell.begin(), Dim, probed.begin());
                        test_bucket(obj, probed, level, cell[0] >= first[0] && cell[1] >= first[1], tally);
                    }
                }
            }
        }
    }
    const std::scoped_lock lock(close_pairs_mutex_);
    probes += tally.probes;
    candidates += tally.candidates;
}

// Lines 10 to 18 and, without the look at the object itself, 23 to 28.
template <int Dim, jostle::Coordinate T>
void Printed<Dim, T>::test_bucket(const Object& obj, const Cell& cell, std::uint32_t level,
                                  bool passes_itself, Tally& tally)
{
    ++tally.probes;
    for (const Object* p = grid_[bucket_of(cell, level)]; p != nullptr; p = p->next) {
        if (passes_itself && p == &obj) continue;
        ++tally.candidates;
        if (jostle::overlaps(obj.box, p->box)) add_pair(obj, *p); // IsClose
    }
}

template <int Dim, jostle::Coordinate T>
void Printed<Dim, T>::add_pair(const Object& obj, const Object& p)
{
    const auto a = static_cast<std::uint32_t>(std::min(&obj, &p) - objects_.data());
    const auto b = static_cast<std::uint32_t>(std::max(&obj, &p) - objects_.data());
    const std::scoped_lock lock(close_pairs_mutex_);
    if (!added_.insert(std::uint64_t{a} << 32 | b).second) {
        ++again;
        return;
    }
    close_pairs.push_back({a, b});
    if (a == b) ++selves;
}

template <int Dim, jostle::Coordinate T>
std::uint64_t Printed<Dim, T>::bytes() const
{
    constexpr std::uint64_t node = sizeof(void*) + sizeof(std::uint64_t); // of the hash table
    return objects_.capacity() * sizeof(Object) + grid_.size() * sizeof(Object*) +
           added_.bucket_count() * sizeof(void*) + added_.size() * node;
}

template class Printed<2, float>;
template class Printed<3, float>;
template class Printed<2, double>;
template class Printed<3, double>;

} // namespace jostle_ladder
