// SPDX-License-Identifier: MIT
// A game server's tick: moving players, trigger zones, props; what each player sees, shots, and rollback.
// Usage: server [PLAYERS] [ZONES] [PROPS] [TICKS]
#include <jostle/jostle.hpp>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <vector>

namespace {

constexpr std::uint32_t player = 1, zone = 2, prop = 4;
constexpr float sight = 50, range = 300;

/// The state of a match outside its world.
struct Match
{
    std::vector<jostle::Vec3f> places, speeds; // by player
    std::mt19937 random{1};
};

float uniform(std::mt19937& random, float lo, float hi)
{
    return lo + (hi - lo) * static_cast<float>(random()) / 4294967296.0f;
}

jostle::Aabb3f around(const jostle::Vec3f& at, const jostle::Vec3f& half)
{
    return {at - half, at + half};
}

} // namespace

int main(int argc, char** argv)
{
    const auto number = [&](int i, std::size_t preset) {
        return argc > i ? std::strtoul(argv[i], nullptr, 10) : preset;
    };
    const std::size_t players = number(1, 20'000), zones = number(2, 300), props = number(3, 200'000);
    const std::size_t ticks = number(4, 100), shots = players / 40 + 1;
    if (players == 0 || ticks == 0) {
        std::fprintf(stderr, "server: PLAYERS and TICKS are numbers from 1 on\n");
        return 2;
    }
    const float side = 20 * std::sqrt(static_cast<float>(players));

    Match match;
    const auto place = [&] {
        return jostle::Vec3f{uniform(match.random, 0, side), uniform(match.random, 0, side),
                             uniform(match.random, 0, 10)};
    };
    const auto heading = [&](float speed) {
        const float angle = uniform(match.random, 0, 6.2831853f);
        return jostle::Vec3f{speed * std::cos(angle), speed * std::sin(angle), 0};
    };
    const jostle::Vec3f body{0.4f, 0.4f, 0.9f};
    std::vector<jostle::Aabb3f> bodies, rooms, things;
    for (std::size_t i = 0; i < players; ++i) {
        match.places.push_back(place());
        match.speeds.push_back(heading(1));
        bodies.push_back(around(match.places[i], body));
    }
    for (std::size_t i = 0; i < zones; ++i)
        rooms.push_back(around(place(), {15, 15, 15}));
    for (std::size_t i = 0; i < props; ++i)
        things.push_back(around(place(), {0.5f, 0.5f, 1}));

    // Players meet players, zones and props; zones and props rest, and meet players only.
    jostle::World3f world({.layers = {{.mask = player}}}); // for queries about players alone
    std::vector<jostle::ObjectId> ids(players), zone_ids(zones), prop_ids(props);
    world.add(bodies, ids, {.filter = {.category = player}}); // indices 0, 1, ...: the players' numbers
    world.add(rooms, zone_ids, {.filter = {.category = zone, .mask = player, .is_static = true}});
    world.add(things, prop_ids, {.filter = {.category = prop, .mask = player, .is_static = true}});
    const auto is_zone = [&](jostle::ObjectId id) {
        return id.index >= players && id.index < players + zones;
    };
    const auto team = [](std::uint32_t of) { return of % 2; };

    std::uint64_t hash = 0; // of all that clients are told
    std::size_t entered = 0, left = 0, seen = 0, hits = 0;
    const auto tell = [&](std::uint64_t what) { hash = (hash ^ what) * 0x9e3779b97f4a7c15u + 1; };
    jostle::ResultLists<jostle::ObjectId> in_sight;
    std::vector<jostle::Sphere3f> views;
    std::vector<jostle::Ray3f> rays(shots);
    std::vector<std::uint32_t> shooters(shots);
    std::vector<jostle::Hit<float, jostle::ObjectId>> first(shots);
    const auto tick = [&] {
        for (std::size_t i = match.random() % 20; i < players; i += 20) { // one in twenty moves
            for (int d = 0; d < 2; ++d)
                if (match.places[i][d] < 0 || match.places[i][d] > side) match.speeds[i][d] *= -1;
            match.places[i] += match.speeds[i];
            world.move(ids[i], around(match.places[i], body));
        }
        world.update();

        // Players that entered and left zones; bumps of players and props are in the same lists.
        for (const jostle::ObjectPair& pair : world.began())
            if (is_zone(pair.b)) ++entered, tell(std::uint64_t{pair.a.index} << 32 | pair.b.index);
        for (const jostle::EndedPair& pair : world.ended())
            if (is_zone(pair.b)) ++left, tell(std::uint64_t{pair.b.index} << 32 | pair.a.index);

        // The players that each player sees: all queries at once.
        views.clear();
        for (const jostle::Vec3f& at : match.places)
            views.push_back({at, sight});
        world.all(std::span<const jostle::Sphere3f>(views), in_sight, {.mask = player});
        seen += in_sight.items().size();
        tell(in_sight.items().size());

        // Shots go through zones and the shooter's own team.
        for (std::size_t i = 0; i < shots; ++i) {
            shooters[i] = static_cast<std::uint32_t>(match.random() % players);
            rays[i] = {match.places[shooters[i]], heading(range), 1};
        }
        const auto can_hit = [&](std::uint32_t shot, jostle::ObjectId id) {
            return id.index >= players || team(id.index) != team(shooters[shot]);
        };
        world.first(rays, first, {.mask = player | prop, .accept = can_hit});
        for (const jostle::Hit<float, jostle::ObjectId>& hit : first)
            if (hit.id != jostle::ObjectId{}) ++hits, tell(hit.id.index);
    };

    world.update();
    for (std::size_t i = 0; i < ticks; ++i)
        tick();
    std::printf(
        "%zu players, %zu ticks: %zu came into zones, %zu left, %.1f seen by each, %.0f%% of shots hit\n",
        players, ticks, entered, left, static_cast<double>(seen) / static_cast<double>(players * ticks),
        100 * static_cast<double>(hits) / static_cast<double>(shots * ticks));

    // An input arrives late: go back to its tick, and replay. Without the input, the result is the same.
    const std::vector<std::byte> snapshot = world.save();
    const Match saved = match;
    const std::uint64_t told = hash;
    for (int i = 0; i < 8; ++i)
        tick();
    const std::uint64_t once = hash;
    world.restore(snapshot);
    match = saved;
    hash = told;
    for (int i = 0; i < 8; ++i)
        tick();
    std::printf("8 ticks taken back and played again: %s\n", hash == once ? "the same" : "different");
    return hash == once && hits > 0 && seen > 0 ? 0 : 1;
}
