// SPDX-License-Identifier: MIT
#pragma once

#include <cstring>
#include <optional>
#include <string>
#include <string_view>

#include "target.hpp"
#include "tool/commands.hpp"
#include "tool/io/boxes.hpp"
#include "tool/io/input_file.hpp"

namespace fuzz {

/// The name that refusals tell.
inline const std::string input_name = "input";

/// What bytes read as: refused in words that name them, or boxes. To open a file would take longer than to
/// read it.
template <class Bytes>
std::optional<jostle_tool::BoxSet>
read_or_refuse(const Bytes& bytes, jostle_tool::BoxSet (*read)(jostle_tool::InputFile&), bool has_size = true)
{
    jostle_tool::InputFile file(input_name, {reinterpret_cast<const char*>(bytes.data()), bytes.size()},
                                has_size);
    try {
        return read(file);
    } catch (const jostle_tool::UsageError& error) {
        demand(std::string_view(error.what()).starts_with(input_name),
               "a refusal that doesn't name the file");
        return std::nullopt;
    }
}

/// Bit by bit, so that NaN counts as well.
inline bool same_boxes(const jostle_tool::BoxSet& a, const jostle_tool::BoxSet& b)
{
    return std::visit(
        [&](const auto& boxes) {
            const auto* const others = std::get_if<std::decay_t<decltype(boxes)>>(&b.boxes);
            return others != nullptr && others->size() == boxes.size() &&
                   (boxes.empty() ||
                    std::memcmp(boxes.data(), others->data(), boxes.size() * sizeof boxes[0]) == 0);
        },
        a.boxes);
}

} // namespace fuzz
