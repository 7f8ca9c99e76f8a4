// SPDX-License-Identifier: MIT
#pragma once

#include <sys/mman.h>
#include <unistd.h>

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <optional>
#include <span>
#include <string>

#include "target.hpp"
#include "tool/commands.hpp"
#include "tool/io/boxes.hpp"

namespace fuzz {

/// A file that readers can open by its name and that is in memory.
class MemoryFile
{
  public:
    MemoryFile() : fd_(memfd_create("input", MFD_CLOEXEC)), name_("/proc/self/fd/" + std::to_string(fd_))
    {
        if (fd_ < 0) std::perror("memfd_create"), std::exit(2);
    }
    MemoryFile(const MemoryFile&) = delete;
    MemoryFile& operator=(const MemoryFile&) = delete;
    ~MemoryFile() { close(fd_); }

    [[nodiscard]] const std::string& name() const { return name_; }
    template <class Bytes>
    void write(const Bytes& bytes)
    {
        if (ftruncate(fd_, 0) != 0 ||
            pwrite(fd_, bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size()))
            std::perror("pwrite"), std::exit(2);
    }

  private:
    int fd_;
    std::string name_;
};

/// What a file reads as: refused in words that name it, or boxes.
template <class Bytes, class Read>
std::optional<jostle_tool::BoxSet> read_or_refuse(const Bytes& bytes, const Read& read)
{
    static MemoryFile file;
    file.write(bytes);
    try {
        return read(file.name());
    } catch (const jostle_tool::UsageError& error) {
        demand(std::string(error.what()).starts_with(file.name()), "a refusal that doesn't name the file");
        return std::nullopt;
    }
}

/// Bit by bit, so that NaN counts as well.
inline bool same_boxes(const jostle_tool::BoxSet& a, const jostle_tool::BoxSet& b)
{
    return std::visit(
        [&](const auto& boxes) {
            const auto* const others = std::get_if<std::decay_t<decltype(boxes)>>(&b.boxes);
            return others != nullptr && others->size() == boxes.size() &&
                   (boxes.empty() ||
                    std::memcmp(boxes.data(), others->data(), boxes.size() * sizeof boxes[0]) == 0);
        },
        a.boxes);
}

} // namespace fuzz
