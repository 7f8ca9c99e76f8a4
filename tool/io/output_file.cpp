// SPDX-License-Identifier: MIT
#include "output_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <climits>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <utility>

#include "tool/commands.hpp"

namespace jostle_tool {

namespace {

constexpr std::size_t buffer_size = std::size_t{1} << 20;

// What a signal handler may look at: plain memory and an atomic flag.
char unfinished[PATH_MAX];
std::atomic<bool> has_unfinished{false};

extern "C" void remove_unfinished_and_die(int signal)
{
    if (has_unfinished.load()) unlink(unfinished);
    std::signal(signal, SIG_DFL);
    std::raise(signal);
}

} // namespace

OutputFile::OutputFile(const std::string& path) : name_(path == "-" ? "stdout" : path)
{
    buffer_.reserve(buffer_size);
    if (path == "-") {
        std::fflush(stdout);
        fd_ = STDOUT_FILENO;
        return;
    }
    std::error_code error;
    // A link is followed: the file that it names is the one to be replaced.
    std::filesystem::path target = std::filesystem::weakly_canonical(path, error);
    if (error) target = path;
    const std::filesystem::file_status status = std::filesystem::status(target, error);
    if (std::filesystem::is_directory(status)) fail(EISDIR);
    if (std::filesystem::exists(status) && !std::filesystem::is_regular_file(status)) {
        fd_ = open(path.c_str(), O_WRONLY | O_CLOEXEC);
        if (fd_ < 0) fail(errno);
        return;
    }
    if (std::filesystem::exists(status) && access(target.c_str(), W_OK) != 0) fail(errno);
    const std::string temporary = target.string() + "." + std::to_string(getpid()) + ".part";
    if (temporary.size() >= sizeof unfinished) fail(ENAMETOOLONG);
    std::memcpy(unfinished, temporary.c_str(), temporary.size() + 1);
    has_unfinished = true; // before there is a file: a signal may come at any time
    for (const int signal : {SIGINT, SIGTERM, SIGHUP})
        std::signal(signal, remove_unfinished_and_die);
    std::signal(SIGXFSZ, SIG_IGN); // a limit on file sizes is then an error like a full disk
    fd_ = open(temporary.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
    if (fd_ < 0) {
        const int error_of_open = errno;
        has_unfinished = false;
        fail(error_of_open);
    }
    if (std::filesystem::exists(status)) { // keep the permissions of the file it replaces
        struct stat before;
        if (stat(target.c_str(), &before) == 0 && fchmod(fd_, before.st_mode & 07777) != 0) {
            // Not ours to change: the new file then has the usual permissions.
        }
    }
    target_ = target.string();
}

OutputFile::~OutputFile()
{
    if (fd_ >= 0 && fd_ != STDOUT_FILENO) close(fd_);
    if (has_unfinished.exchange(false)) unlink(unfinished);
}

void OutputFile::write(std::string_view bytes)
{
    buffer_ += bytes;
    if (buffer_.size() >= buffer_size) flush();
}

void OutputFile::flush()
{
    for (std::string_view left = buffer_; !left.empty();) {
        const ssize_t written = ::write(fd_, left.data(), left.size());
        if (written < 0) {
            if (errno == EINTR) continue;
            fail(errno);
        }
        left.remove_prefix(static_cast<std::size_t>(written));
    }
    buffer_.clear();
}

void OutputFile::commit()
{
    flush();
    if (fd_ == STDOUT_FILENO) return;
    // Some file systems find out only now that the disk is full.
    if (close(std::exchange(fd_, -1)) != 0) fail(errno);
    if (target_.empty()) return;
    if (std::rename(unfinished, target_.c_str()) != 0) fail(errno);
    has_unfinished = false;
}

void OutputFile::fail(int error) const
{
    throw UsageError(name_ + ": " + std::strerror(error) + "; " +
                     (error == ENOSPC || error == EDQUOT || error == EFBIG ? "make room, or write elsewhere"
                                                                           : "choose another place"));
}

} // namespace jostle_tool
