// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <memory>
#include <string_view>

namespace jostle_system {

/// A file that appears complete or not at all. It is written under another name in the same folder and takes
/// its own in commit(). Without commit() it is removed: by the destructor, or when the program is ended: by a
/// handler for every signal that would do so (but SIGKILL), and on Windows by the system. A file that had the
/// name before stays as it was until commit(), and the new one keeps its permissions; where the name is a
/// link, the file that it points to is replaced (except on Windows, where the link is).
///
/// No file or link can be placed in its way beforehand: the other name is random, and must be new.
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
    struct State;
    std::unique_ptr<State> state_;
};

} // namespace jostle_system
