// SPDX-License-Identifier: MIT
// Snapshots: what a world is, without what it is made of. The index is built anew; answers don't show it.
//
// A header of 48 bytes: the letters "jostlewd", then version, dimensions, bytes of a coordinate and 0 as
// 32-bit numbers, then the size of what follows the header and the checksum of both (its own place counted as
// 0) as 64-bit ones, and 0 as 64 bits. All numbers little-endian, coordinates as IEEE 754.
#include <algorithm>
#include <cstring>
#include <limits>
#include <optional>
#include <type_traits>

#include "index/box_index_access.hpp"
#include "world/implementation.hpp"
#include "world/instantiate.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace world {
namespace {

constexpr char snapshot_name[8] = {'j', 'o', 's', 't', 'l', 'e', 'w', 'd'};
// 3 where there are odd boxes, 2 where there are user data or slots, else 1.
constexpr std::uint32_t snapshot_version = 3;
constexpr std::size_t snapshot_header = 48, checksum_at = 32;

/// Words of 8 bytes, the last filled up with zeros. Each step is a bijection of the sum so far, so a change
/// within one word always shows.
std::uint64_t checksum(std::span<const std::byte> bytes) noexcept
{
    std::uint64_t sum = 0x9e3779b97f4a7c15u;
    for (std::size_t i = 0; i < bytes.size(); i += 8) {
        std::uint64_t word = 0;
        const std::size_t count = std::min<std::size_t>(8, bytes.size() - i);
        for (std::size_t k = 0; k < count; ++k)
            word |= std::to_integer<std::uint64_t>(bytes[i + k]) << (8 * k);
        sum = (sum ^ word) * 0xbf58476d1ce4e5b9u;
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
};

class SnapshotReader
{
  public:
    explicit SnapshotReader(std::span<const std::byte> bytes) : bytes_(bytes) {}

    [[noreturn]] void refuse(const std::string& why) const
    {
        throw Error(ErrorCode::bad_snapshot, "snapshot: " + why);
    }
    void demand(bool good, const char* why) const
    {
        if (!good) refuse(std::string(why) + " near byte " + std::to_string(at_));
    }
    template <class N>
    N get()
    {
        using Bits = std::conditional_t<sizeof(N) == 4, std::uint32_t, std::uint64_t>;
        demand(bytes_.size() - at_ >= sizeof(Bits), "it is cut short");
        Bits bits = 0;
        for (std::size_t k = 0; k < sizeof bits; ++k)
            bits |= static_cast<Bits>(std::to_integer<Bits>(bytes_[at_ + k]) << (8 * k));
        at_ += sizeof bits;
        N number;
        std::memcpy(&number, &bits, sizeof number);
        return number;
    }
    /// How many things of at least `size` bytes follow.
    std::uint64_t get_count(std::size_t size)
    {
        const auto count = get<std::uint64_t>();
        demand(count <= (bytes_.size() - at_) / size, "a list is longer than the rest of it");
        return count;
    }
    /// One that may be odd.
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
    [[nodiscard]] std::size_t at() const noexcept { return at_; }

  private:
    std::span<const std::byte> bytes_;
    std::size_t at_ = 0;
};

/// The bits of an object's state in a snapshot. They are part of the format: what a bit means never changes,
/// whichever bits `flag` has in memory.
namespace saved {
constexpr std::uint32_t place = 3; // the two bits of `Place`
constexpr std::uint32_t alive = 1u << 2, enabled = 1u << 3, is_static = 1u << 4;
constexpr std::uint32_t has_reach = 1u << 5; // box, displacement and margin follow
constexpr std::uint32_t has_data = 1u << 7;  // user data follow; from version 2 on
constexpr std::uint32_t odd = 1u << 16;      // from version 3 on
constexpr std::uint32_t all = place | alive | enabled | is_static | has_reach | odd; // but for has_data
} // namespace saved
static_assert(0 == static_cast<int>(Place::none) && 1 == static_cast<int>(Place::disabled) &&
                  2 == static_cast<int>(Place::active) && 3 == static_cast<int>(Place::resting),
              "the places are part of the format, too");

/// The state in memory of an object that has these bits in a snapshot.
constexpr std::uint32_t state_of(std::uint32_t bits) noexcept
{
    const auto either = [&](std::uint32_t bit, std::uint32_t in_memory) {
        return (bits & bit) != 0 ? in_memory : 0u;
    };
    return (bits & saved::place) | either(saved::alive, flag::alive) | either(saved::enabled, flag::enabled) |
           either(saved::is_static, flag::is_static) | either(saved::has_reach, flag::has_reach) |
           either(saved::odd, flag::odd);
}
static_assert(saved::place == flag::place, "state_of() hands the place on as it is");

/// In the list of active objects, how many updates one has been idle; for those that are parked, from this
/// number on, whose turn comes when.
constexpr std::uint32_t first_turn = idle_updates + 1;

/// Checks all but what follows the header, and returns the version.
template <int Dim, class T>
std::uint32_t read_header(SnapshotReader& in, std::span<const std::byte> snapshot)
{
    if (snapshot.size() < snapshot_header)
        in.refuse("it has " + std::to_string(snapshot.size()) + " bytes; even the header takes " +
                  std::to_string(snapshot_header));
    if (std::memcmp(snapshot.data(), snapshot_name, sizeof snapshot_name) != 0)
        in.refuse("it doesn't begin like one: it is something else, or damaged");
    (void)in.get<std::uint64_t>();
    const auto version = in.get<std::uint32_t>(), dim = in.get<std::uint32_t>(),
               coordinate = in.get<std::uint32_t>(), reserved = in.get<std::uint32_t>();
    const auto length = in.get<std::uint64_t>(), sum = in.get<std::uint64_t>();
    const auto reserved_too = in.get<std::uint64_t>();
    if (version == 0 || version > snapshot_version)
        in.refuse("it has version " + std::to_string(version) + "; this library reads versions 1 to " +
                  std::to_string(snapshot_version));
    if (dim != Dim || coordinate != sizeof(T))
        in.refuse("it is of a world of " + std::to_string(dim) + " dimensions with coordinates of " +
                  std::to_string(coordinate) + " bytes; this one has " + std::to_string(Dim) + " and " +
                  std::to_string(sizeof(T)));
    if (length != snapshot.size() - snapshot_header)
        in.refuse("it has " + std::to_string(snapshot.size()) + " bytes, but " +
                  std::to_string(length + snapshot_header) + " were saved");
    std::vector<std::byte> unsealed(snapshot.begin(), snapshot.end());
    std::fill_n(unsealed.begin() + checksum_at, 8, std::byte{0});
    if (checksum(unsealed) != sum || reserved != 0 || reserved_too != 0)
        in.refuse("the checksum says that it was altered");
    return version;
}

template <class T>
T read_margin(SnapshotReader& in)
{
    const T margin = in.get<T>();
    in.demand(margin >= 0 && margin <= std::numeric_limits<T>::max(), "a margin is negative or not finite");
    return margin;
}

template <int Dim, class T>
void read_object(SnapshotReader& in, State<Dim, T>& state, UserData& user_data, std::uint32_t version,
                 Index index)
{
    const auto object = state.objects[index];
    auto flags = in.get<std::uint32_t>();
    object.set_state(state_of(flags));
    if (version > 1 && (flags & saved::has_data) != 0) {
        user_data.set(raw(index), in.get<std::uint64_t>());
        flags &= ~saved::has_data;
    }
    const bool is_odd = object.has(flag::odd);
    in.demand((flags & ~saved::all) == 0 && object.has(flag::alive) && object.place() != Place::none &&
                  object.is_there() == (object.place() != Place::disabled) && (version > 2 || !is_odd),
              "the state of an object is impossible");
    object.set(flag::shut, is_odd && object.has(flag::enabled));
    object.numbers().category = in.get<std::uint32_t>();
    object.numbers().mask = in.get<std::uint32_t>();
    object.numbers().owner = in.get<std::uint32_t>();
    object.now() = in.template get_box<Dim, T>();
    in.demand(valid(object.now()) != is_odd, "a box is NaN or inverted, or is only said to be");
    state.classes[index] = state.classes.of(object.filter());
    if (!object.has(flag::has_reach)) return;
    state.objects.make_room_for_reach(index);
    Reach<Dim, T>& reach = state.objects.reach(index);
    reach.box = in.template get_box<Dim, T>();
    for (T& by : reach.displacement)
        by = in.get<T>();
    reach.margin = read_margin<T>(in);
    in.demand(reach.is_odd() == is_odd && (is_odd || same(reach.bounds(), object.now())),
              "the bounds of an object don't follow from its box");
}

/// Returns the generations of all indices.
template <int Dim, class T>
std::vector<std::uint32_t> read_objects(SnapshotReader& in, State<Dim, T>& state, UserData& user_data,
                                        std::uint32_t version)
{
    const std::uint64_t end = in.get_count(4);
    in.demand(end <= std::numeric_limits<std::uint32_t>::max(), "there are too many objects");
    state.make_room(end);
    std::vector<std::uint32_t> generations(end), resting;
    std::vector<Aabb<Dim, T>> resting_boxes;
    for (std::uint32_t i = 0; i < end; ++i) {
        generations[i] = in.get<std::uint32_t>();
        if (generations[i] == 0) continue;
        read_object(in, state, user_data, version, Index{i});
        const auto object = state.objects[Index{i}];
        ++state.alive;
        state.disabled += !object.has(flag::enabled);
        state.odd += object.has(flag::shut);
        if (object.place() != Place::resting) continue;
        resting.push_back(i);
        resting_boxes.push_back(object.now());
    }
    BoxIndexAccess::rebuild(state.resting, std::span<const std::uint32_t>(resting),
                            BoxView<Dim, T>(std::span<const Aabb<Dim, T>>(resting_boxes)));
    return generations;
}

std::vector<IdTable::Free> read_free_ids(SnapshotReader& in, std::span<const std::uint32_t> generations)
{
    std::vector<IdTable::Free> free(in.get_count(8));
    std::vector<bool> is_free(generations.size());
    for (IdTable::Free& each : free) {
        each.index = in.get<std::uint32_t>();
        each.generation = in.get<std::uint32_t>();
        in.demand(each.index < generations.size() && generations[each.index] == 0 && each.generation != 0 &&
                      !is_free[each.index],
                  "an index is listed as free that isn't, or twice");
        is_free[each.index] = true;
    }
    return free;
}

/// What objects were after the last update, whatever apply() or an update under way has made of them. Asked
/// about objects in ascending order.
template <int Dim, class T>
class Past
{
  public:
    Past(const State<Dim, T>& state, const std::optional<Applied<Dim, T>>& applied) : state_(state)
    {
        if (!applied) return;
        const auto by_index = [](const auto& x, const auto& y) { return x.index < y.index; };
        filters_.assign(applied->changes.old_filters().begin(), applied->changes.old_filters().end());
        reaches_.assign(applied->changes.old_reaches().begin(), applied->changes.old_reaches().end());
        std::sort(filters_.begin(), filters_.end(), by_index);
        std::sort(reaches_.begin(), reaches_.end(), by_index);
    }
    [[nodiscard]] bool has(std::uint32_t index) const noexcept
    {
        return index < state_.objects.capacity() && state_.objects[Index{index}].place() != Place::none;
    }
    [[nodiscard]] const Aabb<Dim, T>& box(Index index) const noexcept
    {
        const auto object = state_.objects[index];
        return object.has(flag::written) ? object.before() : object.now();
    }
    [[nodiscard]] ObjectFilter filter(Index index) noexcept
    {
        if (!state_.objects[index].has(flag::refiltered)) return state_.objects[index].filter();
        return find(filters_, next_filter_, index).filter;
    }
    /// Null if it has none.
    [[nodiscard]] const Reach<Dim, T>* reach(Index index) noexcept
    {
        if (state_.objects[index].has(flag::reach_kept)) {
            const auto& old = find(reaches_, next_reach_, index);
            return old.had_reach ? &old.reach : nullptr;
        }
        return state_.objects[index].has(flag::has_reach) ? &state_.objects.reach(index) : nullptr;
    }

  private:
    template <class Kept>
    static const Kept& find(const std::vector<Kept>& kept, std::size_t& next, Index index) noexcept
    {
        while (kept[next].index < index)
            ++next;
        return kept[next];
    }
    const State<Dim, T>& state_;
    std::vector<typename Changes<Dim, T>::OldFilter> filters_; // ascending
    std::vector<typename Changes<Dim, T>::OldReach> reaches_;
    std::size_t next_filter_ = 0, next_reach_ = 0;
};

template <int Dim, class T>
void read_active(SnapshotReader& in, State<Dim, T>& state, std::size_t end)
{
    const std::uint64_t count = in.get_count(8);
    in.demand(count == state.alive - state.disabled - state.odd - state.resting.size(),
              "the list of active objects doesn't fit the objects");
    std::vector<typename State<Dim, T>::Active> parked;
    std::uint64_t least = 0;
    for (std::uint64_t k = 0; k < count; ++k) {
        const auto index = in.get<std::uint32_t>(), idle = in.get<std::uint32_t>();
        in.demand(least <= index && index < end && state.objects[Index{index}].place() == Place::active,
                  "the list of active objects doesn't fit the objects");
        least = std::uint64_t{index} + 1;
        if (idle < first_turn)
            state.active.push_back({Index{index}, idle});
        else
            parked.push_back({Index{index}, idle});
    }
    std::sort(parked.begin(), parked.end(), [](const auto& x, const auto& y) {
        return x.idle != y.idle ? x.idle < y.idle : x.index < y.index;
    });
    for (const auto& each : parked) {
        const auto object = state.objects[each.index];
        state.parked.stage(each.index, object.now());
        object.set(flag::parked);
    }
    state.parked.keep_staged(parked.size());
}

template <int Dim, class T>
void read_refused(SnapshotReader& in, State<Dim, T>& state, std::span<const std::uint32_t> generations)
{
    const std::uint64_t count = in.get_count(8);
    for (std::uint64_t k = 0; k < count; ++k) {
        const auto key = in.get<std::uint64_t>();
        const std::uint64_t a = key >> 32, b = key & 0xffffffffu;
        in.demand(a < b && b < generations.size() && generations[a] != 0 && generations[b] != 0,
                  "a refused pair names an object that isn't there");
        state.refused.insert(key);
    }
}

std::vector<Key> read_slots(SnapshotReader& in, std::span<const std::uint32_t> generations)
{
    std::vector<Key> keys(in.get_count(8));
    for (Key& key : keys) {
        key = in.get<std::uint64_t>();
        const Pair pair = pair_of(key);
        in.demand(key == no_key || (pair.a < pair.b && pair.b < generations.size() &&
                                    generations[pair.a] != 0 && generations[pair.b] != 0),
                  "a pair with a slot names an object that isn't there");
    }
    return keys;
}

} // namespace
} // namespace world

template <int Dim, Coordinate T>
std::vector<std::byte> World<Dim, T>::save() const
{
    const world::State<Dim, T>& state = implementation_->state;
    world::SnapshotWriter out;
    const std::size_t per_object = 5 * 4 + sizeof(Box);
    out.bytes.reserve(world::snapshot_header + 128 + (per_object + 24) * size());
    for (const char letter : world::snapshot_name)
        out.bytes.push_back(static_cast<std::byte>(letter));
    const world::UserData& user_data = implementation_->user_data;
    const auto& slots = implementation_->pair_slots;
    out.put(1u); // the version, or more in the end
    out.put(static_cast<std::uint32_t>(Dim));
    out.put(static_cast<std::uint32_t>(sizeof(T)));
    out.put(std::uint32_t{0});
    for (int k = 0; k < 3; ++k)
        out.put(std::uint64_t{0}); // size and checksum, for later

    world::Past<Dim, T> past(state, implementation_->applied);
    const auto [generations, free] = state.ids.picture([&](std::uint32_t index) { return past.has(index); });
    out.put(state.margin);
    if constexpr (sizeof(T) == 4) out.put(std::uint32_t{0});
    out.put(std::uint64_t{0}); // reserved
    out.put(std::uint64_t{generations.size()});
    bool any_more = slots.has_value(), any_odd = false;
    for (std::uint32_t i = 0; i < generations.size(); ++i) {
        out.put(generations[i]);
        if (generations[i] == 0) continue;
        const world::Index index{i};
        const world::Place place = state.objects[index].place();
        const ObjectFilter filter = past.filter(index);
        const world::Reach<Dim, T>* const reach = past.reach(index);
        const bool is_odd = !valid(past.box(index));
        any_odd |= is_odd;
        out.put(static_cast<std::uint32_t>(place) | world::saved::alive |
                (state.objects[index].was_enabled() ? world::saved::enabled : 0u) |
                (is_odd ? world::saved::odd : 0u) | (filter.is_static ? world::saved::is_static : 0u) |
                (reach != nullptr ? world::saved::has_reach : 0u) |
                (user_data.of(i) != 0 ? world::saved::has_data : 0u));
        if (const std::uint64_t data = user_data.of(i); data != 0) {
            out.put(data);
            any_more = true;
        }
        out.put(filter.category);
        out.put(filter.mask);
        out.put(filter.owner);
        out.put(past.box(index));
        if (reach == nullptr) continue;
        out.put(reach->box);
        for (const T by : reach->displacement)
            out.put(by);
        out.put(reach->margin);
    }
    out.put(std::uint64_t{free.size()});
    for (const world::IdTable::Free& each : free) {
        out.put(each.index);
        out.put(each.generation);
    }
    std::vector<typename world::State<Dim, T>::Active> active(state.active.begin(), state.active.end());
    std::uint32_t turn = world::first_turn;
    state.parked.each([&](world::Index index) {
        active.push_back({index, turn++});
        return true;
    });
    std::sort(active.begin(), active.end(), [](const auto& x, const auto& y) { return x.index < y.index; });
    out.put(std::uint64_t{active.size()});
    for (const auto& each : active) {
        out.put(raw(each.index));
        out.put(each.idle);
    }
    std::vector<std::uint64_t> refused(state.refused.begin(), state.refused.end());
    std::sort(refused.begin(), refused.end());
    out.put(std::uint64_t{refused.size()});
    for (const std::uint64_t key : refused)
        out.put(key);
    if (any_more || any_odd) {
        out.bytes[8] = static_cast<std::byte>(any_odd ? world::snapshot_version : 2);
        out.put(std::uint32_t{slots ? 1u : 0u});
        out.put(std::uint64_t{slots ? slots->end() : 0u});
        if (slots)
            for (const world::Key key : slots->keys())
                out.put(key);
    }

    out.set(24, out.bytes.size() - world::snapshot_header);
    out.set(world::checksum_at, world::checksum(out.bytes));
    return std::move(out.bytes);
}

template <int Dim, Coordinate T>
void World<Dim, T>::restore(std::span<const std::byte> snapshot)
{
    std::unique_ptr<Implementation> fresh; // the old one in the end, which outlives its `call`
    const InUse call(implementation_->in_use, "World");
    world::Reader::check_none(implementation_->readers);
    world::SnapshotReader in(snapshot);
    const std::uint32_t version = world::read_header<Dim, T>(in, snapshot);

    // From here on whoever made it knew the checksum. Still nothing is believed that could do harm.
    WorldOptions options = implementation_->state.options;
    options.margin = double{world::read_margin<T>(in)};
    if constexpr (sizeof(T) == 4)
        in.demand(in.get<std::uint32_t>() == 0, "a margin is negative or not finite");
    fresh = std::make_unique<Implementation>(options);
    world::State<Dim, T>& state = fresh->state;
    (void)in.get<std::uint64_t>(); // how much had changed of late, to the versions before 0.2
    const std::vector<std::uint32_t> generations = world::read_objects(in, state, fresh->user_data, version);
    state.ids.restore(generations, world::read_free_ids(in, generations));
    world::read_active(in, state, generations.size());
    world::read_refused(in, state, generations);
    bool has_slots = false;
    std::vector<world::Key> slots;
    if (version > 1) {
        const auto said = in.get<std::uint32_t>();
        in.demand(said <= 1, "it says neither that there are slots nor that there are none");
        has_slots = said == 1;
        slots = world::read_slots(in, generations);
        in.demand(has_slots || slots.empty(), "there are slots, and it says that there are none");
    }
    in.demand(in.at() == snapshot.size(), "more bytes follow its end");
    if (fresh->pair_slots && has_slots)
        in.demand(fresh->pair_slots->restore(slots), "a pair has two slots");
    else if (fresh->pair_slots)
        fresh->pair_slots->assign(world::all_pairs(state));
    fresh->recall_pairs();
    implementation_.swap(fresh);
}

template <int Dim, Coordinate T>
World<Dim, T> World<Dim, T>::fork() const
{
    World copy(implementation_->state.options);
    copy.restore(save());
    return copy;
}

#define JOSTLE_INSTANTIATE(Dim, T)                                                                           \
    template JOSTLE_API std::vector<std::byte> World<Dim, T>::save() const;                                  \
    template JOSTLE_API void World<Dim, T>::restore(std::span<const std::byte>);                             \
    template JOSTLE_API World<Dim, T> World<Dim, T>::fork() const;
JOSTLE_FOR_EACH_WORLD(JOSTLE_INSTANTIATE)

JOSTLE_NAMESPACE_END
