// SPDX-License-Identifier: MIT
#include "input_file.hpp"

#include <system_error>

#include "system/system.hpp"
#include "tool/commands.hpp"

namespace jostle_tool {

namespace {

constexpr int standard_input = 0;

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

InputFile::~InputFile()
{
    if (file_ == standard_input) return;
    try {
        jostle_system::close_file(file_);
    } catch (const std::system_error&) {
        // Of a file that was only read there is nothing to lose.
    }
}

std::size_t InputFile::read(char* to, std::size_t most)
{
    try {
        return jostle_system::read_some(file_, to, most);
    } catch (const std::system_error& error) {
        throw UsageError(name_ + ": " + error.code().message() + " while reading; check the file");
    }
}

} // namespace jostle_tool
