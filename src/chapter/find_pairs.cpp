// SPDX-License-Identifier: MIT
// The chapter's grid with nothing to choose.
#include <cmath>
#include <string>

#include "base/instantiate.hpp"
#include "jostle/chapter.hpp"
#include "jostle/find_pairs.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace chapter {

namespace {

// How far most of the boxes spread on the axis where they spread most: between the 5% and the 95% quantile of
// a sample, so that a few that are far away don't count. 0 if they don't spread or can't be measured.
template <int Dim, Coordinate T>
T typical_spread(const BoxView<Dim, T>& boxes)
{
    constexpr std::size_t sample_size = 4096;
    const std::size_t step = boxes.size() / sample_size + 1;
    T spread = 0;
    std::vector<T> sample;
    for (int d = 0; d < Dim; ++d) {
        sample.clear();
        for (std::size_t i = 0; i < boxes.size(); i += step)
            if (std::isfinite(boxes.lo(d, i))) sample.push_back(boxes.lo(d, i));
        if (sample.empty()) continue;
        std::sort(sample.begin(), sample.end());
        const std::size_t tail = sample.size() / 20;
        spread = std::max(spread, sample[sample.size() - 1 - tail] - sample[tail]);
    }
    return std::isfinite(spread) ? spread : 0;
}

} // namespace

template <int Dim, Coordinate T>
std::vector<T> choose_cell_sizes(const BoxView<Dim, T>& boxes)
{
    // Level e has cells of 2^e and takes the boxes of size 2^(e-1) up to but not including 2^e.
    constexpr int lowest = std::numeric_limits<T>::min_exponent;
    constexpr int highest = std::numeric_limits<T>::max_exponent - 1; // 2^max_exponent is infinite
    std::array<bool, highest - lowest + 1> wanted{};

    // Points, and boxes tiny beside the scene, need no cells as small as they are: a million cells side by
    // side keep them apart, and the fewer levels there are the better.
    constexpr int finest = 20;
    const T spread = typical_spread(boxes);
    int floor_exponent = lowest;
    if (spread > 0) floor_exponent = std::clamp(std::ilogb(spread) - finest, lowest, highest);

    bool points = false;
    for (std::size_t i = 0; i < boxes.size(); ++i) {
        T size = 0;
        for (int d = 0; d < Dim; ++d)
            if (boxes.lo(d, i) != boxes.hi(d, i)) size = std::max(size, boxes.hi(d, i) - boxes.lo(d, i));
        if (size == 0) {
            points = true;
            continue;
        }
        if (!std::isfinite(size)) continue; // goes to the grid's list of large objects
        int exponent;
        std::frexp(size, &exponent);
        exponent = std::max({exponent, floor_exponent, lowest});
        if (exponent <= highest) wanted[static_cast<std::size_t>(exponent - lowest)] = true;
    }
    const bool none_wanted = std::find(wanted.begin(), wanted.end(), true) == wanted.end();
    if ((points && spread > 0) || none_wanted)
        wanted[static_cast<std::size_t>((spread > 0 ? floor_exponent : 0) - lowest)] = true;

    std::vector<T> cell_sizes;
    for (int exponent = lowest; exponent <= highest; ++exponent)
        if (wanted[static_cast<std::size_t>(exponent - lowest)])
            cell_sizes.push_back(std::ldexp(T{1}, exponent));
    return cell_sizes;
}

template <int Dim, Coordinate T>
std::vector<Pair> find_pairs(const BoxView<Dim, T>& boxes, Executor& executor)
{
    if (boxes.size() >= std::numeric_limits<std::uint32_t>::max())
        throw Error(ErrorCode::too_many_objects,
                    std::to_string(boxes.size()) + " boxes; split them into sets of fewer than 4294967295");
    check_boxes(boxes);

    GridOptions<T> options;
    options.cell_sizes = choose_cell_sizes(boxes);
    // Twice as many buckets as objects: most cells that are probed in vain find an empty bucket.
    const std::uint64_t buckets = std::max<std::uint64_t>(16, 2 * std::uint64_t{boxes.size()});
    options.buckets = static_cast<std::uint32_t>(std::min<std::uint64_t>(buckets, std::uint64_t{1} << 31));
    Grid<Dim, T> grid(std::move(options));
    for (std::size_t i = 0; i < boxes.size(); ++i)
        grid.add(boxes[i]);
    const std::span<const Pair> pairs = grid.detect_proximity(executor);
    return {pairs.begin(), pairs.end()};
}

#define JOSTLE_INSTANTIATE(Dim, T)                                                                           \
    template JOSTLE_API std::vector<T> choose_cell_sizes(const BoxView<Dim, T>&);                            \
    template JOSTLE_API std::vector<Pair> find_pairs(const BoxView<Dim, T>&, Executor&);
JOSTLE_FOR_EACH_SPACE(JOSTLE_INSTANTIATE)
#undef JOSTLE_INSTANTIATE

} // namespace chapter
JOSTLE_NAMESPACE_END
