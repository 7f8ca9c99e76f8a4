// SPDX-License-Identifier: MIT
#include "jostle/responses.hpp"

#include <cstring>
#include <limits>
#include <mutex>
#include <new>
#include <string>

#include "base/checks.hpp"
#include "base/prefetch.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace detail {

namespace {

constexpr std::size_t line = 128; // two cache lines: neighbours are fetched together
constexpr std::size_t chunks_per_grant = 8;
constexpr std::uint32_t most_bins = 256; // so that a slot's open chunks stay in its cache

template <class Size>
Size rounded_up(Size size, Size step)
{
    return (size + step - 1) / step * step;
}

/// Where things lie that share a piece of memory, each on lines of its own.
class Layout
{
  public:
    /// The next place, for `count` things of `bytes` each. Throws std::bad_alloc rather than go beyond what
    /// any memory could hold: a plan may name billions of blocks.
    std::size_t place(std::uint64_t count, std::uint64_t bytes)
    {
        constexpr std::uint64_t most = std::numeric_limits<std::ptrdiff_t>::max() / 2; // some is added to it
        if (bytes != 0 && count > (most - size_) / bytes) throw std::bad_alloc();
        return static_cast<std::size_t>(
            std::exchange(size_, rounded_up(size_ + count * bytes, std::uint64_t{line})));
    }
    [[nodiscard]] std::size_t size() const { return static_cast<std::size_t>(size_); }

  private:
    std::uint64_t size_ = 0;
};

const ResponsesOptions& checked(const ResponsesOptions& given)
{
    check_memory(given.memory);
    if (given.form != ResponseForm::automatic && given.form != ResponseForm::dense &&
        given.form != ResponseForm::sparse)
        throw Error(ErrorCode::invalid_argument, "there is no response form " +
                                                     std::to_string(static_cast<int>(given.form)) +
                                                     "; give ResponseForm::automatic, dense or sparse");
    return given;
}

/// A chunk as far as it is worth fetching at once: of a longer one the processor sees the rest coming.
void prefetch_chunk(const void* chunk, std::size_t size)
{
    if (chunk != nullptr) prefetch(chunk, std::min<std::size_t>(size, 1024));
}

[[noreturn]] void throw_not_below(const char* what, std::uint32_t value, std::uint32_t limit,
                                  std::uint64_t index, const char* cure)
{
    throw Error(ErrorCode::invalid_argument,
                std::string("add() to ") + what + " " + std::to_string(value) + ", but start() was given " +
                    std::to_string(limit) + " " + what + "s; " + cure,
                index);
}

} // namespace

/// Chunks for the lists. A slot is granted several at a time; which slot gets how many depends on the
/// threads, so there is room for the most unfavourable share.
struct ResponseStore::Pool
{
    struct Slab
    {
        std::byte* bytes;
        std::size_t size; ///< whole grants
    };
    explicit Pool(std::pmr::memory_resource* memory) : slabs(memory) {}

    std::mutex mutex;
    std::pmr::vector<Slab> slabs;
    std::size_t slab = 0, used = 0; ///< the next grant lies there
    std::size_t granted = 0;        ///< since start(), bytes

    void add_slab(std::size_t size, std::pmr::memory_resource* memory)
    {
        slabs.reserve(slabs.size() + 1);
        slabs.push_back({static_cast<std::byte*>(memory->allocate(size, line)), size});
    }
};

ResponseStore::ResponseStore(const ResponsesOptions& given, std::size_t value_size, std::size_t entry_size)
    : options(checked(given)),
      value_size_(value_size),
      entry_size_(entry_size),
      header_size_(64), // entries of 32 bytes lie on one line

      // At least 8 entries, and no line that two slots write.
      chunk_size_(rounded_up(std::max<std::size_t>(1024, header_size_ + 8 * entry_size), line)),
      pool_(std::make_unique<Pool>(given.memory))
{
}

ResponseStore::~ResponseStore()
{
    release();
}

void ResponseStore::release() noexcept
{
    for (const Pool::Slab& slab : pool_->slabs)
        options.memory->deallocate(slab.bytes, slab.size, line);
    pool_->slabs.clear();
    pool_->slab = pool_->used = pool_->granted = 0;
    if (frame_ != nullptr) options.memory->deallocate(frame_, frame_size_, line);
    frame_ = nullptr;
    frame_size_ = 0;
    bytes_reserved = 0;
    rows = values = nullptr;
    rows_clean = false;
    objects = blocks = open_slots = slot_count = bin_count = 0;
}

std::size_t ResponseStore::entries_per_chunk() const noexcept
{
    return (chunk_size_ - header_size_) / entry_size_;
}

/// Bytes of chunks that a slot is granted at a time.
std::size_t ResponseStore::grant_size() const noexcept
{
    return chunk_size_ * chunks_per_grant;
}

std::byte* ResponseStore::entries_of(Chunk* chunk) const noexcept
{
    return reinterpret_cast<std::byte*>(chunk) + header_size_;
}

/// The chunk that a place, which has one, lies in.
ResponseStore::Chunk* ResponseStore::chunk_of(const Place& place) const noexcept
{
    return reinterpret_cast<Chunk*>(place.end - entries_per_chunk() * entry_size_ - header_size_);
}

/// Since start(), by these slots.
std::size_t ResponseStore::entries_added(std::uint32_t of_slots) const noexcept
{
    std::size_t chunks = pool_->granted / chunk_size_, entries = 0;
    for (std::uint32_t i = 0; i < of_slots; ++i) {
        chunks -= static_cast<std::size_t>(slots[i].chunks_end - slots[i].chunks) / chunk_size_;
        for (std::uint32_t bin = 0; bin < bin_count; ++bin)
            if (const Place& place = slots[i].places[bin]; place.end != nullptr) {
                --chunks; // isn't full
                entries +=
                    entries_per_chunk() - static_cast<std::size_t>(place.end - place.next) / entry_size_;
            }
    }
    return entries + chunks * entries_per_chunk();
}

/// What the frame's layout depends on.
struct ResponseStore::Shape
{
    std::uint32_t objects, blocks;
    std::uint32_t slots, merging_slots; ///< for add() and for merge()
    bool dense;
    std::uint64_t row_size; ///< bytes that a block takes in the dense form
    int bin_shift;          ///< a bin has up to 2^bin_shift objects
    std::uint32_t bins;
};

ResponseStore::Shape ResponseStore::shape_for(std::uint32_t for_objects, const WorkPlan& plan) const
{
    Shape shape{};
    shape.objects = for_objects;
    shape.blocks = plan.blocks;
    shape.slots = plan.slots;
    shape.row_size = rounded_up(std::uint64_t{for_objects} * value_size_, std::uint64_t{line});
    // Of all pairs few have a response: the plan says nothing about how many (block_items is 0).
    const bool dense_is_smaller = plan.blocks > 0 && plan.block_items > 0 &&
                                  shape.row_size <= 2 * plan.items * entry_size_ / plan.blocks;
    shape.dense =
        options.form == ResponseForm::dense || (options.form == ResponseForm::automatic && dense_is_smaller);
    const auto bins = [for_objects](int shift) {
        return (std::uint64_t{for_objects} + (std::uint64_t{1} << shift) - 1) >> shift;
    };
    shape.bin_shift = 9;
    while (bins(shape.bin_shift) > most_bins)
        ++shape.bin_shift;
    shape.bins = static_cast<std::uint32_t>(bins(shape.bin_shift));
    ProcessOptions merging;
    merging.executor = options.executor;
    merging.block_items = 1;
    shape.merging_slots = plan_work(shape.bins, merging).slots;
    return shape;
}

void ResponseStore::start(std::uint32_t new_objects, const WorkPlan& plan)
{
    // Nothing can be added if this fails.
    open_slots = 0;
    const std::uint32_t old_objects = std::exchange(objects, 0), old_slots = std::exchange(slot_count, 0);
    const std::size_t last_entries = rows == nullptr ? entries_added(old_slots) : 0;
    Shape shape = shape_for(new_objects, plan);
    const bool is_laid_out = frame_ != nullptr && shape.objects == old_objects && shape.bins == bin_count &&
                             shape.slots <= old_slots && shape.merging_slots <= merging_slots_ &&
                             shape.dense == (rows != nullptr) && (!shape.dense || shape.blocks == blocks);
    if (is_laid_out)
        shape.slots = old_slots;
    else
        lay_out(shape);
    std::memset(merged_, 0, bin_count);
    blocks = shape.blocks;
    if (!shape.dense) empty_lists(shape.slots, last_entries);
    objects = new_objects;
    slot_count = open_slots = shape.slots;
}

/// Cuts the frame up, after making it larger if it is too small.
void ResponseStore::lay_out(const Shape& shape)
{
    const std::size_t slots_used = shape.dense ? 0 : shape.slots;
    const std::size_t places_size = rounded_up(shape.bins * sizeof(Place), line);
    const std::size_t first_size = rounded_up(shape.bins * sizeof(Chunk*), line);
    const std::size_t lists_size = rounded_up(shape.slots * sizeof(List), line);
    const std::size_t per_bin = shape.dense ? 0 : std::size_t{1} << shape.bin_shift;
    Layout layout;
    const std::size_t at_values = layout.place(shape.objects, value_size_);
    const std::size_t at_rows = layout.place(shape.dense ? shape.blocks : 0, shape.row_size);
    const std::size_t at_slots = layout.place(slots_used, sizeof(Slot));
    const std::size_t at_places = layout.place(slots_used, places_size);
    const std::size_t at_first = layout.place(slots_used, first_size);
    const std::size_t at_lists = layout.place(shape.dense ? 0 : shape.merging_slots, lists_size);
    const std::size_t at_partial = layout.place(shape.merging_slots * per_bin, value_size_);
    const std::size_t at_partial_block = layout.place(shape.merging_slots * per_bin, sizeof(std::uint32_t));
    const std::size_t at_dirty = layout.place(std::uint64_t{shape.bins} + 1, sizeof(bool)); // never nothing
    const std::size_t at_merged = layout.place(shape.bins, sizeof(bool));
    const std::size_t size = layout.size();
    if (size > frame_size_) {
        // Some to spare, for scenes that grow object by object.
        const std::size_t wanted = size + size / 8;
        auto* const grown = static_cast<std::byte*>(options.memory->allocate(wanted, line));
        if (frame_ != nullptr) options.memory->deallocate(frame_, frame_size_, line);
        bytes_reserved += wanted - frame_size_;
        frame_ = grown;
        frame_size_ = wanted;
    }
    values = frame_ + at_values;
    rows = shape.dense ? frame_ + at_rows : nullptr;
    rows_clean = false;
    row_size = static_cast<std::size_t>(shape.row_size);
    slots = reinterpret_cast<Slot*>(frame_ + at_slots);
    for (std::size_t i = 0; i < slots_used; ++i) {
        slots[i].places = reinterpret_cast<Place*>(frame_ + at_places + i * places_size);
        slots[i].first = reinterpret_cast<Chunk**>(frame_ + at_first + i * first_size);
    }
    lists_ = reinterpret_cast<List*>(frame_ + at_lists);
    partial_ = frame_ + at_partial;
    partial_block_ = reinterpret_cast<std::uint32_t*>(frame_ + at_partial_block);
    dirty_ = reinterpret_cast<bool*>(frame_ + at_dirty);
    std::memset(dirty_, 1, shape.bins);
    merged_ = reinterpret_cast<bool*>(frame_ + at_merged);
    bin_shift = shape.bin_shift;
    bin_count = shape.bins;
    merging_slots_ = shape.merging_slots;
}

/// Takes all chunks back, and sees that there are enough for as many entries as last time.
void ResponseStore::empty_lists(std::uint32_t of_slots, std::size_t last_entries)
{
    Pool& pool = *pool_;
    std::size_t capacity = 0;
    for (const Pool::Slab& slab : pool.slabs)
        capacity += slab.size;
    // Shared out among slots in the most unfavourable way.
    const std::size_t enough = rounded_up(
        (last_entries / entries_per_chunk() + std::size_t{of_slots} * (bin_count + chunks_per_grant)) *
            chunk_size_,
        grant_size());
    if (last_entries != 0 && capacity < enough) {
        const std::size_t wanted = rounded_up(enough + enough / 8 - capacity, grant_size());
        pool.add_slab(wanted, options.memory);
        bytes_reserved += wanted;
    }
    pool.slab = pool.used = pool.granted = 0;
    for (std::uint32_t i = 0; i < of_slots; ++i) {
        std::memset(static_cast<void*>(slots[i].places), 0, bin_count * sizeof(Place));
        slots[i].chunks = slots[i].chunks_end = nullptr;
        slots[i].last_block = 0;
        slots[i].ascending = true;
    }
}

void ResponseStore::refill(Slot& slot, Place& place)
{
    if (slot.chunks == slot.chunks_end) {
        Pool& pool = *pool_;
        const std::size_t grant = grant_size();
        const std::lock_guard lock(pool.mutex);
        while (pool.slab < pool.slabs.size() && pool.used == pool.slabs[pool.slab].size) {
            ++pool.slab;
            pool.used = 0;
        }
        if (pool.slab == pool.slabs.size()) {
            const std::size_t size = grant * std::max<std::size_t>(4, pool.granted / grant / 2);
            pool.add_slab(size, options.memory);
            bytes_reserved += size;
        }
        slot.chunks = pool.slabs[pool.slab].bytes + pool.used;
        slot.chunks_end = slot.chunks + grant;
        pool.used += grant;
        pool.granted += grant;
    }
    auto* const chunk = reinterpret_cast<Chunk*>(std::exchange(slot.chunks, slot.chunks + chunk_size_));
    chunk->next = nullptr;
    if (place.end == nullptr) {
        slot.first[&place - slot.places] = chunk;
    } else {
        Chunk* const full = chunk_of(place);
        full->next = chunk;
        full->end = place.end;
    }
    place.next = entries_of(chunk);
    place.end = place.next + entries_per_chunk() * entry_size_;
}

bool ResponseStore::in_order() const noexcept
{
    return rows != nullptr ||
           std::all_of(slots, slots + slot_count, [](const Slot& s) { return s.ascending; });
}

ResponseStore::Bin ResponseStore::open_bin(std::uint32_t bin, std::uint32_t merging_slot) noexcept
{
    Bin opened{};
    opened.first = bin << bin_shift;
    opened.count = std::min(objects - opened.first, std::uint32_t{1} << bin_shift);
    opened.dirty = dirty_ + bin;
    opened.merged = merged_ + bin;
    opened.ascending = true;
    if (rows != nullptr) return opened;
    const std::size_t per_bin = std::size_t{1} << bin_shift;
    opened.partial = partial_ + merging_slot * per_bin * value_size_;
    opened.block = partial_block_ + merging_slot * per_bin;
    List* const lists = reinterpret_cast<List*>(reinterpret_cast<std::byte*>(lists_) +
                                                merging_slot * rounded_up(slot_count * sizeof(List), line));
    std::size_t count = 0;
    for (std::uint32_t i = 0; i < slot_count; ++i) {
        const Place& place = slots[i].places[bin];
        if (place.end == nullptr) continue;
        Chunk* chunk = slots[i].first[bin];
        // Of the last chunk only its slot knows the end.
        chunk_of(place)->end = place.next;
        prefetch_chunk(chunk, chunk_size_);
        prefetch_chunk(chunk->next, chunk_size_);
        lists[count++] = {entries_of(chunk), chunk->end, chunk};
        opened.ascending = opened.ascending && slots[i].ascending;
    }
    opened.lists = {lists, count};
    return opened;
}

bool ResponseStore::next_chunk(List& list) const noexcept
{
    if (list.chunk->next == nullptr) return false;
    list.chunk = list.chunk->next;
    list.next = entries_of(list.chunk);
    list.end = list.chunk->end;
    prefetch_chunk(list.chunk->next, chunk_size_);
    return true;
}

void ResponseStore::throw_bad_add(Work work, std::uint32_t object) const
{
    if (open_slots == 0)
        throw Error(
            ErrorCode::invalid_argument,
            "add() before start(), after merge(), or after a start() that failed; call start() first");
    if (object >= objects)
        throw_not_below("object", object, objects, object, "give start() as many as there are");
    const char* const same_work =
        "make its plan from the items and ProcessOptions (executor, block_items) of the work";
    if (work.block >= blocks) throw_not_below("block", work.block, blocks, Error::no_index, same_work);
    throw_not_below("slot", work.slot, open_slots, Error::no_index, same_work);
}

} // namespace detail
JOSTLE_NAMESPACE_END
