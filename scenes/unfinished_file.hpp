// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>

namespace jostle_scenes {

/// A file that appears complete or not at all. It is written under another name in the same folder and takes
/// its own in commit(). Without commit() it is removed: by the destructor, or by a handler for every signal
/// that would end the program (but SIGKILL). A file that had the name before stays as it was until commit(),
/// and the new one keeps its permissions; where the name is a link, the file that it points to is replaced.
///
/// Nobody can place a file or a link in its way beforehand: the other name is random, and must be new.
///
/// Errors   std::system_error with the operating system's reason.
/// Threads  different files from different threads; at most 16 files at a time.
class UnfinishedFile
{
  public:
    /// `target` is a regular file or no file yet.
    explicit UnfinishedFile(const std::filesystem::path& target);
    ~UnfinishedFile();
    UnfinishedFile(const UnfinishedFile&) = delete;
    UnfinishedFile& operator=(const UnfinishedFile&) = delete;

    /// Appends.
    void write(std::string_view bytes);
    /// Writes over the first bytes of what was written.
    void write_over_start(std::string_view bytes);
    void commit();

  private:
    void create(int permissions);

    std::filesystem::path target_;
    std::size_t slot_; // where the signal handler finds the file's present name
    int fd_ = -1;
};

/// Writes all bytes to a file descriptor, whatever signals come in between.
void write_all(int fd, std::string_view bytes);

} // namespace jostle_scenes
