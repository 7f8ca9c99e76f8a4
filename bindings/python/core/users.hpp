// SPDX-License-Identifier: MIT
#pragma once

#include <atomic>
#include <string>

#include "core/calls.hpp"

namespace jostle_python {

/// Who uses an object of the library that many may read at a time, or one may change. Callbacks and other
/// threads run while a call goes on without Python's lock: a call that would change what another one reads is
/// refused.
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
            int count = users.count_;
            do {
                if (count == changing) users.refuse_now();
            } while (!users.count_.compare_exchange_weak(count, count + 1));
        }
        ~Reading() { --users_.count_; }
        Reading(const Reading&) = delete;

      private:
        Users& users_;
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

  private:
    static constexpr int changing = -1;

    [[noreturn]] void refuse_now() const
    {
        refuse(
            std::string("the ") + what_ +
            " is in use by another call, which this one would disturb: make it when that one has returned");
    }

    const char* what_;
    std::atomic<int> count_{0}; // of readers
};

} // namespace jostle_python
