// SPDX-License-Identifier: MIT
#include "engine/sample.hpp"

#include <utility>

#include "base/instantiate.hpp"
#include "base/prefetch.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace engine {
namespace {

/// The number of boxes to sample: enough to know the densities, few enough to cost little of a frame.
constexpr std::size_t sample_size(std::size_t boxes)
{
    const std::size_t wanted = boxes / 64 + 64;
    return wanted < boxes ? (wanted < Sample::capacity ? wanted : Sample::capacity)
                          : (boxes < 128 ? boxes : 128);
}

/// Which boxes to sample: one from each of `samples` equal parts, picked by a hash, so that no regular
/// pattern in the user's array, such as every tenth box being big, is missed or counted too often.
void choose_sample(std::uint32_t* chosen, std::size_t samples, std::size_t boxes)
{
    if (samples == 0) return;
    const auto step = static_cast<std::uint32_t>(boxes / samples),
               rest = static_cast<std::uint32_t>(boxes % samples);
    std::uint32_t begin = 0, excess = 0; // of the `samples`-ths of a box
    for (std::size_t k = 0; k < samples; ++k) {
        std::uint32_t size = step;
        if ((excess += rest) >= samples) {
            excess -= static_cast<std::uint32_t>(samples);
            ++size;
        }
        const std::uint64_t hash = (k + 1) * 0x9e3779b97f4a7c15u;
        chosen[k] = begin + static_cast<std::uint32_t>((hash >> 32) * size >> 32);
        begin += size;
    }
}

} // namespace

template <int Dim, class T>
void sample_boxes(const Boxes<Dim, T>& boxes, Sample& sample)
{
    const std::size_t wanted = sample_size(boxes.size());
    const auto place = [&](std::uint32_t i) {
        const bool in_a = i < boxes.a.size();
        return std::pair(in_a ? &boxes.a : &boxes.b, in_a ? i : i - boxes.a.size());
    };
    std::uint32_t chosen[Sample::capacity];
    choose_sample(chosen, wanted, boxes.size());
    constexpr std::size_t ahead = 16; // boxes being fetched from memory
    sample.size = 0;
    for (std::size_t k = 0; k < wanted; ++k) {
        if (k + ahead < wanted) {
            const auto [set, at] = place(chosen[k + ahead]);
            prefetch(set->lo_pointer(0, at));
            prefetch(set->hi_pointer(Dim - 1, at));
        }
        const auto [view, at] = place(chosen[k]);
        const BoxView<Dim, T>& set = *view;
        bool valid = true;
        for (int d = 0; d < Dim; ++d) {
            valid &= set.lo(d, at) <= set.hi(d, at);
            sample.add(d, static_cast<double>(set.lo(d, at)), static_cast<double>(set.hi(d, at)));
        }
        sample.size += valid;
    }
}

template <int Dim, class T>
void sample_records(const Boxes<Dim, T>& boxes, const Record* records, std::uint32_t count, Sample& sample)
{
    const std::size_t wanted = sample_size(count);
    std::uint32_t chosen[Sample::capacity];
    choose_sample(chosen, wanted, count);
    for (sample.size = 0; sample.size < wanted; ++sample.size) {
        const Aabb<Dim, T> box = boxes[records[chosen[sample.size]].object & object_mask];
        for (int d = 0; d < Dim; ++d)
            sample.add(d, static_cast<double>(box.lo[d]), static_cast<double>(box.hi[d]));
    }
}

#define JOSTLE_INSTANTIATE(Dim, T)                                                                           \
    template void sample_boxes(const Boxes<Dim, T>&, Sample&);                                               \
    template void sample_records(const Boxes<Dim, T>&, const Record*, std::uint32_t, Sample&);
JOSTLE_FOR_EACH_SPACE(JOSTLE_INSTANTIATE)
#undef JOSTLE_INSTANTIATE

} // namespace engine
JOSTLE_NAMESPACE_END
