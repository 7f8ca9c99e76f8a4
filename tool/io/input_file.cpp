// SPDX-License-Identifier: MIT
#include "input_file.hpp"

#include <algorithm>
#include <system_error>
#include <utility>

#include "tool/commands.hpp"
#include "tool/system/system.hpp"

namespace jostle_tool {

namespace {

constexpr int standard_input = 0, no_file = -1;

} // namespace

InputFile::InputFile(const std::string& path) : name_(path == "-" ? "stdin" : path), file_(standard_input)
{
    if (path == "-") return;
    try {
        file_ = jostle_system::open_to_read(jostle_system::path_of(path));
    } catch (const std::system_error& error) {
        throw UsageError(name_ + ": " + error.code().message() + "; check the name and its permissions");
    }
    size_ = jostle_system::size_of(file_);
}

InputFile::InputFile(std::string name, std::span<const char> bytes, bool has_size)
    : name_(std::move(name)), file_(no_file), memory_(bytes)
{
    if (has_size) size_ = bytes.size();
}

InputFile::~InputFile()
{
    if (file_ == standard_input || file_ == no_file) return;
    try {
        jostle_system::close_file(file_);
    } catch (const std::system_error&) {
        // Of a file that was only read there is nothing to lose.
    }
}

std::size_t InputFile::read(char* to, std::size_t most)
{
    if (file_ == no_file) {
        const std::size_t count = std::min(most, memory_.size());
        std::copy_n(memory_.begin(), count, to);
        memory_ = memory_.subspan(count);
        return count;
    }
    try {
        return jostle_system::read_some(file_, to, most);
    } catch (const std::system_error& error) {
        throw UsageError(name_ + ": " + error.code().message() + " while reading; check the file");
    }
}

} // namespace jostle_tool
