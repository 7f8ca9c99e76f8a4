// SPDX-License-Identifier: MIT
#include "input_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "tool/commands.hpp"

#ifndef O_CLOEXEC // Windows, where files are text unless they are said to be none
#define O_CLOEXEC O_BINARY
#endif

namespace jostle_tool {

InputFile::InputFile(const std::string& path)
    : name_(path == "-" ? "stdin" : path),
      fd_(path == "-" ? STDIN_FILENO : open(path.c_str(), O_RDONLY | O_CLOEXEC))
{
    if (fd_ < 0)
        throw UsageError(name_ + ": " + std::strerror(errno) + "; check the name and its permissions");
    struct stat status;
    if (fstat(fd_, &status) == 0 && S_ISREG(status.st_mode) && fd_ != STDIN_FILENO)
        size_ = static_cast<std::uint64_t>(status.st_size);
}

InputFile::~InputFile()
{
    if (fd_ > STDIN_FILENO) close(fd_);
}

std::size_t InputFile::read(char* to, std::size_t most)
{
    for (;;) {
        const ssize_t got = ::read(fd_, to, static_cast<unsigned>(std::min(most, std::size_t{1} << 24)));
        if (got >= 0) return static_cast<std::size_t>(got);
        if (errno != EINTR)
            throw UsageError(name_ + ": " + std::strerror(errno) + " while reading; check the file");
    }
}

} // namespace jostle_tool
