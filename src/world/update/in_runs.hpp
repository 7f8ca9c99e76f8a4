// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory_resource>
#include <mutex>
#include <vector>

#include "jostle/version.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace world {

/// Collects what tasks find in numbered runs, in the order of the runs, whichever task was first. Nor does
/// its memory depend on the tasks.
template <class Value>
class InRuns
{
  public:
    explicit InRuns(std::pmr::memory_resource* memory) : values_(memory), parts_(memory) {}

    void clear() noexcept
    {
        values_.clear();
        parts_.clear();
    }
    /// Copies them all to `out`.
    void copy_to(std::pmr::vector<Value>& out)
    {
        std::sort(parts_.begin(), parts_.end(), [](const Part& x, const Part& y) {
            return x.run != y.run ? x.run < y.run : x.begin < y.begin;
        });
        out.clear();
        out.reserve(values_.size());
        for (const Part& part : parts_)
            out.insert(out.end(), values_.begin() + static_cast<std::ptrdiff_t>(part.begin),
                       values_.begin() + static_cast<std::ptrdiff_t>(part.begin + part.count));
    }
    /// The task's side.
    class Run
    {
      public:
        Run(InRuns& all, std::uint32_t number) : all_(all), number_(number) {}
        void push(const Value& value)
        {
            if (count_ == room) flush();
            values_[count_++] = value;
        }
        /// Returns room for `most` values, of which `take` keeps the first. At most half of what `room`
        /// returns.
        [[nodiscard]] Value* make_room(std::size_t most)
        {
            if (count_ + most > room) flush();
            return values_ + count_;
        }
        void take(std::size_t count) noexcept { count_ += static_cast<std::uint32_t>(count); }
        void flush()
        {
            if (count_ == 0) return;
            const std::lock_guard lock(all_.mutex_);
            all_.parts_.push_back({number_, count_, all_.values_.size()});
            all_.values_.insert(all_.values_.end(), values_, values_ + count_);
            count_ = 0;
        }

      private:
        static constexpr std::uint32_t room = 256;
        InRuns& all_;
        std::uint32_t number_, count_ = 0;
        Value values_[room];
    };

  private:
    struct Part
    {
        std::uint32_t run, count;
        std::size_t begin;
    };
    std::mutex mutex_;
    std::pmr::vector<Value> values_;
    std::pmr::vector<Part> parts_; // in the order of the runs
};

} // namespace world
JOSTLE_NAMESPACE_END
