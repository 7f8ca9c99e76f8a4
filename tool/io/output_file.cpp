// SPDX-License-Identifier: MIT
#include "output_file.hpp"

#include <cerrno>
#include <cstdio>
#include <filesystem>
#include <system_error>
#include <utility>

#include "tool/commands.hpp"
#include "tool/system/system.hpp"

namespace jostle_tool {

namespace {

constexpr std::size_t buffer_size = std::size_t{1} << 20;
constexpr int standard_output = 1;

bool is_over_quota([[maybe_unused]] const std::error_code& error)
{
#ifdef EDQUOT // which Windows doesn't have
    return error.value() == EDQUOT;
#else
    return false;
#endif
}

} // namespace

OutputFile::OutputFile(const std::string& path) : name_(path == "-" ? "stdout" : path)
{
    buffer_.reserve(buffer_size);
    const std::filesystem::path place = jostle_system::path_of(path);
    if (path == "-") {
        std::fflush(stdout);
        direct_ = standard_output;
        return;
    }
    if (jostle_system::is_stream(place)) {
        attempt([&] { direct_ = jostle_system::open_to_write(place); });
        return;
    }
    attempt([&] { file_.emplace(place); });
}

OutputFile::~OutputFile()
{
    if (direct_ < 0 || direct_ == standard_output) return;
    try {
        jostle_system::close_file(direct_);
    } catch (const std::system_error&) {
        // Without commit() the file isn't used.
    }
}

void OutputFile::write(std::string_view bytes)
{
    buffer_ += bytes;
    if (buffer_.size() >= buffer_size) flush();
}

void OutputFile::flush()
{
    attempt([&] { file_ ? file_->write(buffer_) : jostle_system::write_all(direct_, buffer_); });
    buffer_.clear();
}

void OutputFile::commit()
{
    flush();
    if (file_)
        attempt([&] { file_->commit(); });
    else if (direct_ != standard_output)
        attempt([&] { jostle_system::close_file(std::exchange(direct_, -1)); });
}

void keep_input(const std::string& in, const std::string& out)
{
    std::error_code ignored;
    if (std::filesystem::equivalent(jostle_system::path_of(in), jostle_system::path_of(out), ignored))
        throw UsageError(out + ": is the input itself; choose another name for the output");
}

template <class Work>
void OutputFile::attempt(const Work& work)
{
    try {
        work();
    } catch (const std::system_error& error) {
        const bool full = error.code() == std::errc::no_space_on_device ||
                          error.code() == std::errc::file_too_large || is_over_quota(error.code());
        throw UsageError(name_ + ": " + error.code().message() + "; " +
                         (full ? "make room, or write elsewhere" : "choose another place"));
    }
}

} // namespace jostle_tool
