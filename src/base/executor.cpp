// SPDX-License-Identifier: MIT
#include "jostle/executor.hpp"

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <map>
#include <mutex>
#include <thread>
#include <vector>

#include "jostle/error.hpp"

#ifdef JOSTLE_WITH_TBB
#include <tbb/global_control.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>
#endif

JOSTLE_NAMESPACE_BEGIN

Executor::~Executor() = default;

namespace {

std::uint32_t core_count()
{
#if defined(__EMSCRIPTEN__) && !defined(__EMSCRIPTEN_PTHREADS__)
    return 1; // however many cores there are, no thread can be started
#else
    return std::max(1u, std::thread::hardware_concurrency());
#endif
}

class SerialExecutor final : public Executor
{
  public:
    std::uint32_t concurrency() const noexcept override { return 1; }
    void run(std::uint32_t count, FunctionRef<void(std::uint32_t)> task) override
    {
        for (std::uint32_t i = 0; i < count; ++i)
            task(i);
    }
};

class ThreadExecutor final : public Executor
{
  public:
    explicit ThreadExecutor(std::uint32_t threads)
    {
        threads_.reserve(threads - 1);
        try {
            for (std::uint32_t i = 1; i < threads; ++i)
                threads_.emplace_back([this] { serve(); });
        } catch (...) {
            stop(); // the system has no more threads: join those that started
            throw;
        }
    }
    ~ThreadExecutor() override { stop(); }

    std::uint32_t concurrency() const noexcept override
    {
        return static_cast<std::uint32_t>(threads_.size()) + 1;
    }

    void run(std::uint32_t count, FunctionRef<void(std::uint32_t)> task) override
    {
        if (count <= 1 || threads_.empty()) {
            serial_executor().run(count, task);
            return;
        }
        Job job{task, count};
        {
            std::lock_guard lock(mutex_);
            jobs_.push_back(&job);
        }
        wake_.notify_all();
        work_on(job);
        std::unique_lock lock(mutex_);
        if (auto here = std::find(jobs_.begin(), jobs_.end(), &job); here != jobs_.end()) jobs_.erase(here);
        done_.wait(lock, [&] { return job.helpers == 0; });
    }

  private:
    struct Job
    {
        FunctionRef<void(std::uint32_t)> task;
        std::uint32_t count;
        std::atomic<std::uint32_t> next{0};
        std::uint32_t helpers = 0; // pool threads inside work_on; guarded by mutex_
    };

    static void work_on(Job& job)
    {
        for (std::uint32_t i; (i = job.next.fetch_add(1, std::memory_order_relaxed)) < job.count;)
            job.task(i);
    }

    void serve()
    {
        std::unique_lock lock(mutex_);
        for (;;) {
            wake_.wait(lock, [&] { return stopping_ || !jobs_.empty(); });
            if (stopping_) return;
            Job& job = *jobs_.front();
            if (job.next.load(std::memory_order_relaxed) >= job.count) {
                jobs_.erase(jobs_.begin());
                continue;
            }
            ++job.helpers;
            lock.unlock();
            work_on(job);
            lock.lock();
            if (--job.helpers == 0) done_.notify_all();
        }
    }

    void stop()
    {
        {
            std::lock_guard lock(mutex_);
            stopping_ = true;
        }
        wake_.notify_all();
        for (std::thread& thread : threads_)
            thread.join();
    }

    std::mutex mutex_;
    std::condition_variable wake_, done_;
    std::vector<Job*> jobs_; // of callers inside run, oldest first
    bool stopping_ = false;
    std::vector<std::thread> threads_;
};

#ifdef JOSTLE_WITH_TBB
class TbbExecutor final : public Executor
{
  public:
    // Asked for more threads than the process may have, oneTBB would run with those it has, and print that.
    explicit TbbExecutor(std::uint32_t threads)
        : arena_(threads == 0 ? tbb::task_arena::automatic
                              : static_cast<int>(std::min<std::size_t>(
                                    threads, tbb::global_control::active_value(
                                                 tbb::global_control::max_allowed_parallelism))))
    {
    }
    std::uint32_t concurrency() const noexcept override
    {
        return static_cast<std::uint32_t>(arena_.max_concurrency());
    }
    void run(std::uint32_t count, FunctionRef<void(std::uint32_t)> task) override
    {
        if (count <= 1) {
            serial_executor().run(count, task);
            return;
        }
        arena_.execute([&] {
            // While it waits for the last of these tasks, the thread takes up no task of another call: that
            // could want a lock which the thread holds.
            tbb::this_task_arena::isolate([&] {
                tbb::parallel_for(
                    std::uint32_t{0}, count, [&](std::uint32_t i) { task(i); }, tbb::simple_partitioner());
            });
        });
    }

  private:
    tbb::task_arena arena_;
};
#endif

} // namespace

Executor& serial_executor() noexcept
{
    static SerialExecutor executor;
    return executor;
}

namespace {

Executor& executor_with(std::uint32_t threads)
{
    static std::mutex changing;
    static std::map<std::uint32_t, std::unique_ptr<Executor>> by_threads;
    const std::lock_guard lock(changing);
    std::unique_ptr<Executor>& executor = by_threads[threads];
    if (executor == nullptr) {
#ifdef JOSTLE_WITH_TBB
        executor = std::make_unique<TbbExecutor>(threads);
#else
        executor = make_thread_executor(threads);
#endif
    }
    return *executor;
}

} // namespace

Executor& default_executor(std::uint32_t threads)
{
    if (threads != 0) return executor_with(threads);
    static Executor& all = executor_with(0); // without the lock from then on
    return all;
}

std::unique_ptr<Executor> make_thread_executor(std::uint32_t threads)
{
    return std::make_unique<ThreadExecutor>(threads == 0 ? core_count() : threads);
}

CallbackExecutor::CallbackExecutor(std::uint32_t concurrency, void* host, Run callback)
    : concurrency_(std::max(1u, concurrency)), host_(host), run_(callback)
{
    if (callback == nullptr)
        throw Error(ErrorCode::invalid_argument,
                    "a CallbackExecutor without a callback; give the function that runs the host's tasks");
}

std::uint32_t CallbackExecutor::concurrency() const noexcept
{
    return concurrency_;
}

void CallbackExecutor::run(std::uint32_t count, FunctionRef<void(std::uint32_t)> task)
{
    run_(
        host_, count,
        [](void* context, std::uint32_t i) { (*static_cast<FunctionRef<void(std::uint32_t)>*>(context))(i); },
        &task);
}

JOSTLE_NAMESPACE_END
