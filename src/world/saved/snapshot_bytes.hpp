// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "base/box.hpp"
#include "jostle/error.hpp"
#include "world/kept/records.hpp"
#include "world/objects/ids.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace world {

// Snapshots, changes and slots of pairs begin with a header of 48 bytes: eight letters that tell which it is;
// then version, dimensions, bytes of a coordinate (both 0 for slots) and 0 as 32-bit numbers; then, as 64-bit
// numbers, the size of what follows the header, the checksum of both (with its own place as 0), and the
// checksum of the base of changes (otherwise 0). All numbers are little-endian, coordinates IEEE 754.
inline constexpr std::size_t snapshot_header = 48, size_at = 24, checksum_at = 32, base_at = 40;

/// A kind of bytes: its name, how it begins, its version, and the function that reads it.
struct SnapshotKind
{
    std::string_view letters;
    const char* name;
    std::uint32_t version;
    const char* reader;
};
constexpr SnapshotKind whole_snapshot = {"jostlewd", "snapshot", 5,
                                         "this is a whole snapshot, for World::restore()"};
constexpr SnapshotKind changes_since = {"jostlech", "changes", 3,
                                        "these are changes since a base, for World::restore_changes()"};
constexpr SnapshotKind slots_of_pairs = {"jostleps", "slots of pairs", 1,
                                         "these are slots of pairs, for PairSlots::restore()"};

/// The kind of world it belongs to.
struct SavedSpace
{
    std::uint32_t dim = 0, coordinate = 0;
};
template <int Dim, class T>
constexpr SavedSpace saved_space = {Dim, sizeof(T)};

/// Processes words of 8 bytes, the last padded with zeros. Each step is a bijection of the sum so far, so a
/// change within one word is always detected.
[[nodiscard]] inline std::uint64_t checksum(std::span<const std::byte> bytes) noexcept
{
    std::uint64_t sum = 0x9e3779b97f4a7c15u;
    for (std::size_t i = 0; i < bytes.size(); i += 8) {
        std::uint64_t word = 0;
        const std::size_t count = std::min<std::size_t>(8, bytes.size() - i);
        for (std::size_t k = 0; k < count; ++k)
            word |= std::to_integer<std::uint64_t>(bytes[i + k]) << (8 * k);
        sum = (sum ^ (i == checksum_at ? 0 : word)) * 0xbf58476d1ce4e5b9u;
        sum ^= sum >> 32;
    }
    return sum;
}

class SnapshotWriter
{
  public:
    std::vector<std::byte> bytes;

    template <class N>
    void put(N number)
    {
        using Bits = std::conditional_t<sizeof(N) == 4, std::uint32_t, std::uint64_t>;
        static_assert(sizeof(N) == sizeof(Bits));
        Bits bits;
        std::memcpy(&bits, &number, sizeof bits);
        std::byte out[sizeof bits];
        for (std::size_t k = 0; k < sizeof bits; ++k)
            out[k] = static_cast<std::byte>(bits >> (8 * k));
        bytes.insert(bytes.end(), out, out + sizeof bits);
    }
    template <int Dim, class T>
    void put(const Aabb<Dim, T>& box)
    {
        for (int d = 0; d < Dim; ++d) {
            put(box.lo[d]);
            put(box.hi[d]);
        }
    }
    void set(std::size_t at, std::uint64_t number)
    {
        for (std::size_t k = 0; k < 8; ++k)
            bytes[at + k] = static_cast<std::byte>(number >> (8 * k));
    }
    void begin(const SnapshotKind& kind, const SavedSpace& space, std::uint64_t base)
    {
        for (const char letter : kind.letters)
            bytes.push_back(static_cast<std::byte>(letter));
        put(kind.version);
        put(space.dim);
        put(space.coordinate);
        put(std::uint32_t{0});
        put(std::uint64_t{0}); // size and checksum, filled in later
        put(std::uint64_t{0});
        put(base);
    }
    void end()
    {
        set(size_at, bytes.size() - snapshot_header);
        set(checksum_at, checksum(bytes));
    }
};

class SnapshotReader
{
  public:
    SnapshotReader(const SnapshotKind& kind, std::span<const std::byte> bytes) : kind_(kind), bytes_(bytes) {}

    [[noreturn]] void refuse(const std::string& why) const
    {
        throw Error(ErrorCode::bad_snapshot, std::string(kind_.name) + ": " + why);
    }
    void demand(bool good, const char* why) const
    {
        if (!good) refuse(std::string(why) + " near byte " + std::to_string(at_));
    }
    template <class N>
    N get()
    {
        using Bits = std::conditional_t<sizeof(N) == 4, std::uint32_t, std::uint64_t>;
        demand(bytes_.size() - at_ >= sizeof(Bits), "the end is missing");
        Bits bits = 0;
        for (std::size_t k = 0; k < sizeof bits; ++k)
            bits |= static_cast<Bits>(std::to_integer<Bits>(bytes_[at_ + k]) << (8 * k));
        at_ += sizeof bits;
        N number;
        std::memcpy(&number, &bits, sizeof number);
        return number;
    }
    /// Reads how many items of at least `size` bytes follow.
    std::uint64_t get_count(std::size_t size)
    {
        const auto count = get<std::uint64_t>();
        demand(count <= (bytes_.size() - at_) / size, "a list is longer than what is left");
        return count;
    }
    template <int Dim, class T>
    Aabb<Dim, T> get_box()
    {
        Aabb<Dim, T> box;
        for (int d = 0; d < Dim; ++d) {
            box.lo[d] = get<T>();
            box.hi[d] = get<T>();
        }
        return box;
    }
    void demand_end() const { demand(at_ == bytes_.size(), "more bytes follow the end"); }

    /// Checks the header. Returns the checksum of the base.
    std::uint64_t read_header(const SavedSpace& space)
    {
        if (bytes_.size() < snapshot_header)
            refuse("there are " + std::to_string(bytes_.size()) + " bytes; even the header takes " +
                   std::to_string(snapshot_header));
        const auto begins_as = [&](const SnapshotKind& kind) {
            return std::memcmp(bytes_.data(), kind.letters.data(), kind.letters.size()) == 0;
        };
        if (!begins_as(kind_)) {
            for (const SnapshotKind& kind : {whole_snapshot, changes_since, slots_of_pairs})
                if (begins_as(kind)) refuse(kind.reader);
            refuse("its first bytes are wrong: it is something else, or damaged");
        }
        (void)get<std::uint64_t>();
        const auto version = get<std::uint32_t>(), dim = get<std::uint32_t>(),
                   coordinate = get<std::uint32_t>(), reserved = get<std::uint32_t>();
        const auto length = get<std::uint64_t>(), sum = get<std::uint64_t>(), base = get<std::uint64_t>();
        if (version != kind_.version)
            refuse("the version is " + std::to_string(version) + "; this library reads version " +
                   std::to_string(kind_.version));
        if (dim != space.dim || coordinate != space.coordinate)
            refuse("the world saved has " + std::to_string(dim) + " dimensions and coordinates of " +
                   std::to_string(coordinate) + " bytes; this one has " + std::to_string(space.dim) +
                   " and " + std::to_string(space.coordinate));
        if (length != bytes_.size() - snapshot_header)
            refuse("there are " + std::to_string(bytes_.size()) + " bytes, but " +
                   std::to_string(length + snapshot_header) + " were saved");
        if (checksum(bytes_) != sum || reserved != 0) refuse("its checksum is wrong, so it was altered");
        return base;
    }

  private:
    const SnapshotKind& kind_;
    std::span<const std::byte> bytes_;
    std::size_t at_ = 0;
};

/// The bits of an object's state in a snapshot. They are part of the format: the meaning of a bit never
/// changes, whatever the bits of `flag` in memory.
namespace saved {
constexpr std::uint32_t place = 3; // the two bits of `Place`
constexpr std::uint32_t alive = 1u << 2, enabled = 1u << 3, is_static = 1u << 4;
constexpr std::uint32_t has_reach = 1u << 5; // box, displacement and margin follow
constexpr std::uint32_t has_data = 1u << 7;  // user data follow
constexpr std::uint32_t all = place | alive | enabled | is_static | has_reach; // except has_data

struct Meaning
{
    std::uint32_t bit, in_memory;
};
constexpr Meaning meanings[] = {{alive, flag::alive},
                                {enabled, flag::enabled},
                                {is_static, flag::is_static},
                                {has_reach, flag::has_reach}};
} // namespace saved
static_assert(0 == static_cast<int>(Place::none) && 1 == static_cast<int>(Place::disabled) &&
                  2 == static_cast<int>(Place::active) && 3 == static_cast<int>(Place::resting),
              "the places are part of the format, too");

/// Converts between an object's bits in a snapshot and its state in memory.
constexpr std::uint32_t state_of(std::uint32_t bits) noexcept
{
    std::uint32_t state = bits & saved::place;
    for (const auto& [bit, in_memory] : saved::meanings)
        if ((bits & bit) != 0) state |= in_memory;
    return state;
}
constexpr std::uint32_t bits_of(std::uint32_t state) noexcept
{
    std::uint32_t bits = state & saved::place;
    for (const auto& [bit, in_memory] : saved::meanings)
        if ((state & in_memory) != 0) bits |= bit;
    return bits;
}

/// In the list of active objects a number tells for how many updates an object has been idle. Parked objects
/// have numbers from this one on, in the order in which they come to rest. The list includes resting objects
/// that have moved recently.
constexpr std::uint32_t first_turn = idle_updates + 1;

/// Whether an element of that list is possible for an object in this place.
[[nodiscard]] constexpr bool may_be_listed(Place place, std::uint32_t idle) noexcept
{
    return place == Place::active || (place == Place::resting && idle < shifted_updates);
}

/// Begins with the generation, which for no object is all there is.
template <int Dim, class T>
void write_record(SnapshotWriter& out, const Record<Dim, T>& record)
{
    out.put(record.generation);
    if (record.generation == 0) return;
    out.put(bits_of(record.state) | (record.data != 0 ? saved::has_data : 0u));
    if (record.data != 0) out.put(record.data);
    out.put(record.numbers.category);
    out.put(record.numbers.mask);
    out.put(record.numbers.owner);
    out.put(record.box);
    if (!record.has(flag::has_reach)) return;
    out.put(record.reach.box);
    for (const T by : record.reach.displacement)
        out.put(by);
    out.put(record.reach.margin);
}

template <class T>
T read_margin(SnapshotReader& in)
{
    const T margin = in.get<T>();
    in.demand(margin >= 0 && margin <= std::numeric_limits<T>::max(), "a margin is negative or not finite");
    return margin;
}

template <int Dim, class T>
Record<Dim, T> read_record(SnapshotReader& in)
{
    Record<Dim, T> record;
    record.generation = in.get<std::uint32_t>();
    if (record.generation == 0) return record;
    in.demand(is_generation(record.generation), "an object has a generation that none can have");
    auto bits = in.get<std::uint32_t>();
    record.state = state_of(bits);
    if ((bits & saved::has_data) != 0) {
        record.data = in.get<std::uint64_t>();
        bits &= ~saved::has_data;
    }
    in.demand((bits & ~saved::all) == 0 && record.has(flag::alive) && record.place() != Place::none &&
                  record.has(flag::enabled) == (record.place() != Place::disabled),
              "the state of an object is impossible");
    record.numbers.category = in.get<std::uint32_t>();
    record.numbers.mask = in.get<std::uint32_t>();
    record.numbers.owner = in.get<std::uint32_t>();
    record.box = in.template get_box<Dim, T>();
    in.demand(valid(record.box), "a box is NaN or inverted");
    if (!record.has(flag::has_reach)) return record;
    Reach<Dim, T>& reach = record.reach;
    reach.box = in.template get_box<Dim, T>();
    for (T& by : reach.displacement) {
        by = in.get<T>();
        in.demand(!(by != by), "a displacement is NaN");
    }
    reach.margin = read_margin<T>(in);
    in.demand(valid(reach.box) && same(reach.bounds(), record.box),
              "the bounds of an object don't follow from its box");
    return record;
}

/// Writes active objects, ascending, including parked ones with their order, and resting ones that have
/// moved.
template <int Dim, class T, class List>
void write_active(SnapshotWriter& out, const State<Dim, T>& state, List& active)
{
    active.assign(state.active.begin(), state.active.end());
    std::uint32_t turn = first_turn;
    state.parked.each([&](Index index) {
        active.push_back({index, turn++});
        return true;
    });
    active.insert(active.end(), state.shifted.begin(), state.shifted.end());
    std::sort(active.begin(), active.end(), [](const auto& x, const auto& y) { return x.index < y.index; });
    out.put(std::uint64_t{active.size()});
    for (const auto& each : active) {
        out.put(raw(each.index));
        out.put(each.idle);
    }
}

/// Reads what that wrote into empty lists, parked objects in their order. `place_of` returns the place of an
/// index, none if there is no object; `count_of_active` is the number of objects in the place active.
template <class List, class PlaceOf>
void read_active(SnapshotReader& in, const PlaceOf& place_of, std::uint64_t count_of_active, List& active,
                 List& parked, List& shifted)
{
    const std::uint64_t count = in.get_count(8);
    std::uint64_t least = 0;
    for (std::uint64_t k = 0; k < count; ++k) {
        const auto index = in.get<std::uint32_t>(), idle = in.get<std::uint32_t>();
        const Place place = place_of(index);
        in.demand(least <= index && may_be_listed(place, idle),
                  "the list of active objects doesn't fit the objects");
        least = std::uint64_t{index} + 1;
        List& list = place == Place::resting ? shifted : idle < first_turn ? active : parked;
        list.push_back({Index{index}, idle});
    }
    in.demand(count - shifted.size() == count_of_active,
              "the list of active objects doesn't fit the objects");
    std::sort(parked.begin(), parked.end(), [](const auto& x, const auto& y) {
        return x.idle != y.idle ? x.idle < y.idle : x.index < y.index;
    });
}

/// Makes these the present lists. The objects already exist, as in their records.
template <int Dim, class T, class List>
void put_active(State<Dim, T>& state, const List& active, const List& parked, const List& shifted)
{
    state.active.assign(active.begin(), active.end());
    state.shifted.assign(shifted.begin(), shifted.end());
    for (const auto& each : shifted)
        state.objects[each.index].set(flag::shifted);
    state.parked.reserve(parked.size());
    for (const auto& each : parked) {
        state.parked.push(each.index, state.objects[each.index].now());
        state.objects[each.index].set_place(Place::parked);
    }
}

} // namespace world
JOSTLE_NAMESPACE_END
