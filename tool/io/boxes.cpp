// SPDX-License-Identifier: MIT
#include "boxes.hpp"

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <functional>

#include "tool/commands.hpp"

namespace jostle_tool {

namespace {

bool is_whole_number(std::string_view text)
{
    if (text.substr(0, 1) == "-") text.remove_prefix(1);
    if (text.empty() || text.size() > 18) return false; // 18 digits fit 64 bits, signed or not
    if (text.front() == '0') return text.size() == 1;
    return text.find_first_not_of("0123456789") == std::string_view::npos;
}

} // namespace

std::optional<std::uint32_t> Ids::add(std::string_view id)
{
    if (3 * (size() + 1) > 2 * table_.size()) grow_table();
    const std::size_t mask = table_.size() - 1;
    std::size_t slot = std::hash<std::string_view>()(id) & mask;
    for (; table_[slot] != 0; slot = (slot + 1) & mask)
        if ((*this)[table_[slot] - 1] == id) return table_[slot] - 1;
    text_ += id;
    ends_.push_back(text_.size());
    table_[slot] = static_cast<std::uint32_t>(size());
    whole_numbers_ = whole_numbers_ && is_whole_number(id);
    return std::nullopt;
}

void Ids::grow_table()
{
    table_.assign(table_.empty() ? 64 : 2 * table_.size(), 0);
    const std::size_t mask = table_.size() - 1;
    for (std::size_t i = 0; i < size(); ++i) {
        std::size_t slot = std::hash<std::string_view>()((*this)[i]) & mask;
        while (table_[slot] != 0)
            slot = (slot + 1) & mask;
        table_[slot] = static_cast<std::uint32_t>(i + 1);
    }
}

std::string extension_of(const std::string& path)
{
    std::string extension = std::filesystem::path(path).extension().string();
    for (char& c : extension)
        if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
    return extension;
}

std::string quote(std::string_view text)
{
    constexpr std::size_t longest = 40;
    std::string quoted = "\"";
    for (char c : text.substr(0, longest))
        quoted += (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) ? '?' : c;
    return quoted + (text.size() > longest ? "...\"" : "\"");
}

BoxSet read_boxes(const std::string& path, const ReadOptions& options)
{
    const std::string extension = path == "-" ? ".csv" : extension_of(path);
    const bool mesh =
        extension != ".csv" && extension != ".npy" && extension != ".jrec" && is_mesh_extension(extension);
    if (options.parts && !mesh)
        throw UsageError(path + ": --parts is for meshes only; leave it out for this file");
    if (options.frame && extension != ".jrec")
        throw UsageError(path + ": --frame is for recordings (.jrec) only; leave it out for this file");
    if (path != "-") {
        // The readers would find out as well, but each in the words of its own library.
        std::error_code error;
        if (std::filesystem::is_directory(path, error))
            throw UsageError(path + ": is a directory; name a file");
        std::FILE* file = std::fopen(path.c_str(), "rb");
        if (file == nullptr)
            throw UsageError(path + ": " + std::strerror(errno) + "; check the name and its permissions");
        std::fclose(file);
    }
    if (extension == ".csv") return read_csv(path);
    if (extension == ".npy") return read_npy(path);
    if (extension == ".jrec") return read_recording(path, options.frame.value_or(0));
    if (mesh) return read_mesh(path, options.parts);
    throw UsageError(
        path + ": " +
        (extension.empty() ? "the name has no extension" : "can't read " + extension + " files") +
        "; give a .csv, .npy or .jrec file, or a mesh (.obj, .stl, .ply, .glb, ...)");
}

} // namespace jostle_tool
