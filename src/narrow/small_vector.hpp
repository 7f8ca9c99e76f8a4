// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <type_traits>
#include <vector>

#include "jostle/version.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace narrow {

/// A stack of trivial values: the first N without allocation, any number with.
template <class T, std::size_t N>
class SmallVector
{
    static_assert(std::is_trivially_copyable_v<T>);

  public:
    void push_back(const T& value)
    {
        if (size_ < N) {
            inline_[size_++] = value;
            return;
        }
        if (size_ == N && more_.empty()) more_.assign(inline_, inline_ + N);
        more_.push_back(value);
        ++size_;
    }
    void clear()
    {
        size_ = 0;
        more_.clear();
    }
    [[nodiscard]] std::size_t size() const { return size_; }
    [[nodiscard]] bool empty() const { return size_ == 0; }
    [[nodiscard]] T* data() { return more_.empty() ? inline_ : more_.data(); }
    [[nodiscard]] const T* data() const { return more_.empty() ? inline_ : more_.data(); }
    T& operator[](std::size_t i) { return data()[i]; }
    const T& operator[](std::size_t i) const { return data()[i]; }

  private:
    T inline_[N];
    std::vector<T> more_; // everything, once there are more than N
    std::size_t size_ = 0;
};

} // namespace narrow
JOSTLE_NAMESPACE_END
