// SPDX-License-Identifier: MIT
// Too many pairs to store: they are counted as they are found, in bounded memory. Then a
// search that stops at the first pair.
#include <jostle/jostle.hpp>

#include <atomic>
#include <cstdint>
#include <cstdio>
#include <vector>

int main()
{
    // Two crowds of points in the same place: every point of one touches every point of the other.
    const std::vector<jostle::Aabb3f> crowd_a(2000, {{1, 2, 3}, {1, 2, 3}});
    const std::vector<jostle::Aabb3f> crowd_b(3000, {{1, 2, 3}, {1, 2, 3}});

    // The sink is called from several threads at a time, hence the atomics; a sum doesn't ask for an order.
    std::atomic<std::uint64_t> count{0}, checksum{0};
    const bool complete = jostle::PairFinder().stream(crowd_a, crowd_b, [&](const jostle::PairChunk& chunk) {
        count += chunk.pairs.size();
        checksum += jostle::pair_checksum(chunk.pairs);
        return true; // go on
    });
    std::printf("%llu pairs, checksum %016llx\n", static_cast<unsigned long long>(count),
                static_cast<unsigned long long>(checksum));

    const bool free_of_contact =
        jostle::PairFinder().stream(crowd_a, [](const jostle::PairChunk&) { return false; });
    std::printf("free of contact: %s\n", free_of_contact ? "yes" : "no");
    return complete && count == 6'000'000 && !free_of_contact ? 0 : 1;
}
