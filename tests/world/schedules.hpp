// SPDX-License-Identifier: MIT
// Every schedule of a few threads, and everything that each of their loads may read: a model checker for code
// that takes its mutexes, atomics and the calling thread's id from a parameter, as Queues does.
//
// Threads take turns where one can see another: at each lock, unlock, load and store. Which goes on, and
// which store a load reads, is a choice; a scenario is run again and again until all have been made. A load
// may read any store from the last one on of which its thread knows: those of its own, what it read before,
// and what others knew at an unlock that it locked after, or at a release that it acquired. (What C++ allows
// besides: stores to one place that are seen in another order than they were done in. No code here has two
// threads store to one place but under a mutex.) Two schedules that differ only in the order of steps that
// don't see each other come to the same state, from which on only the first one goes on. Source of the idea:
// Musuvathi and Qadeer, "Iterative context bounding", PLDI 2007.
#pragma once

#include <ucontext.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <string>
#include <unordered_set>
#include <vector>

namespace world_tests::schedules {

constexpr std::uint32_t most_threads = 4, most_places = 24;

/// How many of a place's stores each thread can't be ignorant of; 0 where it doesn't know of the place.
struct Knowledge
{
    std::array<std::uint8_t, most_places> stores{};
    void learn(const Knowledge& other)
    {
        for (std::size_t k = 0; k < most_places; ++k)
            stores[k] = std::max(stores[k], other.stores[k]);
    }
};

inline std::uint64_t mix(std::uint64_t a, std::uint64_t b)
{
    std::uint64_t x = a * 0x9e3779b97f4a7c15 + b;
    x = (x ^ (x >> 29)) * 0xbf58476d1ce4e5b9;
    return x ^ (x >> 32);
}

/// What threads share: an atomic or a mutex. Its name doesn't depend on the schedule, but on who made it and
/// when.
struct Place
{
    struct Store
    {
        std::uint64_t name; // of the step
        bool releases;
        Knowledge knowledge;
    };
    std::uint64_t name = 0;
    std::vector<Store> stores; // for a mutex: one for each unlock
    bool locked = false;
};

class Explorer
{
  public:
    /// Runs a Scenario, which says how many `threads` it has, what `run(thread)` does, and in `wrong()`, once
    /// all have ended, what is wrong. Returns the first thing that was wrong in any schedule; empty if there
    /// is none.
    template <class Scenario>
    std::string explore()
    {
        at_work() = this;
        std::string wrong;
        do {
            begin();
            const auto scenario = std::make_unique<Scenario>();
            for (std::uint32_t t = 0; t < Scenario::threads; ++t)
                start<Scenario>(t, *scenario);
            const bool ended = go_on(Scenario::threads);
            running_ = outside;
            ++runs_;
            if (ended && error_.empty()) error_ = scenario->wrong();
            wrong = error_;
        } while (wrong.empty() && next());
        at_work() = nullptr;
        return wrong;
    }
    [[nodiscard]] std::uint64_t runs() const { return runs_; }
    [[nodiscard]] std::uint64_t states() const { return seen_.size(); }

    static Explorer*& at_work()
    {
        static Explorer* explorer = nullptr;
        return explorer;
    }

    // What threads do:

    [[nodiscard]] std::uint32_t self() const { return running_; }
    std::uint32_t add_place()
    {
        if (places_.size() == most_places) {
            error_ = "more places than were thought of";
            return most_places - 1;
        }
        Place place;
        place.name = step(0);
        place.stores.push_back({place.name, false, {}});
        places_.push_back(place);
        const auto number = static_cast<std::uint32_t>(places_.size() - 1);
        knowledge().stores[number] = 1;
        return number;
    }
    /// Which of the place's stores is read.
    std::uint32_t load(std::uint32_t number, std::memory_order order)
    {
        pause();
        Place& place = places_[number];
        const std::uint8_t known = knowledge().stores[number];
        if (known == 0) {
            error_ = "a thread reads what wasn't shown to it";
            return static_cast<std::uint32_t>(place.stores.size() - 1);
        }
        const auto newest = static_cast<std::uint32_t>(place.stores.size());
        // What is read outside is read when all have ended.
        const std::uint32_t read = running_ == outside ? newest : newest - choose(newest - known + 1);
        const Place::Store& store = place.stores[read - 1];
        knowledge().stores[number] = static_cast<std::uint8_t>(read);
        if (store.releases && order != std::memory_order_relaxed) knowledge().learn(store.knowledge);
        step(store.name);
        return read - 1;
    }
    void store(std::uint32_t number, std::memory_order order)
    {
        pause();
        Place& place = places_[number];
        const std::uint64_t name = step(place.stores.back().name);
        knowledge().stores[number] = static_cast<std::uint8_t>(place.stores.size() + 1);
        place.stores.push_back({name, order != std::memory_order_relaxed, knowledge()});
    }
    void lock(std::uint32_t number)
    {
        if (running_ == outside) return;
        if (knowledge().stores[number] == 0) error_ = "a thread locks what wasn't shown to it";
        wanted_[running_] = number;
        pause();
        wanted_[running_] = most_places;
        Place& place = places_[number];
        place.locked = true;
        knowledge().learn(place.stores.back().knowledge);
        place.stores.back().name = step(place.stores.back().name);
    }
    void unlock(std::uint32_t number)
    {
        if (running_ == outside) return;
        pause();
        Place& place = places_[number];
        place.locked = false;
        place.stores.back() = {step(place.stores.back().name), true, knowledge()};
    }

  private:
    static constexpr std::uint32_t outside = most_threads;

    struct Choice
    {
        std::uint32_t taken, options;
    };
    struct Thread
    {
        ucontext_t context{};
        std::unique_ptr<char[]> stack = std::make_unique<char[]>(stack_size);
        void (*body)(void*, std::uint32_t) = nullptr;
        void* scenario = nullptr;
        bool ended = false;
    };
    static constexpr std::size_t stack_size = 128 * 1024;

    void begin()
    {
        places_.clear();
        depth_ = 0;
        error_.clear();
        running_ = outside;
        names_.fill(1);
        knowledge_.fill({});
        wanted_.fill(most_places);
    }
    template <class Scenario>
    void start(std::uint32_t number, Scenario& scenario)
    {
        Thread& thread = threads_[number];
        thread.body = [](void* what, std::uint32_t which) { static_cast<Scenario*>(what)->run(which); };
        thread.scenario = &scenario;
        thread.ended = false;
        names_[number] = mix(1, number);
        knowledge_[number] = knowledge_[outside];
        getcontext(&thread.context);
        thread.context.uc_stack.ss_sp = thread.stack.get();
        thread.context.uc_stack.ss_size = stack_size;
        thread.context.uc_link = nullptr; // it never returns: nobody goes on with one that has ended
        makecontext(&thread.context, &Explorer::enter, 0);
    }
    static void enter()
    {
        Explorer& me = *at_work();
        const std::uint32_t mine = me.running_;
        me.threads_[mine].body(me.threads_[mine].scenario, mine);
        me.threads_[mine].ended = true;
        me.pause();
    }

    /// Lets threads take turns until all have ended; false where another run has been here.
    bool go_on(std::uint32_t count)
    {
        count_ = 0;
        been_here_ = false;
        for (std::uint32_t t = 0; t < count; ++t) {
            running_ = outside;
            go_to(t); // up to its first step, before which nothing is seen of it
        }
        running_ = outside;
        count_ = count;
        go_to(decide());
        return !been_here_;
    }
    void pause()
    {
        if (running_ != outside) go_to(decide());
    }
    void go_to(std::uint32_t thread)
    {
        if (thread == running_) return;
        ucontext_t& here = running_ == outside ? main_ : threads_[running_].context;
        running_ = thread;
        swapcontext(&here, thread == outside ? &main_ : &threads_[thread].context);
    }
    /// Who does the next step: outside where there is nobody, or no more to see.
    std::uint32_t decide()
    {
        std::array<std::uint32_t, most_threads> ready{};
        std::uint32_t ready_count = 0, left = 0;
        for (std::uint32_t k = 0; k < count_; ++k) {
            const std::uint32_t t = (running_ + k) % count_; // to go on is the first choice, and the cheapest
            if (threads_[t].ended) continue;
            ++left;
            if (wanted_[t] == most_places || !places_[wanted_[t]].locked) ready[ready_count++] = t;
        }
        if (ready_count == 0 && left != 0) error_ = "threads wait for each other";
        if (ready_count == 0 || !error_.empty()) return outside;
        if (depth_ >= choices_.size() && !seen_.insert(state()).second) {
            been_here_ = true;
            return outside;
        }
        return ready[choose(ready_count)];
    }

    std::uint32_t choose(std::uint32_t options)
    {
        if (options == 1) return 0;
        if (depth_ == choices_.size()) choices_.push_back({0, options});
        return choices_[depth_++].taken;
    }
    /// The next choice is made, from the last one back; false if none is left.
    bool next()
    {
        while (!choices_.empty() && choices_.back().taken + 1 == choices_.back().options)
            choices_.pop_back();
        if (choices_.empty()) return false;
        ++choices_.back().taken;
        return true;
    }

    Knowledge& knowledge() { return knowledge_[running_]; }
    /// The running thread has done something that depends on `seen`, and on all it did before.
    std::uint64_t step(std::uint64_t seen) { return names_[running_] = mix(names_[running_], seen); }
    /// The same for two runs that did the same, except for the order of steps that don't see each other.
    [[nodiscard]] std::uint64_t state() const
    {
        std::uint64_t sum = 0;
        for (std::size_t t = 0; t < most_threads; ++t)
            sum += mix(t + 1, names_[t]);
        for (const Place& place : places_)
            sum += mix(place.name, place.stores.back().name);
        return sum;
    }

    std::array<Thread, most_threads> threads_;
    std::array<std::uint64_t, most_threads + 1> names_{}; // of each thread's last step
    std::array<Knowledge, most_threads + 1> knowledge_;
    std::array<std::uint32_t, most_threads + 1> wanted_{}; // the mutex that a thread waits for
    ucontext_t main_{};
    std::uint32_t running_ = outside;
    std::uint32_t count_ = 0; // of threads that take turns
    bool been_here_ = false;  // in another run, and that has gone on
    std::vector<Place> places_;
    std::vector<Choice> choices_; // of this run; the first `depth_` have been made
    std::size_t depth_ = 0;
    std::unordered_set<std::uint64_t> seen_;
    std::uint64_t runs_ = 0;
    std::string error_;
};

/// Replaces std::atomic.
template <class Value>
class Atomic
{
  public:
    Atomic(Value value = {}) : values_{value}, place_(Explorer::at_work()->add_place()) {}
    Value load(std::memory_order order = std::memory_order_seq_cst) const
    {
        return values_[Explorer::at_work()->load(place_, order)];
    }
    void store(Value value, std::memory_order order = std::memory_order_seq_cst)
    {
        Explorer::at_work()->store(place_, order);
        values_.push_back(value);
    }

  private:
    std::vector<Value> values_; // all that were stored, the first one first
    std::uint32_t place_;
};

/// Replaces std::mutex.
class Mutex
{
  public:
    void lock() { Explorer::at_work()->lock(place_); }
    void unlock() { Explorer::at_work()->unlock(place_); }

  private:
    std::uint32_t place_ = Explorer::at_work()->add_place();
};

/// For Queues.
struct Threads
{
    using Id = std::uint32_t; // 0 is nobody
    using Mutex = schedules::Mutex;
    template <class Value>
    using Atomic = schedules::Atomic<Value>;
    static Id self() { return Explorer::at_work()->self() + 1; }
};

} // namespace world_tests::schedules
