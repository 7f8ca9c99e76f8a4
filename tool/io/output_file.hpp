// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace jostle_tool {

/// A file that appears complete or not at all: it is written under another name in the same folder and takes
/// its own in commit(). Without commit() (an error, or a signal that ends the program) it leaves nothing, and
/// a file that had the name before stays. "-" is stdout, and devices and pipes are written directly.
///
/// One at a time per process (signals know of one file only). Errors are UsageErrors that name the file.
class OutputFile
{
  public:
    explicit OutputFile(const std::string& path);
    ~OutputFile();
    OutputFile(const OutputFile&) = delete;
    OutputFile& operator=(const OutputFile&) = delete;

    /// Buffered.
    void write(std::string_view bytes);
    void commit();

  private:
    void flush();
    [[noreturn]] void fail(int error) const;

    std::string name_;   // as the user wrote it
    std::string target_; // what it is renamed to; empty if written directly
    int fd_ = -1;
    std::string buffer_;
};

} // namespace jostle_tool
