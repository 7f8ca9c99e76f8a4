// SPDX-License-Identifier: MIT
#include "pairs/scene_finder.hpp"

#include <algorithm>
#include <atomic>
#include <bit>
#include <exception>
#include <mutex>
#include <string>
#include <utility>

#include "base/block_buffer_access.hpp"
#include "base/buffer.hpp"
#include "base/checks.hpp"
#include "base/exact_floats.hpp"
#include "base/instantiate.hpp"
#include "base/run_tasks.hpp"
#include "engine/kernels/few.hpp"
#include "pairs/filters.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace {

// Scenes are claimed together up to this many boxes, and a thread isn't woken for fewer.
constexpr std::size_t boxes_per_claim = 2048;
// If a scene has this many boxes, and more than half of a thread's share of all, all threads search it.
constexpr std::size_t large_scene = 4096;
// A scene with more pairs has its own memory, so that no task leaves more than this of a chunk unused,
// whichever scenes it gets.
constexpr std::size_t shared_pairs = engine::chunk_pairs / 4;
static_assert(engine::few_room <= shared_pairs);

} // namespace

/// The working memory of one task.
struct alignas(128) SceneFinder::Slot
{
    explicit Slot(const FinderOptions& options)
        : engine(options), found(options.memory), unit_float(options.memory), unit_double(options.memory)
    {
    }
    engine::Engine engine;
    PairBuffer found; // by it
    Buffer<engine::Unit<float>> unit_float;
    Buffer<engine::Unit<double>> unit_double;
    std::span<Pair> room; // the rest of the last chunk of the result
    Stats stats;

    template <class T>
    engine::Unit<T>& unit()
    {
        if constexpr (sizeof(T) == 4)
            return *unit_float.reserve_exactly(1);
        else
            return *unit_double.reserve_exactly(1);
    }
    /// Reserves as much memory as `other` has: next time the scenes may be divided the other way round.
    void match(Slot& other)
    {
        engine.match(other.engine);
        unit_float.reserve_exactly(other.unit_float.capacity());
        unit_double.reserve_exactly(other.unit_double.capacity());
        const std::size_t chunks = other.found.bytes_reserved() / (engine::chunk_pairs * sizeof(Pair));
        for (std::size_t c = 0; c < chunks; ++c)
            PairBufferAccess(found).chunk(c, engine::chunk_pairs);
        PairBufferAccess(found).reserve_blocks(other.found.blocks().size());
    }
};

/// One call.
template <int Dim, class T>
class SceneFinder::Search
{
  public:
    Search(SceneFinder& finder, const BoxView<Dim, T>& boxes, std::span<const std::uint64_t> offsets,
           const SceneFilter& filter)
        : finder_(finder),
          result_(finder.result_),
          boxes_(boxes),
          offsets_(offsets),
          filter_(filter),
          scenes_(offsets.size() - 1),
          first_failed_(scenes_)
    {
    }

    void operator()(engine::Engine& whole, Stats& stats)
    {
        Executor& executor = whole.executor();
        const std::size_t threads = std::max(1u, executor.concurrency());
        large_ = std::max(large_scene, threads == 1 ? boxes_.size() : boxes_.size() / (2 * threads));
        const auto tasks = static_cast<std::uint32_t>(
            std::min(threads, std::max<std::size_t>(1, boxes_.size() / boxes_per_claim)));
        FinderOptions serial = finder_.options_;
        serial.executor = &serial_executor();
        while (finder_.slots_.size() < tasks)
            finder_.slots_.push_back(std::make_unique<Slot>(serial));
        for (std::uint32_t s = 0; s < tasks; ++s) {
            slot(s).room = {};
            slot(s).stats = {};
        }
        finder_.chunks_.begin_call();
        result_.scenes_.resize(scenes_);
        PairBufferAccess(result_.large_).reserve_chunks(scenes_);

        const std::size_t claims = boxes_.size() / boxes_per_claim + 1;
        std::atomic<std::size_t> cursor{0};
        const auto task = [&](std::uint32_t s) {
            const ExactFloats exact;
            for (std::size_t claim; (claim = cursor.fetch_add(1, std::memory_order_relaxed)) < claims;) {
                const auto [first, last] = scenes_of(claim);
                for (std::size_t scene = first; scene < last; ++scene)
                    if (!is_large(scene)) guarded(scene, [&] { find_here(scene, slot(s)); });
            }
        };
        if (tasks == 1)
            task(0);
        else
            run_tasks(executor, tasks, task);
        for (std::size_t scene = 0; scene < scenes_; ++scene)
            if (is_large(scene)) guarded(scene, [&] { find_on_all(scene, whole, slot(0)); });
        if (error_) std::rethrow_exception(error_);

        for (std::uint32_t s = 1; s < tasks; ++s)
            slot(0).match(slot(s));
        for (std::uint32_t s = 1; s < tasks; ++s)
            slot(s).match(slot(0));
        std::uint64_t shared = 0; // pairs in chunks
        for (const std::span<const Pair> pairs : result_.scenes_) {
            result_.size_ += pairs.size();
            if (pairs.size() <= shared_pairs) shared += pairs.size();
        }
        // As many as the same pairs can fill, however the scenes are distributed: all except each task's last
        // are three quarters full.
        if (tasks > 1)
            engine::ResultChunks::reserve(result_.small_,
                                          shared / (engine::chunk_pairs - shared_pairs) + tasks);
        for (std::uint32_t s = 0; s < tasks; ++s) {
            add(stats, slot(s).stats);
            stats.bytes_reserved += slot(s).engine.bytes();
        }
        stats.objects = boxes_.size();
        stats.pairs = result_.size_;
        stats.bytes_reserved += whole.bytes();
    }

  private:
    Slot& slot(std::uint32_t s) { return *finder_.slots_[s]; }
    [[nodiscard]] std::size_t size_of(std::size_t scene) const
    {
        return static_cast<std::size_t>(offsets_[scene + 1] - offsets_[scene]);
    }
    [[nodiscard]] bool is_large(std::size_t scene) const { return size_of(scene) > large_; }
    [[nodiscard]] BoxView<Dim, T> boxes_of(std::size_t scene) const
    {
        return boxes_.subview(static_cast<std::size_t>(offsets_[scene]), size_of(scene));
    }

    /// The scenes that begin among the boxes of the claim.
    [[nodiscard]] std::pair<std::size_t, std::size_t> scenes_of(std::size_t claim) const
    {
        const auto first_from = [&](std::size_t box) {
            return static_cast<std::size_t>(std::lower_bound(offsets_.begin(), offsets_.end() - 1, box) -
                                            offsets_.begin());
        };
        return {first_from(claim * boxes_per_claim), first_from((claim + 1) * boxes_per_claim)};
    }

    /// Of the exceptions of scenes, that of the lowest scene is kept; later scenes needn't be searched any
    /// more.
    template <class Body>
    void guarded(std::size_t scene, const Body& body)
    {
        if (scene > first_failed_.load(std::memory_order_relaxed)) return;
        try {
            body();
        } catch (...) {
            const std::lock_guard lock(mutex_);
            if (scene > first_failed_) return;
            first_failed_ = scene;
            error_ = std::current_exception();
        }
    }

    /// Moves the wanted pairs of the scene to the front and returns their end.
    Pair* select(std::size_t scene, Pair* first, Pair* last) const
    {
        const auto begin = static_cast<std::size_t>(offsets_[scene]);
        return std::remove_if(first, last, [&](const Pair& pair) {
            return !passes(filter_, begin + pair.a, begin + pair.b) ||
                   (filter_.accept && !filter_.accept(scene, pair.a, pair.b));
        });
    }
    [[nodiscard]] bool selects() const
    {
        return !filter_.mask.empty() || !filter_.owner.empty() || filter_.accept;
    }

    /// Returns room for this many pairs, at most `shared_pairs`, in the result.
    std::span<Pair> room(Slot& mine, std::size_t pairs)
    {
        if (mine.room.size() < pairs) mine.room = finder_.chunks_.next(result_.small_);
        return mine.room;
    }
    void keep(std::size_t scene, Slot& mine, std::size_t pairs)
    {
        result_.scenes_[scene] = mine.room.first(pairs);
        mine.room = mine.room.subspan(pairs);
    }

    void find_here(std::size_t scene, Slot& mine)
    {
        const std::size_t n = size_of(scene);
        result_.scenes_[scene] = {};
        if (n <= engine::few_boxes) {
            Pair* const first = room(mine, engine::few_room).data();
            Pair* end = engine::find_among_few(finder_.options_.instruction_set,
                                               engine::Boxes<Dim, T>{boxes_of(scene), {}, false},
                                               mine.unit<T>(), first);
            if (end == nullptr) throw engine::BadBox{};
            mine.stats.candidates += n * (n - (n != 0)) / 2;
            if (selects()) end = select(scene, first, end);
            keep(scene, mine, static_cast<std::size_t>(end - first));
        } else {
            search(scene, mine.engine, mine);
        }
    }
    void find_on_all(std::size_t scene, engine::Engine& whole, Slot& mine)
    {
        const ExactFloats exact;
        search(scene, whole, mine);
    }

    void search(std::size_t scene, engine::Engine& engine, Slot& mine)
    {
        result_.scenes_[scene] = {};
        engine.begin_call();
        mine.found.clear();
        engine::Request request;
        request.result = &mine.found;
        const auto select = [&](Pair* first, Pair* last) { return this->select(scene, first, last); };
        if (selects()) request.select = select;
        engine.search(engine::Boxes<Dim, T>{boxes_of(scene), {}, false}, request);
        add(mine.stats, engine.stats);

        const auto pairs = static_cast<std::size_t>(mine.found.size());
        if (pairs <= shared_pairs) {
            mine.found.copy_to(room(mine, pairs));
            keep(scene, mine, pairs);
        } else { // in steps, so that a scene whose size fluctuates doesn't allocate at every new pair
            const std::size_t step = std::bit_floor(pairs) / 8;
            const std::span<Pair> own =
                PairBufferAccess(result_.large_).chunk(scene, (pairs + step - 1) / step * step);
            mine.found.copy_to(own);
            result_.scenes_[scene] = own.first(pairs);
        }
    }

    static void add(Stats& sum, const Stats& part)
    {
        sum.records += part.records;
        sum.candidates += part.candidates;
        sum.ties += part.ties;
        sum.bricks += part.bricks;
        sum.nested_grids += part.nested_grids;
        sum.ms_tune += part.ms_tune;
        sum.ms_scatter += part.ms_scatter;
        sum.ms_sweep += part.ms_sweep;
        sum.ms_finish += part.ms_finish;
    }

    SceneFinder& finder_;
    ScenePairs& result_;
    const BoxView<Dim, T>& boxes_;
    const std::span<const std::uint64_t> offsets_;
    const SceneFilter& filter_;
    const std::size_t scenes_;
    std::size_t large_ = 0; // all threads search scenes with more boxes
    std::mutex mutex_;
    std::atomic<std::size_t> first_failed_;
    std::exception_ptr error_;
};

SceneFinder::SceneFinder(const FinderOptions& options) : options_(options), result_(options.memory) {}
SceneFinder::~SceneFinder() = default;

void SceneFinder::clear() noexcept
{
    result_.scenes_.clear();
    result_.size_ = 0;
}

void SceneFinder::release() noexcept
{
    slots_.clear();
    result_ = ScenePairs(options_.memory);
}

template <int Dim, Coordinate T>
void SceneFinder::find(const BoxView<Dim, T>& boxes, std::span<const std::uint64_t> offsets,
                       const SceneFilter& filter, engine::Engine& engine, Stats& stats)
{
    check_offsets(offsets, "scene", "box", boxes.size(), "boxes");
    for (std::size_t scene = 0; scene + 1 < offsets.size(); ++scene)
        if (const std::uint64_t size = offsets[scene + 1] - offsets[scene]; size > engine::index_mask)
            throw Error(ErrorCode::too_many_objects,
                        "scene " + std::to_string(scene) + " has " + std::to_string(size) +
                            " boxes; 134,217,727 of them are the most, find() takes more",
                        scene);
    check_filter(filter, boxes.size());
    try {
        Search<Dim, T>(*this, boxes, offsets, filter)(engine, stats);
    } catch (const engine::BadBox&) {
        clear();
        check_boxes(boxes);
        throw Error(ErrorCode::invalid_argument, "boxes changed while they were read");
    } catch (...) {
        clear();
        throw;
    }
}

#define JOSTLE_INSTANTIATE(Dim, T)                                                                           \
    template void SceneFinder::find(const BoxView<Dim, T>&, std::span<const std::uint64_t>,                  \
                                    const SceneFilter&, engine::Engine&, Stats&);
JOSTLE_FOR_EACH_SPACE(JOSTLE_INSTANTIATE)
#undef JOSTLE_INSTANTIATE

JOSTLE_NAMESPACE_END
