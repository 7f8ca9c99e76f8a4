// SPDX-License-Identifier: MIT
#ifndef NOMINMAX
#define NOMINMAX
#endif
#include <windows.h>

#include <fcntl.h>
#include <io.h>

#include <cerrno>
#include <cstdio>
#include <string>
#include <system_error>
#include <utility>

#include "tool/system/random_letters.hpp"
#include "tool/system/system.hpp"
#include "tool/system/unfinished_file.hpp"

namespace jostle_system {

namespace {

[[noreturn]] void fail(int error)
{
    throw std::system_error(error, std::generic_category());
}

/// The last error of a call to the system, as the C library would number it.
int last_error()
{
    const std::error_condition condition =
        std::error_code(static_cast<int>(GetLastError()), std::system_category()).default_error_condition();
    return condition.category() == std::generic_category() ? condition.value() : EIO;
}

HANDLE handle_of(int fd)
{
    return reinterpret_cast<HANDLE>(_get_osfhandle(fd));
}

/// Whether the system removes the file when it is closed: by the program, or by its end, however that comes.
bool remove_at_end(HANDLE file, bool remove)
{
    FILE_DISPOSITION_INFO info{};
    info.DeleteFile = remove ? TRUE : FALSE;
    return SetFileInformationByHandle(file, FileDispositionInfo, &info, sizeof info) != 0;
}

} // namespace

struct UnfinishedFile::State
{
    std::filesystem::path target, part; // the name that it will have, and its present one
    bool replaces = false;
    int fd = -1;
};

UnfinishedFile::UnfinishedFile(const std::filesystem::path& target) : state_(std::make_unique<State>())
{
    State& state = *state_;
    if (is_stream(target)) fail(ESPIPE);
    std::error_code error;
    state.target = std::filesystem::weakly_canonical(target, error);
    if (error) state.target = target;
    const std::filesystem::file_status before = std::filesystem::status(state.target, error);
    state.replaces = std::filesystem::exists(before);
    if (state.replaces) {
        if (std::filesystem::is_directory(before)) fail(EISDIR);
        // The attribute stops also those who may write to anything.
        if ((GetFileAttributesW(state.target.c_str()) & FILE_ATTRIBUTE_READONLY) != 0) fail(EACCES);
        close_file(open_to_write(state.target)); // says whether it may be written to
    }
    for (int attempt = 0;; ++attempt) {
        state.part = state.target;
        state.part += "." + random_letters() + ".part";
        const HANDLE file =
            CreateFileW(state.part.c_str(), GENERIC_WRITE | DELETE, FILE_SHARE_READ | FILE_SHARE_DELETE,
                        nullptr, CREATE_NEW, FILE_ATTRIBUTE_NORMAL, nullptr);
        if (file != INVALID_HANDLE_VALUE) {
            remove_at_end(file, true); // a file system that can't has the destructor alone
            state.fd = _open_osfhandle(reinterpret_cast<std::intptr_t>(file), _O_BINARY);
            if (state.fd >= 0) return;
            CloseHandle(file);
            fail(EMFILE);
        }
        const int reason = last_error();
        if (reason != EEXIST || attempt == 100) fail(reason);
    }
}

UnfinishedFile::~UnfinishedFile()
{
    if (state_->fd >= 0) _close(state_->fd);
    DeleteFileW(state_->part.c_str()); // fails where the system has done so, or it has its own name
}

void UnfinishedFile::write(std::string_view bytes)
{
    write_all(state_->fd, bytes);
}

void UnfinishedFile::write_over_start(std::string_view bytes)
{
    if (_lseeki64(state_->fd, 0, SEEK_SET) < 0) fail(errno);
    write_all(state_->fd, bytes);
    if (_lseeki64(state_->fd, 0, SEEK_END) < 0) fail(errno);
}

void UnfinishedFile::commit()
{
    remove_at_end(handle_of(state_->fd), false);
    close_file(std::exchange(state_->fd, -1));
    // ReplaceFile keeps who may do what with the file. Some file systems don't have it.
    const wchar_t* const part = state_->part.c_str();
    const wchar_t* const target = state_->target.c_str();
    if (state_->replaces && ReplaceFileW(target, part, nullptr, 0, nullptr, nullptr) != 0) return;
    if (MoveFileExW(part, target, MOVEFILE_REPLACE_EXISTING) == 0) fail(last_error());
}

} // namespace jostle_system
