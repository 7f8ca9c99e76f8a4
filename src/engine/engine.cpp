// SPDX-License-Identifier: MIT
#include "engine/engine.hpp"

#include <algorithm>
#include <bit>
#include <chrono>
#include <limits>
#include <mutex>

#include "exact_floats.hpp"
#include "pair_arena.hpp"
#include "run_tasks.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace engine {
namespace {

// Fewer boxes than this per thread are not worth waking one.
constexpr std::size_t boxes_per_thread = 2048;
// A brick whose rows meet more blocks than this, on average, may get a grid of its own.
constexpr double crowded_blocks = 10;
// ... if the model expects it to cost less than this share of sweeping it as it is.
constexpr double worth_nesting = 0.6;
// Grids in grids halve the cost at least (see above) and shrink the extent; no real scene came near.
constexpr int deepest_nesting = 24;
// Nested grids and single bricks of this much work are shared out over all threads instead of being one
// worker's.
constexpr std::uint32_t job_records = 1u << 15;
constexpr double job_blocks = 1 << 19;
constexpr std::uint32_t job_rows = 2048; // per block of a brick that is shared out; even
// Bricks are claimed in blocks, so many a grid that claiming costs nothing and the last block doesn't keep
// all waiting.
constexpr std::uint32_t blocks_per_grid = 512;

constexpr std::size_t chunk_pairs = std::size_t{1} << 15;

using Clock = std::chrono::steady_clock;
double milliseconds(Clock::time_point from, Clock::time_point to)
{
    return std::chrono::duration<double, std::milli>(to - from).count();
}

struct Counts
{
    std::uint64_t records = 0, blocks = 0, ties = 0, bricks = 0, nested = 0;
};

template <int Dim, class T>
void load_box(const BoxView<Dim, T>& boxes, std::size_t from, Unit<T>& unit, std::uint32_t to)
{
    for (int d = 0; d < Dim; ++d) {
        unit.lo[d][to] = boxes.lo(d, from);
        unit.hi[d][to] = boxes.hi(d, from);
    }
}

/// The copies of a box that crosses a border on the sweep axis or spans more than two bricks on another.
template <int Dim, class T>
void append_wide(const Grid<T>& grid, const Unit<T>& unit, std::uint32_t i, BrickStore& store)
{
    std::int32_t first[3] = {0, 0, 0}, last[3] = {0, 0, 0};
    for (int p = 0; p < Dim; ++p) {
        first[p] = unit.quantum_lo[p][i] >> quanta_bits;
        last[p] = unit.quantum_hi[p][i] >> quanta_bits;
    }
    const Record& home = unit.record[i];
    for (std::int32_t z = first[2]; z <= last[2]; ++z)
        for (std::int32_t y = first[1]; y <= last[1]; ++y)
            for (std::int32_t x = first[0]; x <= last[0]; ++x) {
                const std::int32_t cell[3] = {x, y, z};
                if (x == first[0] && y == first[1] && z == first[2]) continue;
                Record copy = home;
                for (int p = 0; p < Dim; ++p) {
                    if (cell[p] == first[p]) continue;
                    const std::int32_t local_hi = unit.quantum_hi[p][i] - (cell[p] << quanta_bits);
                    copy.axis[p] = pack_axis(0, std::min(local_hi, quanta) + 1);
                    copy.object |= copy_flag(grid.axis[p]);
                }
                store.append(static_cast<std::uint32_t>(x + grid.cells[0] * (y + grid.cells[1] * z)), copy);
            }
}

template <int Dim, class T>
void append_unit(const Kernels& kernels, const Grid<T>& grid, Unit<T>& unit, BrickStore& store)
{
    kernels.quantise<Dim, T>()(grid, unit);
    for (std::uint32_t i = 0; i < unit.records; ++i) {
        store.prefetch(unit.brick[std::min(i + 16, unit.records - 1)]);
        store.append(unit.brick[i], unit.record[i]);
    }
    for (std::uint32_t k = 0; k < unit.wide; ++k)
        append_wide<Dim>(grid, unit, unit.wide_box[k], store);
}

} // namespace

/// Work that one worker found too big for itself: a crowd to be given a grid of its own, or one brick to be
/// swept in parts.
struct Engine::Job
{
    explicit Job(std::pmr::memory_resource* memory) : records(memory), window_end(memory) {}

    bool in_use = false;
    std::uint64_t block = 0; // where it was found: what orders jobs independently of who found them
    std::uint32_t number = 0;
    int depth = 0;
    bool sorted = false; // with window_end: to be swept as the one brick it is
    std::uint32_t count = 0;
    Buffer<Record> records;
    Buffer<std::uint32_t> window_end;
};

/// The working memory of one task. Which thread runs the task doesn't matter.
struct alignas(128) Engine::Slot
{
    explicit Slot(std::pmr::memory_resource* memory)
        : store(memory),
          unit_float(memory),
          unit_double(memory),
          sample(memory),
          bucket(memory),
          sorted(memory),
          columns(memory),
          window_end(memory),
          ties(memory),
          objects(memory),
          buffer(memory),
          segments(memory),
          jobs(memory),
          nested(memory),
          memory_(memory)
    {
    }

    BrickStore store;
    Buffer<Unit<float>> unit_float;
    Buffer<Unit<double>> unit_double;
    Buffer<Sample> sample;
    Buffer<std::uint32_t> bucket;
    Buffer<Record> sorted;
    Buffer<std::uint32_t> columns;
    Buffer<std::uint32_t> window_end;
    Buffer<Pair> ties;
    Buffer<std::uint32_t> objects;
    Buffer<Pair> buffer; // of pairs on their way to a sink
    std::pmr::vector<std::span<const Pair>> segments;
    std::pmr::vector<Job*> jobs; // found and not yet taken, in the order of their bricks
    std::pmr::vector<std::unique_ptr<BrickStore>> nested; // by depth

    Pair* chunk_next = nullptr; // what is left of the last chunk of the result
    Pair* chunk_end = nullptr;
    std::uint64_t bad_box = ~std::uint64_t{0};
    Counts counts;
    std::exception_ptr error;

    /// Has as much memory as `other`: next time the work may be shared out the other way round.
    void match(const Slot& other)
    {
        bucket.reserve_exactly(other.bucket.capacity());
        sorted.reserve_exactly(other.sorted.capacity());
        columns.reserve_exactly(other.columns.capacity());
        window_end.reserve_exactly(other.window_end.capacity());
        ties.reserve_exactly(other.ties.capacity());
        objects.reserve_exactly(other.objects.capacity());
        buffer.reserve_exactly(other.buffer.capacity());
        sample.reserve_exactly(other.sample.capacity());
        unit_float.reserve_exactly(other.unit_float.capacity());
        unit_double.reserve_exactly(other.unit_double.capacity());
        segments.reserve(other.segments.capacity());
        jobs.reserve(other.jobs.capacity());
        for (std::size_t depth = 0; depth < other.nested.size(); ++depth)
            nested_store(static_cast<int>(depth)).match(*other.nested[depth]);
    }

    BrickStore& nested_store(int depth)
    {
        while (nested.size() <= static_cast<std::size_t>(depth))
            nested.push_back(std::make_unique<BrickStore>(memory_));
        return *nested[static_cast<std::size_t>(depth)];
    }
    template <class T>
    Unit<T>& unit()
    {
        if constexpr (sizeof(T) == 4)
            return *unit_float.reserve_exactly(1);
        else
            return *unit_double.reserve_exactly(1);
    }
    std::uint64_t bytes() const
    {
        std::uint64_t sum = store.bytes() + unit_float.bytes() + unit_double.bytes() + sample.bytes() +
                            bucket.bytes() + sorted.bytes() + columns.bytes() + window_end.bytes() +
                            ties.bytes() + objects.bytes() + buffer.bytes() +
                            segments.capacity() * sizeof(segments[0]);
        for (const auto& each : nested)
            sum += each->bytes();
        return sum;
    }

  private:
    std::pmr::memory_resource* memory_;
};

/// One call: the phases, and what a worker does in each.
template <int Dim, class T>
class Engine::Run
{
  public:
    Run(Engine& engine, const Boxes<Dim, T>& boxes, const Request& request)
        : engine_(engine),
          kernels_(kernels_for(engine.options_.instruction_set)),
          boxes_(boxes),
          request_(request),
          memory_(engine.options_.memory),
          blocks_(engine.blocks_),
          jobs_(engine.jobs_)
    {
        const std::size_t wanted = std::max<std::size_t>(1, boxes.size() / boxes_per_thread);
        slots_ = static_cast<std::uint32_t>(
            std::min<std::size_t>(std::max(1u, engine.executor_->concurrency()), wanted));
        engine.use_slots(slots_);
        blocks_.clear();
        jobs_.clear();
        for (const std::unique_ptr<Job>& job : engine.job_pool_)
            job->in_use = false;
        for (std::uint32_t s = 0; s < slots_; ++s) {
            Slot& slot = *engine.slots_[s];
            slot.segments.clear();
            slot.jobs.clear();
            slot.chunk_next = slot.chunk_end = nullptr;
            slot.bad_box = ~std::uint64_t{0};
            slot.counts = {};
            slot.error = nullptr;
        }
    }

    bool operator()()
    {
        const ExactFloats exact;
        const auto t0 = Clock::now();
        Sample& sample = *slot(0).sample.reserve_exactly(1);
        sample_boxes(sample);
        const Grid<T> grid = tune<Dim, T>(sample, boxes_.size()).grid;
        const auto t1 = Clock::now();

        const std::uint32_t units_a = unit_count(boxes_.a.size()),
                            units = units_a + unit_count(boxes_.b.size());
        each_slot([&](Slot& mine, std::uint32_t s) {
            mine.store.clear(grid.bricks());
            // Contiguous shares, so that the slots' lists one after the other are in the order of the boxes.
            const std::uint32_t first = static_cast<std::uint32_t>(std::uint64_t{units} * s / slots_);
            const std::uint32_t last = static_cast<std::uint32_t>(std::uint64_t{units} * (s + 1) / slots_);
            Unit<T>& unit = mine.unit<T>();
            for (std::uint32_t u = first; u < last; ++u)
                if (!scatter_unit(mine, grid, unit, u < units_a ? boxes_.a : boxes_.b,
                                  u < units_a ? u : u - units_a,
                                  u < units_a ? (boxes_.cross ? side_a : 0) : side_b))
                    return;
            mine.store.close();
        });
        throw_bad_box();
        const auto t2 = Clock::now();

        sweep_grid(grid, 0);
        while (!stopped_ && take_jobs()) {
            for (Job* job : jobs_)
                if (!stopped_) run_job(*job);
        }
        const auto t3 = Clock::now();

        finish();
        Stats& total = engine_.stats;
        total.objects += boxes_.size();
        for (std::uint32_t s = 0; s < slots_; ++s) {
            const Counts& counts = slot(s).counts;
            total.records += counts.records;
            total.candidates += counts.blocks * 2 * block_size;
            total.ties += counts.ties;
            total.bricks += counts.bricks;
            total.nested_grids += counts.nested;
        }
        total.ms_tune += milliseconds(t0, t1);
        total.ms_scatter += milliseconds(t1, t2);
        total.ms_sweep += milliseconds(t2, t3);
        total.ms_finish += milliseconds(t3, Clock::now());
        return !stopped_;
    }

  private:
    /// Where a slot's pairs go, within one block.
    struct Output : PairOutput
    {
        Run& run;
        Slot& slot;
        std::uint64_t block;
        std::uint64_t part = 0;
        Pair* first = nullptr; // of the segment being written

        Output(Run& r, Slot& s, std::uint64_t b) : run(r), slot(s), block(b)
        {
            ties = slot.ties.reserve_exactly(tie_capacity);
            tie_count = 0;
            make_room = [](PairOutput& self) { return static_cast<Output&>(self).next_chunk_if_needed(); };
            if (run.request_.sink) {
                next = first = slot.buffer.reserve_exactly(chunk_pairs);
                end = first + chunk_pairs;
            } else {
                next = first = slot.chunk_next;
                end = slot.chunk_end;
            }
        }

        bool next_chunk_if_needed()
        {
            if (tie_count > tie_capacity - sweep_room) resolve_ties();
            if (static_cast<std::size_t>(end - next) < sweep_room) hand_over();
            return !run.stopped_.load(std::memory_order_relaxed);
        }

        /// Decides ties by the user's own numbers. Called when a brick is done or ties overflow, never
        /// because a chunk is full: where chunks end depends on what the slot did before, and the order of
        /// pairs must not.
        void resolve_ties()
        {
            slot.counts.ties += tie_count;
            for (std::uint32_t k = 0; k < tie_count; ++k) {
                const Pair later = ties[std::min(k + 8, tie_count - 1)];
                run.boxes_.prefetch(later.a);
                run.boxes_.prefetch(later.b);
                const Pair tie = ties[k];
                if (!overlaps(run.boxes_[tie.a], run.boxes_[tie.b])) continue;
                if (next == end) hand_over();
                *next++ = {std::min(tie.a, tie.b) & index_mask, std::max(tie.a, tie.b) & index_mask};
            }
            tie_count = 0;
        }

        /// Passes on what was written and gets a new chunk.
        void hand_over()
        {
            flush();
            if (run.request_.sink) {
                next = first = slot.buffer.data();
            } else {
                const std::span<Pair> chunk = run.new_chunk();
                next = first = chunk.data();
                end = first + chunk.size();
            }
        }

        void flush()
        {
            const Request& request = run.request_;
            if (next == first) return;
            if (request.offset_a != 0 || request.offset_b != 0)
                for (Pair* pair = first; pair != next; ++pair)
                    *pair = {pair->a + request.offset_a, pair->b + request.offset_b};
            if (request.select) next = request.select(first, next);
            if (next == first) return;
            const std::span<const Pair> pairs(first, next);
            if (!request.sink) {
                slot.segments.push_back(pairs);
            } else if (!run.stopped_.load(std::memory_order_relaxed)) {
                if (!request.sink({pairs, request.first_block + block, part++})) run.stopped_ = true;
                next = first;
            }
            first = next;
        }

        void close()
        {
            resolve_ties();
            flush();
            if (!run.request_.sink) {
                slot.chunk_next = next;
                slot.chunk_end = end;
            }
        }
    };

    Slot& slot(std::uint32_t s) { return *engine_.slots_[s]; }

    /// Runs body(slot, s) for each slot on the executor; what a body throws is thrown here, the lowest slot's
    /// first.
    template <class Body>
    void each_slot(const Body& body)
    {
        auto task = [&](std::uint32_t s) {
            const ExactFloats exact;
            try {
                body(slot(s), s);
            } catch (...) {
                slot(s).error = std::current_exception();
                stopped_ = true;
            }
        };
        if (slots_ == 1)
            task(0);
        else
            run_tasks(*engine_.executor_, slots_, task);
        for (std::uint32_t s = 0; s < slots_; ++s)
            if (slot(s).error) std::rethrow_exception(slot(s).error);
    }

    static std::uint32_t unit_count(std::size_t boxes)
    {
        return static_cast<std::uint32_t>((boxes + unit_size - 1) / unit_size);
    }

    void sample_boxes(Sample& sample)
    {
        const std::size_t boxes = boxes_.size(), wanted = sample_size(boxes);
        const auto place = [&](std::uint32_t i) {
            const bool in_a = i < boxes_.a.size();
            return std::pair(in_a ? &boxes_.a : &boxes_.b, in_a ? i : i - boxes_.a.size());
        };
        std::uint32_t chosen[Sample::capacity];
        choose_sample(chosen, wanted, boxes);
        constexpr std::size_t ahead = 16; // boxes on their way from memory
        sample.size = 0;
        for (std::size_t k = 0; k < wanted; ++k) {
            if (k + ahead < wanted) {
                const auto [set, at] = place(chosen[k + ahead]);
                __builtin_prefetch(set->lo_pointer(0, at));
                __builtin_prefetch(set->hi_pointer(Dim - 1, at));
            }
            const auto [view, at] = place(chosen[k]);
            const BoxView<Dim, T>& set = *view;
            bool valid = true;
            for (int d = 0; d < Dim; ++d) {
                valid &= set.lo(d, at) <= set.hi(d, at); // the scatter finds and names the bad ones
                sample.add(d, static_cast<double>(set.lo(d, at)), static_cast<double>(set.hi(d, at)));
            }
            sample.size += valid;
        }
    }

    bool scatter_unit(Slot& mine, const Grid<T>& grid, Unit<T>& unit, const BoxView<Dim, T>& set,
                      std::uint32_t number, std::uint32_t side)
    {
        const std::size_t begin = std::size_t{number} * unit_size;
        unit.count = static_cast<std::uint32_t>(std::min<std::size_t>(unit_size, set.size() - begin));
        kernels_.load<Dim, T>()(set, begin, unit);
        for (std::uint32_t i = 0; i < unit.count; ++i)
            unit.object[i] = (static_cast<std::uint32_t>(begin) + i) | side;
        append_unit<Dim>(kernels_, grid, unit, mine.store);
        if (!unit.bad) return true;
        for (std::uint32_t i = 0; i < unit.count; ++i) {
            bool valid = true;
            for (int d = 0; d < Dim; ++d)
                valid &= unit.lo[d][i] <= unit.hi[d][i];
            if (valid) continue;
            mine.bad_box = begin + i + (side == side_b ? boxes_.a.size() : 0);
            return false;
        }
        return true;
    }

    void throw_bad_box()
    {
        for (std::uint32_t s = 0; s < slots_; ++s) // shares are ascending: the first slot's is the lowest
            if (slot(s).bad_box != ~std::uint64_t{0}) throw BadBox{slot(s).bad_box};
    }

    /// Sweeps all bricks of a grid whose records lie in the slots' stores.
    void sweep_grid(const Grid<T>& grid, int depth)
    {
        const std::uint32_t bricks = grid.bricks();
        const std::uint32_t per_block = (bricks + blocks_per_grid - 1) / blocks_per_grid;
        const std::uint32_t blocks = (bricks + per_block - 1) / per_block;
        claim_blocks(blocks, [&](Slot& mine, Output& out, std::uint32_t block) {
            const std::uint32_t end = std::min(bricks, (block + 1) * per_block);
            for (std::uint32_t brick = block * per_block; brick < end; ++brick) {
                if (stopped_.load(std::memory_order_relaxed)) return;
                sweep_brick(
                    mine, out, [&](std::uint32_t k) -> const BrickStore& { return slot(k).store; }, slots_,
                    brick, bricks, depth);
            }
        });
    }

    /// Shares out `count` new blocks of the result: body(slot, output, i) for each i, claimed one by one.
    template <class Body>
    void claim_blocks(std::uint32_t count, const Body& body)
    {
        const std::size_t base = blocks_.size();
        blocks_.resize(base + count);
        std::atomic<std::uint32_t> cursor{0};
        each_slot([&](Slot& mine, std::uint32_t s) {
            for (std::uint32_t i; (i = cursor.fetch_add(1, std::memory_order_relaxed)) < count;) {
                if (stopped_.load(std::memory_order_relaxed)) return;
                const auto first = static_cast<std::uint32_t>(mine.segments.size());
                Output out(*this, mine, base + i);
                body(mine, out, i);
                out.close();
                blocks_[base + i] = {s, first, static_cast<std::uint32_t>(mine.segments.size())};
            }
        });
    }

    /// Loads a brick's records, sorts them along the sweep axis and finds its pairs.
    template <class StoreOf>
    void sweep_brick(Slot& mine, Output& out, const StoreOf& store_of, std::uint32_t stores,
                     std::uint32_t brick, std::uint32_t bricks, int depth)
    {
        std::uint32_t count = 0;
        for (std::uint32_t k = 0; k < stores; ++k)
            count += store_of(k).size(brick);
        mine.counts.records += count;
        mine.counts.bricks += count != 0;
        if (count < 2) return;

        // A counting sort with about one bucket per record. Order within a bucket is free, since the sweep
        // compares both ends on every axis; it is the order of the boxes all the same.
        const int bucket_bits = std::clamp(static_cast<int>(std::bit_width(count - 1)), 4, quanta_bits);
        const int shift = quanta_bits - bucket_bits;
        const std::uint32_t buckets = (1u << bucket_bits) + 2;
        const auto bucket_of = [&](const Record& record) {
            return ((0u - (record.axis[0] >> 16)) & 0xffffu) >> shift;
        };
        std::uint32_t* bucket = mine.bucket.reserve(buckets);
        std::fill_n(bucket, buckets, 0u);
        const auto each_record = [&](const auto& visit, const auto& before_chunk) {
            std::uint32_t number = 0;
            for (std::uint32_t k = 0; k < stores; ++k) {
                const BrickStore& store = store_of(k);
                std::uint32_t left = store.size(brick);
                for (std::uint32_t c = 0; left != 0; ++c) {
                    before_chunk(number++);
                    const BrickStore::Chunk& chunk = *store.chunk(brick, c);
                    const std::uint32_t here = std::min(left, BrickStore::Chunk::capacity);
                    for (std::uint32_t r = 0; r < here; ++r)
                        visit(chunk.record[r]);
                    left -= here;
                }
            }
        };
        each_record([&](const Record& record) { ++bucket[bucket_of(record)]; }, [](std::uint32_t) {});
        std::uint32_t sum = 0;
        for (std::uint32_t b = 0; b < buckets; ++b) {
            const std::uint32_t size = bucket[b];
            bucket[b] = sum;
            sum += size;
        }
        const std::uint32_t size = padded(count);
        Record* sorted = mine.sorted.reserve(size);
        // Fetch the next brick's chunks meanwhile, one for each of this brick's, so that they don't all come
        // at once.
        const bool has_next = brick + 1 < bricks;
        std::uint32_t next_store = 0, next_chunk = 0;
        const auto fetch_one = [&](std::uint32_t) {
            if (!has_next) return;
            while (next_store < stores && next_chunk == store_of(next_store).chunks(brick + 1)) {
                ++next_store;
                next_chunk = 0;
            }
            if (next_store == stores) return;
            const auto* chunk =
                reinterpret_cast<const char*>(store_of(next_store).chunk(brick + 1, next_chunk++));
            for (std::size_t offset = 0; offset < sizeof(BrickStore::Chunk); offset += 64)
                __builtin_prefetch(chunk + offset);
        };
        each_record([&](const Record& record) { sorted[bucket[bucket_of(record)]++] = record; }, fetch_one);
        std::fill(sorted + count, sorted + size, padding_record);

        // Now bucket[b] is where bucket b ends.
        std::uint32_t* window_end = mine.window_end.reserve(size);
        std::uint64_t windows = 0;
        for (std::uint32_t i = 0; i < count; ++i) {
            window_end[i] = bucket[(sorted[i].axis[0] & 0xffffu) >> shift];
            windows += window_end[i] - i;
        }
        window_end[count] = 0;

        const double blocks_per_row = static_cast<double>(windows) / block_size / count + 0.5;
        if (blocks_per_row > crowded_blocks && divide(mine, out, count, blocks_per_row, depth)) return;

        SortedBrick brick_data{count, mine.columns.reserve(std::size_t{size} * columns_per_record),
                               window_end};
        kernels_.arrange(sorted, brick_data);
        mine.counts.blocks += kernels_.sweep<Dim>()(brick_data, 0, count, out);
        out.resolve_ties();
    }

    /// For a crowded brick that lies sorted in the slot: gives it a grid of its own, or to all threads if it
    /// is too much for one. Returns false if it is best swept as it is.
    bool divide(Slot& mine, Output& out, std::uint32_t count, double blocks_per_row, int depth)
    {
        const Record* sorted = mine.sorted.data();
        if (depth < deepest_nesting) {
            Sample& sample = *mine.sample.reserve_exactly(1);
            sample_records(sample, sorted, count);
            const TunedGrid<T> tuned = tune<Dim, T>(sample, count);
            if (tuned.grid.bricks() > 1 && tuned.cost < worth_nesting * sweep_cost(blocks_per_row)) {
                if (count >= job_records) {
                    add_job(mine, out, depth + 1, false, count);
                } else {
                    BrickStore& store = mine.nested_store(depth);
                    ++mine.counts.nested;
                    std::uint32_t* objects = mine.objects.reserve(count);
                    for (std::uint32_t i = 0; i < count; ++i)
                        objects[i] = sorted[i].object;
                    store.clear(tuned.grid.bricks());
                    scatter_objects(
                        mine, tuned.grid, store, [&](std::uint32_t i) { return objects[i]; }, 0, count);
                    const std::uint32_t bricks = tuned.grid.bricks();
                    for (std::uint32_t brick = 0; brick < bricks && !stopped_.load(std::memory_order_relaxed);
                         ++brick)
                        sweep_brick(
                            mine, out, [&](std::uint32_t) -> const BrickStore& { return store; }, 1, brick,
                            bricks, depth + 1);
                }
                return true;
            }
        }
        if (blocks_per_row * count > job_blocks) {
            add_job(mine, out, depth, true, count);
            return true;
        }
        return false;
    }

    void sample_records(Sample& sample, const Record* records, std::uint32_t count)
    {
        const std::size_t wanted = sample_size(count);
        std::uint32_t chosen[Sample::capacity];
        choose_sample(chosen, wanted, count);
        for (sample.size = 0; sample.size < wanted; ++sample.size) {
            const Aabb<Dim, T> box = boxes_[records[chosen[sample.size]].object & object_mask];
            for (int d = 0; d < Dim; ++d)
                sample.add(d, static_cast<double>(box.lo[d]), static_cast<double>(box.hi[d]));
        }
    }

    template <class ObjectOf>
    void scatter_objects(Slot& mine, const Grid<T>& grid, BrickStore& store, const ObjectOf& object_of,
                         std::uint32_t first, std::uint32_t last)
    {
        Unit<T>& unit = mine.unit<T>();
        for (std::uint32_t begin = first; begin < last; begin += unit_size) {
            unit.count = std::min(unit_size, last - begin);
            for (std::uint32_t i = 0; i < unit.count; ++i) {
                const std::uint32_t object = object_of(begin + i);
                unit.object[i] = object;
                load_box(object & side_b ? boxes_.b : boxes_.a, object & index_mask, unit, i);
            }
            append_unit<Dim>(kernels_, grid, unit, store);
        }
        store.close();
    }

    void add_job(Slot& mine, Output& out, int depth, bool is_sorted, std::uint32_t count)
    {
        const std::uint32_t size = padded(count);
        Job& job = job_of_size(size);
        std::copy_n(mine.sorted.data(), size, job.records.reserve(size));
        if (is_sorted) std::copy_n(mine.window_end.data(), count + 1, job.window_end.reserve(size));
        job.block = out.block;
        job.number = static_cast<std::uint32_t>(mine.jobs.size());
        job.depth = depth;
        job.sorted = is_sorted;
        job.count = count;
        mine.jobs.push_back(&job);
    }

    /// Kept jobs are reused for their memory: the smallest that is big enough, so that a steady frame needs
    /// no new memory whoever finds which first.
    Job& job_of_size(std::uint32_t size)
    {
        std::lock_guard lock(mutex_);
        Job* best = nullptr;
        for (const std::unique_ptr<Job>& job : engine_.job_pool_)
            if (!job->in_use &&
                (best == nullptr ||
                 (job->records.capacity() >= size
                      ? best->records.capacity() < size || job->records.capacity() < best->records.capacity()
                      : best->records.capacity() < job->records.capacity())))
                best = job.get();
        if (best == nullptr) {
            engine_.job_pool_.push_back(std::make_unique<Job>(memory_));
            best = engine_.job_pool_.back().get();
        }
        best->in_use = true;
        return *best;
    }

    bool take_jobs()
    {
        jobs_.clear();
        for (std::uint32_t s = 0; s < slots_; ++s) {
            Slot& each = slot(s);
            jobs_.insert(jobs_.end(), each.jobs.begin(), each.jobs.end());
            each.jobs.clear();
        }
        // A block's jobs come from one slot, numbered in the order of its bricks.
        std::sort(jobs_.begin(), jobs_.end(), [](const Job* x, const Job* y) {
            return x->block != y->block ? x->block < y->block : x->number < y->number;
        });
        return !jobs_.empty();
    }

    void run_job(Job& job)
    {
        if (job.sorted) {
            SortedBrick brick{job.count,
                              slot(0).columns.reserve(std::size_t{padded(job.count)} * columns_per_record),
                              job.window_end.data()};
            kernels_.arrange(job.records.data(), brick);
            claim_blocks((job.count + job_rows - 1) / job_rows,
                         [&](Slot& mine, Output& out, std::uint32_t part) {
                             mine.counts.blocks += kernels_.sweep<Dim>()(
                                 brick, part * job_rows, std::min(job.count, (part + 1) * job_rows), out);
                             out.resolve_ties();
                         });
            return;
        }
        Sample& sample = *slot(0).sample.reserve_exactly(1);
        sample_records(sample, job.records.data(), job.count);
        const Grid<T> grid = tune<Dim, T>(sample, job.count).grid;
        ++slot(0).counts.nested;
        const std::uint32_t units = unit_count(job.count);
        each_slot([&](Slot& mine, std::uint32_t s) {
            mine.store.clear(grid.bricks());
            const auto first = static_cast<std::uint32_t>(std::uint64_t{units} * s / slots_) * unit_size;
            const auto last = std::min(
                job.count, static_cast<std::uint32_t>(std::uint64_t{units} * (s + 1) / slots_) * unit_size);
            scatter_objects(
                mine, grid, mine.store, [&](std::uint32_t i) { return job.records[i].object; }, first, last);
        });
        sweep_grid(grid, job.depth);
    }

    std::span<Pair> new_chunk()
    {
        std::lock_guard lock(mutex_);
        const std::span<Pair> chunk =
            PairBufferAccess(*request_.result).chunk(engine_.chunks_used_, chunk_pairs);
        ++engine_.chunks_used_; // only now: after a failure, other threads still ask for theirs
        return chunk;
    }

    void finish()
    {
        engine_.next_block = request_.first_block + blocks_.size();
        std::size_t segments = 0;
        for (std::uint32_t s = 0; s < slots_; ++s)
            segments += slot(s).segments.size();
        for (std::uint32_t s = 0; s < slots_; ++s)
            if (slot(s).segments.capacity() < segments) slot(s).segments.reserve(segments + segments / 4);
        for (std::uint32_t s = 1; s < slots_; ++s)
            slot(0).match(slot(s));
        for (std::uint32_t s = 1; s < slots_; ++s)
            slot(s).match(slot(0));
        if (request_.sink) return;
        PairBufferAccess result(*request_.result);
        result.reserve_blocks(segments);
        for (const Block& block : blocks_)
            for (std::uint32_t k = block.first; k < block.last; ++k)
                result.append(slot(block.slot).segments[k]);
        // How many chunks the same pairs fill varies by one per slot with the threads' luck. Some to spare,
        // and twice that when they run short, keep steady frames from allocating.
        const std::uint64_t chunks = request_.result->bytes_reserved() / (chunk_pairs * sizeof(Pair));
        const std::uint32_t used = engine_.chunks_used_;
        if (slots_ > 1 && chunks < used + slots_)
            for (std::uint64_t c = chunks; c < used + 2 * slots_ + used / 16; ++c)
                result.chunk(c, chunk_pairs);
    }

    Engine& engine_;
    const Kernels& kernels_;
    const Boxes<Dim, T>& boxes_;
    const Request& request_;
    std::pmr::memory_resource* memory_;
    std::uint32_t slots_;
    std::atomic<bool> stopped_{false};
    std::mutex mutex_; // guards what is shared while tasks run: the result's chunks and the pool of jobs
    std::pmr::vector<Block>& blocks_;
    std::pmr::vector<Job*>& jobs_; // of the round under way
};

Engine::Engine(const FinderOptions& options)
    : options_(options),
      executor_(options.executor != nullptr ? options.executor : &default_executor()),
      blocks_(options.memory),
      jobs_(options.memory)
{
}

Engine::~Engine() = default;

void Engine::use_slots(std::uint32_t count)
{
    while (slots_.size() < count)
        slots_.push_back(std::make_unique<Slot>(options_.memory));
}

std::uint64_t Engine::bytes() const noexcept
{
    std::uint64_t sum = 0;
    for (const auto& each : slots_)
        sum += each->bytes();
    for (const auto& job : job_pool_)
        sum += job->records.bytes() + job->window_end.bytes();
    return sum;
}

void Engine::release()
{
    slots_.clear();
    job_pool_.clear();
    blocks_ = std::pmr::vector<Block>(options_.memory);
    jobs_ = std::pmr::vector<Job*>(options_.memory);
}

void Engine::begin_call() noexcept
{
    stats = {};
    next_block = 0;
    chunks_used_ = 0;
}

template <int Dim, class T>
bool Engine::run(const Boxes<Dim, T>& boxes, const Request& request)
{
    return Run<Dim, T>(*this, boxes, request)();
}

template bool Engine::run(const Boxes<2, float>&, const Request&);
template bool Engine::run(const Boxes<2, double>&, const Request&);
template bool Engine::run(const Boxes<3, float>&, const Request&);
template bool Engine::run(const Boxes<3, double>&, const Request&);

} // namespace engine
JOSTLE_NAMESPACE_END
