// SPDX-License-Identifier: MIT
#include "tool/system/unfinished_file.hpp"

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
#include <string>
#include <system_error>
#include <utility>

#include "tool/system/random_letters.hpp"
#include "tool/system/system.hpp"

namespace jostle_system {

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

} // namespace

struct UnfinishedFile::State
{
    std::filesystem::path target;
    std::size_t slot; // where the signal handler finds the file's present name
    int fd = -1;

    void create(int permissions);
};

UnfinishedFile::UnfinishedFile(const std::filesystem::path& target) : state_(std::make_unique<State>())
{
    State& state = *state_;
    state.slot = take_slot();
    try {
        std::error_code error;
        state.target = std::filesystem::weakly_canonical(target, error);
        if (error) state.target = target;
        struct stat before;
        const bool replaces = stat(state.target.c_str(), &before) == 0;
        if (replaces) {
            if (S_ISDIR(before.st_mode)) fail(EISDIR);
            if (!S_ISREG(before.st_mode)) fail(ESPIPE);
            if (access(state.target.c_str(), W_OK) != 0) fail(errno);
        }
        static const bool handled = (handle_signals(), true);
        (void)handled;
        // Nobody else may read what replaces a private file, not even while it is empty.
        state.create(replaces ? 0600 : 0666);
        if (replaces && fchmod(state.fd, before.st_mode & 07777) != 0) {
            // Some file systems have no permissions.
        }
    } catch (...) {
        slots[state.slot].taken = false;
        throw;
    }
}

void UnfinishedFile::State::create(int permissions)
{
    Slot& place = slots[slot];
    for (int attempt = 0;; ++attempt) {
        const std::string name = target.string() + "." + random_letters() + ".part";
        if (name.size() >= sizeof place.name) fail(ENAMETOOLONG);
        std::memcpy(place.name, name.c_str(), name.size() + 1);
        place.unfinished = true; // before there is a file: a signal may come at any time
        fd = open(place.name, O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, permissions);
        if (fd >= 0) return;
        const int error = errno;
        place.unfinished = false;
        if (error != EEXIST || attempt == 100) fail(error);
    }
}

UnfinishedFile::~UnfinishedFile()
{
    if (state_->fd >= 0) close(state_->fd);
    if (slots[state_->slot].unfinished.exchange(false)) unlink(slots[state_->slot].name);
    slots[state_->slot].taken = false;
}

void UnfinishedFile::write(std::string_view bytes)
{
    write_all(state_->fd, bytes);
}

void UnfinishedFile::write_over_start(std::string_view bytes)
{
    if (lseek(state_->fd, 0, SEEK_SET) < 0) fail(errno);
    write_all(state_->fd, bytes);
    if (lseek(state_->fd, 0, SEEK_END) < 0) fail(errno);
}

void UnfinishedFile::commit()
{
    // Some file systems find out only now that the disk is full.
    if (close(std::exchange(state_->fd, -1)) != 0) fail(errno);
    if (std::rename(slots[state_->slot].name, state_->target.c_str()) != 0) fail(errno);
    slots[state_->slot].unfinished = false;
}

} // namespace jostle_system
