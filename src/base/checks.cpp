// SPDX-License-Identifier: MIT
#include "base/checks.hpp"

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
    for (std::size_t i = 0; i < boxes.size(); ++i)
        check_box(boxes[i], i, set);
}

template <int Dim, Coordinate T>
void validate_boxes(const BoxView<Dim, T>& boxes)
{
    validate_boxes_of(boxes, "");
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
