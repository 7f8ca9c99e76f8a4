// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstring>
#include <memory>
#include <type_traits>

#include "jostle/version.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace narrow {

/// A stack of trivial values, the first N without allocation and uninitialised.
template <class T, std::size_t N>
class SmallVector
{
    static_assert(std::is_trivially_copyable_v<T> && std::is_trivially_destructible_v<T>);

  public:
    SmallVector() {} // not = default, which would zero the memory in SmallVector{}
    SmallVector(const SmallVector& other) { *this = other; }
    SmallVector& operator=(const SmallVector& other)
    {
        if (this == &other) return *this;
        size_ = 0;
        if (other.size_ > capacity_) grow(other.size_);
        size_ = other.size_;
        std::memcpy(static_cast<void*>(data_), other.data_, size_ * sizeof(T));
        return *this;
    }
    ~SmallVector() = default;

    void push_back(const T& value)
    {
        if (size_ == capacity_) {
            const T copy = value; // it may be an element of this vector
            grow(2 * capacity_);
            ::new (data_ + size_++) T(copy);
            return;
        }
        ::new (data_ + size_++) T(value);
    }
    void resize(std::size_t size) // new elements are uninitialised
    {
        if (size > capacity_) grow(size);
        size_ = size;
    }
    T pop_back() { return data_[--size_]; }
    void clear() { size_ = 0; }
    [[nodiscard]] std::size_t size() const { return size_; }
    [[nodiscard]] bool empty() const { return size_ == 0; }
    [[nodiscard]] T* data() { return data_; }
    [[nodiscard]] const T* data() const { return data_; }
    T& operator[](std::size_t i) { return data_[i]; }
    const T& operator[](std::size_t i) const { return data_[i]; }

  private:
    void grow(std::size_t capacity)
    {
        std::unique_ptr<std::byte[]> more(new std::byte[capacity * sizeof(T)]);
        std::memcpy(more.get(), data_, size_ * sizeof(T));
        more_ = std::move(more);
        data_ = reinterpret_cast<T*>(more_.get());
        capacity_ = capacity;
    }

    std::size_t size_ = 0, capacity_ = N;
    T* data_ = reinterpret_cast<T*>(inline_);
    std::unique_ptr<std::byte[]> more_;
    alignas(T) std::byte inline_[N * sizeof(T)];
};

} // namespace narrow
JOSTLE_NAMESPACE_END
