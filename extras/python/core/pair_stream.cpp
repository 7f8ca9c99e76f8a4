// SPDX-License-Identifier: MIT
// Pairs as they are found.
#include <condition_variable>
#include <deque>
#include <memory>
#include <mutex>
#include <new>
#include <thread>
#include <vector>

#include "core/module.hpp"
#include "core/pair_filter.hpp"

namespace jostle_python {

namespace {

/// A search on a thread of its own, which waits until its pairs are taken: memory stays bounded.
class PairStream
{
  public:
    PairStream(const py::array& boxes, const std::optional<py::array>& other,
               std::unique_ptr<PairFilter> filter, std::uint64_t chunk, std::uint32_t threads)
        : a_(boxes_of(boxes, "boxes")),
          filter_(std::move(filter)),
          chunk_(chunk),
          executor_(executor_of(threads))
    {
        if (other) b_ = boxes_of(*other, "other", a_.space);
        const jostle_options options = options_of(executor_);
        finder_ = make<FinderHandle>(
            [&](auto** out, auto* error) { return jostle_finder_new(&options, out, error); });
        worker_ = std::thread([this] { run(); });
    }
    PairStream(const PairStream&) = delete;
    ~PairStream() { close(); }

    void close()
    {
        const py::gil_scoped_release without_python;
        {
            const std::lock_guard lock(mutex_);
            stopped_ = true;
        }
        changed_.notify_all();
        if (worker_.joinable()) worker_.join();
    }

    py::array next()
    {
        std::vector<jostle_pair> chunk;
        std::unique_lock lock(mutex_, std::defer_lock);
        for (;;) {
            bool there;
            {
                const py::gil_scoped_release without_python;
                lock.lock();
                there = changed_.wait_for(lock, std::chrono::milliseconds(50),
                                          [&] { return !queue_.empty() || done_ || stopped_; });
                if (there && !queue_.empty()) {
                    chunk = std::move(queue_.front());
                    queue_.pop_front();
                } else if (there && !stopped_ && status_ == JOSTLE_OK) {
                    chunk.swap(open_); // the last ones, fewer than a chunk
                }
                there = there && (done_ || stopped_ || !chunk.empty());
                lock.unlock();
            }
            changed_.notify_all();
            if (there) break;
            if (PyErr_CheckSignals() != 0) throw py::error_already_set();
        }
        if (!chunk.empty()) {
            Packed<std::uint32_t> pairs({static_cast<py::ssize_t>(chunk.size()), py::ssize_t(2)});
            std::memcpy(pairs.mutable_data(), chunk.data(), chunk.size() * sizeof chunk[0]);
            return pairs;
        }
        if (!stopped_ && status_ != JOSTLE_OK) {
            status_ = JOSTLE_OK;
            open_.clear();
            if (no_memory_) throw std::bad_alloc();
            filter_->pending.rethrow();
            raise(error_);
        }
        throw py::stop_iteration();
    }

  private:
    void run()
    {
        std::int32_t finished = 0;
        const jostle_status status = jostle_finder_stream(
            finder_.get(), a_.space, &a_.view, b_ ? &b_->view : nullptr, &filter_->filter,
            [](void* context, const jostle_pair* pairs, std::uint64_t count, std::uint64_t, std::uint64_t) {
                return static_cast<PairStream*>(context)->take(pairs, count);
            },
            this, &finished, &error_);
        const std::lock_guard lock(mutex_);
        status_ = status;
        done_ = true;
        changed_.notify_all();
    }
    std::int32_t take(const jostle_pair* pairs, std::uint64_t count) noexcept
    {
        try {
            std::unique_lock lock(mutex_);
            changed_.wait(lock, [&] { return queue_.size() < 4 || stopped_; });
            if (stopped_) return 0;
            open_.insert(open_.end(), pairs, pairs + count);
            while (open_.size() >= chunk_) {
                std::vector<jostle_pair> full(open_.begin(),
                                              open_.begin() + static_cast<std::ptrdiff_t>(chunk_));
                open_.erase(open_.begin(), open_.begin() + static_cast<std::ptrdiff_t>(chunk_));
                queue_.push_back(std::move(full));
                changed_.notify_all();
            }
            return 1;
        } catch (const std::bad_alloc&) {
            no_memory_ = true;
            return -1;
        }
    }

    Boxes a_;
    std::optional<Boxes> b_;
    std::unique_ptr<PairFilter> filter_;
    std::uint64_t chunk_;
    Executor executor_;
    FinderHandle finder_;
    std::mutex mutex_;
    std::condition_variable changed_;
    std::deque<std::vector<jostle_pair>> queue_;
    std::vector<jostle_pair> open_;
    bool done_ = false, stopped_ = false, no_memory_ = false;
    jostle_status status_ = JOSTLE_OK;
    jostle_error error_{};
    std::thread worker_;
};

} // namespace

void define_pair_stream(py::module_& m)
{
    define_class<PairStream>(m, "PairStream")
        .def(py::init([](const Array& boxes, const Maybe& other, Maybe category, Maybe mask, Maybe owner,
                         Maybe category_b, Maybe mask_b, Maybe owner_b, std::uint64_t ghosts, Maybe vertices,
                         py::object accept, std::uint64_t chunk, std::uint32_t threads) {
            return std::make_unique<PairStream>(
                boxes, other,
                std::make_unique<PairFilter>(category, mask, owner, category_b, mask_b, owner_b, ghosts,
                                             vertices, std::move(accept)),
                chunk, threads);
        }))
        .def("__iter__", [](py::object self) { return self; })
        .def("__next__", &PairStream::next)
        .def("close", &PairStream::close);
}

} // namespace jostle_python
