// SPDX-License-Identifier: MIT
#pragma once

#include <atomic>
#include <string>

#include "core/calls.hpp"

namespace jostle_python {

/// Who uses an object of the library that many may read at a time, or one may change. Callbacks and other
/// threads run while a call goes on without Python's lock: a call that would change what another one reads is
/// refused. What changes it may let the functions that it asks, on its own thread, read.
class Users
{
  public:
    explicit Users(const char* what) : what_(what) {}
    Users(const Users&) = delete;

    class Reading
    {
      public:
        explicit Reading(Users& users) : users_(users)
        {
            if (users.lent_to_ == this_thread()) {
                counts_ = false;
                return;
            }
            int count = users.count_;
            do {
                if (count == changing) users.refuse_now();
            } while (!users.count_.compare_exchange_weak(count, count + 1));
        }
        ~Reading()
        {
            if (counts_) --users_.count_;
        }
        Reading(const Reading&) = delete;

      private:
        Users& users_;
        bool counts_ = true;
    };

    class Changing
    {
      public:
        explicit Changing(Users& users) : users_(users)
        {
            int count = 0;
            if (!users.count_.compare_exchange_strong(count, changing)) users.refuse_now();
        }
        ~Changing() { users_.count_ = 0; }
        Changing(const Changing&) = delete;

      private:
        Users& users_;
    };

    /// What changes it stands still meanwhile, and this thread may read.
    class Lent
    {
      public:
        explicit Lent(Users& users) : users_(users) { users.lent_to_ = this_thread(); }
        ~Lent() { users_.lent_to_ = nullptr; }
        Lent(const Lent&) = delete;

      private:
        Users& users_;
    };

  private:
    static constexpr int changing = -1;

    /// Another address on each thread.
    static const void* this_thread() noexcept
    {
        static thread_local const char here = 0;
        return &here;
    }

    [[noreturn]] void refuse_now() const
    {
        refuse(
            std::string("the ") + what_ +
            " is in use by another call, which this one would disturb: make it when that one has returned");
    }

    const char* what_;
    std::atomic<int> count_{0}; // of readers
    std::atomic<const void*> lent_to_{nullptr};
};

} // namespace jostle_python
