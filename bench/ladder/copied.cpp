// SPDX-License-Identifier: MIT
// Rungs 5 and 6: one size of cells, and boxes copied into every cell that they touch, so that none looks at
// a neighbouring cell; then larger cells, in which the copies are sorted along x and swept.
#include <algorithm>

#include "bench/ladder/cells.hpp"

namespace jostle_ladder {
namespace {

struct Copy
{
    jostle::Aabb3f box;
    std::uint32_t object;
    /// One bit for each axis on which the box begins in an earlier cell. The cell of the two greater lower
    /// corners is the only one in which two boxes that touch have no bit in common: it reports their pair.
    std::uint32_t flags;
    Cell cell;
};

/// The cell's edge in mean edges of the boxes.
constexpr float copied_edges = 2.5f, swept_edges = 5;

template <bool swept>
class Copied final : public FoundByProcessor
{
  public:
    void find(Boxes boxes, jostle::Executor& executor) override
    {
        objects_ = boxes.size();
        const auto buckets = std::max<std::uint32_t>(1, static_cast<std::uint32_t>(boxes.size()));
        const float size = mean_edge(boxes) * (swept ? swept_edges : copied_edges);
        cells_.sort(buckets, [&](auto use) {
            for (std::uint32_t i = 0; i < boxes.size(); ++i) {
                const Cell first = cell_of(boxes[i].lo, size);
                each_cell(first, cell_of(boxes[i].hi, size), [&](const Cell& cell) {
                    std::uint32_t flags = 0;
                    for (std::size_t d = 0; d < 3; ++d)
                        flags |= static_cast<std::uint32_t>(cell[d] > first[d]) << d;
                    use(bucket_of(cell, 0, buckets), Copy{boxes[i], i, flags, cell});
                });
            }
        });
        share(buckets, executor, [this](std::uint32_t begin, std::uint32_t end, Found& found) {
            for (std::uint32_t bucket = begin; bucket < end; ++bucket)
                search(bucket, found);
        });
    }
    [[nodiscard]] Counts counts() const override { return totals(cells_.bytes(), objects_); }

  private:
    static float mean_edge(Boxes boxes)
    {
        double sum = 0;
        for (const jostle::Aabb3f& box : boxes)
            for (int d = 0; d < 3; ++d)
                sum += box.hi[d] - box.lo[d];
        return sum > 0 ? static_cast<float>(sum / (3 * static_cast<double>(boxes.size()))) : 1;
    }
    void search(std::uint32_t bucket, Found& found)
    {
        const auto begin = cells_.records.begin() + cells_.begin[bucket];
        const auto end = cells_.records.begin() + cells_.begin[bucket + 1];
        if (begin == end) return;
        ++found.probes;
        if (swept)
            std::sort(begin, end, [](const Copy& a, const Copy& b) { return a.box.lo[0] < b.box.lo[0]; });
        for (auto a = begin; a != end; ++a)
            for (auto b = a + 1; b != end && !(swept && b->box.lo[0] > a->box.hi[0]); ++b) {
                if ((a->flags & b->flags) != 0 || a->cell != b->cell) continue;
                ++found.candidates;
                if (jostle::overlaps(a->box, b->box)) found.add(a->object, b->object);
            }
    }

    std::size_t objects_ = 0;
    Sorted<Copy> cells_;
};

} // namespace

std::unique_ptr<Rung> make_copied(std::uint32_t)
{
    return std::make_unique<Copied<false>>();
}
std::unique_ptr<Rung> make_swept(std::uint32_t)
{
    return std::make_unique<Copied<true>>();
}

} // namespace jostle_ladder
