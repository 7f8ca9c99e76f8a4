// SPDX-License-Identifier: MIT
#include "scenes/unfinished_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <climits>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <random>
#include <system_error>
#include <utility>

namespace jostle_scenes {

namespace {

// What a signal handler may look at: plain memory and atomic flags.
struct Slot
{
    std::atomic<bool> taken{false};
    std::atomic<bool> unfinished{false}; // `name` is to be removed
    char name[PATH_MAX];
};
std::array<Slot, 16> slots;

extern "C" void remove_unfinished_and_die(int signal)
{
    for (Slot& slot : slots)
        if (slot.unfinished.load()) unlink(slot.name);
    std::signal(signal, SIG_DFL);
    std::raise(signal); // comes when this handler has returned
}

/// Once per process: signals that the user or the caller of the program ignores stay ignored.
void handle_signals()
{
    constexpr int not_deadly[] = {SIGKILL, SIGSTOP, SIGCHLD, SIGCONT,  SIGTSTP,
                                  SIGTTIN, SIGTTOU, SIGURG,  SIGWINCH, SIGXFSZ};
    struct sigaction action = {};
    action.sa_handler = remove_unfinished_and_die;
    sigfillset(&action.sa_mask);
    for (int signal = 1; signal <= SIGRTMAX; ++signal) {
        struct sigaction present;
        if (std::find(std::begin(not_deadly), std::end(not_deadly), signal) == std::end(not_deadly) &&
            sigaction(signal, nullptr, &present) == 0 && present.sa_handler == SIG_DFL)
            sigaction(signal, &action, nullptr);
    }
    std::signal(SIGXFSZ, SIG_IGN); // a limit on file sizes is then an error like a full disk
}

[[noreturn]] void fail(int error)
{
    throw std::system_error(error, std::generic_category());
}

std::size_t take_slot()
{
    for (std::size_t i = 0; i < slots.size(); ++i)
        if (!slots[i].taken.exchange(true)) return i;
    fail(EMFILE);
}

std::string random_letters()
{
    std::random_device random;
    std::string letters;
    for (int i = 0; i < 12; ++i)
        letters += static_cast<char>('a' + random() % 26);
    return letters;
}

} // namespace

UnfinishedFile::UnfinishedFile(const std::filesystem::path& target) : slot_(take_slot())
{
    try {
        std::error_code error;
        target_ = std::filesystem::weakly_canonical(target, error);
        if (error) target_ = target;
        struct stat before;
        const bool replaces = stat(target_.c_str(), &before) == 0;
        if (replaces) {
            if (S_ISDIR(before.st_mode)) fail(EISDIR);
            if (!S_ISREG(before.st_mode)) fail(ESPIPE);
            if (access(target_.c_str(), W_OK) != 0) fail(errno);
        }
        static const bool handled = (handle_signals(), true);
        (void)handled;
        // Nobody else may read what replaces a private file, not even while it is empty.
        create(replaces ? 0600 : 0666);
        if (replaces && fchmod(fd_, before.st_mode & 07777) != 0) {
            // Some file systems have no permissions.
        }
    } catch (...) {
        slots[slot_].taken = false;
        throw;
    }
}

void UnfinishedFile::create(int permissions)
{
    Slot& slot = slots[slot_];
    for (int attempt = 0;; ++attempt) {
        const std::string name = target_.string() + "." + random_letters() + ".part";
        if (name.size() >= sizeof slot.name) fail(ENAMETOOLONG);
        std::memcpy(slot.name, name.c_str(), name.size() + 1);
        slot.unfinished = true; // before there is a file: a signal may come at any time
        fd_ = open(slot.name, O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, permissions);
        if (fd_ >= 0) return;
        const int error = errno;
        slot.unfinished = false;
        if (error != EEXIST || attempt == 100) fail(error);
    }
}

UnfinishedFile::~UnfinishedFile()
{
    if (fd_ >= 0) close(fd_);
    if (slots[slot_].unfinished.exchange(false)) unlink(slots[slot_].name);
    slots[slot_].taken = false;
}

void UnfinishedFile::write(std::string_view bytes)
{
    write_all(fd_, bytes);
}

void UnfinishedFile::write_over_start(std::string_view bytes)
{
    if (lseek(fd_, 0, SEEK_SET) < 0) fail(errno);
    write_all(fd_, bytes);
    if (lseek(fd_, 0, SEEK_END) < 0) fail(errno);
}

void UnfinishedFile::commit()
{
    // Some file systems find out only now that the disk is full.
    if (close(std::exchange(fd_, -1)) != 0) fail(errno);
    if (std::rename(slots[slot_].name, target_.c_str()) != 0) fail(errno);
    slots[slot_].unfinished = false;
}

void write_all(int fd, std::string_view bytes)
{
    while (!bytes.empty()) {
        const ssize_t written = ::write(fd, bytes.data(), bytes.size());
        if (written >= 0)
            bytes.remove_prefix(static_cast<std::size_t>(written));
        else if (errno != EINTR)
            fail(errno);
    }
}

} // namespace jostle_scenes
