// SPDX-License-Identifier: MIT
#include "base/checks.hpp"
#include "base/instantiate.hpp"
#include "base/number_text.hpp"

#include <initializer_list>
#include <string>
#include <string_view>

JOSTLE_NAMESPACE_BEGIN

namespace {

/// The message of throw_bad_box, in pieces, of which one function for all spaces makes an `Error`.
[[noreturn]] void throw_about_box(ErrorCode code, std::uint64_t index,
                                  std::initializer_list<std::string_view> said)
{
    std::string message = "box ";
    for (const std::string_view piece : said)
        message += piece;
    throw Error(code, message, index);
}

} // namespace

template <int Dim, Coordinate T>
void throw_bad_box(const Aabb<Dim, T>& box, std::uint64_t index, const char* set, const std::string& name)
{
    static constexpr std::string_view axis_names[] = {"x", "y", "z"};
    const std::string number = std::to_string(index);
    for (int d = 0; d < Dim; ++d) {
        const bool lo_nan = box.lo[d] != box.lo[d], hi_nan = box.hi[d] != box.hi[d];
        if (lo_nan || hi_nan)
            throw_about_box(ErrorCode::nan_coordinate, index,
                            {set, number, name, ": ", lo_nan ? "lo." : "hi.", axis_names[d],
                             " is NaN; every bound must be a number (infinite is allowed)"});
        if (box.lo[d] > box.hi[d])
            throw_about_box(ErrorCode::inverted_box, index,
                            {set, number, name, ": lo.", axis_names[d], " = ", number_text(box.lo[d]),
                             " is greater than hi.", axis_names[d], " = ", number_text(box.hi[d]),
                             "; swap them or drop the box"});
    }
    throw_about_box(ErrorCode::invalid_argument, index, {set, number, name, ": changed while it was read"});
}

template <int Dim, Coordinate T>
void check_pointers(const BoxView<Dim, T>& boxes, const char* set)
{
    for (int d = 0; d < Dim; ++d)
        if (!boxes.empty() && (boxes.lo_pointer(d) == nullptr || boxes.hi_pointer(d) == nullptr))
            throw Error(ErrorCode::invalid_argument, "a view of " + std::to_string(boxes.size()) + " boxes " +
                                                         set + "with a null pointer");
}

template <int Dim, Coordinate T>
void check_boxes_of(const BoxView<Dim, T>& boxes, const char* set, std::span<const std::uint32_t> ids)
{
    check_pointers(boxes, set);
    for (std::size_t i = 0; i < boxes.size(); ++i)
        if (const Aabb<Dim, T> box = boxes[i]; !valid(box))
            throw_bad_box(box, i, set, ids.empty() ? std::string() : " (id " + std::to_string(ids[i]) + ")");
}

template <int Dim, Coordinate T>
void detail::check_boxes(const BoxView<Dim, T>& boxes)
{
    check_boxes_of(boxes, "");
}

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

void check_one_id_each(std::size_t ids, std::size_t boxes)
{
    if (ids != boxes)
        throw Error(ErrorCode::size_mismatch,
                    std::to_string(ids) + " ids for " + std::to_string(boxes) + " boxes; give one for each");
}

void check_offsets(std::span<const std::uint64_t> offsets, const char* part, const char* item,
                   std::uint64_t count, const char* items)
{
    const auto offset = [&](std::size_t k) {
        return "offset " + std::to_string(k) + " is " + std::to_string(offsets[k]);
    };
    if (offsets.empty())
        throw Error(ErrorCode::size_mismatch, std::string("there are no offsets; give one for each ") + part +
                                                  "'s first " + item + ", and the number of " + items);
    if (offsets.front() != 0)
        throw Error(ErrorCode::invalid_argument,
                    offset(0) + "; the first " + part + " begins with " + item + " 0", 0);
    for (std::size_t k = 1; k < offsets.size(); ++k)
        if (offsets[k] < offsets[k - 1])
            throw Error(ErrorCode::invalid_argument,
                        offset(k) + ", less than the " + std::to_string(offsets[k - 1]) + " before it; " +
                            part + "s lie one behind the other",
                        k);
    if (offsets.back() != count)
        throw Error(ErrorCode::size_mismatch,
                    "the last offset, number " + std::to_string(offsets.size() - 1) + ", is " +
                        std::to_string(offsets.back()) + ", and there are " + std::to_string(count) + " " +
                        items + "; it must be their number",
                    offsets.size() - 1);
}

#define JOSTLE_INSTANTIATE(Dim, T)                                                                           \
    template void throw_bad_box<Dim, T>(const Aabb<Dim, T>&, std::uint64_t, const char*,                     \
                                        const std::string&);                                                 \
    template void check_pointers<Dim, T>(const BoxView<Dim, T>&, const char*);                               \
    template void check_boxes_of<Dim, T>(const BoxView<Dim, T>&, const char*,                                \
                                         std::span<const std::uint32_t>);                                    \
    template void detail::check_boxes<Dim, T>(const BoxView<Dim, T>&);
JOSTLE_FOR_EACH_SPACE(JOSTLE_INSTANTIATE)
#undef JOSTLE_INSTANTIATE

JOSTLE_NAMESPACE_END
