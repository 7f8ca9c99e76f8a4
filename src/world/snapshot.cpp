// SPDX-License-Identifier: MIT
// Snapshots: what a world is, without what it is made of. The index is built anew; answers don't show it.
//
// A header of 48 bytes: the letters "jostlewd", then version, dimensions, bytes of a coordinate and 0 as
// 32-bit numbers, then the size of what follows the header and the checksum of both (its own place counted as
// 0) as 64-bit ones, and 0 as 64 bits. All numbers little-endian, coordinates as IEEE 754.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <type_traits>

#include "index/box_index_access.hpp"
#include "world/implementation.hpp"
#include "world/instantiate.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace world {
namespace {

constexpr char snapshot_name[8] = {'j', 'o', 's', 't', 'l', 'e', 'w', 'd'};
constexpr std::uint32_t snapshot_version = 1;
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
        demand(bytes_.size() - at_ >= sizeof(Bits), "cut short");
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
        demand(count <= (bytes_.size() - at_) / size, "a list longer than the snapshot");
        return count;
    }
    template <int Dim, class T>
    Aabb<Dim, T> get_box()
    {
        Aabb<Dim, T> box;
        for (int d = 0; d < Dim; ++d) {
            box.lo[d] = get<T>();
            box.hi[d] = get<T>();
            demand(box.lo[d] <= box.hi[d], "a box that is none");
        }
        return box;
    }
    [[nodiscard]] std::size_t at() const noexcept { return at_; }

  private:
    std::span<const std::byte> bytes_;
    std::size_t at_ = 0;
};

constexpr std::uint32_t saved_flags =
    flag::place | flag::alive | flag::enabled | flag::is_static | flag::has_reach;

/// Checks all but what follows the header.
template <int Dim, class T>
void read_header(SnapshotReader& in, std::span<const std::byte> snapshot)
{
    if (snapshot.size() < snapshot_header)
        in.refuse(std::to_string(snapshot.size()) + " bytes; even the header takes " +
                  std::to_string(snapshot_header));
    if (std::memcmp(snapshot.data(), snapshot_name, sizeof snapshot_name) != 0)
        in.refuse("doesn't begin like one; it is something else, or damaged");
    (void)in.get<std::uint64_t>();
    const auto version = in.get<std::uint32_t>(), dim = in.get<std::uint32_t>(),
               coordinate = in.get<std::uint32_t>(), reserved = in.get<std::uint32_t>();
    const auto length = in.get<std::uint64_t>(), sum = in.get<std::uint64_t>();
    const auto reserved_too = in.get<std::uint64_t>();
    if (version != snapshot_version)
        in.refuse("version " + std::to_string(version) + "; this library reads version " +
                  std::to_string(snapshot_version));
    if (dim != Dim || coordinate != sizeof(T))
        in.refuse("of a world of " + std::to_string(dim) + " dimensions with coordinates of " +
                  std::to_string(coordinate) + " bytes; this one has " + std::to_string(Dim) + " and " +
                  std::to_string(sizeof(T)));
    if (length != snapshot.size() - snapshot_header)
        in.refuse(std::to_string(snapshot.size()) + " bytes, but " +
                  std::to_string(length + snapshot_header) + " were saved");
    std::vector<std::byte> unsealed(snapshot.begin(), snapshot.end());
    std::fill_n(unsealed.begin() + checksum_at, 8, std::byte{0});
    if (checksum(unsealed) != sum || reserved != 0 || reserved_too != 0)
        in.refuse("the checksum says that it was altered");
}

template <class T>
T read_margin(SnapshotReader& in)
{
    const T margin = in.get<T>();
    in.demand(margin >= 0 && margin <= std::numeric_limits<T>::max(), "a wrong margin");
    return margin;
}

template <int Dim, class T>
void read_object(SnapshotReader& in, State<Dim, T>& state, Index index)
{
    const auto object = state.objects[index];
    const auto flags = in.get<std::uint32_t>();
    object.set_state(flags & saved_flags);
    in.demand((flags & ~saved_flags) == 0 && object.has(flag::alive) && object.place() != Place::none &&
                  object.has(flag::enabled) == (object.place() != Place::disabled),
              "an object in no proper state");
    object.numbers().category = in.get<std::uint32_t>();
    object.numbers().mask = in.get<std::uint32_t>();
    object.numbers().owner = in.get<std::uint32_t>();
    object.now() = in.template get_box<Dim, T>();
    state.classes[index] = state.classes.of(object.filter());
    if (!object.has(flag::has_reach)) return;
    state.objects.make_room_for_reach(index);
    Reach<Dim, T>& reach = state.objects.reach(index);
    reach.box = in.template get_box<Dim, T>();
    for (T& by : reach.displacement) {
        by = in.get<T>();
        in.demand(!std::isnan(by), "a displacement that is no number");
    }
    reach.margin = read_margin<T>(in);
    in.demand(same(reach.bounds(), object.now()), "bounds that don't fit their box");
}

/// Returns the generations of all indices.
template <int Dim, class T>
std::vector<std::uint32_t> read_objects(SnapshotReader& in, State<Dim, T>& state)
{
    const std::uint64_t end = in.get_count(4);
    in.demand(end <= std::numeric_limits<std::uint32_t>::max(), "too many objects");
    state.make_room(end);
    std::vector<std::uint32_t> generations(end), resting;
    std::vector<Aabb<Dim, T>> resting_boxes;
    for (std::uint32_t i = 0; i < end; ++i) {
        generations[i] = in.get<std::uint32_t>();
        if (generations[i] == 0) continue;
        read_object(in, state, Index{i});
        const auto object = state.objects[Index{i}];
        ++state.alive;
        state.disabled += object.place() == Place::disabled;
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
                  "a free index that isn't");
        is_free[each.index] = true;
    }
    return free;
}

template <int Dim, class T>
void read_active(SnapshotReader& in, State<Dim, T>& state, std::size_t end)
{
    const std::uint64_t count = in.get_count(8);
    in.demand(count == state.alive - state.disabled - state.resting.size(), "a wrong list of active objects");
    for (std::uint64_t k = 0; k < count; ++k) {
        const auto index = in.get<std::uint32_t>(), idle = in.get<std::uint32_t>();
        in.demand(index < end && (state.active.empty() || raw(state.active.back().index) < index) &&
                      state.objects[Index{index}].place() == Place::active,
                  "a wrong list of active objects");
        state.active.push_back({Index{index}, idle});
    }
}

template <int Dim, class T>
void read_refused(SnapshotReader& in, State<Dim, T>& state, std::span<const std::uint32_t> generations)
{
    const std::uint64_t count = in.get_count(8);
    for (std::uint64_t k = 0; k < count; ++k) {
        const auto key = in.get<std::uint64_t>();
        const std::uint64_t a = key >> 32, b = key & 0xffffffffu;
        in.demand(a < b && b < generations.size() && generations[a] != 0 && generations[b] != 0,
                  "a refused pair of nobody");
        state.refused.insert(key);
    }
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
    out.put(world::snapshot_version);
    out.put(static_cast<std::uint32_t>(Dim));
    out.put(static_cast<std::uint32_t>(sizeof(T)));
    out.put(std::uint32_t{0});
    for (int k = 0; k < 3; ++k)
        out.put(std::uint64_t{0}); // size and checksum, for later

    const auto is_alive = [&](std::uint32_t index) {
        return index < state.objects.capacity() && state.objects[world::Index{index}].has(world::flag::alive);
    };
    const auto [generations, free] = state.ids.picture(is_alive);
    out.put(state.margin);
    if constexpr (sizeof(T) == 4) out.put(std::uint32_t{0});
    out.put(state.recent_work);
    out.put(std::uint64_t{generations.size()});
    for (std::uint32_t i = 0; i < generations.size(); ++i) {
        out.put(generations[i]);
        if (generations[i] == 0) continue;
        const auto object = state.objects[world::Index{i}];
        out.put(std::uint32_t{object.state()} & world::saved_flags);
        out.put(object.numbers().category);
        out.put(object.numbers().mask);
        out.put(object.numbers().owner);
        out.put(object.now());
        if (!object.has(world::flag::has_reach)) continue;
        const auto& reach = state.objects.reach(world::Index{i});
        out.put(reach.box);
        for (const T by : reach.displacement)
            out.put(by);
        out.put(reach.margin);
    }
    out.put(std::uint64_t{free.size()});
    for (const world::IdTable::Free& each : free) {
        out.put(each.index);
        out.put(each.generation);
    }
    out.put(std::uint64_t{state.active.size()});
    for (const auto& each : state.active) {
        out.put(raw(each.index));
        out.put(each.idle);
    }
    std::vector<std::uint64_t> refused(state.refused.begin(), state.refused.end());
    std::sort(refused.begin(), refused.end());
    out.put(std::uint64_t{refused.size()});
    for (const std::uint64_t key : refused)
        out.put(key);

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
    world::read_header<Dim, T>(in, snapshot);

    // From here on whoever made it knew the checksum. Still nothing is believed that could do harm.
    WorldOptions options = implementation_->state.options;
    options.margin = double{world::read_margin<T>(in)};
    if constexpr (sizeof(T) == 4) in.demand(in.get<std::uint32_t>() == 0, "a wrong margin");
    fresh = std::make_unique<Implementation>(options);
    world::State<Dim, T>& state = fresh->state;
    state.recent_work = in.get<std::uint64_t>();
    const std::vector<std::uint32_t> generations = world::read_objects(in, state);
    state.ids.restore(generations, world::read_free_ids(in, generations));
    world::read_active(in, state, generations.size());
    world::read_refused(in, state, generations);
    in.demand(in.at() == snapshot.size(), "more than a snapshot holds");
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
