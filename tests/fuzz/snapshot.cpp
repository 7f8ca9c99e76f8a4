// SPDX-License-Identifier: MIT
// Snapshots and changes, with sizes and checksums that are right: as a world saves them, with bytes
// altered, cut out and doubled, and any bytes. What is taken is a world like any other; what is refused
// changes nothing.
#include <algorithm>
#include <optional>

#include "jostle/world.hpp"
#include "target.hpp"
#include "world/saved/snapshot_bytes.hpp"

namespace {

using Bytes = std::vector<std::byte>;
using jostle::ObjectId;

void write(Bytes& bytes, std::size_t at, std::uint64_t number, std::size_t size = 8)
{
    for (std::size_t k = 0; k < size && at + k < bytes.size(); ++k)
        bytes[at + k] = static_cast<std::byte>(number >> (8 * k));
}

void seal(Bytes& bytes)
{
    using namespace jostle::world;
    bytes.resize(std::max(bytes.size(), snapshot_header));
    write(bytes, size_at, bytes.size() - snapshot_header);
    write(bytes, checksum_at, checksum(bytes));
}

/// Some lies.
void alter(fuzz::Input& in, Bytes& bytes)
{
    constexpr std::size_t first = 8; // behind the letters, without which there is no more to see
    for (std::uint32_t k = 1 + in.below(4); k > 0; --k) {
        // Objects take most of the bytes; the lists of free ids and of who moves lie at the end.
        const std::size_t most = bytes.size() - first,
                          span = in.below(2) == 0 ? most : std::min<std::size_t>(most, 120);
        const std::size_t at = bytes.size() - 1 - in.below(static_cast<std::uint32_t>(span));
        const std::size_t count = std::min<std::size_t>(1 + in.below(64), bytes.size() - at);
        const auto begin = bytes.begin() + static_cast<std::ptrdiff_t>(at);
        static const std::uint64_t numbers[] = {
            0, 1, 2, 0x7fffffff, 0xffffffff, 0x100000000, ~std::uint64_t{0}};
        switch (in.below(7)) {
        case 0:
            bytes[at] = std::byte{in.number<std::uint8_t>()};
            break;
        case 1:
            bytes[at] ^= static_cast<std::byte>(1u << in.below(8));
            break;
        case 2:
            write(bytes, at / 4 * 4, numbers[in.below(std::size(numbers))], in.below(2) == 0 ? 4 : 8);
            break;
        case 3:
            write(bytes, at / 4 * 4, in.below(100), in.below(2) == 0 ? 4 : 8);
            break;
        case 4:
            bytes.erase(begin, begin + static_cast<std::ptrdiff_t>(count));
            break;
        case 5: {
            const Bytes twice(begin, begin + static_cast<std::ptrdiff_t>(count));
            bytes.insert(begin, twice.begin(), twice.end());
            break;
        }
        default:
            bytes.resize(at);
        }
        bytes.resize(std::max(bytes.size(), first + 1));
    }
}

template <int Dim, class T>
class Scene
{
  public:
    using World = jostle::World<Dim, T>;
    jostle::WorldOptions options;

    explicit Scene(fuzz::Input& in) : in_(in)
    {
        options.executor = &jostle::serial_executor();
        if (in.below(4) == 0) options.margin = 0.25;
    }

    /// Some commands, and updates between them.
    void live(World& world)
    {
        for (std::uint32_t k = in_.below(24); k > 0; --k) {
            const ObjectId id =
                ids_.empty() ? ObjectId{} : ids_[in_.below(static_cast<std::uint32_t>(ids_.size()))];
            switch (ids_.empty() ? 0 : in_.below(10)) {
            case 0:
            case 1:
            case 2: {
                jostle::ObjectOptions<T> with;
                with.filter = filter();
                with.enabled = in_.below(8) != 7;
                with.user_data = in_.below(3);
                ids_.push_back(world.add(box(), with));
                break;
            }
            case 3:
                world.remove(id);
                std::erase(ids_, id);
                break;
            case 4:
                world.set_filter(id, filter());
                break;
            case 5:
                world.set_enabled(id, in_.below(2) == 0);
                break;
            case 6:
                world.set_user_data(id, in_.number<std::uint8_t>());
                break;
            case 7:
                world.move(id, box());
                break;
            default:
                world.update();
            }
        }
        world.update();
    }

    /// The two are worlds alike, and stay so.
    void compare(World& a, World& b)
    {
        const Bytes saved = a.save();
        fuzz::demand(b.save() == saved, "a world saves other bytes than it was restored from");
        fuzz::demand(a.pairs().to_vector() == b.pairs().to_vector(), "a restored world has other pairs");
        if (a.stats().refused == 0)
            fuzz::demand(a.pairs().to_vector() == pairs_by_definition(a),
                         "other pairs than its objects have");
        for (std::uint32_t i = 0; i < a.index_end(); ++i)
            if (const ObjectId id = a.id(i); id != ObjectId{})
                fuzz::demand(b.id(i) == id && a.user_data(id) == b.user_data(id), "other user data");
        fuzz::count_boxes(2 * a.size());
        const auto given = in_.template box<Dim, T>();
        const bool goes = a.size() != 0 && in_.below(2) == 0;
        for (World* world : {&a, &b}) {
            if (goes) {
                std::uint32_t i = 0;
                while (world->id(i) == ObjectId{})
                    ++i;
                world->remove(world->id(i));
            }
            (void)world->add(given);
            world->update();
        }
        fuzz::demand(std::equal(a.began().begin(), a.began().end(), b.began().begin(), b.began().end()) &&
                         std::equal(a.ended().begin(), a.ended().end(), b.ended().begin(), b.ended().end()),
                     "other pairs begin or end after restoring");
        fuzz::demand(a.save() == b.save(), "another world one update after restoring");
    }

  private:
    jostle::Aabb<Dim, T> box() { return in_.template box<Dim, T>(); }
    jostle::ObjectFilter filter()
    {
        jostle::ObjectFilter filter;
        if (in_.below(3) != 0) return filter;
        filter.category = 1u << in_.below(3);
        filter.mask = in_.below(8);
        filter.owner = in_.below(4);
        filter.is_static = in_.below(2) == 0;
        return filter;
    }
    static std::vector<jostle::Pair> pairs_by_definition(const World& world)
    {
        std::vector<jostle::Pair> pairs;
        const auto there = [&](std::uint32_t i) {
            return world.id(i) != ObjectId{} && world.enabled(world.id(i));
        };
        for (std::uint32_t i = 0; i < world.index_end(); ++i)
            for (std::uint32_t j = i + 1; there(i) && j < world.index_end(); ++j) {
                if (!there(j)) continue;
                const auto a = world.bounds(world.id(i)), b = world.bounds(world.id(j));
                const jostle::ObjectFilter f = world.filter(world.id(i)), g = world.filter(world.id(j));
                bool touch = (f.category & g.mask) != 0 && (g.category & f.mask) != 0 &&
                             (f.owner != g.owner || f.owner == jostle::Filter::no_owner) &&
                             !(f.is_static && g.is_static);
                for (int d = 0; d < Dim; ++d)
                    touch = touch && a.lo[d] <= b.hi[d] && b.lo[d] <= a.hi[d];
                if (touch) pairs.push_back({i, j});
            }
        return pairs;
    }

    fuzz::Input& in_;
    std::vector<ObjectId> ids_;
};

} // namespace

JOSTLE_FUZZ_TARGET(snapshot)
{
    const std::uint32_t form = in.below(8);
    fuzz::with_kind(in, [&]<int Dim, class T>() {
        Scene<Dim, T> scene(in);
        using World = jostle::World<Dim, T>;
        World world(scene.options), other(scene.options), third(scene.options);
        const bool changes = form % 2 == 1, raw = form == 6 || form == 7;
        bool honest = !raw;
        scene.live(world);
        const Bytes base = world.save_base();
        Bytes bytes = base;
        if (changes) {
            scene.live(world);
            world.save_changes(bytes);
        }
        if (raw) {
            const std::vector<std::uint8_t> rest = in.rest();
            bytes.resize(jostle::world::snapshot_header);
            for (const std::uint8_t byte : rest)
                bytes.push_back(std::byte{byte});
        } else if (in.below(4) != 0) {
            honest = false;
            alter(in, bytes);
        }
        if (!honest) seal(bytes);
        other.restore(base);
        (void)other.save_base();
        const Bytes before = other.save();
        try {
            changes ? other.restore_changes(bytes) : other.restore(bytes);
        } catch (const jostle::Error& error) {
            fuzz::demand(error.code() == jostle::ErrorCode::bad_snapshot, "a refusal of another kind");
            if (honest) fuzz::fail(std::string("a snapshot without a lie is refused: ") + error.what());
            fuzz::demand(other.save() == before, "a refused snapshot changed the world");
            if (in.below(4) == 3) scene.compare(other, *std::make_unique<World>(other.fork()));
            return;
        }
        if (honest) fuzz::demand(other.save() == world.save(), "another world than was saved");
        third.restore(other.save());
        scene.compare(other, third);
    });
}
