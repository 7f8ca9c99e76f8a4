// SPDX-License-Identifier: MIT
#include "engine/scatter.hpp"

#include <algorithm>

JOSTLE_NAMESPACE_BEGIN
namespace engine {

template <int Dim, class T>
bool Scatter<Dim, T>::add_unit(std::uint32_t number)
{
    const std::uint32_t units_a = units_of(boxes_.a.size());
    const bool in_a = number < units_a;
    const BoxView<Dim, T>& set = in_a ? boxes_.a : boxes_.b;
    const std::uint32_t side = !in_a ? side_b : boxes_.cross ? side_a : 0;
    const std::size_t begin = std::size_t{in_a ? number : number - units_a} * unit_size;
    unit_.count = static_cast<std::uint32_t>(std::min<std::size_t>(unit_size, set.size() - begin));
    kernels_.load<Dim, T>()(set, begin, unit_);
    for (std::uint32_t i = 0; i < unit_.count; ++i)
        unit_.object[i] = (static_cast<std::uint32_t>(begin) + i) | side;
    for (std::size_t i = std::max(begin, boxes_.loners); i < begin + unit_.count; ++i)
        unit_.object[i - begin] |= side_a;
    append_unit();
    return !unit_.bad;
}

template <int Dim, class T>
void Scatter<Dim, T>::add_records(const Record* records, std::uint32_t count)
{
    for (std::uint32_t begin = 0; begin < count; begin += unit_size) {
        unit_.count = std::min(unit_size, count - begin);
        for (std::uint32_t i = 0; i < unit_.count; ++i) {
            const std::uint32_t object = records[begin + i].object;
            boxes_.prefetch(records[std::min(begin + i + 8, count - 1)].object);
            const BoxView<Dim, T>& set = object & side_b ? boxes_.b : boxes_.a;
            unit_.object[i] = object;
            for (int d = 0; d < Dim; ++d) {
                unit_.lo[d][i] = set.lo(d, object & index_mask);
                unit_.hi[d][i] = set.hi(d, object & index_mask);
            }
        }
        append_unit();
    }
}

template <int Dim, class T>
void Scatter<Dim, T>::append_unit()
{
    Unit<T>& unit = unit_; // a local, since the compiler reloads members while records are written
    BrickStore& store = store_;
    const std::uint32_t first = first_brick_;
    kernels_.quantise<Dim, T>()(grid_, unit);
    if (unit.bad) return;
    for (std::uint32_t i = 0; i < unit.records; ++i) {
        store.prefetch(first + unit.brick[std::min(i + 16, unit.records - 1)]);
        store.append(first + unit.brick[i], unit.record[i]);
    }
    for (std::uint32_t k = 0; k < unit.wide; ++k)
        append_wide(unit.wide_box[k]);
}

/// The copies of a box that crosses a border on the sweep axis or spans more than two bricks on another: one
/// in each of its bricks except the first.
template <int Dim, class T>
void Scatter<Dim, T>::append_wide(std::uint32_t i)
{
    std::int32_t first[3] = {0, 0, 0}, last[3] = {0, 0, 0};
    for (int p = 0; p < Dim; ++p) {
        first[p] = unit_.quantum_lo[p][i] >> quanta_bits;
        last[p] = unit_.quantum_hi[p][i] >> quanta_bits;
    }
    const Record& home = unit_.record[i];
    for (std::int32_t z = first[2]; z <= last[2]; ++z)
        for (std::int32_t y = first[1]; y <= last[1]; ++y)
            for (std::int32_t x = first[0]; x <= last[0]; ++x) {
                const std::int32_t cell[3] = {x, y, z};
                if (x == first[0] && y == first[1] && z == first[2]) continue;
                Record copy = home;
                for (int p = 0; p < Dim; ++p) {
                    if (cell[p] == first[p]) continue;
                    const std::int32_t local_hi = unit_.quantum_hi[p][i] - (cell[p] << quanta_bits);
                    copy.axis[p] = pack_axis(0, std::min(local_hi, quanta) + 1);
                    copy.object |= copy_flag(grid_.axis[p]);
                }
                const auto brick = static_cast<std::uint32_t>(x + grid_.cells[0] * (y + grid_.cells[1] * z));
                store_.append(first_brick_ + brick, copy);
            }
}

template class Scatter<2, float>;
template class Scatter<2, double>;
template class Scatter<3, float>;
template class Scatter<3, double>;

} // namespace engine
JOSTLE_NAMESPACE_END
