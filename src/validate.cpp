// SPDX-License-Identifier: MIT
#include "validate.hpp"

#include <limits>
#include <sstream>

JOSTLE_NAMESPACE_BEGIN

template <int Dim, Coordinate T>
void throw_bad_box(const Aabb<Dim, T>& box, std::uint64_t index, const char* set)
{
    static constexpr char axis_names[] = "xyz";
    std::ostringstream message;
    message.imbue(std::locale::classic());
    message.precision(std::numeric_limits<T>::max_digits10);
    message << "box " << set << index << ": ";
    for (int d = 0; d < Dim; ++d) {
        const bool lo_nan = box.lo[d] != box.lo[d], hi_nan = box.hi[d] != box.hi[d];
        if (lo_nan || hi_nan) {
            message << (lo_nan ? "lo." : "hi.") << axis_names[d]
                    << " is NaN; every bound must be a number (infinite is allowed)";
            throw Error(ErrorCode::nan_coordinate, message.str(), index);
        }
        if (box.lo[d] > box.hi[d]) {
            message << "lo." << axis_names[d] << " = " << box.lo[d] << " is greater than hi." << axis_names[d]
                    << " = " << box.hi[d] << "; swap them or drop the box";
            throw Error(ErrorCode::inverted_box, message.str(), index);
        }
    }
    throw Error(ErrorCode::invalid_argument, message.str() + "changed while it was read", index);
}

template <int Dim, Coordinate T>
void validate_boxes_of(const BoxView<Dim, T>& boxes, const char* set)
{
    for (std::size_t i = 0; i < boxes.size(); ++i) {
        const Aabb<Dim, T> box = boxes[i];
        for (int d = 0; d < Dim; ++d)
            if (!(box.lo[d] <= box.hi[d])) throw_bad_box(box, i, set);
    }
}

template <int Dim, Coordinate T>
void validate_boxes(const BoxView<Dim, T>& boxes)
{
    validate_boxes_of(boxes, "");
}

namespace {

void check_column(const StridedView<std::uint32_t>& column, std::size_t size, const char* name)
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

void check_filter(const Filter& filter, std::size_t size)
{
    check_masks(filter.category, filter.mask, size, "category", "mask");
    check_column(filter.owner, size, "owner");
}

void check_filter(const CrossFilter& filter, std::size_t size_a, std::size_t size_b)
{
    check_masks(filter.category_a, filter.mask_a, size_a, "category_a", "mask_a");
    check_masks(filter.category_b, filter.mask_b, size_b, "category_b", "mask_b");
    check_column(filter.owner_a, size_a, "owner_a");
    check_column(filter.owner_b, size_b, "owner_b");
    const bool both_sets = size_a != 0 && size_b != 0; // an empty set can't give anything
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

} // namespace

void check_memory(const std::pmr::memory_resource* memory)
{
    if (memory == nullptr)
        throw Error(ErrorCode::invalid_argument, "memory is null; leave it out for the default resource");
}

InstructionSet checked(InstructionSet set)
{
    std::string known;
    for (const InstructionSet each : supported_instruction_sets()) {
        if (each == set) return set;
        known += (known.empty() ? "" : ", ") + std::string(name(each));
    }
    throw Error(ErrorCode::invalid_argument,
                std::string("instruction set ") + name(set) + " can't be run here; choose one of " + known);
}

bool passes(const Filter& filter, std::uint32_t a, std::uint32_t b) noexcept
{
    if (!filter.mask.empty() &&
        ((filter.category[a] & filter.mask[b]) == 0 || (filter.category[b] & filter.mask[a]) == 0))
        return false;
    return filter.owner.empty() || owners_differ(filter.owner[a], filter.owner[b]);
}

bool passes(const CrossFilter& filter, std::uint32_t a, std::uint32_t b) noexcept
{
    if (!filter.mask_a.empty() &&
        ((filter.category_a[a] & filter.mask_b[b]) == 0 || (filter.category_b[b] & filter.mask_a[a]) == 0))
        return false;
    return filter.owner_a.empty() || owners_differ(filter.owner_a[a], filter.owner_b[b]);
}

#define JOSTLE_INSTANTIATE(Dim, T)                                                                           \
    template void throw_bad_box<Dim, T>(const Aabb<Dim, T>&, std::uint64_t, const char*);                    \
    template void validate_boxes_of<Dim, T>(const BoxView<Dim, T>&, const char*);                            \
    template void validate_boxes<Dim, T>(const BoxView<Dim, T>&);
JOSTLE_INSTANTIATE(2, float)
JOSTLE_INSTANTIATE(2, double)
JOSTLE_INSTANTIATE(3, float)
JOSTLE_INSTANTIATE(3, double)
#undef JOSTLE_INSTANTIATE

JOSTLE_NAMESPACE_END
