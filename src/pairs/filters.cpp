// SPDX-License-Identifier: MIT
#include "pairs/filters.hpp"

#include <bit>
#include <string>

#include "jostle/error.hpp"

JOSTLE_NAMESPACE_BEGIN

namespace {

template <class T>
void check_column(const StridedView<T>& column, std::size_t size, const char* name)
{
    if (column.empty() || column.size() == size) return;
    throw Error(ErrorCode::size_mismatch,
                std::string("filter ") + name + " has " + std::to_string(column.size()) + " entries for " +
                    std::to_string(size) + " objects; give one per object, or none");
}

void check_masks(const StridedView<std::uint32_t>& category, const StridedView<std::uint32_t>& mask,
                 std::size_t size, const char* category_name, const char* mask_name)
{
    check_column(category, size, category_name);
    check_column(mask, size, mask_name);
    if (category.empty() != mask.empty())
        throw Error(ErrorCode::size_mismatch,
                    std::string("filter ") + (category.empty() ? mask_name : category_name) +
                        " is given without " + (category.empty() ? category_name : mask_name) +
                        "; give both or neither");
}

} // namespace

namespace {

template <class OneSet>
void check_one_set(const OneSet& filter, std::size_t size)
{
    check_masks(filter.category, filter.mask, size, "category", "mask");
    check_column(filter.owner, size, "owner");
}

} // namespace

void check_filter(const Filter& filter, std::size_t size)
{
    check_one_set(filter, size);
    check_column(filter.vertices, size, "vertices");
    if (filter.ghosts > size)
        throw Error(ErrorCode::size_mismatch, "filter ghosts is " + std::to_string(filter.ghosts) + " for " +
                                                  std::to_string(size) +
                                                  " objects; the ghosts are the last of them");
}
void check_filter(const SceneFilter& filter, std::size_t size)
{
    check_one_set(filter, size);
}

void check_filter(const CrossFilter& filter, std::size_t size_a, std::size_t size_b)
{
    check_masks(filter.category_a, filter.mask_a, size_a, "category_a", "mask_a");
    check_masks(filter.category_b, filter.mask_b, size_b, "category_b", "mask_b");
    check_column(filter.owner_a, size_a, "owner_a");
    check_column(filter.owner_b, size_b, "owner_b");
    const bool both_sets = size_a != 0 && size_b != 0; // an empty set can't provide its arrays
    if (both_sets && filter.category_a.empty() != filter.category_b.empty())
        throw Error(ErrorCode::size_mismatch,
                    "filter category and mask are given for one set only; give them for both");
    if (both_sets && filter.owner_a.empty() != filter.owner_b.empty())
        throw Error(ErrorCode::size_mismatch, "filter owner is given for one set only; give it for both");
}

namespace {

bool owners_differ(std::uint32_t a, std::uint32_t b) noexcept
{
    return a != b || a == Filter::no_owner;
}

using Triple = std::array<std::uint32_t, 3>;

bool none_shared(const Triple& a, const Triple& b) noexcept
{
    const auto [x, y, z] = b;
    bool none = true;
    for (const std::uint32_t vertex : a)
        none &= (vertex == Filter::no_owner) | ((vertex != x) & (vertex != y) & (vertex != z));
    return none;
}

template <class OneSet>
bool passes_one_set(const OneSet& filter, std::size_t a, std::size_t b) noexcept
{
    if (!filter.mask.empty() &&
        ((filter.category[a] & filter.mask[b]) == 0 || (filter.category[b] & filter.mask[a]) == 0))
        return false;
    return filter.owner.empty() || owners_differ(filter.owner[a], filter.owner[b]);
}

} // namespace

bool passes(const Filter& filter, std::size_t a, std::size_t b) noexcept
{
    if (filter.images != nullptr &&
        !filter.images->allows(static_cast<std::uint32_t>(a), static_cast<std::uint32_t>(b)))
        return false;
    if (!filter.vertices.empty() && !none_shared(filter.vertices[a], filter.vertices[b])) return false;
    return passes_one_set(filter, a, b);
}
bool passes(const SceneFilter& filter, std::size_t a, std::size_t b) noexcept
{
    return passes_one_set(filter, a, b);
}

bool passes(const CrossFilter& filter, std::size_t a, std::size_t b) noexcept
{
    if (!filter.mask_a.empty() &&
        ((filter.category_a[a] & filter.mask_b[b]) == 0 || (filter.category_b[b] & filter.mask_a[a]) == 0))
        return false;
    return filter.owner_a.empty() || owners_differ(filter.owner_a[a], filter.owner_b[b]);
}

namespace {

using Values = StridedView<std::uint32_t>;

void append_masks(const Values& category, const Values& mask, std::pmr::vector<std::uint64_t>& out)
{
    for (std::size_t i = 0; i < mask.size(); ++i)
        out.push_back(std::uint64_t{mask[i]} << 32 | category[i]);
}
void append_owners(const Values& owner, std::pmr::vector<std::uint32_t>& out)
{
    for (std::size_t i = 0; i < owner.size(); ++i)
        out.push_back(owner[i]);
}

/// No branch depends on a pair's values: a misprediction costs more than everything else.
template <bool Masks, bool Owners, bool WithVertices>
Pair* keep(const PackedFilter& filter, Pair* first, Pair* last) noexcept
{
    const std::uint64_t* const masks = filter.masks.data();
    const std::uint32_t* const owners = filter.owners.data();
    const std::size_t b = filter.second;
    Pair* end = first;
    for (; first != last; ++first) {
        const Pair pair = *first;
        bool good = true;
        if constexpr (Masks) {
            const std::uint64_t both = masks[pair.a] & std::rotl(masks[b + pair.b], 32);
            good = (static_cast<std::uint32_t>(both) != 0) & (both >> 32 != 0);
        }
        if constexpr (Owners) {
            const std::uint32_t owner = owners[pair.a];
            good &= (owner != owners[b + pair.b]) | (owner == Filter::no_owner);
        }
        if constexpr (WithVertices) good &= none_shared(filter.vertices[pair.a], filter.vertices[pair.b]);
        *end = pair;
        end += good;
    }
    return end;
}

} // namespace

void PackedFilter::pack(const Filter& filter, std::size_t)
{
    clear();
    append_masks(filter.category, filter.mask, masks);
    append_owners(filter.owner, owners);
    for (std::size_t i = 0; i < filter.vertices.size(); ++i)
        vertices.push_back(filter.vertices[i]);
}

void PackedFilter::pack(const CrossFilter& filter, std::size_t size_a)
{
    clear();
    second = size_a;
    append_masks(filter.category_a, filter.mask_a, masks);
    append_masks(filter.category_b, filter.mask_b, masks);
    append_owners(filter.owner_a, owners);
    append_owners(filter.owner_b, owners);
}

void PackedFilter::clear() noexcept
{
    masks.clear();
    owners.clear();
    vertices.clear();
    second = 0;
}

Pair* PackedFilter::keep_passing(Pair* first, Pair* last) const noexcept
{
    using Keep = Pair* (*)(const PackedFilter&, Pair*, Pair*) noexcept;
    constexpr Keep ways[] = {nullptr,
                             keep<true, false, false>,
                             keep<false, true, false>,
                             keep<true, true, false>,
                             keep<false, false, true>,
                             keep<true, false, true>,
                             keep<false, true, true>,
                             keep<true, true, true>};
    const int way = (masks.empty() ? 0 : 1) + (owners.empty() ? 0 : 2) + (vertices.empty() ? 0 : 4);
    return way == 0 ? last : ways[way](*this, first, last);
}

JOSTLE_NAMESPACE_END
