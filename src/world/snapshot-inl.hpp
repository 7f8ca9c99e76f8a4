// SPDX-License-Identifier: MIT
#pragma once

// Snapshots: what a world is, without what it is made of. The index is built anew; answers don't show it.
//
// A header of 48 bytes: the letters "jostlewd", then version, dimensions, bytes of a coordinate and 0 as
// 32-bit numbers, then the size of what follows the header and the checksum of both (its own place counted as
// 0) as 64-bit ones, and 0 as 64 bits. All numbers little-endian, coordinates as IEEE 754.
#include <algorithm>
#include <cstring>
#include <type_traits>

#include "world/state.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace world {

constexpr char snapshot_name[8] = {'j', 'o', 's', 't', 'l', 'e', 'w', 'd'};
constexpr std::uint32_t snapshot_version = 1;
constexpr std::size_t snapshot_header = 48, checksum_at = 32;

/// Words of 8 bytes, the last filled up with zeros. Each step is a bijection of the sum so far, so a change
/// within one word always shows.
inline std::uint64_t checksum(std::span<const std::byte> bytes) noexcept
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
    flag::place | flag::alive | flag::enabled | flag::is_static | flag::has_shape;

} // namespace world

template <int Dim, Coordinate T>
std::vector<std::byte> World<Dim, T>::save() const
{
    const Implementation& me = *implementation_;
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
        return index < me.objects.capacity() && me.objects[index].has(world::flag::alive);
    };
    const auto [generations, free] = me.ids.picture(is_alive);
    out.put(me.margin);
    if constexpr (sizeof(T) == 4) out.put(std::uint32_t{0});
    out.put(me.recent_work);
    out.put(std::uint64_t{generations.size()});
    for (std::uint32_t i = 0; i < generations.size(); ++i) {
        out.put(generations[i]);
        if (generations[i] == 0) continue;
        const auto object = me.objects[i];
        out.put(std::uint32_t{object.state()} & world::saved_flags);
        out.put(object.numbers().category);
        out.put(object.numbers().mask);
        out.put(object.numbers().owner);
        out.put(object.now());
        if (!object.has(world::flag::has_shape)) continue;
        const auto& shape = me.shapes[i];
        out.put(shape.box);
        for (const T by : shape.displacement)
            out.put(by);
        out.put(shape.margin);
    }
    out.put(std::uint64_t{free.size()});
    for (const world::IdTable::Free& each : free) {
        out.put(each.index);
        out.put(each.generation);
    }
    out.put(std::uint64_t{me.active.size()});
    for (const auto& each : me.active) {
        out.put(each.index);
        out.put(each.idle);
    }
    std::vector<std::uint64_t> refused(me.refused.begin(), me.refused.end());
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
    world::SnapshotReader in(snapshot);
    if (snapshot.size() < world::snapshot_header)
        in.refuse(std::to_string(snapshot.size()) + " bytes; even the header takes " +
                  std::to_string(world::snapshot_header));
    if (std::memcmp(snapshot.data(), world::snapshot_name, sizeof world::snapshot_name) != 0)
        in.refuse("doesn't begin like one; it is something else, or damaged");
    (void)in.get<std::uint64_t>();
    const auto version = in.get<std::uint32_t>(), dim = in.get<std::uint32_t>(),
               coordinate = in.get<std::uint32_t>(), reserved = in.get<std::uint32_t>();
    const auto length = in.get<std::uint64_t>(), sum = in.get<std::uint64_t>();
    const auto reserved_too = in.get<std::uint64_t>();
    if (version != world::snapshot_version)
        in.refuse("version " + std::to_string(version) + "; this library reads version " +
                  std::to_string(world::snapshot_version));
    if (dim != Dim || coordinate != sizeof(T))
        in.refuse("of a world of " + std::to_string(dim) + " dimensions with coordinates of " +
                  std::to_string(coordinate) + " bytes; this one has " + std::to_string(Dim) + " and " +
                  std::to_string(sizeof(T)));
    if (length != snapshot.size() - world::snapshot_header)
        in.refuse(std::to_string(snapshot.size()) + " bytes, but " +
                  std::to_string(length + world::snapshot_header) + " were saved");
    std::vector<std::byte> unsealed(snapshot.begin(), snapshot.end());
    std::fill_n(unsealed.begin() + world::checksum_at, 8, std::byte{0});
    if (world::checksum(unsealed) != sum || reserved != 0 || reserved_too != 0)
        in.refuse("the checksum says that it was altered");

    // From here on whoever made it knew the checksum. Still nothing is believed that could do harm.
    WorldOptions options = implementation_->options;
    const T margin = in.get<T>();
    if constexpr (sizeof(T) == 4) in.demand(in.get<std::uint32_t>() == 0, "a wrong margin");
    in.demand(margin >= 0 && margin <= std::numeric_limits<T>::max(), "a wrong margin");
    options.margin = double{margin};
    fresh = std::make_unique<Implementation>(options);
    Implementation& me = *fresh;
    me.recent_work = in.get<std::uint64_t>();

    const std::uint64_t end = in.get_count(4);
    in.demand(end <= std::numeric_limits<std::uint32_t>::max(), "too many objects");
    me.objects.grow(end);
    me.class_of.resize(me.objects.capacity());
    me.rested_at.resize(me.objects.capacity());
    std::vector<std::uint32_t> generations(end), resting;
    std::vector<Box> resting_boxes;
    std::size_t active = 0;
    for (std::uint32_t i = 0; i < end; ++i) {
        generations[i] = in.get<std::uint32_t>();
        if (generations[i] == 0) continue;
        const auto object = me.objects[i];
        const auto state = in.get<std::uint32_t>();
        object.set_state(state & world::saved_flags);
        in.demand((state & ~world::saved_flags) == 0 && object.has(world::flag::alive) &&
                      object.place() != world::Place::none &&
                      object.has(world::flag::enabled) == (object.place() != world::Place::disabled),
                  "an object in no proper state");
        object.numbers().category = in.get<std::uint32_t>();
        object.numbers().mask = in.get<std::uint32_t>();
        object.numbers().owner = in.get<std::uint32_t>();
        object.now() = in.template get_box<Dim, T>();
        me.class_of[i] = me.filter_classes.of(object.filter());
        ++me.alive;
        me.disabled += object.place() == world::Place::disabled;
        active += object.place() == world::Place::active;
        if (object.place() == world::Place::resting) {
            resting.push_back(i);
            resting_boxes.push_back(object.now());
        }
        if (!object.has(world::flag::has_shape)) continue;
        me.shapes.grow(std::size_t{i} + 1);
        auto& shape = me.shapes[i];
        shape.box = in.template get_box<Dim, T>();
        for (T& by : shape.displacement)
            by = in.get<T>();
        shape.margin = in.get<T>();
        in.demand(world::same(shape.bounds(), object.now()), "bounds that don't fit their box");
    }
    std::vector<world::IdTable::Free> free(in.get_count(8));
    std::vector<bool> is_free(end);
    for (world::IdTable::Free& each : free) {
        each.index = in.get<std::uint32_t>();
        each.generation = in.get<std::uint32_t>();
        in.demand(each.index < end && generations[each.index] == 0 && each.generation != 0 &&
                      !is_free[each.index],
                  "a free index that isn't");
        is_free[each.index] = true;
    }
    me.ids.restore(generations, free);
    const std::uint64_t active_count = in.get_count(8);
    in.demand(active_count == active, "a wrong list of active objects");
    for (std::uint64_t k = 0; k < active_count; ++k) {
        const auto index = in.get<std::uint32_t>(), idle = in.get<std::uint32_t>();
        in.demand(index < end && (me.active.empty() || me.active.back().index < index) &&
                      me.objects[index].place() == world::Place::active,
                  "a wrong list of active objects");
        me.active.push_back({index, idle});
    }
    const std::uint64_t refused = in.get_count(8);
    for (std::uint64_t k = 0; k < refused; ++k) {
        const auto key = in.get<std::uint64_t>();
        const std::uint64_t a = key >> 32, b = key & 0xffffffffu;
        in.demand(a < b && b < end && generations[a] != 0 && generations[b] != 0, "a refused pair of nobody");
        me.refused.insert(key);
    }
    in.demand(in.at() == snapshot.size(), "more than a snapshot holds");
    me.resting.build(resting, Boxes(std::span<const Box>(resting_boxes)));
    me.hoods.make_room(me.objects.capacity());
    me.recall_pairs();
    me.stats.objects = me.alive;
    me.stats.resting = resting.size();
    me.stats.active = active;
    me.stats.disabled = me.disabled;
    me.stats.refused = me.refused.size();
    me.stats.bytes_reserved = me.bytes();
    implementation_.swap(fresh);
}

template <int Dim, Coordinate T>
World<Dim, T> World<Dim, T>::fork() const
{
    World copy(implementation_->options);
    copy.restore(save());
    return copy;
}

JOSTLE_NAMESPACE_END
