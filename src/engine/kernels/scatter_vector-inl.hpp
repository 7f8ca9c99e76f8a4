// SPDX-License-Identifier: MIT
// The two steps of the scatter that Highway does better than a compiler: transposing packed boxes and listing
// copies. With vectors of 128 bits on every instruction set, since longer ones gained nothing
// (docs/decisions/005). No include guard: kernels.cpp includes it once per set.

/// Four consecutive boxes of floats as columns: lo of each axis, then hi.
template <int Dim>
HWY_ATTR inline void transpose(const float* boxes, float* const (&columns)[2 * Dim])
{
    const hn::CappedTag<float, 4> d;
    const hn::Repartition<double, decltype(d)> d2;
    // Each box's first four numbers and its last four, which share two of them in 3D.
    for (const int at : {0, 2 * Dim - 4}) {
        const auto r0 = hn::LoadU(d, boxes + at), r1 = hn::LoadU(d, boxes + at + 2 * Dim);
        const auto r2 = hn::LoadU(d, boxes + at + 4 * Dim), r3 = hn::LoadU(d, boxes + at + 6 * Dim);
        const auto low01 = hn::BitCast(d2, hn::InterleaveLower(d, r0, r1));
        const auto low23 = hn::BitCast(d2, hn::InterleaveLower(d, r2, r3));
        const auto high01 = hn::BitCast(d2, hn::InterleaveUpper(d, r0, r1));
        const auto high23 = hn::BitCast(d2, hn::InterleaveUpper(d, r2, r3));
        hn::StoreU(hn::BitCast(d, hn::InterleaveLower(d2, low01, low23)), d, columns[at]);
        hn::StoreU(hn::BitCast(d, hn::InterleaveUpper(d2, low01, low23)), d, columns[at + 1]);
        hn::StoreU(hn::BitCast(d, hn::InterleaveLower(d2, high01, high23)), d, columns[at + 2]);
        hn::StoreU(hn::BitCast(d, hn::InterleaveUpper(d2, high01, high23)), d, columns[at + 3]);
        if (2 * Dim == 4) break;
    }
}

/// Loads packed boxes of floats, four at a time, and returns how many; the caller loads the rest.
template <int Dim>
inline std::uint32_t load_packed(const float* from, Unit<float>& unit)
{
    std::uint32_t i = 0;
    for (; i + 4 <= unit.count; i += 4) {
        float* columns[2 * Dim];
        for (int d = 0; d < Dim; ++d) {
            columns[d] = unit.lo[d] + i;
            columns[Dim + d] = unit.hi[d] + i;
        }
        for (std::uint32_t offset = 0; offset < 8 * Dim; offset += 64 / sizeof(float))
            prefetch(from + 2 * Dim * (i + unit_size) + offset);
        transpose<Dim>(from + 2 * Dim * i, columns);
    }
    return i;
}

/// Writes the numbers of the boxes that have copies according to `kind`; see quantise.
HWY_ATTR inline void list_copies(const std::uint16_t* kind, std::uint32_t count, CopyLists& lists,
                                 std::uint16_t* wide)
{
    const hn::CappedTag<std::uint16_t, 8> d;
    const hn::Rebind<std::uint8_t, decltype(d)> bytes;
    const auto list = [d, bytes](std::uint16_t* to, std::uint32_t& size, unsigned listed,
                                 std::uint32_t first) HWY_ATTR {
        const auto numbers = hn::PromoteTo(d, hn::LoadU(bytes, compress_order.of8[listed]));
        hn::StoreU(hn::Add(numbers, hn::Set(d, static_cast<std::uint16_t>(first))), d, to + size);
        size += static_cast<std::uint32_t>(std::popcount(listed));
    };
    for (std::uint32_t i = 0; i < count; i += 8) {
        const unsigned valid = count - i >= 8 ? 0xff : (1u << (count - i)) - 1;
        const auto kinds = hn::LoadU(d, kind + i);
        const auto of = [d, kinds, valid](std::uint16_t bit) HWY_ATTR {
            std::uint8_t mask[8];
            hn::StoreMaskBits(d, hn::TestBit(kinds, hn::Set(d, bit)), mask);
            return mask[0] & valid;
        };
        const unsigned y = of(1), z = of(2), more = of(4);
        list(lists.y, lists.ys, y, i);
        list(lists.z, lists.zs, z, i);
        list(lists.yz, lists.yzs, y & z, i);
        if (more != 0) list(wide, lists.wides, more, i);
    }
}
