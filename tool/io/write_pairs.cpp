// SPDX-License-Identifier: MIT
#include "write_pairs.hpp"

#include <charconv>
#include <cstring>

#include <nlohmann/json.hpp>

#include "npy_header.hpp"
#include "output_file.hpp"
#include "tool/commands.hpp"
#include "tool/progress.hpp"
#include "tool/text.hpp"

namespace jostle_tool {

namespace {

using jostle::Pair;

void append_number(std::string& text, std::uint32_t number)
{
    char digits[10];
    text.append(digits, std::to_chars(digits, digits + sizeof digits, number).ptr);
}

std::string csv_field(std::string_view text)
{
    const bool plain = text.find_first_of(",\"\r\n") == std::string_view::npos && text.front() != ' ' &&
                       text.front() != '\t' && text.back() != ' ' && text.back() != '\t';
    if (plain) return std::string(text);
    std::string field = "\"";
    for (const char c : text)
        field.append(c == '"' ? 2 : 1, c);
    return field + '"';
}

/// Whether the number reads back as the same text: 7 does and 007 doesn't.
bool is_uint32(std::string_view text, std::uint32_t& number)
{
    if (text.size() > 1 && text.front() == '0') return false;
    const auto result = std::from_chars(text.data(), text.data() + text.size(), number);
    return result.ec == std::errc() && result.ptr == text.data() + text.size();
}

} // namespace

PairFormat pair_format(const std::string& path)
{
    if (path == "-") return PairFormat::csv;
    const std::string extension = extension_of(path);
    if (extension == ".csv") return PairFormat::csv;
    if (extension == ".npy") return PairFormat::npy;
    if (extension == ".jsonl" || extension == ".ndjson") return PairFormat::json_lines;
    throw UsageError(
        path + ": " +
        (extension.empty() ? "the name has no extension" : "can't write " + extension + " files") +
        "; choose a name that ends in .csv, .npy or .jsonl");
}

void check_ids(const std::string& path, PairFormat format, const Ids& ids)
{
    for (std::size_t i = 0; i < ids.size(); ++i) {
        std::uint32_t number;
        if (format == PairFormat::npy && !is_uint32(ids[i], number))
            throw UsageError(path + ": id " + quote(ids[i]) +
                             " isn't a whole number up to 4294967295, as .npy needs; write .csv or .jsonl");
        if (format == PairFormat::json_lines && !ids.whole_numbers()) {
            try {
                (void)nlohmann::json(ids[i]).dump();
            } catch (const nlohmann::json::exception&) {
                throw UsageError(path + ": id " + quote(ids[i]) + " isn't UTF-8, as JSON needs; write .csv");
            }
        }
    }
}

void write_pairs(const std::string& path, PairFormat format, std::span<const std::span<const Pair>> blocks,
                 const Ids& ids)
{
    std::uint64_t pairs = 0;
    for (const auto block : blocks)
        pairs += block.size();
    Progress progress("writing " + path, pairs);
    OutputFile file(path);
    if (format == PairFormat::csv) file.write("a,b\n");
    if (format == PairFormat::npy) file.write(npy_header("u4", "(" + std::to_string(pairs) + ", 2)"));

    const auto append_name = [&](std::string& text, std::uint32_t position) {
        if (ids.empty())
            append_number(text, position);
        else if (format == PairFormat::csv)
            text += csv_field(ids[position]);
        else
            text += ids.whole_numbers() ? std::string(ids[position]) : nlohmann::json(ids[position]).dump();
    };
    const auto append_raw = [&](std::string& bytes, std::uint32_t position) {
        std::uint32_t number = position;
        if (!ids.empty()) is_uint32(ids[position], number);
        char raw[sizeof number];
        std::memcpy(raw, &number, sizeof number);
        bytes.append(raw, sizeof raw);
    };
    constexpr std::size_t per_write = 4096; // small enough to stay in cache on its way
    std::string text;
    for (const auto block : blocks)
        for (std::size_t first = 0; first < block.size(); first += per_write) {
            const auto chunk = block.subspan(first, std::min(per_write, block.size() - first));
            text.clear();
            for (const Pair& pair : chunk) {
                switch (format) {
                case PairFormat::csv:
                    append_name(text, pair.a);
                    text += ',';
                    append_name(text, pair.b);
                    text += '\n';
                    break;
                case PairFormat::npy:
                    append_raw(text, pair.a);
                    append_raw(text, pair.b);
                    break;
                case PairFormat::json_lines:
                    text += "{\"a\":";
                    append_name(text, pair.a);
                    text += ",\"b\":";
                    append_name(text, pair.b);
                    text += "}\n";
                    break;
                }
            }
            file.write(text);
            progress.step(chunk.size());
        }
    file.commit();
}

} // namespace jostle_tool
