// SPDX-License-Identifier: MIT
// Neighbour lists: points in the cells of a grid along the reciprocal axes of the space that repeats. A test
// of wrapped points with room for rounding finds who may be near; the test of the definition decides.
#include "jostle/neighbors.hpp"

#include <algorithm>
#include <atomic>
#include <memory_resource>
#include <vector>

#include "base/buffer.hpp"
#include "base/checks.hpp"
#include "base/exact_floats.hpp"
#include "base/in_use.hpp"
#include "base/instantiate.hpp"
#include "jostle/executor.hpp"
#include "jostle/process.hpp"
#include "pairs/neighbor_grid.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace neighbors {
namespace {

constexpr std::size_t rows_per_block = 128; // of work; up to three blocks are done by the calling thread
constexpr int image_bits = 10;              // of an image's number along an axis, in the key of a neighbour
constexpr std::int64_t image_bias = 1 << (image_bits - 1);
static_assert(most_images + 2 < image_bias);

/// Points of the grid that follow each other in memory, all shifted in the same way.
template <int Dim, Coordinate T>
struct ImageRun
{
    std::size_t begin, end;
    Vec<Dim, T> by;
    Periods<Dim> image;
};

/// A neighbour as it is sorted: by index, then by image, the first axis first. Of two points in whole periods
/// of their own, shifts ascend as images do.
template <int Dim>
std::uint64_t neighbor_key(std::uint32_t index, const Periods<Dim>& image)
{
    std::uint64_t code = 0;
    for (const std::int32_t periods : image)
        code = code << image_bits | static_cast<std::uint64_t>(periods + image_bias);
    return std::uint64_t{index} << 32 | code;
}
template <int Dim>
Periods<Dim> image_of(std::uint64_t key)
{
    Periods<Dim> image;
    for (std::size_t k = detail::axes<Dim>; k-- > 0; key >>= image_bits)
        image[k] =
            static_cast<std::int32_t>(static_cast<std::int64_t>(key % (1u << image_bits)) - image_bias);
    return image;
}

/// A list in memory of its own.
template <int Dim, Coordinate T>
struct StoredNeighbors
{
    explicit StoredNeighbors(std::pmr::memory_resource* memory)
        : offsets(memory), neighbors(memory), shifts(memory), vectors(memory), distances(memory)
    {
    }

    Buffer<std::uint64_t> offsets;
    Buffer<std::uint32_t> neighbors;
    Buffer<Periods<Dim>> shifts;
    Buffer<Vec<Dim, T>> vectors;
    Buffer<T> distances;

    void release()
    {
        offsets.release(), neighbors.release(), shifts.release(), vectors.release(), distances.release();
    }
};

} // namespace
} // namespace neighbors

template <int Dim, Coordinate T>
struct NeighborFinder<Dim, T>::Implementation
{
    using Set = neighbors::PointSet<Dim, T>;

    struct Scratch
    {
        explicit Scratch(std::pmr::memory_resource* memory) : runs(memory) {}
        std::pmr::vector<neighbors::ImageRun<Dim, T>> runs;
    };
    struct Request
    {
        Set a, b;
        bool two_sets;
        neighbors::CutoffRule<T> rule;
        Cell cell;
        NeighborOptions options;
    };

    explicit Implementation(const FinderOptions& given)
        : options(given),
          grid_a((check_memory(given.memory), given.memory)),
          grid_b(given.memory),
          scratch(given.memory),
          blocks(given.memory),
          counts(given.memory),
          result(given.memory),
          kept(given.memory),
          kept_points(given.memory),
          kept_radii(given.memory),
          kept_types(given.memory),
          kept_table(given.memory)
    {
        (void)checked(given.instruction_set);
    }

    FinderOptions options;
    std::atomic<bool> in_use{false};
    neighbors::NeighborGrid<Dim, T> grid;
    neighbors::GridPoints<Dim, T> grid_a, grid_b;             ///< one set has the first alone
    std::pmr::vector<Scratch> scratch;                        ///< of each task
    std::pmr::vector<std::pmr::vector<std::uint64_t>> blocks; ///< what each block of rows found
    Buffer<std::uint64_t> counts;                             ///< of each row
    std::size_t most_runs = 0;                                ///< what each Scratch has room for
    neighbors::StoredNeighbors<Dim, T> result, kept;
    NeighborList<Dim, T> list;

    // What is kept is for these.
    bool is_kept = false, kept_two_sets = false, kept_half = false;
    double kept_skin = 0, kept_rounding = 0;
    T kept_value = 0;
    Cell kept_cell;
    std::size_t kept_a = 0;
    std::pmr::vector<Vec<Dim, T>> kept_points; ///< of both sets, as are the next two
    std::pmr::vector<T> kept_radii;
    std::pmr::vector<std::uint32_t> kept_types;
    std::pmr::vector<T> kept_table;

    /// Calls body(scratch, block, begin, end) for each block of n rows.
    template <class Body>
    void each_block(std::size_t n, const Body& body)
    {
        const bool few = n <= 3 * neighbors::rows_per_block;
        const ProcessOptions by{few ? &serial_executor() : options.executor, neighbors::rows_per_block};
        const WorkPlan plan = plan_work(n, by);
        while (scratch.size() < plan.slots)
            scratch.emplace_back(options.memory);
        while (blocks.size() < plan.blocks)
            blocks.emplace_back();
        for (Scratch& each : scratch)
            each.runs.reserve(most_runs);
        const auto run_block = [&](std::uint64_t begin, std::uint64_t end, Work work) {
            const ExactFloats exact; // on this thread
            body(scratch[work.slot], work.block, static_cast<std::size_t>(begin),
                 static_cast<std::size_t>(end));
        };
        process_items(n, run_block, by);
    }

    /// Where the images of b's points lie that points of this cell of the grid can reach.
    void list_runs(std::uint32_t number, neighbors::GridPoints<Dim, T>& b,
                   std::pmr::vector<neighbors::ImageRun<Dim, T>>& runs)
    {
        std::int64_t at[detail::axes<Dim>], other[detail::axes<Dim>];
        std::int64_t rest = number;
        for (int k = Dim - 1; k >= 0; --k) {
            at[k] = rest % grid.cells[k];
            rest /= grid.cells[k];
        }
        runs.clear();
        neighbors::Periods<Dim> image{};
        const auto along = [&](const auto& self, int k) -> void {
            std::int64_t first = at[k] - grid.reach[k], last = at[k] + grid.reach[k];
            if (!grid.repeats[k])
                first = std::max<std::int64_t>(first, 0), last = std::min(last, grid.cells[k] - 1);
            for (std::int64_t c = first; c <= last; ++c) {
                const std::int64_t within = ((c % grid.cells[k]) + grid.cells[k]) % grid.cells[k];
                const std::int64_t periods = (c - within) / grid.cells[k];
                image[static_cast<std::size_t>(k)] = static_cast<std::int32_t>(periods);
                other[k] = within;
                if (k < Dim - 1) {
                    self(self, k + 1);
                    continue;
                }
                const std::int64_t end = std::min(last, (periods + 1) * grid.cells[k] - 1);
                std::int64_t cell = 0;
                for (int d = 0; d < Dim; ++d)
                    cell = cell * grid.cells[d] + other[d];
                const std::size_t begin = b.starts[static_cast<std::size_t>(cell)];
                const std::size_t stop = b.starts[static_cast<std::size_t>(cell + end - c + 1)];
                c = end;
                if (begin == stop) continue;
                Vec<Dim, double> by{};
                for (int d = 0; d < Dim; ++d)
                    by += grid.vectors[d] * static_cast<double>(image[static_cast<std::size_t>(d)]);
                runs.push_back({begin, stop, Vec<Dim, T>(by), image});
            }
        };
        along(along, 0);
    }

    /// Appends the keys of the neighbours of a's point `row`, sorted.
    void find_row(const Request& request, const neighbors::GridPoint<Dim, T>& from, std::size_t row,
                  const std::pmr::vector<neighbors::ImageRun<Dim, T>>& runs, neighbors::GridPoints<Dim, T>& b,
                  std::pmr::vector<std::uint64_t>& out)
    {
        constexpr std::size_t at_once = 64;
        const T skin = static_cast<T>(request.options.skin);
        const std::uint64_t itself = neighbors::neighbor_key<Dim>(from.index, {});
        const std::size_t before = out.size();
        const T* const axes[] = {b.x.data(), b.y.data(), b.z.data()};
        T here[detail::axes<Dim>];
        for (int d = 0; d < Dim; ++d)
            here[d] = grid_a.axis(d)[row];
        for (const neighbors::ImageRun<Dim, T>& run : runs) {
            T to[detail::axes<Dim>];
            for (int d = 0; d < Dim; ++d)
                to[d] = here[d] - run.by[d];
            for (std::size_t begin = run.begin; begin < run.end; begin += at_once) {
                const std::size_t size = std::min(at_once, run.end - begin);
                T squares[at_once];
                std::uint32_t hits[at_once];
                for (std::size_t k = 0; k < size; ++k) {
                    T square = 0;
                    for (int d = 0; d < Dim; ++d) {
                        const T apart = axes[d][begin + k] - to[d];
                        square += apart * apart;
                    }
                    squares[k] = square;
                }
                std::size_t count = 0;
                for (std::size_t k = 0; k < size; ++k) {
                    hits[count] = static_cast<std::uint32_t>(k);
                    count += squares[k] <= grid.near;
                }
                for (std::size_t k = 0; k < count; ++k) {
                    const neighbors::GridPoint<Dim, T>& other = b.points[begin + hits[k]];
                    const std::uint64_t key = neighbors::neighbor_key<Dim>(other.index, run.image);
                    if (!request.two_sets && (request.options.half ? key <= itself : key == itself)) continue;
                    const T cutoff = request.rule(from.radius, from.type, other.radius, other.type);
                    const T most = cutoff + skin;
                    const Vec<Dim, T> apart = neighbors::vector_between(
                        from.at, other.at, shift_of(run.image, from.wrapped, other.wrapped), request.cell);
                    if (cutoff > 0 && dot(apart, apart) <= most * most) out.push_back(key);
                }
            }
        }
        std::sort(out.begin() + static_cast<std::ptrdiff_t>(before), out.end());
    }
    static neighbors::Periods<Dim> shift_of(neighbors::Periods<Dim> image,
                                            const neighbors::Periods<Dim>& from,
                                            const neighbors::Periods<Dim>& to)
    {
        for (std::size_t k = 0; k < detail::axes<Dim>; ++k)
            image[k] += from[k] - to[k];
        return image;
    }

    /// Writes what blocks have found: row_of(s) is the row of their s-th, and decode(row, found) the
    /// neighbour and its shift.
    template <class RowOf, class Decode>
    void store(const Request& request, const NeighborOptions& what, neighbors::StoredNeighbors<Dim, T>& into,
               const RowOf& row_of, const Decode& decode)
    {
        const std::size_t n = request.a.points.size();
        std::uint64_t* const offsets = into.offsets.reserve(n + 1);
        std::uint64_t total = 0;
        for (std::size_t i = 0; i < n; ++i) {
            offsets[i] = total;
            total += counts[i];
        }
        offsets[n] = total;
        into.neighbors.reserve(total), into.shifts.reserve(total);
        if (what.vectors) into.vectors.reserve(total);
        if (what.distances) into.distances.reserve(total);
        each_block(n, [&](Scratch&, std::size_t block, std::size_t begin, std::size_t end) {
            const std::uint64_t* found = blocks[block].data();
            for (std::size_t s = begin; s < end; ++s) {
                const std::size_t row = row_of(s);
                for (std::uint64_t k = offsets[row]; k < offsets[row + 1]; ++k) {
                    const auto [neighbor, shift] = decode(row, *found++);
                    into.neighbors[k] = neighbor;
                    into.shifts[k] = shift;
                    if (!what.vectors && !what.distances) continue;
                    const Vec<Dim, T> apart = neighbors::vector_between(
                        request.a.points[row], request.b.points[neighbor], shift, request.cell);
                    if (what.vectors) into.vectors[k] = apart;
                    if (what.distances) into.distances[k] = length(apart);
                }
            }
        });
    }

    void search(const Request& request, const NeighborOptions& what, neighbors::StoredNeighbors<Dim, T>& into)
    {
        const std::size_t n = request.a.points.size();
        counts.reserve(n);
        if (n == 0 || request.b.points.empty()) {
            std::fill_n(counts.data(), n, std::uint64_t{0});
            return store(
                request, what, into, [](std::size_t s) { return s; },
                [](std::size_t, std::uint64_t) { return Neighbor{}; });
        }
        neighbors::GridPoints<Dim, T>& b = request.two_sets ? grid_b : grid_a;
        grid_a.fill(request.a, grid);
        if (request.two_sets) grid_b.fill(request.b, grid);
        double runs = 1; // at most, unless they are very many: which task has the most is chance
        for (int k = 0; k < Dim; ++k)
            runs *= 2 * static_cast<double>(grid.reach[k]) /
                        static_cast<double>(k < Dim - 1 ? 1 : grid.cells[k]) +
                    2;
        most_runs = static_cast<std::size_t>(std::min(runs, 4096.0));
        each_block(n, [&](Scratch& own, std::size_t block, std::size_t begin, std::size_t end) {
            auto& found = blocks[block];
            found.clear();
            std::uint64_t cell = ~std::uint64_t{0};
            for (std::size_t s = begin; s < end; ++s) {
                const neighbors::GridPoint<Dim, T>& from = grid_a.points[s];
                if (grid_a.cell[from.index] != cell) list_runs(grid_a.cell[from.index], b, own.runs);
                cell = grid_a.cell[from.index];
                const std::size_t before = found.size();
                find_row(request, from, s, own.runs, b, found);
                counts[from.index] = found.size() - before;
            }
        });
        store(
            request, what, into, [&](std::size_t s) { return grid_a.points[s].index; },
            [&](std::size_t row, std::uint64_t key) {
                const auto neighbor = static_cast<std::uint32_t>(key >> 32);
                return Neighbor{neighbor, shift_of(neighbors::image_of<Dim>(key), grid_a.periods[row],
                                                   b.periods[neighbor])};
            });
    }
    struct Neighbor
    {
        std::uint32_t index;
        neighbors::Periods<Dim> shift;
    };

    /// Chooses from what is kept.
    void choose(const Request& request)
    {
        const std::size_t n = request.a.points.size();
        counts.reserve(n);
        const auto of = [](const auto& values, std::size_t i) {
            using Value = std::remove_cvref_t<decltype(values[i])>;
            return values.empty() ? Value{} : values[i];
        };
        each_block(n, [&](Scratch&, std::size_t block, std::size_t begin, std::size_t end) {
            auto& found = blocks[block];
            found.clear();
            for (std::size_t i = begin; i < end; ++i) {
                const std::size_t before = found.size();
                for (std::uint64_t k = kept.offsets[i]; k < kept.offsets[i + 1]; ++k) {
                    const std::uint32_t j = kept.neighbors[k];
                    const Vec<Dim, T> apart = neighbors::vector_between(
                        request.a.points[i], request.b.points[j], kept.shifts[k], request.cell);
                    const T cutoff = request.rule(of(request.a.radii, i), of(request.a.types, i),
                                                  of(request.b.radii, j), of(request.b.types, j));
                    if (dot(apart, apart) <= cutoff * cutoff) found.push_back(k);
                }
                counts[i] = found.size() - before;
            }
        });
        store(
            request, request.options, result, [](std::size_t i) { return i; },
            [&](std::size_t, std::uint64_t k) { return Neighbor{kept.neighbors[k], kept.shifts[k]}; });
    }

    /// Calls look(kept, given) with all that a kept list depends on, until it says false.
    template <class Look>
    bool each_input(const Request& request, const Look& look)
    {
        return look(kept_two_sets, request.two_sets) && look(kept_half, request.options.half) &&
               look(kept_skin, request.options.skin) && look(kept_value, request.rule.value) &&
               look(kept_cell, request.cell) && look(kept_a, request.a.points.size());
    }
    template <class Kept, class Get>
    static bool same_columns(const Request& request, const Kept& kept_column, const Get& get)
    {
        const auto a = get(request.a), b = get(request.b);
        return kept_column.size() == a.size() + b.size() &&
               std::equal(a.begin(), a.end(), kept_column.begin()) &&
               std::equal(b.begin(), b.end(), kept_column.begin() + static_cast<std::ptrdiff_t>(a.size()));
    }
    template <class Kept, class Get>
    static void keep_columns(const Request& request, Kept& kept_column, const Get& get)
    {
        const auto a = get(request.a), b = get(request.b);
        kept_column.assign(a.begin(), a.end());
        kept_column.insert(kept_column.end(), b.begin(), b.end());
    }
    static constexpr auto radii_of = [](const Set& set) { return set.radii; };
    static constexpr auto types_of = [](const Set& set) { return set.types; };

    /// Whether all who may be neighbours now are in the kept list.
    bool still_holds(const Request& request)
    {
        if (!is_kept ||
            !each_input(request, [](const auto& before, const auto& now) { return before == now; }) ||
            kept_points.size() != request.a.points.size() + request.b.points.size() ||
            !same_columns(request, kept_radii, radii_of) || !same_columns(request, kept_types, types_of) ||
            !std::equal(kept_table.begin(), kept_table.end(), request.rule.table.begin(),
                        request.rule.table.end()))
            return false;
        const double most = kept_skin / 2 * (1 - 1e-12) - 4 * kept_rounding;
        std::size_t at = 0;
        for (const Set* set : {&request.a, &request.b})
            for (const Vec<Dim, T>& point : set->points) {
                const auto moved = grid.wide(point) - grid.wide(kept_points[at++]);
                if (!(most > 0 && dot(moved, moved) <= most * most)) return false;
            }
        return true;
    }
    void keep(const Request& request)
    {
        each_input(request, [](auto& before, const auto& now) {
            before = now;
            return true;
        });
        keep_columns(request, kept_points, [](const Set& set) { return set.points; });
        keep_columns(request, kept_radii, radii_of);
        keep_columns(request, kept_types, types_of);
        kept_table.assign(request.rule.table.begin(), request.rule.table.end());
        kept_rounding = grid.rounding;
        is_kept = true;
    }

    const NeighborList<Dim, T>& find(const Set& a, const Set& b, bool two_sets,
                                     const NeighborCutoff<T>& cutoff, const Cell& cell,
                                     const NeighborOptions& what)
    {
        const InUse use(in_use, "NeighborFinder");
        const ExactFloats exact;
        if (!(what.skin >= 0 && what.skin <= static_cast<double>(std::numeric_limits<T>::max())))
            neighbors::refuse_search("the skin is " + number_text(what.skin) + "; give a length, or 0");
        if (two_sets && what.half)
            neighbors::refuse_search("half lists are for one set: of two sets each pair comes once already");
        neighbors::check_points(a);
        if (two_sets) neighbors::check_points(b);
        Request request{a, b, two_sets, neighbors::check_cutoffs(a, b, cutoff), cell, what};
        const T most = request.rule.greatest + static_cast<T>(what.skin);
        if (!(most * most <= std::numeric_limits<T>::max()))
            neighbors::refuse_search("the skin is " + number_text(what.skin) +
                                     ": its sum with the cutoff is too great");
        const bool somebody = !a.points.empty() && !b.points.empty();
        neighbors::NeighborGrid<Dim, T> fresh;
        fresh.set_axes(cell);
        const bool holds = what.skin > 0 && still_holds(request);
        if (!holds && somebody) fresh.fit(a, b, static_cast<double>(most));
        list = {}; // from here on only want of memory ends the call
        if (!holds) {
            grid = fresh;
            is_kept = false;
            search(request, what.skin > 0 ? NeighborOptions{} : what, what.skin > 0 ? kept : result);
            if (what.skin > 0) keep(request);
        }
        if (what.skin > 0) choose(request);
        const std::size_t n = a.points.size(), total = result.offsets[n];
        list.offsets = {result.offsets.data(), n + 1};
        list.neighbors = {result.neighbors.data(), total};
        list.shifts = {result.shifts.data(), total};
        if (what.vectors) list.vectors = {result.vectors.data(), total};
        if (what.distances) list.distances = {result.distances.data(), total};
        list.searched = !holds;
        return list;
    }

    void release()
    {
        grid_a.release(), grid_b.release(), counts.release(), result.release(), kept.release();
        const auto empty = [this](auto& vector) {
            vector = std::remove_reference_t<decltype(vector)>(options.memory);
        };
        empty(scratch), empty(blocks), empty(kept_points), empty(kept_radii), empty(kept_types),
            empty(kept_table);
        list = {};
        is_kept = false;
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
    if (!cutoff.radii_b.empty() || !cutoff.types_b.empty())
        neighbors::refuse_search("there are radii or types of a second set, and there is one set");
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
void NeighborFinder<Dim, T>::release_memory() noexcept
{
    implementation_->release();
}

#define JOSTLE_INSTANTIATE(Dim, T) template class JOSTLE_API NeighborFinder<Dim, T>;
JOSTLE_FOR_EACH_SPACE(JOSTLE_INSTANTIATE)
#undef JOSTLE_INSTANTIATE

JOSTLE_NAMESPACE_END
