// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

namespace jostle_tool {

/// A file that is read once, from its beginning to its end, so that it may also be a pipe or a device.
/// "-" is stdin. Errors are UsageErrors that name the file.
class InputFile
{
  public:
    explicit InputFile(const std::string& path);
    /// Bytes in memory, which must stay there, as a file of this name or, without a size, a pipe.
    InputFile(std::string name, std::span<const char> bytes, bool has_size = true);
    ~InputFile();
    InputFile(const InputFile&) = delete;
    InputFile& operator=(const InputFile&) = delete;

    [[nodiscard]] const std::string& name() const noexcept { return name_; }
    /// In bytes; none if it isn't known before the end.
    [[nodiscard]] std::optional<std::uint64_t> size() const noexcept { return size_; }

    /// Reads up to `most` bytes and returns how many: 0 at the end only.
    std::size_t read(char* to, std::size_t most);

  private:
    std::string name_; // as the user wrote it
    int file_;
    std::span<const char> memory_; // what is left of it, if there is no file
    std::optional<std::uint64_t> size_;
};

} // namespace jostle_tool
