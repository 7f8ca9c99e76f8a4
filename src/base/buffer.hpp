// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cstddef>
#include <memory_resource>
#include <type_traits>
#include <utility>

#include "jostle/version.hpp"

JOSTLE_NAMESPACE_BEGIN

/// Working memory: grows, never shrinks by itself, and leaves its elements uninitialised.
template <class T>
class Buffer
{
    static_assert(std::is_trivially_destructible_v<T>);
    static constexpr std::size_t alignment = alignof(T) > 64 ? alignof(T) : 64;

  public:
    explicit Buffer(std::pmr::memory_resource* memory) noexcept : memory_(memory) {}
    Buffer(Buffer&& other) noexcept
        : memory_(other.memory_),
          data_(std::exchange(other.data_, nullptr)),
          capacity_(std::exchange(other.capacity_, 0))
    {
    }
    Buffer& operator=(Buffer&&) = delete;
    ~Buffer() { release(); }

    /// Room for `count` elements; what was in it is lost if it has to grow. It grows by a quarter more than
    /// asked, so that a scene whose size varies doesn't allocate at every new record.
    T* reserve(std::size_t count)
    {
        if (count > capacity_) reserve_exactly(count + count / 4 + 16);
        return data_;
    }
    T* reserve_exactly(std::size_t capacity)
    {
        if (capacity > capacity_) {
            T* grown = static_cast<T*>(memory_->allocate(capacity * sizeof(T), alignment));
            release();
            data_ = grown;
            capacity_ = capacity;
        }
        return data_;
    }
    /// Room for `count` elements, the first `used` of which are kept.
    T* grow(std::size_t count, std::size_t used)
    {
        if (count > capacity_) {
            Buffer bigger(memory_);
            bigger.reserve(count);
            std::copy_n(data_, used, bigger.data_);
            std::swap(data_, bigger.data_);
            std::swap(capacity_, bigger.capacity_);
        }
        return data_;
    }
    void release() noexcept
    {
        if (data_ != nullptr) memory_->deallocate(data_, capacity_ * sizeof(T), alignment);
        data_ = nullptr;
        capacity_ = 0;
    }
    T* data() noexcept { return data_; }
    const T* data() const noexcept { return data_; }
    std::size_t capacity() const noexcept { return capacity_; }
    std::size_t bytes() const noexcept { return capacity_ * sizeof(T); }
    T& operator[](std::size_t i) noexcept { return data_[i]; }

  private:
    std::pmr::memory_resource* memory_;
    T* data_ = nullptr;
    std::size_t capacity_ = 0;
};

JOSTLE_NAMESPACE_END
