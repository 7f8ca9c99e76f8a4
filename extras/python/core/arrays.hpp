// SPDX-License-Identifier: MIT
#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <cstdint>
#include <cstring>
#include <optional>
#include <string>
#include <vector>

#include "core/calls.hpp"

// Arrays of NumPy for the pointers of jostle.h. Python has brought arguments into shape (_arrays.py); here
// they are checked once more, since memory depends on it.

namespace jostle_python {

using Array = py::array;
using Maybe = std::optional<py::array>;
template <class T>
using Packed = py::array_t<T, py::array::c_style>;
using U32 = Packed<std::uint32_t>;
using U64 = Packed<std::uint64_t>;
using F64 = Packed<double>;

[[nodiscard]] int dim_of(jostle_space space);
[[nodiscard]] bool is_float(jostle_space space);
[[nodiscard]] jostle_space space_of(py::ssize_t dim, bool single);
[[nodiscard]] py::dtype number_of(jostle_space space);
[[nodiscard]] std::string shape_text(const py::array& array);
/// Refuses an array of other numbers than the space's.
void want_number(const py::array& array, jostle_space space, const char* name);

/// Boxes in an array's memory.
struct Boxes
{
    py::array array; // keeps the memory
    jostle_boxes view{};
    jostle_space space = JOSTLE_3D;
};

constexpr jostle_space any_space = -1;
[[nodiscard]] Boxes boxes_of(const py::array& array, const char* name, jostle_space wanted = any_space);

/// One number per object, or nothing.
template <class T>
jostle_values values_of(const std::optional<py::array>& array, const char* name)
{
    if (!array) return {nullptr, 0, 0};
    if (array->ndim() != 1 || !array->dtype().equal(py::dtype::of<T>()))
        refuse(std::string(name) + " must be an array of shape (n,)");
    return {array->data(), static_cast<std::uint64_t>(array->shape(0)), array->strides(0)};
}

template <class T>
std::uint64_t length_of(const Packed<T>& array, const char* name)
{
    if (array.ndim() != 1)
        refuse(std::string(name) + " has the shape " + shape_text(array) + ": it must be (n,)");
    return static_cast<std::uint64_t>(array.shape(0));
}
template <class T>
void want_length(const Packed<T>& array, std::uint64_t count, const char* name)
{
    if (length_of(array, name) != count)
        refuse(std::string(name) + " has " + std::to_string(array.shape(0)) + " elements, and there are " +
               std::to_string(count) + " objects");
}
/// Refuses what isn't `count` packed rows of `width` of the space's numbers.
void want_rows(const py::array& array, jostle_space space, py::ssize_t width, std::uint64_t count,
               const char* name);

/// A new array of pairs with these: the only copy that is made of them.
[[nodiscard]] py::array copy_pairs(const jostle_blocks& blocks);
[[nodiscard]] py::array copy_pairs(const Results& results);
template <class T>
py::array copy_array(const T* from, std::uint64_t count)
{
    Packed<T> array(static_cast<py::ssize_t>(count));
    if (count != 0) std::memcpy(array.mutable_data(), from, count * sizeof(T));
    return array;
}
/// Pairs of the caller's.
struct Pairs
{
    explicit Pairs(const Packed<std::uint32_t>& array)
    {
        if (array.ndim() != 2 || array.shape(1) != 2)
            refuse("pairs has the shape " + shape_text(array) + ": it must be (m, 2)");
        block = {array.data(), static_cast<std::uint64_t>(array.shape(0))};
        all = {&block, 1, block.count, sizeof(jostle_pair)};
    }
    Pairs(const Pairs&) = delete;
    jostle_block block;
    jostle_blocks all;
};

} // namespace jostle_python
