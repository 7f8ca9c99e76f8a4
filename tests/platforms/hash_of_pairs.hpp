// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "jostle/find_pairs.hpp"
#include "tool/scenes/scenes.hpp"

namespace platforms_test {

/// What golden/table.txt has: names and hashes.
using Table = std::vector<std::pair<std::string, std::uint64_t>>;

/// FNV-1a over numbers, their lowest byte first.
class Hash
{
  public:
    template <class... Numbers>
    void add(Numbers... numbers)
    {
        (add_one(static_cast<std::uint64_t>(numbers)), ...);
    }
    [[nodiscard]] std::uint64_t value() const { return value_; }

  private:
    void add_one(std::uint64_t number)
    {
        for (int byte = 0; byte < 8; ++byte)
            value_ = (value_ ^ (number >> 8 * byte & 0xff)) * 0x100000001b3u;
    }
    std::uint64_t value_ = 0xcbf29ce484222325u;
};

template <int Dim, class T>
std::uint64_t hash_of_pairs(std::string_view scene_name, jostle::PairFinder& finder)
{
    Hash hash;
    jostle_scenes::Scene<Dim, T> scene(scene_name, 1'000);
    for (int frame = 0; frame < 2; ++frame, scene.step()) {
        const jostle::PairBuffer& pairs = finder.find(scene.boxes());
        hash.add(pairs.size());
        for (const jostle::Pair& pair : pairs)
            hash.add(pair.a, pair.b);
    }
    return hash.value();
}

inline void add_pairs(Table& table, std::string_view scene, jostle::PairFinder& finder)
{
    table.emplace_back("pairs_3f_" + std::string(scene), hash_of_pairs<3, float>(scene, finder));
    table.emplace_back("pairs_2d_" + std::string(scene), hash_of_pairs<2, double>(scene, finder));
}

} // namespace platforms_test
