// SPDX-License-Identifier: MIT
// Contacts, number by number.

#include <algorithm>
#include <cstdint>

#include "extras/js/module.hpp"

namespace {

using jostle::c_api::in_space;

template <int Dim, class T>
struct ContactIn;
template <>
struct ContactIn<2, float>
{
    using type = jostle_contact_2f;
};
template <>
struct ContactIn<3, float>
{
    using type = jostle_contact_3f;
};
template <>
struct ContactIn<2, double>
{
    using type = jostle_contact_2d;
};
template <>
struct ContactIn<3, double>
{
    using type = jostle_contact_3d;
};

template <int Dim, class T, class F>
void each_contact(const jostle_blocks& blocks, F&& work_on)
{
    using Contact = typename ContactIn<Dim, T>::type;
    for (std::uint64_t b = 0; b < blocks.block_count; ++b)
        for (std::uint64_t i = 0; i < blocks.blocks[b].count; ++i)
            work_on(static_cast<const Contact*>(blocks.blocks[b].items)[i]);
}

} // namespace

/// How many points contacts have.
JOSTLE_JS std::uint32_t jostle_js_contact_points(jostle_space space, const jostle_blocks* contacts)
{
    std::uint32_t points = 0;
    in_space(space, [&](auto in) {
        each_contact<decltype(in)::dim, typename decltype(in)::T>(
            *contacts, [&](const auto& contact) { points += contact.count; });
    });
    return points;
}

/// Where jostle_js_split_contacts writes, one array per member.
struct SplitContacts
{
    std::uint32_t *pairs, *parts;
    void* normals;
    std::uint32_t* first;
    void *from_a, *from_b, *depths;
    std::uint32_t* features;
};

JOSTLE_JS void jostle_js_split_contacts(jostle_space space, const jostle_blocks* contacts,
                                        const SplitContacts* into)
{
    in_space(space, [&](auto in) {
        constexpr int dim = decltype(in)::dim;
        using T = typename decltype(in)::T;
        SplitContacts to = *into;
        auto *normal = static_cast<T*>(to.normals), *from_a = static_cast<T*>(to.from_a),
             *from_b = static_cast<T*>(to.from_b), *depth = static_cast<T*>(to.depths);
        std::uint32_t points = 0;
        *to.first++ = 0;
        each_contact<dim, T>(*contacts, [&](const auto& contact) {
            *to.pairs++ = contact.pair.a;
            *to.pairs++ = contact.pair.b;
            *to.parts++ = contact.part_a;
            *to.parts++ = contact.part_b;
            normal = std::copy_n(contact.normal, dim, normal);
            for (std::uint32_t p = 0; p < contact.count; ++p) {
                from_a = std::copy_n(contact.point[p].from_a, dim, from_a);
                from_b = std::copy_n(contact.point[p].from_b, dim, from_b);
                *depth++ = contact.point[p].depth;
                *to.features++ = contact.point[p].feature;
            }
            *to.first++ = points += contact.count;
        });
    });
}
