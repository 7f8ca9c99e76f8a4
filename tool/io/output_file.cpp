// SPDX-License-Identifier: MIT
#include "output_file.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <system_error>
#include <utility>

#include "tool/commands.hpp"

namespace jostle_tool {

namespace {

constexpr std::size_t buffer_size = std::size_t{1} << 20;

} // namespace

OutputFile::OutputFile(const std::string& path) : name_(path == "-" ? "stdout" : path)
{
    buffer_.reserve(buffer_size);
    if (path == "-") {
        std::fflush(stdout);
        fd_ = STDOUT_FILENO;
        return;
    }
    std::error_code unknown; // then opening it will say
    const std::filesystem::file_status status = std::filesystem::status(path, unknown);
    if (std::filesystem::exists(status) && !std::filesystem::is_regular_file(status)) {
        fd_ = open(path.c_str(), O_WRONLY | O_CLOEXEC);
        if (fd_ < 0) fail(errno);
        return;
    }
    attempt([&] { file_.emplace(path); });
}

OutputFile::~OutputFile()
{
    if (fd_ >= 0 && fd_ != STDOUT_FILENO) close(fd_);
}

void OutputFile::write(std::string_view bytes)
{
    buffer_ += bytes;
    if (buffer_.size() >= buffer_size) flush();
}

void OutputFile::flush()
{
    attempt([&] { file_ ? file_->write(buffer_) : jostle_scenes::write_all(fd_, buffer_); });
    buffer_.clear();
}

void OutputFile::commit()
{
    flush();
    if (file_)
        attempt([&] { file_->commit(); });
    else if (fd_ != STDOUT_FILENO && close(std::exchange(fd_, -1)) != 0)
        fail(errno);
}

template <class Work>
void OutputFile::attempt(const Work& work)
{
    try {
        work();
    } catch (const std::system_error& error) {
        fail(error.code().value());
    }
}

void OutputFile::fail(int error) const
{
    throw UsageError(name_ + ": " + std::strerror(error) + "; " +
                     (error == ENOSPC || error == EDQUOT || error == EFBIG ? "make room, or write elsewhere"
                                                                           : "choose another place"));
}

} // namespace jostle_tool
