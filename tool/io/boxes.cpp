// SPDX-License-Identifier: MIT
#include "boxes.hpp"

#include <filesystem>
#include <functional>

#include "input_file.hpp"
#include "tool/commands.hpp"
#include "tool/system/system.hpp"

namespace jostle_tool {

namespace {

bool is_whole_number(std::string_view text)
{
    if (text == "0") return true;
    if (text.substr(0, 1) == "-") text.remove_prefix(1);
    if (text.empty() || text.size() > 15 || text.front() == '0') return false;
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
    std::string extension = jostle_system::text_of(jostle_system::path_of(path).extension());
    for (char& c : extension)
        if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
    return extension;
}

BoxSet read_boxes(const std::string& path, const ReadOptions& options)
{
    std::string extension = path == "-" ? ".csv" : extension_of(path);
    if (path != "-") {
        std::error_code error;
        const std::filesystem::file_status status =
            std::filesystem::status(jostle_system::path_of(path), error);
        if (error) throw UsageError(path + ": " + error.message() + "; check the name and its permissions");
        if (std::filesystem::is_directory(status)) throw UsageError(path + ": is a directory; name a file");
        // A shell's <(...) is a pipe without an extension; /dev/stdin may well be a file.
        const bool stream = !std::filesystem::is_regular_file(status) || path.starts_with("/dev/");
        if (extension.empty() && stream) extension = ".csv";
    }
    const bool mesh =
        extension != ".csv" && extension != ".npy" && extension != ".jrec" && is_mesh_extension(extension);
    if (options.parts && !mesh)
        throw UsageError(path + ": --parts is for meshes only; leave it out for this file");
    if (options.frame && extension != ".jrec")
        throw UsageError(path + ": --frame is for recordings (.jrec) only; leave it out for this file");
    if (extension == ".csv" || extension == ".npy") {
        InputFile file(path);
        return extension == ".csv" ? read_csv(file) : read_npy(file);
    }
    if (extension == ".jrec") return read_recording(path, options.frame.value_or(0));
    if (mesh) return read_mesh(path, options.parts);
    throw UsageError(
        path + ": " +
        (extension.empty() ? "the name has no extension" : "can't read " + extension + " files") +
        "; give a .csv, .npy or .jrec file, or a mesh (.obj, .stl, .ply, .glb, ...)");
}

} // namespace jostle_tool
