// SPDX-License-Identifier: MIT
#pragma once

#include <atomic>
#include <cstdint>
#include <string>

#include "base/in_use.hpp"
#include "jostle/error.hpp"

JOSTLE_NAMESPACE_BEGIN

/// Counts the users of an object that many may query at a time, and one may change. While a query runs the
/// user's code, neither that code nor another thread may change the data that the query still reads.
class Users
{
  public:
    /// What the object is called, and what to do in a callback instead of changing it.
    Users(const char* name, const char* instead) noexcept : name_(name), instead_(instead) {}

    /// A query that runs the user's code. Null: it runs none.
    class Answering
    {
      public:
        explicit Answering(Users* users) noexcept : users_(users)
        {
            if (users_ != nullptr) users_->answering_.fetch_add(1, std::memory_order_relaxed);
        }
        Answering(const Answering&) = delete;
        Answering& operator=(const Answering&) = delete;
        ~Answering()
        {
            if (users_ != nullptr) users_->answering_.fetch_sub(1, std::memory_order_relaxed);
        }

      private:
        Users* users_;
    };

    /// A call that works in the object's own memory: one at a time.
    [[nodiscard]] InUse work() { return {in_use_, name_}; }
    /// A call that changes the object as well.
    [[nodiscard]] InUse change()
    {
        if (answering_.load(std::memory_order_relaxed) != 0)
            throw Error(ErrorCode::invalid_argument,
                        std::string("this ") + name_ +
                            " is answering a query, which runs this callback or was called by another "
                            "thread; " +
                            instead_);
        return work();
    }
    /// Whether one of these two goes on.
    [[nodiscard]] bool are_at_work() const noexcept { return in_use_.load(std::memory_order_acquire); }

  private:
    const char* const name_;
    const char* const instead_;
    std::atomic<bool> in_use_{false};
    std::atomic<std::uint32_t> answering_{0};
};

JOSTLE_NAMESPACE_END
