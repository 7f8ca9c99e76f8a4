// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <stdexcept>
#include <string>

#include "jostle/version.hpp"

JOSTLE_NAMESPACE_BEGIN

// What the library throws:
//
//     try {
//         finder.find(boxes);
//     } catch (const jostle::Error& error) {
//         std::fprintf(stderr, "%s\n", error.what()); // "box 7: lo.y is NaN; ..."; error.index() is 7
//     }

/// What was wrong with the arguments of a call.
enum class ErrorCode
{
    nan_coordinate = 1, ///< a bound of a box is NaN
    inverted_box,       ///< lo > hi on some axis
    too_many_objects,   ///< more objects than a 32-bit index can name
    size_mismatch,      ///< per-object arrays of different lengths, or one array without its partner
    invalid_argument,   ///< anything else that the documentation of the call forbids
    stale_id,           ///< an `ObjectId` that names no object of the world
    bad_snapshot,       ///< a snapshot that is truncated, altered, or of another kind of world
    file_error,         ///< a recording that can't be written; from C only
};

/// Thrown for invalid input. The message names the object and the value, and says what to do. What the call
/// was to change is unchanged.
class JOSTLE_API Error : public std::runtime_error
{
  public:
    static constexpr std::uint64_t no_index = ~std::uint64_t{0};

    Error(ErrorCode code, const std::string& message, std::uint64_t index = no_index);
    ~Error() override; // here, so that the type has one home and can be caught across libraries

    [[nodiscard]] ErrorCode code() const noexcept { return code_; }
    /// The number of what is wrong, or `no_index` if it has none. In a World it is the index of the object's
    /// id. Elsewhere, and where objects have no id yet, as in a search or in add(), it is the lowest bad
    /// position in the given arrays.
    [[nodiscard]] std::uint64_t index() const noexcept { return index_; }

  private:
    ErrorCode code_;
    std::uint64_t index_;
};

JOSTLE_NAMESPACE_END
