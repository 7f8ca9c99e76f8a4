// SPDX-License-Identifier: MIT
// Rung 4: the corrected grid of the chapter, its cells sorted by counting: a bucket is a piece of an array in
// place of a linked list.
#include <algorithm>

#include "bench/ladder/cells.hpp"

namespace jostle_ladder {
namespace {

struct Record
{
    jostle::Aabb3f box;
    Cell cell;
    std::uint32_t level, object;
};

class Counted final : public FoundByProcessor
{
  public:
    void find(Boxes boxes, jostle::Executor& executor) override
    {
        sizes_ = level_sizes(boxes);
        buckets_ = std::max<std::uint32_t>(1, static_cast<std::uint32_t>(boxes.size()));
        occupied_.assign(sizes_.size(), false);
        cells_.sort(buckets_, [&](auto use) {
            for (std::uint32_t i = 0; i < boxes.size(); ++i) {
                const std::uint32_t level = level_of(boxes[i], sizes_);
                const Cell cell = cell_of(boxes[i].lo, sizes_[level]);
                occupied_[level] = true;
                use(bucket_of(cell, level, buckets_), Record{boxes[i], cell, level, i});
            }
        });
        share(static_cast<std::uint32_t>(boxes.size()), executor,
              [this](std::uint32_t begin, std::uint32_t end, Found& found) {
                  for (std::uint32_t i = begin; i < end; ++i)
                      search(i, found);
              });
    }
    [[nodiscard]] Counts counts() const override { return totals(cells_.bytes(), cells_.records.size()); }

  private:
    /// Alg. 10, corrected: on its own level what lies ahead of the object, on coarser levels whatever may
    /// touch it.
    void search(std::uint32_t i, Found& found) const
    {
        const Record& obj = cells_.records[i];
        for (std::uint32_t level = obj.level; level < sizes_.size(); ++level) {
            if (!occupied_[level]) continue;
            const bool own = level == obj.level;
            const Cell at = cell_of(obj.box.lo, sizes_[level]), last = cell_of(obj.box.hi, sizes_[level]);
            each_cell({at[0] - 1, at[1] - 1, at[2] - 1}, last, [&](const Cell& cell) {
                if (own && std::lexicographical_compare(cell.rbegin(), cell.rend(), at.rbegin(), at.rend()))
                    return;
                ++found.probes;
                const std::uint32_t bucket = bucket_of(cell, level, buckets_);
                for (std::uint32_t k = cells_.begin[bucket]; k < cells_.begin[bucket + 1]; ++k) {
                    const Record& other = cells_.records[k];
                    if (other.level != level || other.cell != cell || (own && cell == at && k <= i)) continue;
                    ++found.candidates;
                    if (jostle::overlaps(obj.box, other.box)) found.add(obj.object, other.object);
                }
            });
        }
    }

    std::vector<float> sizes_;
    std::uint32_t buckets_ = 1;
    std::vector<bool> occupied_;
    Sorted<Record> cells_;
};

} // namespace

std::unique_ptr<Rung> make_counted(std::uint32_t)
{
    return std::make_unique<Counted>();
}

} // namespace jostle_ladder
