// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <memory_resource>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

#include "jostle/error.hpp"
#include "jostle/executor.hpp"
#include "jostle/process.hpp"
#include "jostle/version.hpp"

JOSTLE_NAMESPACE_BEGIN

/// How a Responses stores what is added until it is merged. The merged values have the same bits in both
/// forms.
enum class ResponseForm
{
    /// The form that needs less memory if each item of the plan adds two responses.
    automatic,
    /// An array over all objects for each block of work (the thesis, fig. 4.8, has one for each processor).
    /// For few objects with many responses each. Memory: blocks x objects x sizeof(T).
    dense,
    /// Lists of responses, sorted roughly by object as they are added. Memory: sizeof(T) + 8 bytes per
    /// response, and for each slot up to 1 KB per 512 objects (up to 256 KB from 131,072 objects on).
    sparse,
};

struct ResponsesOptions
{
    /// Runs merge(). Null means default_executor(). It must outlive the Responses.
    Executor* executor = nullptr;
    /// Provides the memory. It is used from several threads at a time, so it must be synchronised.
    std::pmr::memory_resource* memory = std::pmr::get_default_resource();
    ResponseForm form = ResponseForm::automatic;
};

/// Merges with +=.
struct AddUp
{
    template <class T>
    void operator()(T& into, const T& value) const
    {
        into += value;
    }
};

namespace detail {

inline void prefetch_for_writing([[maybe_unused]] const void* memory) noexcept
{
#if defined(__GNUC__)
    __builtin_prefetch(memory, 1);
#endif
}

/// The memory of a Responses, for any T.
class JOSTLE_API ResponseStore
{
  public:
    /// A piece of a list, followed by its entries.
    struct Chunk
    {
        Chunk* next;
        std::byte* end; ///< of its entries
    };
    /// Where the next entry of one slot and one bin of objects goes.
    struct Place
    {
        std::byte* next;
        std::byte* end; ///< of the chunk
    };
    /// The state of one task, on its own cache lines.
    struct alignas(128) Slot
    {
        Place* places; ///< by bin
        Chunk** first; ///< by bin, of those with a place
        std::byte* chunks;
        std::byte* chunks_end; ///< granted and not used
        std::uint32_t last_block;
        bool ascending; ///< no block came after a higher one
    };
    /// What one slot added to one bin, oldest first; next == end at its end.
    struct List
    {
        const std::byte* next;
        const std::byte* end;
        Chunk* chunk;
    };
    /// What is needed to merge the objects [first, first + count).
    struct Bin
    {
        std::uint32_t first, count;
        std::span<List> lists; ///< of the slots that added something
        bool ascending;        ///< in every list
        bool* dirty;           ///< whether their values are other than T{}
        bool* merged;          ///< whether they have been since start()
        std::byte* partial;    ///< scratch: a T per object
        std::uint32_t* block;  ///< scratch: a number per object
    };

    ResponseStore(const ResponsesOptions& options, std::size_t value_size, std::size_t entry_size);
    ResponseStore(const ResponseStore&) = delete;
    ResponseStore& operator=(const ResponseStore&) = delete;
    ~ResponseStore();

    void start(std::uint32_t objects, const WorkPlan& plan);
    void refill(Slot& slot, Place& place);
    [[noreturn]] void throw_bad_add(Work work, std::uint32_t object) const;
    /// Whether every slot's blocks ascend: then merging needs no memory.
    [[nodiscard]] bool in_order() const noexcept;
    [[nodiscard]] Bin open_bin(std::uint32_t bin, std::uint32_t merging_slot) noexcept;
    /// Returns false at the end of the list.
    bool next_chunk(List& list) const noexcept;
    void release() noexcept;

    // What add() reads. Without start() there are no objects.
    Slot* slots = nullptr;
    std::byte* rows = nullptr; ///< of the dense form, row_size bytes a block, whole cache lines
    std::size_t row_size = 0;
    std::uint32_t objects = 0, blocks = 0;
    std::uint32_t open_slots = 0; ///< 0 when nothing can be added: before start(), after merge()
    int bin_shift = 0;

    // What merge() reads.
    std::uint32_t slot_count = 0, bin_count = 0;
    std::byte* values = nullptr;
    bool rows_clean = false; ///< all T{}
    std::uint64_t bytes_reserved = 0;
    ResponsesOptions options;

  private:
    struct Pool;
    struct Shape;
    Shape shape_for(std::uint32_t objects, const WorkPlan& plan) const;
    void lay_out(const Shape& shape);
    void empty_lists(std::uint32_t of_slots, std::size_t last_entries);
    std::size_t entries_per_chunk() const noexcept;
    std::size_t entries_added(std::uint32_t of_slots) const noexcept;
    std::size_t grant_size() const noexcept;
    std::byte* entries_of(Chunk* chunk) const noexcept;
    Chunk* chunk_of(const Place& place) const noexcept;

    const std::size_t value_size_, entry_size_, header_size_, chunk_size_;
    std::byte* frame_ = nullptr; // holds all arrays below and the public ones, laid out by start()
    std::size_t frame_size_ = 0;
    List* lists_ = nullptr; // per merging slot: one for each slot
    std::byte* partial_ = nullptr;
    std::uint32_t* partial_block_ = nullptr;
    bool* dirty_ = nullptr;
    bool* merged_ = nullptr;
    std::uint32_t merging_slots_ = 0;
    std::unique_ptr<Pool> pool_;
};

} // namespace detail

/// Accumulates values per object on all cores at once: impulses, counts, anything that can be merged.
///
/// Any task may add to any object, without locks and without sharing cache lines for writing. After the work,
/// merge() combines what was added to each object.
///
///     responses.start(objects, plan_work(pairs.size(), options)); // the same options as below
///     process_pairs(pairs, [&](Pair pair, Work work) { responses.add(work, pair.a, ...); }, options);
///     std::span<const T> sums = responses.merge();
///
/// Exact    bit for bit the same for any number of threads, any executor and any order of execution,
///          floating-point sums included. An object's responses within one block of work are merged in the
///          order in which they were added, starting with T{}; then the blocks' results in ascending order,
///          starting with T{}. With one block that is a plain loop.
/// T        trivially copyable. T{} must be neutral: merging it changes nothing.
/// Merge    called as merge(into, value) with T& and const T&, on several threads at a time; must not throw.
/// Threads  add() may run on several threads at a time if their slots differ, with blocks in any order, but
///          all adds of one block with the same slot. Other members: one call at a time.
/// Memory   kept from frame to frame: a steady frame allocates nothing, however the work is spread over
///          slots.
/// Source   thesis, ch. 4, Alg. 15-16 and fig. 4.8, there with an array per processor.
template <class T, class Merge = AddUp>
class Responses
{
    static_assert(std::is_trivially_copyable_v<T> && std::is_default_constructible_v<T>);
    static_assert(alignof(T) <= 64);

  public:
    explicit Responses(const ResponsesOptions& options = {}, Merge merge = {})
        : store_(std::make_unique<detail::ResponseStore>(options, sizeof(T), sizeof(Entry))),
          merge_(std::move(merge))
    {
    }

    /// Discards everything, and makes room for responses of `objects` objects from work cut by `plan`.
    /// Errors   std::bad_alloc; then nothing can be added until a start succeeds.
    void start(std::uint32_t objects, const WorkPlan& plan)
    {
        store_->start(objects, plan);
        merged_ = false;
        if (store_->rows != nullptr && !store_->rows_clean)
            for (std::uint32_t block = 0; block < store_->blocks; ++block)
                std::fill_n(row(block), objects, T{});
        store_->rows_clean = false;
    }

    /// Adds a response of `object`, while working on work.block.
    /// Errors   invalid_argument if object, block or slot is not below the number that start() was given, or
    ///          after merge(); std::bad_alloc. The response isn't added then.
    /// Cost     a few nanoseconds; writes sizeof(T) + 8 bytes (dense: sizeof(T)).
    void add(Work work, std::uint32_t object, const T& value)
    {
        detail::ResponseStore& store = *store_;
        if (object >= store.objects || work.block >= store.blocks || work.slot >= store.open_slots)
            store.throw_bad_add(work, object);
        if (store.rows != nullptr) {
            merge_(row(work.block)[object], value);
            return;
        }
        detail::ResponseStore::Slot& slot = store.slots[work.slot];
        detail::ResponseStore::Place& place = slot.places[object >> store.bin_shift];
        if (place.next == place.end) store.refill(slot, place);
        ::new (static_cast<void*>(place.next)) Entry{object, work.block, value};
        place.next += sizeof(Entry);
        detail::prefetch_for_writing(place.next + 128); // a third of the time, with random objects
        if (work.block < slot.last_block) slot.ascending = false;
        slot.last_block = work.block;
    }

    /// Returns the merged responses by object, T{} where there were none. They are valid until the next
    /// start(). Another call before that returns them again. Nothing can be added in between.
    /// Errors   std::bad_alloc, only if blocks ran out of order; what the executor throws, and an `Error` if
    ///          it leaves tasks out. Nothing is lost then: call merge() again.
    /// Cost     one pass over the responses, and over the objects that have or had one; parallel.
    std::span<const T> merge()
    {
        if (!merged_) each_bin([](const Bin&) {});
        return {values(), store_->objects};
    }

    /// Merges, and calls apply(first, values) for each run of objects, which begins at `first`, as soon as it
    /// is merged and still in the cache. Runs without a response may be skipped.
    ///
    /// Threads  `apply` is called on several threads at a time. It must not throw.
    template <class F>
        requires std::invocable<F&, std::uint32_t, std::span<const T>>
    void merge(F&& apply)
    {
        if (!store_->in_order()) merge(); // what may throw, before anything is applied
        each_bin([&](const Bin& bin) {
            if (store_->rows != nullptr || *bin.dirty)
                apply(bin.first, std::span<const T>(values() + bin.first, bin.count));
        });
    }

    /// Returns the form that the last start() chose.
    [[nodiscard]] ResponseForm form() const noexcept
    {
        return store_->rows != nullptr ? ResponseForm::dense : ResponseForm::sparse;
    }
    [[nodiscard]] std::uint64_t bytes_reserved() const noexcept { return store_->bytes_reserved; }
    /// Frees all memory, that of the merged values included.
    void release_memory() noexcept { store_->release(); }

  private:
    struct Entry
    {
        std::uint32_t object, block;
        T value;
    };
    using Bin = detail::ResponseStore::Bin;
    using List = detail::ResponseStore::List;

    T* values() const noexcept { return reinterpret_cast<T*>(store_->values); }
    T* row(std::uint32_t block) const noexcept
    {
        return reinterpret_cast<T*>(store_->rows + block * store_->row_size);
    }
    static const Entry& entry(const std::byte* at) noexcept { return *reinterpret_cast<const Entry*>(at); }

    /// Calls done(bin) for each bin once it is merged.
    template <class F>
    void each_bin(F&& done)
    {
        store_->open_slots = 0; // what is merged is used up, also if this fails later on
        ProcessOptions process;
        process.executor = store_->options.executor;
        process.block_items = 1;
        process_items(
            store_->objects == 0 ? 0 : store_->bin_count, // none if start() has failed
            [&](std::uint64_t number, std::uint64_t, Work work) {
                const Bin bin = store_->open_bin(static_cast<std::uint32_t>(number), work.slot);
                if (!*bin.merged) {
                    if (store_->rows != nullptr)
                        merge_rows(bin);
                    else
                        merge_lists(bin);
                    *bin.merged = true;
                }
                done(bin);
            },
            process);
        store_->rows_clean = true;
        merged_ = true;
    }

    void merge_rows(const Bin& bin)
    {
        T* const sums = values() + bin.first;
        std::fill_n(sums, bin.count, T{});
        for (std::uint32_t block = 0; block < store_->blocks; ++block) {
            T* const from = row(block) + bin.first;
            for (std::uint32_t i = 0; i < bin.count; ++i) {
                merge_(sums[i], from[i]);
                from[i] = T{};
            }
        }
    }

    void merge_lists(const Bin& bin)
    {
        constexpr std::uint32_t none = std::numeric_limits<std::uint32_t>::max();
        if (bin.lists.empty() && !*bin.dirty) return;
        T* const sums = values() + bin.first;
        std::fill_n(sums, bin.count, T{});
        *bin.dirty = !bin.lists.empty();
        if (bin.lists.empty()) return;

        T* const partial = reinterpret_cast<T*>(bin.partial);
        std::fill_n(bin.block, bin.count, none);
        std::fill_n(partial, bin.count, T{});
        // Of each object the block at hand is summed up in `partial`, those before it are in `sums`.
        const auto take = [&](const Entry& e) {
            const std::uint32_t i = e.object - bin.first;
            if (bin.block[i] != e.block) {
                merge_(sums[i], partial[i]);
                bin.block[i] = e.block;
                partial[i] = T{};
            }
            merge_(partial[i], e.value);
        };
        if (bin.ascending)
            merge_ascending(bin.lists, take);
        else
            merge_any_order(bin.lists, take);
        for (std::uint32_t i = 0; i < bin.count; ++i)
            merge_(sums[i], partial[i]);
    }

    /// Takes the entries of all lists in ascending order of blocks; each list has it.
    template <class Take>
    void merge_ascending(std::span<List> lists, Take&& take)
    {
        while (!lists.empty()) {
            std::size_t lowest = 0;
            std::uint32_t block = entry(lists[0].next).block; // of the lowest list
            std::uint32_t limit =
                std::numeric_limits<std::uint32_t>::max(); // where another one comes before it
            for (std::size_t k = 1; k < lists.size(); ++k) {
                const std::uint32_t other = entry(lists[k].next).block;
                limit = std::min(limit, std::max(block, other));
                if (other < block) {
                    block = other;
                    lowest = k;
                }
            }
            List& list = lists[lowest];
            for (bool more = true; more;) {
                for (; list.next != list.end; list.next += sizeof(Entry)) {
                    if (entry(list.next).block > limit) break;
                    take(entry(list.next));
                }
                more = list.next == list.end && store_->next_chunk(list);
            }
            if (list.next == list.end) {
                list = lists.back();
                lists = lists.first(lists.size() - 1);
            }
        }
    }

    /// The same for lists in any order, in which the entries of one block still lie together.
    template <class Take>
    void merge_any_order(std::span<List> lists, Take&& take)
    {
        struct Run
        {
            std::uint32_t block;
            std::size_t number;
            const std::byte* begin;
            const std::byte* end;
        };
        std::pmr::vector<Run> runs(store_->options.memory);
        for (List& list : lists)
            do
                for (; list.next != list.end; list.next += sizeof(Entry)) {
                    if (runs.empty() || runs.back().block != entry(list.next).block ||
                        runs.back().end != list.next)
                        runs.push_back({entry(list.next).block, runs.size(), list.next, list.next});
                    runs.back().end = list.next + sizeof(Entry);
                }
            while (store_->next_chunk(list));
        std::sort(runs.begin(), runs.end(), [](const Run& x, const Run& y) {
            return x.block != y.block ? x.block < y.block : x.number < y.number;
        });
        for (const Run& run : runs)
            for (const std::byte* at = run.begin; at != run.end; at += sizeof(Entry))
                take(entry(at));
    }

    std::unique_ptr<detail::ResponseStore> store_;
    Merge merge_;
    bool merged_ = false;
};

JOSTLE_NAMESPACE_END
