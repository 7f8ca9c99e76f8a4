// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cstdint>
#include <memory_resource>
#include <mutex>
#include <span>
#include <vector>

#include "jostle/pair_buffer.hpp"
#include "world/objects.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace world {

/// Behind every pair.
constexpr std::uint64_t no_key = ~std::uint64_t{0};

[[nodiscard]] inline std::uint64_t key_of(const Pair& pair) noexcept
{
    return std::uint64_t{pair.a} << 32 | pair.b;
}
[[nodiscard]] inline Pair pair_of(std::uint64_t key) noexcept
{
    return {static_cast<std::uint32_t>(key >> 32), static_cast<std::uint32_t>(key)};
}

/// Goes through ascending pairs that lie in blocks, from the first that isn't less than some key.
class PairCursor
{
  public:
    std::uint64_t key = no_key; // of the pair it stands at; `no_key` at the end

    PairCursor(std::span<const std::span<const Pair>> blocks, std::uint64_t from) noexcept
    {
        block_ = std::partition_point(blocks.data(), blocks.data() + blocks.size(),
                                      [from](const auto& block) { return key_of(block.back()) < from; });
        last_ = blocks.data() + blocks.size();
        if (block_ == last_) return;
        end_ = block_->data() + block_->size();
        at_ = std::partition_point(block_->data(), end_,
                                   [from](const Pair& pair) { return key_of(pair) < from; });
        key = key_of(*at_);
    }
    void next() noexcept { skip_to(at_ + 1); }

    /// The pairs from here on that lie side by side, and how many there are: no fewer than any number at the
    /// end, where one that is greater than all pairs stands for them.
    [[nodiscard]] const Pair* at() const noexcept { return at_; }
    [[nodiscard]] std::uint64_t left() const noexcept
    {
        return key == no_key ? no_key : static_cast<std::uint64_t>(end_ - at_);
    }
    /// One of these, or what follows the last of them.
    void skip_to(const Pair* place) noexcept
    {
        at_ = place;
        if (at_ == end_) {
            if (++block_ == last_) {
                at_ = &none_;
                key = no_key;
                return;
            }
            at_ = block_->data();
            end_ = at_ + block_->size();
        }
        key = key_of(*at_);
    }

  private:
    static constexpr Pair none_ = {~std::uint32_t{0}, ~std::uint32_t{0}};
    const Pair* at_ = &none_;
    const Pair* end_ = nullptr;
    const std::span<const Pair>* block_ = nullptr;
    const std::span<const Pair>* last_ = nullptr;
};

/// What tasks find in numbered runs, put in the order of the runs whichever task was first. How much memory
/// that takes doesn't depend on the tasks either.
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
    [[nodiscard]] std::uint64_t bytes() const noexcept
    {
        return values_.capacity() * sizeof(Value) + parts_.capacity() * sizeof(Part);
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
        /// Room for `most` values, of which `take` keeps the first. Not more than half of what `room` says.
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
    std::pmr::vector<Part> parts_; // of one run in its order
};

} // namespace world
JOSTLE_NAMESPACE_END
