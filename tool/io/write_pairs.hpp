// SPDX-License-Identifier: MIT
#pragma once

#include <span>
#include <string>

#include "boxes.hpp"
#include "jostle/pair_buffer.hpp"

namespace jostle_tool {

enum class PairFormat
{
    csv,       ///< header a,b and one pair per line
    npy,       ///< uint32, shape (m, 2)
    json_lines ///< {"a":0,"b":1} per line
};

/// The format that the name of an output file asks for; "-" (stdout) asks for CSV. Throws UsageError.
[[nodiscard]] PairFormat pair_format(const std::string& path);

/// Throws UsageError if the format can't hold these ids.
void check_ids(const std::string& path, PairFormat format, const Ids& ids);

/// Writes the pairs in the order of `blocks`, as ids if there are any, else as positions. The file appears
/// complete or not at all. Throws UsageError if it can't be written.
void write_pairs(const std::string& path, PairFormat format,
                 std::span<const std::span<const jostle::Pair>> blocks, const Ids& ids);

} // namespace jostle_tool
