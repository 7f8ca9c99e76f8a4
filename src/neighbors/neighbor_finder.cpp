// SPDX-License-Identifier: MIT
// Neighbour lists: points in the cells of a grid, and rows that a search of cells finds, or that are chosen
// from a list that a skin has kept.
#include "jostle/neighbors.hpp"

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <memory_resource>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "base/buffer.hpp"
#include "base/checks.hpp"
#include "base/exact_floats.hpp"
#include "base/in_use.hpp"
#include "base/instantiate.hpp"
#include "base/radix.hpp"
#include "jostle/executor.hpp"
#include "jostle/process.hpp"
#include "neighbors/grid.hpp"
#include "neighbors/kept.hpp"
#include "neighbors/kernels/neighbors.hpp"
#include "neighbors/request.hpp"
#include "neighbors/rows.hpp"
#include "neighbors/search.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace neighbors {

constexpr std::size_t systems_per_block = 16;

} // namespace neighbors

template <int Dim, Coordinate T>
struct NeighborFinder<Dim, T>::Implementation
{
    using Set = neighbors::PointSet<Dim, T>;
    using Request = neighbors::Request<Dim, T>;

    explicit Implementation(const FinderOptions& given)
        : options(given),
          kernels(&neighbors::kernels_for<Dim, T>(checked(given.instruction_set))),
          sets((check_memory(given.memory), given.memory)),
          tasks(given),
          places(given.memory),
          next_place(given.memory),
          result(given.memory),
          kept(given.memory),
          in_system(given.memory),
          of_systems(given.memory)
    {
    }

    FinderOptions options;
    const neighbors::NeighborKernels<Dim, T>* kernels;
    std::atomic<bool> in_use{false};
    neighbors::PointsInGrid<Dim, T> sets;
    neighbors::RowTasks<Dim, T> tasks;
    Buffer<std::uint32_t> places, next_place; ///< of a stream: of each of its ranges of rows
    neighbors::StoredNeighbors<Dim, T> result;
    neighbors::KeptList<Dim, T> kept;
    NeighborList<Dim, T> list;

    std::pmr::vector<std::unique_ptr<Implementation>>
        in_system; ///< of each task, where there are many systems
    std::pmr::vector<neighbors::StoredNeighbors<Dim, T>> of_systems; ///< what each block of systems found

    void search(const Request& request, const neighbors::RowRange& rows, const NeighborOptions& what,
                neighbors::StoredNeighbors<Dim, T>& into)
    {
        neighbors::Search<Dim, T>(request, sets, *kernels, tasks).find(rows, what, into);
    }

    const NeighborList<Dim, T>& find(const Set& a, const Set& b, bool two_sets,
                                     const NeighborCutoff<T>& cutoff, const Cell& cell,
                                     const NeighborOptions& what)
    {
        const InUse use(in_use, "NeighborFinder");
        const ExactFloats exact;
        const Request request = neighbors::checked_request<Dim, T>(a, b, two_sets, cutoff, cell, what);
        const neighbors::RowRange all{0, a.points.size(), nullptr};
        const bool with_skin = what.skin > 0, holds = with_skin && kept.holds(request);
        if (!holds) {
            const auto fitted = sets.fitted_grid(request);
            list = {}; // from here on only a lack of memory ends the call
            kept.forget();
            sets.fill(request, fitted);
            constexpr NeighborOptions to_keep{.shifts = true, .distances = true};
            search(request, all, with_skin ? to_keep : what, with_skin ? kept.list : result);
            if (with_skin) kept.keep(request, sets.grid, tasks);
        }
        list = {};
        if (with_skin) kept.choose(request, *kernels, tasks, result);
        return show(all.count, what, !holds);
    }

    bool stream(const Set& a, const Set& b, bool two_sets, const NeighborCutoff<T>& cutoff, std::size_t rows,
                Sink sink, const Cell& cell, const NeighborOptions& what)
    {
        const InUse use(in_use, "NeighborFinder");
        const ExactFloats exact;
        if (!sink) neighbors::refuse_search("no sink to stream to; find() lists all");
        if (rows == 0) neighbors::refuse_search("a stream in blocks of 0 rows never ends; give 1 or more");
        if (what.skin != 0)
            neighbors::refuse_search("a skin is for lists that are kept, and a stream keeps none");
        const Request request = neighbors::checked_request<Dim, T>(a, b, two_sets, cutoff, cell, what);
        const auto fitted = sets.fitted_grid(request);
        list = {}; // from here on only a lack of memory, or the sink, ends the call
        sets.fill(request, fitted);
        const std::size_t n = a.points.size();
        rows = std::min(rows, n);
        places.reserve(n);
        if (request.any_points()) { // the places of each block's rows, ascending
            std::uint32_t* const next = next_place.reserve((n - 1) / rows + 1);
            for (std::size_t block = 0; block * rows < n; ++block)
                next[block] = static_cast<std::uint32_t>(block * rows);
            for (std::size_t place = 0; place < n; ++place)
                places[next[sets.a.index[place] / rows]++] = static_cast<std::uint32_t>(place);
        }
        for (std::size_t first = 0; first < n; first += rows) {
            const neighbors::RowRange some{first, std::min(rows, n - first), places.data() + first};
            search(request, some, what, result);
            const NeighborList<Dim, T> found = std::exchange(show(some.count, what, true), {});
            if (!sink(first, found)) return false;
        }
        return true;
    }
    /// The result of n rows.
    NeighborList<Dim, T>& show(std::size_t n, const NeighborOptions& what, bool searched)
    {
        const std::size_t total = result.offsets[n];
        list.offsets = {result.offsets.data(), n + 1};
        list.neighbors = {result.neighbors.data(), total};
        if (what.shifts) list.shifts = {result.shifts.data(), total};
        if (what.vectors) list.vectors = {result.vectors.data(), total};
        if (what.distances) list.distances = {result.distances.data(), total};
        list.searched = searched;
        return list;
    }

    /// Each system by itself, divided among tasks.
    const NeighborList<Dim, T>& find_systems(const Set& all, std::span<const std::uint64_t> starts,
                                             const NeighborCutoff<T>& cutoff, std::span<const Cell> cells,
                                             const NeighborOptions& what)
    {
        const InUse use(in_use, "NeighborFinder");
        check_offsets(starts, "system", "point", all.points.size(), "points");
        neighbors::check_number(all);
        const std::size_t systems = starts.size() - 1;
        if (cells.size() > 1 && cells.size() != systems)
            throw Error(ErrorCode::size_mismatch, "there are " + std::to_string(cells.size()) +
                                                      " cells for " + std::to_string(systems) +
                                                      " systems; give one for each, or one for all");
        if (what.skin != 0) neighbors::refuse_search("a skin is for one system, and there are many");
        (void)neighbors::check_cutoffs(all, all, cutoff);
        const auto part_of = [](const auto& values, std::size_t first, std::size_t count) {
            return values.empty() ? values : values.subspan(first, count);
        };

        const ProcessOptions by{options.executor, neighbors::systems_per_block};
        const WorkPlan plan = plan_work(systems, by);
        while (in_system.size() < plan.slots) {
            FinderOptions serial = options;
            serial.executor = &serial_executor();
            in_system.push_back(std::make_unique<Implementation>(serial));
        }
        while (of_systems.size() < plan.blocks)
            of_systems.emplace_back(options.memory);
        tasks.counts.reserve(all.points.size());
        const auto find_block = [&](std::uint64_t begin, std::uint64_t end, Work work) {
            neighbors::StoredNeighbors<Dim, T>& found = of_systems[work.block];
            std::size_t total = 0;
            for (auto k = static_cast<std::size_t>(begin); k < end; ++k) {
                const auto first = static_cast<std::size_t>(starts[k]),
                           size = static_cast<std::size_t>(starts[k + 1]) - first;
                NeighborCutoff<T> own = cutoff;
                own.radii = part_of(cutoff.radii, first, size);
                own.types = part_of(cutoff.types, first, size);
                const Set set{all.points.subspan(first, size), own.radii, own.types, ""};
                const auto is_zero = [](T radius) { return radius == 0; }; // alone all of them are an error
                if (!own.radii.empty() && std::all_of(own.radii.begin(), own.radii.end(), is_zero)) {
                    std::fill_n(tasks.counts.data() + first, size, std::uint64_t{0});
                    continue;
                }
                const NeighborList<Dim, T>* some = nullptr;
                try {
                    some = &in_system[work.slot]->find(
                        set, set, false, own, cells.empty() ? Cell{} : cells[cells.size() == 1 ? 0 : k],
                        what);
                } catch (const Error& error) {
                    throw Error(error.code(), "system " + std::to_string(k) + ": " + error.what(),
                                error.index() == Error::no_index ? Error::no_index : first + error.index());
                }
                for (std::size_t i = 0; i < size; ++i)
                    tasks.counts[first + i] = some->offsets[i + 1] - some->offsets[i];
                const auto append = [&](auto& to, const auto& from) {
                    if (from.empty()) return; // also what isn't wanted
                    std::copy(from.begin(), from.end(), to.grow(total + from.size(), total) + total);
                };
                append(found.neighbors, some->neighbors);
                for (std::size_t n = 0; n < some->neighbors.size(); ++n)
                    found.neighbors[total + n] += static_cast<std::uint32_t>(first);
                append(found.shifts, some->shifts);
                append(found.vectors, some->vectors);
                append(found.distances, some->distances);
                total += some->neighbors.size();
            }
        };
        process_items(systems, find_block, by);

        list = {};
        const std::size_t n = all.points.size();
        std::uint64_t* const offsets = result.offsets.reserve(n + 1);
        offsets[n] = exclusive_sum(std::copy_n(tasks.counts.data(), n, offsets) - n, n);
        const std::uint64_t total = offsets[n];
        result.neighbors.reserve(total);
        if (what.shifts) result.shifts.reserve(total);
        if (what.vectors) result.vectors.reserve(total);
        if (what.distances) result.distances.reserve(total);
        const auto copy_block = [&](std::uint64_t begin, std::uint64_t end, Work work) {
            neighbors::StoredNeighbors<Dim, T>& found = of_systems[work.block];
            const std::uint64_t first = offsets[starts[begin]], size = offsets[starts[end]] - first;
            std::copy_n(found.neighbors.data(), size, result.neighbors.data() + first);
            if (what.shifts) std::copy_n(found.shifts.data(), size, result.shifts.data() + first);
            if (what.vectors) std::copy_n(found.vectors.data(), size, result.vectors.data() + first);
            if (what.distances) std::copy_n(found.distances.data(), size, result.distances.data() + first);
        };
        process_items(systems, copy_block, by);
        return show(n, what, true);
    }

    void release()
    {
        sets.release(), tasks.release(), result.release(), kept.release();
        places.release(), next_place.release();
        std::pmr::vector<std::unique_ptr<Implementation>>(options.memory).swap(in_system);
        std::pmr::vector<neighbors::StoredNeighbors<Dim, T>>(options.memory).swap(of_systems);
        list = {};
    }
};

template <int Dim, Coordinate T>
NeighborFinder<Dim, T>::NeighborFinder(const FinderOptions& options)
    : implementation_(std::make_unique<Implementation>(options))
{
}
template <int Dim, Coordinate T>
NeighborFinder<Dim, T>::NeighborFinder(NeighborFinder&&) noexcept = default;
template <int Dim, Coordinate T>
NeighborFinder<Dim, T>& NeighborFinder<Dim, T>::operator=(NeighborFinder&&) noexcept = default;
template <int Dim, Coordinate T>
NeighborFinder<Dim, T>::~NeighborFinder() = default;

template <int Dim, Coordinate T>
const NeighborList<Dim, T>& NeighborFinder<Dim, T>::find(Points points, const NeighborCutoff<T>& cutoff,
                                                         const Cell& cell, const NeighborOptions& options) &
{
    neighbors::refuse_second_set(cutoff);
    const neighbors::PointSet<Dim, T> set{points, cutoff.radii, cutoff.types, ""};
    return implementation_->find(set, set, false, cutoff, cell, options);
}

template <int Dim, Coordinate T>
const NeighborList<Dim, T>& NeighborFinder<Dim, T>::find(Points points, Points others,
                                                         const NeighborCutoff<T>& cutoff, const Cell& cell,
                                                         const NeighborOptions& options) &
{
    return implementation_->find({points, cutoff.radii, cutoff.types, "a "},
                                 {others, cutoff.radii_b, cutoff.types_b, "b "}, true, cutoff, cell, options);
}

template <int Dim, Coordinate T>
const NeighborList<Dim, T>&
NeighborFinder<Dim, T>::find_systems(Points points, std::span<const std::uint64_t> offsets,
                                     const NeighborCutoff<T>& cutoff, std::span<const Cell> cells,
                                     const NeighborOptions& options) &
{
    neighbors::refuse_second_set(cutoff);
    return implementation_->find_systems({points, cutoff.radii, cutoff.types, ""}, offsets, cutoff, cells,
                                         options);
}

template <int Dim, Coordinate T>
bool NeighborFinder<Dim, T>::stream(Points points, const NeighborCutoff<T>& cutoff, std::size_t rows,
                                    Sink sink, const Cell& cell, const NeighborOptions& options)
{
    neighbors::refuse_second_set(cutoff);
    const neighbors::PointSet<Dim, T> set{points, cutoff.radii, cutoff.types, ""};
    return implementation_->stream(set, set, false, cutoff, rows, sink, cell, options);
}

template <int Dim, Coordinate T>
bool NeighborFinder<Dim, T>::stream(Points points, Points others, const NeighborCutoff<T>& cutoff,
                                    std::size_t rows, Sink sink, const Cell& cell,
                                    const NeighborOptions& options)
{
    return implementation_->stream({points, cutoff.radii, cutoff.types, "a "},
                                   {others, cutoff.radii_b, cutoff.types_b, "b "}, true, cutoff, rows, sink,
                                   cell, options);
}

template <int Dim, Coordinate T>
void NeighborFinder<Dim, T>::release_memory() noexcept
{
    implementation_->release();
}

#define JOSTLE_INSTANTIATE(Dim, T) template class JOSTLE_API NeighborFinder<Dim, T>;
JOSTLE_FOR_EACH_SPACE(JOSTLE_INSTANTIATE)
#undef JOSTLE_INSTANTIATE

JOSTLE_NAMESPACE_END
