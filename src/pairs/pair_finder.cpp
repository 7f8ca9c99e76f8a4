// SPDX-License-Identifier: MIT
#include "jostle/find_pairs.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <limits>

#include "base/checks.hpp"
#include "base/in_use.hpp"
#include "base/instantiate.hpp"
#include "engine/engine.hpp"
#include "engine/kernels/few.hpp"
#include "pairs/filters.hpp"
#include "pairs/pair_finder_access.hpp"
#include "pairs/scene_finder.hpp"
#include "pairs/sort_pairs.hpp"

JOSTLE_NAMESPACE_BEGIN

struct PairFinder::Implementation
{
    explicit Implementation(const FinderOptions& options)
        : engine(options),
          result(options.memory),
          packed(options.memory),
          sorter(options.memory),
          sorted(options.memory),
          scenes(options)
    {
    }

    /// One call of the interface: boxes of up to 2^32 objects a set, in slices that the engine can number.
    template <int Dim, class T, class AnyFilter>
    bool stream(const engine::Boxes<Dim, T>& boxes, PairSink sink, const AnyFilter& filter)
    {
        const InUse call(in_use, "PairFinder");
        return search(boxes, sink, filter, {}, result);
    }
    template <int Dim, class T, class AnyFilter>
    bool search(const engine::Boxes<Dim, T>& boxes, PairSink sink, const AnyFilter& filter,
                engine::PairSelection selection, PairBuffer& into);
    template <int Dim, class T, class AnyFilter>
    PairBuffer& store(const engine::Boxes<Dim, T>& boxes, const AnyFilter& filter, Order order)
    {
        const InUse call(in_use, "PairFinder");
        if (order != Order::canonical && order != Order::sorted) {
            result.clear();
            throw Error(ErrorCode::invalid_argument, "there is no order " +
                                                         std::to_string(static_cast<int>(order)) +
                                                         "; give Order::canonical or Order::sorted");
        }
        search(boxes, {}, filter, {}, result);
        const bool ascending = boxes.size() <= engine::few_boxes && boxes.size() <= slice; // as they are
        return order == Order::sorted && !ascending ? sort(boxes.a.size()) : result;
    }
    PairBuffer& sort(std::size_t objects);
    template <int Dim, class T>
    const ScenePairs& find_scenes(const BoxView<Dim, T>& boxes, std::span<const std::uint64_t> offsets,
                                  const SceneFilter& filter);

    std::size_t slice = std::size_t{1} << engine::index_bits; // objects that the engine can number at a time

    engine::Engine engine;
    PairBuffer result;
    PackedFilter packed;
    PairSorter sorter;
    PairBuffer sorted; // used on request
    SceneFinder scenes;
    Stats stats;
    std::atomic<bool> in_use{false};
};

namespace {

/// The name of one of two sets in errors.
template <int Dim, class T>
const char* name_of(const BoxView<Dim, T>& set, const engine::Boxes<Dim, T>& boxes)
{
    return !boxes.cross ? "" : &set == &boxes.a ? "a " : "b ";
}

template <int Dim, class T>
void check_sizes(const engine::Boxes<Dim, T>& boxes)
{
    for (const BoxView<Dim, T>* set : {&boxes.a, &boxes.b}) {
        check_pointers(*set, name_of(*set, boxes));
        if (set->size() > std::numeric_limits<std::uint32_t>::max())
            throw Error(ErrorCode::too_many_objects,
                        std::to_string(set->size()) +
                            " boxes: objects are numbered with 32 bits; split the set");
    }
}

void check(const Filter& filter, std::size_t size, std::size_t)
{
    check_filter(filter, size);
}
void check(const CrossFilter& filter, std::size_t a, std::size_t b)
{
    check_filter(filter, a, b);
}

template <class AnyFilter>
const ImageRule* images_of(const AnyFilter& filter)
{
    if constexpr (std::is_same_v<AnyFilter, Filter>)
        return filter.images;
    else
        return nullptr;
}

/// From which object on no two make a pair, which the engine ensures.
std::size_t loners_of(const Filter& filter, std::size_t size)
{
    const std::size_t originals = filter.images != nullptr ? filter.images->originals : size;
    return std::min(originals, size - filter.ghosts);
}
std::size_t loners_of(const CrossFilter&, std::size_t size)
{
    return size;
}

/// Whether there is nothing to filter.
template <class AnyFilter>
bool is_empty(const AnyFilter& filter)
{
    if constexpr (std::is_same_v<AnyFilter, Filter>)
        return filter.mask.empty() && filter.owner.empty() && filter.vertices.empty() && !filter.accept &&
               (filter.images == nullptr || filter.images->axes.empty());
    else
        return filter.mask_a.empty() && filter.owner_a.empty() && !filter.accept;
}

void check_sink(PairSink sink)
{
    if (!sink) throw Error(ErrorCode::invalid_argument, "no sink to stream to; find() stores the pairs");
}

/// Throws for the lowest bad box, if any.
template <int Dim, class T>
void check_sets(const engine::Boxes<Dim, T>& boxes)
{
    for (const BoxView<Dim, T>* set : {&boxes.a, &boxes.b})
        check_boxes_of(*set, name_of(*set, boxes));
}

/// Calls search(part, offset_a, offset_b) for parts of at most `slice` boxes a set, whose boxes begin at the
/// offsets. Together they have each pair once.
template <int Dim, class T, class Search>
void each_slice(const engine::Boxes<Dim, T>& boxes, std::size_t slice, const Search& search)
{
    const auto slices = [slice](const BoxView<Dim, T>& set) { return (set.size() + slice - 1) / slice; };
    const auto part_of = [slice](const BoxView<Dim, T>& set, std::size_t k) {
        return set.subview(k * slice, std::min(slice, set.size() - k * slice));
    };
    for (std::size_t a = 0; a < slices(boxes.a); ++a) {
        const std::size_t others_meet = boxes.loners - std::min(boxes.loners, a * slice); // those before it
        // One set: each slice with itself and with every later one.
        if (!boxes.cross) search({part_of(boxes.a, a), {}, false, others_meet}, a * slice, a * slice);
        const BoxView<Dim, T>& others = boxes.cross ? boxes.b : boxes.a;
        const BoxView<Dim, T> rows = part_of(boxes.a, a);
        const BoxView<Dim, T> part = rows.subview(0, std::min(rows.size(), others_meet));
        for (std::size_t b = boxes.cross ? 0 : a + 1; b < slices(others) && !part.empty(); ++b)
            search({part, part_of(others, b), true}, a * slice, b * slice);
    }
}

double ms_since(std::chrono::steady_clock::time_point start)
{
    return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
}

} // namespace

template <int Dim, class T, class AnyFilter>
bool PairFinder::Implementation::search(const engine::Boxes<Dim, T>& given, PairSink sink,
                                        const AnyFilter& filter, engine::PairSelection selection,
                                        PairBuffer& into)
{
    const auto start = std::chrono::steady_clock::now();
    into.clear();
    stats = {};
    engine.begin_call();
    check_sizes(given);
    check(filter, given.a.size(), given.b.size());

    engine::Boxes<Dim, T> boxes = given;
    const ImageRule* const images = images_of(filter);
    boxes.loners = loners_of(filter, boxes.a.size());
    packed.pack(filter, boxes.a.size());

    std::atomic<std::uint64_t> pairs{0};
    const auto select = [&](Pair* first, Pair* last) {
        last = packed.keep_passing(first, last);
        if (images != nullptr && !images->axes.empty())
            last = std::remove_if(first, last,
                                  [&](const Pair& pair) { return !images->allows(pair.a, pair.b); });
        if (filter.accept)
            last =
                std::remove_if(first, last, [&](const Pair& pair) { return !filter.accept(pair.a, pair.b); });
        return last;
    };
    const auto count_and_pass = [&](const PairChunk& chunk) {
        pairs.fetch_add(chunk.pairs.size(), std::memory_order_relaxed);
        return sink(chunk);
    };
    engine::Request request;
    request.select = selection;
    if (!is_empty(filter)) request.select = select;
    if (sink) request.sink = count_and_pass;
    request.result = &into;

    bool complete = true;
    const auto run = [&](const engine::Boxes<Dim, T>& part, std::size_t offset_a, std::size_t offset_b) {
        if (!complete) return;
        request.offset_a = static_cast<std::uint32_t>(offset_a);
        request.offset_b = static_cast<std::uint32_t>(offset_b);
        try {
            complete = engine.search(part, request);
        } catch (const engine::BadBox&) {
            check_sets(boxes); // a bad box of another slice may be lower, so let the definition name it
            throw Error(ErrorCode::invalid_argument, "boxes changed while they were read");
        }
        request.first_block = engine.next_block;
    };
    try {
        if (boxes.cross && (boxes.a.empty() || boxes.b.empty()))
            check_sets(boxes); // nothing to find, but the checks are the same
        each_slice(boxes, slice, run);
    } catch (...) {
        into.clear();
        throw;
    }
    stats = engine.stats;
    stats.objects = boxes.size();
    stats.pairs = sink ? pairs.load() : into.size();
    stats.bytes_reserved = engine.bytes();
    stats.ms_total = ms_since(start);
    return complete;
}

PairBuffer& PairFinder::Implementation::sort(std::size_t objects)
{
    const auto start = std::chrono::steady_clock::now();
    sorter.sort(result, objects, engine.executor(), engine.instruction_set(), sorted);
    const double ms = ms_since(start);
    stats.ms_finish += ms;
    stats.ms_total += ms;
    return sorted;
}

template <int Dim, class T>
const ScenePairs& PairFinder::Implementation::find_scenes(const BoxView<Dim, T>& boxes,
                                                          std::span<const std::uint64_t> offsets,
                                                          const SceneFilter& filter)
{
    const InUse call(in_use, "PairFinder");
    const auto start = std::chrono::steady_clock::now();
    scenes.clear();
    stats = {};
    check_pointers(boxes);
    scenes.find(boxes, offsets, filter, engine, stats);
    stats.ms_total = ms_since(start);
    return scenes.result();
}

PairFinder::PairFinder(const FinderOptions& options)
    : implementation_(std::make_unique<Implementation>(options))
{
    (void)checked(options.instruction_set);
    check_memory(options.memory);
}
PairFinder::PairFinder(PairFinder&&) noexcept = default;
PairFinder& PairFinder::operator=(PairFinder&&) noexcept = default;
PairFinder::~PairFinder() = default;

template <int Dim, Coordinate T>
void PairFinderAccess::find(PairFinder& finder, const BoxView<Dim, T>& boxes, Selection select,
                            PairBuffer& result)
{
    finder.implementation_->search(engine::Boxes<Dim, T>{boxes, {}, false}, {}, Filter{}, select, result);
}

template <int Dim, Coordinate T>
void PairFinderAccess::find(PairFinder& finder, const BoxView<Dim, T>& a, const BoxView<Dim, T>& b,
                            Selection select, PairBuffer& result)
{
    finder.implementation_->search(engine::Boxes<Dim, T>{a, b, true}, {}, CrossFilter{}, select, result);
}

void PairFinderAccess::search_in_slices_of(PairFinder& finder, std::size_t objects)
{
    finder.implementation_->slice = objects;
}

const Stats& PairFinder::stats() const noexcept
{
    return implementation_->stats;
}

void PairFinder::release_memory() noexcept
{
    implementation_->engine.release();
    implementation_->result.release();
    implementation_->sorted.release();
    implementation_->packed = PackedFilter(implementation_->packed.masks.get_allocator().resource());
    implementation_->sorter.release();
    implementation_->scenes.release();
    implementation_->stats.bytes_reserved = implementation_->engine.bytes();
}

template <int Dim, Coordinate T>
const PairBuffer& PairFinder::found(const BoxView<Dim, T>& boxes, const Filter& filter, Order order)
{
    return implementation_->store(engine::Boxes<Dim, T>{boxes, {}, false}, filter, order);
}

template <int Dim, Coordinate T>
const PairBuffer& PairFinder::found(const BoxView<Dim, T>& a, const BoxView<Dim, T>& b,
                                    const CrossFilter& filter, Order order)
{
    return implementation_->store(engine::Boxes<Dim, T>{a, b, true}, filter, order);
}

template <int Dim, Coordinate T>
const ScenePairs& PairFinder::scenes_found(const BoxView<Dim, T>& boxes,
                                           std::span<const std::uint64_t> offsets, const SceneFilter& filter)
{
    return implementation_->find_scenes(boxes, offsets, filter);
}

template <int Dim, Coordinate T>
bool PairFinder::streamed(const BoxView<Dim, T>& boxes, PairSink sink, const Filter& filter)
{
    check_sink(sink);
    return implementation_->stream(engine::Boxes<Dim, T>{boxes, {}, false}, sink, filter);
}

template <int Dim, Coordinate T>
bool PairFinder::streamed(const BoxView<Dim, T>& a, const BoxView<Dim, T>& b, PairSink sink,
                          const CrossFilter& filter)
{
    check_sink(sink);
    return implementation_->stream(engine::Boxes<Dim, T>{a, b, true}, sink, filter);
}

#define JOSTLE_INSTANTIATE(Dim, T)                                                                           \
    template const PairBuffer& PairFinder::found(const BoxView<Dim, T>&, const Filter&, Order);              \
    template const PairBuffer& PairFinder::found(const BoxView<Dim, T>&, const BoxView<Dim, T>&,             \
                                                 const CrossFilter&, Order);                                 \
    template const ScenePairs& PairFinder::scenes_found(const BoxView<Dim, T>&,                              \
                                                        std::span<const std::uint64_t>, const SceneFilter&); \
    template bool PairFinder::streamed(const BoxView<Dim, T>&, PairSink, const Filter&);                     \
    template bool PairFinder::streamed(const BoxView<Dim, T>&, const BoxView<Dim, T>&, PairSink,             \
                                       const CrossFilter&);                                                  \
    template void PairFinderAccess::find(PairFinder&, const BoxView<Dim, T>&, Selection, PairBuffer&);       \
    template void PairFinderAccess::find(PairFinder&, const BoxView<Dim, T>&, const BoxView<Dim, T>&,        \
                                         Selection, PairBuffer&);
JOSTLE_FOR_EACH_SPACE(JOSTLE_INSTANTIATE)
#undef JOSTLE_INSTANTIATE

JOSTLE_NAMESPACE_END
