// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <mutex>
#include <type_traits>
#include <utility>
#include <vector>

// What calls need on the way to their answers, such as a copy of their queries: kept from call to call, so
// that a steady one allocates nothing.

namespace jostle::c_api {

/// One object of each type that a call wanted. The next call finds it as the last one left it.
class WorkingMemory
{
  public:
    /// That of type T, made of `how` when it is first wanted.
    template <class T, class... How>
    T& of(const How&... how)
    {
        for (const Place& place : places_)
            if (place.type == &type_<T>) return *static_cast<T*>(place.object.get());
        places_.push_back({&type_<T>, std::make_shared<T>(how...)});
        return *static_cast<T*>(places_.back().object.get());
    }

  private:
    template <class T>
    static inline char type_ = 0; // its address counts. Not const: linkers may merge constants
    struct Place
    {
        const char* type;
        std::shared_ptr<void> object;
    };
    std::vector<Place> places_;
    std::unique_ptr<WorkingMemory> next_;

    friend class WorkingMemories;
};

/// Of a handle that may be asked by several threads at a time, and again by a callback: as many as calls are
/// made at a time.
class WorkingMemories
{
  public:
    /// One of them, for one call.
    class Lent
    {
      public:
        explicit Lent(WorkingMemories& from) noexcept : from_(from) {}
        Lent(const Lent&) = delete;
        Lent& operator=(const Lent&) = delete;
        ~Lent()
        {
            if (memory_ != nullptr) from_.take_back(std::move(memory_));
        }
        /// Most calls are about one query, and never want any.
        template <class T>
        T& of()
        {
            if (memory_ == nullptr) memory_ = from_.lend();
            return memory_->of<T>();
        }

      private:
        WorkingMemories& from_;
        std::unique_ptr<WorkingMemory> memory_;
    };

    /// Gives back what no call has at the moment.
    void release() noexcept
    {
        while (first() != nullptr) {
        }
    }

  private:
    std::unique_ptr<WorkingMemory> first() noexcept
    {
        const std::lock_guard lock(changing_);
        std::unique_ptr<WorkingMemory> taken = std::move(free_);
        if (taken != nullptr) free_ = std::move(taken->next_);
        return taken;
    }
    std::unique_ptr<WorkingMemory> lend()
    {
        std::unique_ptr<WorkingMemory> free = first();
        return free != nullptr ? std::move(free) : std::make_unique<WorkingMemory>();
    }
    void take_back(std::unique_ptr<WorkingMemory> memory) noexcept
    {
        const std::lock_guard lock(changing_);
        memory->next_ = std::move(free_);
        free_ = std::move(memory);
    }

    std::mutex changing_;
    std::unique_ptr<WorkingMemory> free_; // each with the next
};

} // namespace jostle::c_api
