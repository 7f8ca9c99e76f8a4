// SPDX-License-Identifier: MIT
// The same as scatter_vector-inl.hpp, in plain C++. No include guard: kernels.cpp includes it once per set.

/// There is no faster way to load boxes here: returns 0, the number of boxes loaded.
template <int Dim>
inline std::uint32_t load_packed(const float*, Unit<float>&)
{
    return 0;
}

/// Writes the numbers of the boxes that have copies according to `kind`; see quantise.
inline void list_copies(const std::uint16_t* kind, std::uint32_t count, CopyLists& lists, std::uint16_t* wide)
{
    for (std::uint32_t i = 0; i < count; ++i) { // about one in three is listed, at random: no branches
        const std::uint16_t box = static_cast<std::uint16_t>(i);
        lists.y[lists.ys] = box;
        lists.ys += kind[i] & 1u;
        lists.z[lists.zs] = box;
        lists.zs += (kind[i] >> 1) & 1u;
        lists.yz[lists.yzs] = box;
        lists.yzs += (kind[i] & (kind[i] >> 1)) & 1u;
        wide[lists.wides] = box;
        lists.wides += static_cast<std::uint32_t>(kind[i] >> 2);
    }
}
