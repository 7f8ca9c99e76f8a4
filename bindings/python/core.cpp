// SPDX-License-Identifier: MIT
// What the package's Python code stands on: jostle.h with arrays of NumPy for pointers. Arguments have been
// brought into shape by Python (arrays.py); here they are checked once more, since memory depends on it.
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <cstring>
#include <deque>
#include <exception>
#include <limits>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "jostle/jostle.h"

namespace py = pybind11;
using namespace py::literals;

namespace {

// --- Errors ---

/// The first exception of a callback in Python, until the call that it ended has returned.
class Pending
{
  public:
    /// Runs a callback in Python; -1 if it raised.
    template <class F>
    std::int32_t call(F&& function) noexcept
    {
        const py::gil_scoped_acquire with_python;
        try {
            return function() ? 1 : 0;
        } catch (...) {
            const std::lock_guard lock(mutex_);
            if (first_ == nullptr) first_ = std::current_exception();
            return -1;
        }
    }
    void rethrow()
    {
        if (first_ != nullptr) std::rethrow_exception(std::exchange(first_, nullptr));
    }

  private:
    std::mutex mutex_;
    std::exception_ptr first_;
};

[[noreturn]] void raise_error(const std::string& status, const std::string& message, const py::object& index)
{
    const py::object exception = py::module_::import("jostle._errors").attr("make")(status, message, index);
    PyErr_SetObject(reinterpret_cast<PyObject*>(Py_TYPE(exception.ptr())), exception.ptr());
    throw py::error_already_set();
}
[[noreturn]] void refuse(const std::string& message)
{
    raise_error("invalid_argument", message, py::none());
}
[[noreturn]] void raise(const jostle_error& error)
{
    if (error.status == JOSTLE_OUT_OF_MEMORY) {
        PyErr_SetString(PyExc_MemoryError, error.message);
        throw py::error_already_set();
    }
    const char* name = "unknown";
    jostle_status_name(error.status, &name, nullptr);
    const py::object index =
        error.index == UINT64_MAX ? py::object(py::none()) : py::object(py::int_(error.index));
    raise_error(name, error.message, index);
}

/// Calls f(error) without Python's lock. What went wrong becomes an exception.
template <class F>
void call(F&& f, Pending* pending = nullptr)
{
    jostle_error error;
    jostle_status status;
    {
        const py::gil_scoped_release without_python;
        status = f(&error);
    }
    if (status == JOSTLE_CALLBACK_FAILED && pending != nullptr) pending->rethrow();
    if (status != JOSTLE_OK) raise(error);
}

template <class Handle, jostle_status (*Free)(Handle*, jostle_error*)>
struct Freed
{
    void operator()(Handle* handle) const noexcept { Free(handle, nullptr); }
};
using Executor = std::unique_ptr<jostle_executor, Freed<jostle_executor, jostle_executor_free>>;
using Results = std::unique_ptr<jostle_results, Freed<jostle_results, jostle_results_free>>;
using FinderHandle = std::unique_ptr<jostle_finder, Freed<jostle_finder, jostle_finder_free>>;
using IndexHandle = std::unique_ptr<jostle_index, Freed<jostle_index, jostle_index_free>>;
using WorldHandle = std::unique_ptr<jostle_world, Freed<jostle_world, jostle_world_free>>;
using ShapeHandle = std::unique_ptr<jostle_shape, Freed<jostle_shape, jostle_shape_free>>;
using ShapesHandle = std::unique_ptr<jostle_shapes, Freed<jostle_shapes, jostle_shapes_free>>;
using ContactFinderHandle =
    std::unique_ptr<jostle_contact_finder, Freed<jostle_contact_finder, jostle_contact_finder_free>>;
using ResponsesHandle = std::unique_ptr<jostle_responses, Freed<jostle_responses, jostle_responses_free>>;

/// Makes a handle: make(&out, error).
template <class Owner, class F>
Owner make(F&& f)
{
    typename Owner::pointer out = nullptr;
    call([&](jostle_error* error) { return f(&out, error); });
    return Owner(out);
}

Results new_results()
{
    return make<Results>([](auto** out, auto* error) { return jostle_results_new(nullptr, out, error); });
}

// --- Interrupts ---

/// Memory of a call that may take long. Once the call is cancelled, there is none left: that ends it.
class Cancellable
{
  public:
    Cancellable()
    {
        allocator_.struct_size = sizeof allocator_;
        allocator_.context = this;
        allocator_.allocate = [](void* context, std::uint64_t size, std::uint64_t alignment) -> void* {
            if (static_cast<Cancellable*>(context)->cancelled.load(std::memory_order_relaxed)) return nullptr;
            return ::operator new(size, std::align_val_t(alignment), std::nothrow);
        };
        allocator_.deallocate = [](void*, void* memory, std::uint64_t, std::uint64_t alignment) {
            ::operator delete(memory, std::align_val_t(alignment));
        };
    }
    [[nodiscard]] const jostle_allocator* allocator() const noexcept { return &allocator_; }
    std::atomic<bool> cancelled{false};

  private:
    jostle_allocator allocator_{};
};

/// As call(), on another thread, while this one looks whether Ctrl-C was pressed: that cancels it.
template <class F>
void call_interruptibly(Cancellable& memory, F&& f, Pending* pending = nullptr)
{
    jostle_error error;
    jostle_status status = JOSTLE_OK;
    std::exception_ptr interrupt;
    {
        const py::gil_scoped_release without_python;
        std::mutex mutex;
        std::condition_variable ended;
        bool done = false;
        std::thread worker([&] {
            status = f(&error);
            const std::lock_guard lock(mutex);
            done = true;
            ended.notify_one();
        });
        std::unique_lock lock(mutex);
        while (!ended.wait_for(lock, std::chrono::milliseconds(50), [&] { return done; })) {
            if (interrupt != nullptr) continue;
            lock.unlock();
            {
                const py::gil_scoped_acquire with_python;
                if (PyErr_CheckSignals() != 0) {
                    try {
                        throw py::error_already_set();
                    } catch (...) {
                        interrupt = std::current_exception();
                    }
                    memory.cancelled = true;
                }
            }
            lock.lock();
        }
        lock.unlock();
        worker.join();
    }
    if (interrupt != nullptr) std::rethrow_exception(interrupt);
    if (status == JOSTLE_CALLBACK_FAILED && pending != nullptr) pending->rethrow();
    if (status != JOSTLE_OK) raise(error);
}
/// Calls of fewer objects are over before anybody could press a key.
constexpr py::ssize_t many = 20000;

// --- Arrays ---

int dim_of(jostle_space space)
{
    return space == JOSTLE_2F || space == JOSTLE_2D ? 2 : 3;
}
bool is_float(jostle_space space)
{
    return space == JOSTLE_2F || space == JOSTLE_3F;
}
jostle_space space_of(py::ssize_t dim, bool single)
{
    return dim == 2 ? (single ? JOSTLE_2F : JOSTLE_2D) : (single ? JOSTLE_3F : JOSTLE_3D);
}
py::dtype number_of(jostle_space space)
{
    return is_float(space) ? py::dtype::of<float>() : py::dtype::of<double>();
}
std::string shape_text(const py::array& array)
{
    return py::str(array.attr("shape"));
}
void want_number(const py::array& array, jostle_space space, const char* name)
{
    if (!number_of(space).is(array.dtype()) && !array.dtype().equal(number_of(space)))
        refuse(std::string(name) + " must be " + (is_float(space) ? "float32" : "float64") +
               " as the rest, not " + std::string(py::str(array.dtype())));
}

/// Boxes in an array's memory.
struct Boxes
{
    py::array array; // keeps the memory
    jostle_boxes view{};
    jostle_space space = JOSTLE_3D;
};

Boxes boxes_of(const py::array& array, const char* name, std::optional<jostle_space> wanted = std::nullopt)
{
    Boxes boxes{array};
    const bool single = array.dtype().equal(py::dtype::of<float>());
    if (!single && !array.dtype().equal(py::dtype::of<double>()))
        refuse(std::string(name) + " must be float32 or float64, not " + std::string(py::str(array.dtype())));
    py::ssize_t dim = 0, axis_stride = 0, half_stride = 0;
    if (array.ndim() == 3 && array.shape(1) == 2) {
        dim = array.shape(2);
        axis_stride = array.strides(2);
        half_stride = array.strides(1);
    } else if (array.ndim() == 2 && array.shape(1) % 2 == 0) {
        dim = array.shape(1) / 2;
        axis_stride = array.strides(1);
        half_stride = dim * axis_stride;
    }
    if (dim != 2 && dim != 3)
        refuse(std::string(name) + " has the shape " + shape_text(array) +
               ": it must be (n, 2, d) or (n, 2 d), with d 2 or 3, lower bounds before upper ones");
    boxes.space = space_of(dim, single);
    if (wanted && *wanted != boxes.space)
        refuse(std::string(name) + " is " + std::to_string(dim) + "D " + (single ? "float32" : "float64") +
               ", and it must be " + std::to_string(dim_of(*wanted)) + "D " +
               (is_float(*wanted) ? "float32" : "float64"));
    const auto* const first = static_cast<const char*>(array.data());
    boxes.view.count = static_cast<std::uint64_t>(array.shape(0));
    boxes.view.stride = array.strides(0);
    for (py::ssize_t d = 0; d < dim; ++d) {
        boxes.view.lo[d] = first + d * axis_stride;
        boxes.view.hi[d] = first + half_stride + d * axis_stride;
    }
    return boxes;
}

/// One number per object, or nothing.
template <class T>
jostle_values values_of(const std::optional<py::array>& array, const char* name)
{
    if (!array) return {nullptr, 0, 0};
    if (array->ndim() != 1 || !array->dtype().equal(py::dtype::of<T>()))
        refuse(std::string(name) + " must be an array of shape (n,)");
    return {array->data(), static_cast<std::uint64_t>(array->shape(0)), array->strides(0)};
}

template <class T>
using Packed = py::array_t<T, py::array::c_style>;

template <class T>
std::uint64_t length_of(const Packed<T>& array, const char* name)
{
    if (array.ndim() != 1)
        refuse(std::string(name) + " has the shape " + shape_text(array) + ": it must be (n,)");
    return static_cast<std::uint64_t>(array.shape(0));
}
template <class T>
void want_length(const Packed<T>& array, std::uint64_t count, const char* name)
{
    if (length_of(array, name) != count)
        refuse(std::string(name) + " has " + std::to_string(array.shape(0)) + " elements, and there are " +
               std::to_string(count) + " objects");
}
/// Rows of numbers, packed.
void want_rows(const py::array& array, jostle_space space, py::ssize_t width, std::uint64_t count,
               const char* name)
{
    want_number(array, space, name);
    if (array.ndim() != 2 || array.shape(1) != width || static_cast<std::uint64_t>(array.shape(0)) != count)
        refuse(std::string(name) + " has the shape " + shape_text(array) + ": it must be (" +
               std::to_string(count) + ", " + std::to_string(width) + ")");
    if ((array.flags() & py::array::c_style) == 0) refuse(std::string(name) + " must be contiguous");
}

/// An empty array of pairs with these items: the one copy that there is.
py::array copy_pairs(const jostle_blocks& blocks)
{
    Packed<std::uint32_t> pairs({static_cast<py::ssize_t>(blocks.count), py::ssize_t(2)});
    void* const out = pairs.mutable_data();
    call([&](jostle_error* error) { return jostle_blocks_copy(&blocks, blocks.count, out, error); });
    return pairs;
}
py::array copy_pairs(const Results& results)
{
    jostle_blocks blocks;
    call([&](jostle_error* error) { return jostle_results_blocks(results.get(), &blocks, error); });
    return copy_pairs(blocks);
}
template <class T>
py::array copy_array(const T* from, std::uint64_t count)
{
    Packed<T> array(static_cast<py::ssize_t>(count));
    if (count != 0) std::memcpy(array.mutable_data(), from, count * sizeof(T));
    return array;
}
/// Pairs of the caller's.
struct Pairs
{
    explicit Pairs(const Packed<std::uint32_t>& array)
    {
        if (array.ndim() != 2 || array.shape(1) != 2)
            refuse("pairs has the shape " + shape_text(array) + ": it must be (m, 2)");
        block = {array.data(), static_cast<std::uint64_t>(array.shape(0))};
        all = {&block, 1, block.count, sizeof(jostle_pair)};
    }
    Pairs(const Pairs&) = delete;
    jostle_block block;
    jostle_blocks all;
};

// --- Options ---

Executor executor_of(std::uint32_t threads)
{
    if (threads == 0) return nullptr;
    return make<Executor>([&](auto** out, auto* error) {
        return threads == 1 ? jostle_executor_serial(out, error)
                            : jostle_executor_threads(threads, out, error);
    });
}

jostle_options options_of(const Executor& executor, const jostle_allocator* allocator = nullptr)
{
    jostle_options options{};
    options.struct_size = sizeof options;
    options.executor = executor.get();
    options.allocator = allocator;
    return options;
}

/// A pair's filter, and the function in Python that it may end in.
struct PairFilter
{
    PairFilter(std::optional<py::array> category, std::optional<py::array> mask,
               std::optional<py::array> owner, std::optional<py::array> category_b,
               std::optional<py::array> mask_b, std::optional<py::array> owner_b, py::object function)
        : kept{category, mask, owner, category_b, mask_b, owner_b}, accept(std::move(function))
    {
        filter.struct_size = sizeof filter;
        filter.category = values_of<std::uint32_t>(category, "category");
        filter.mask = values_of<std::uint32_t>(mask, "mask");
        filter.owner = values_of<std::uint32_t>(owner, "owner");
        filter.category_b = values_of<std::uint32_t>(category_b, "category_b");
        filter.mask_b = values_of<std::uint32_t>(mask_b, "mask_b");
        filter.owner_b = values_of<std::uint32_t>(owner_b, "owner_b");
        if (accept.is_none()) return;
        filter.context = this;
        filter.accept = [](void* context, std::uint32_t a, std::uint32_t b) {
            auto* const self = static_cast<PairFilter*>(context);
            return self->pending.call([&] { return self->accept(a, b).cast<bool>(); });
        };
    }
    PairFilter(const PairFilter&) = delete;

    jostle_filter filter{};
    Pending pending;
    std::vector<std::optional<py::array>> kept;
    py::object accept;
};

/// Spheres that touch, in double: what join() keeps of the pairs of boxes.
struct SphereFilter
{
    jostle_boxes a, b; // lo is the centre
    const double *radii_a, *radii_b;
    jostle_space space;

    template <class T>
    [[nodiscard]] bool touch(std::uint64_t i, std::uint64_t k) const
    {
        double sum = 0;
        for (int d = 0; d < dim_of(space); ++d) {
            T p, q;
            std::memcpy(&p, static_cast<const char*>(a.lo[d]) + static_cast<std::int64_t>(i) * a.stride,
                        sizeof p);
            std::memcpy(&q, static_cast<const char*>(b.lo[d]) + static_cast<std::int64_t>(k) * b.stride,
                        sizeof q);
            const double gap = static_cast<double>(p) - static_cast<double>(q);
            sum += gap * gap;
        }
        const double reach = radii_a[i] + radii_b[k];
        return sum <= reach * reach;
    }
};

/// Boxes around spheres, no smaller than they whatever rounding does; `centers` is (n, d).
template <class T>
py::array boxes_around(const py::array& centers, const Packed<double>& radii, const char* name)
{
    const py::ssize_t n = centers.shape(0), dim = centers.shape(1);
    py::array_t<T> boxes({n, py::ssize_t(2), dim});
    T* out = boxes.mutable_data();
    const double* const reach = radii.data();
    const auto* row = static_cast<const char*>(centers.data());
    const py::ssize_t row_stride = centers.strides(0), stride = centers.strides(1);
    py::ssize_t wrong = n;
    {
        const py::gil_scoped_release without_python;
        constexpr T few = 8 * std::numeric_limits<T>::epsilon();
        for (py::ssize_t i = 0; i < n; ++i, row += row_stride, out += 2 * dim) {
            const T radius = static_cast<T>(reach[i]); // rounded: the few are more than that
            bool finite = reach[i] >= 0 && std::isfinite(reach[i]);
            for (py::ssize_t d = 0; d < dim; ++d) {
                T at;
                std::memcpy(&at, row + d * stride, sizeof at);
                finite = finite && std::isfinite(at);
                const T more = radius + few * (std::abs(at) + radius) + std::numeric_limits<T>::denorm_min();
                out[d] = at - more;
                out[dim + d] = at + more;
            }
            if (!finite) {
                wrong = i;
                break;
            }
        }
    }
    if (wrong == n) return boxes;
    raise_error("invalid_argument",
                std::string(name) + "[" + std::to_string(wrong) + "] has the radius " +
                    std::string(py::str(py::float_(reach[wrong]))) + " and the place " +
                    std::string(py::str(centers[py::int_(wrong)])) +
                    ": both must be finite, and the radius at least 0",
                py::int_(wrong));
}

py::array find(const py::array& boxes, const std::optional<py::array>& other, PairFilter& filter, bool sorted,
               std::uint32_t threads, const SphereFilter* spheres = nullptr)
{
    const Boxes a = boxes_of(boxes, "boxes");
    std::optional<Boxes> b;
    if (other) b = boxes_of(*other, "other", a.space);
    const Executor executor = executor_of(threads);
    Cancellable memory;
    const jostle_options options = options_of(executor, memory.allocator());
    jostle_filter wish = filter.filter;
    if (spheres != nullptr) {
        wish.context = const_cast<SphereFilter*>(spheres);
        wish.accept = [](void* context, std::uint32_t i, std::uint32_t k) -> std::int32_t {
            const auto* const self = static_cast<const SphereFilter*>(context);
            return is_float(self->space) ? self->touch<float>(i, k) : self->touch<double>(i, k);
        };
    }
    const FinderHandle finder =
        make<FinderHandle>([&](auto** out, auto* error) { return jostle_finder_new(&options, out, error); });
    jostle_blocks pairs{};
    const auto search = [&](jostle_error* error) {
        return jostle_finder_find(finder.get(), a.space, &a.view, b ? &b->view : nullptr, &wish,
                                  sorted ? JOSTLE_SORTED : JOSTLE_CANONICAL, &pairs, error);
    };
    if (boxes.shape(0) + (other ? other->shape(0) : 0) < many)
        call(search, &filter.pending);
    else
        call_interruptibly(memory, search, &filter.pending);
    return copy_pairs(pairs);
}

// --- Pairs as they are found ---

/// A search on a thread of its own, which waits where nobody takes its pairs: memory stays bounded.
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
            const jostle_status status = std::exchange(status_, JOSTLE_OK);
            if (status == JOSTLE_CALLBACK_FAILED) filter_->pending.rethrow();
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
        if (!open_.empty() && status == JOSTLE_OK) queue_.push_back(std::move(open_));
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
        } catch (...) { // no memory
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
    bool done_ = false, stopped_ = false;
    jostle_status status_ = JOSTLE_OK;
    jostle_error error_{};
    std::thread worker_;
};

// --- Questions ---

/// Questions as Python packed them: rows of numbers, or planes, or points.
struct Questions
{
    Questions(jostle_question given, const py::array& numbers, jostle_space space,
              const std::vector<py::array>& planes, std::uint32_t near_count)
        : kind(given), kept(numbers), kept_planes(planes)
    {
        const int dim = dim_of(space);
        if (kind == JOSTLE_FRUSTUM) {
            for (const py::array& one : planes) {
                want_rows(one, space, dim + 1, static_cast<std::uint64_t>(one.ndim() == 2 ? one.shape(0) : 0),
                          "planes");
                frusta.push_back({one.data(), static_cast<std::uint64_t>(one.shape(0))});
            }
            data = frusta.data();
            count = frusta.size();
            return;
        }
        const int widths[] = {0, 2 * dim + 1, 3 * dim + 1, 2 * dim, dim + 1, 0, dim + 1};
        count = static_cast<std::uint64_t>(numbers.ndim() == 2 ? numbers.shape(0) : 0);
        if (kind < JOSTLE_RAY || kind > JOSTLE_NEAREST) refuse("there is no such kind of question");
        want_rows(numbers, space, widths[kind], count, "questions");
        data = numbers.data();
        if (kind != JOSTLE_NEAREST) return;
        switch (space) { // point and greatest distance, as rows
        case JOSTLE_2F:
            fill<jostle_nearest_2f, float, 2>(near_count);
            return;
        case JOSTLE_3F:
            fill<jostle_nearest_3f, float, 3>(near_count);
            return;
        case JOSTLE_2D:
            fill<jostle_nearest_2d, double, 2>(near_count);
            return;
        default:
            fill<jostle_nearest_3d, double, 3>(near_count);
            return;
        }
    }
    Questions(const Questions&) = delete;

    jostle_question kind;
    const void* data = nullptr;
    std::uint64_t count = 0;

  private:
    template <class Nearest, class T, int Dim>
    void fill(std::uint32_t near_count)
    {
        nearest.resize(count * sizeof(Nearest));
        const T* row = static_cast<const T*>(data);
        for (std::uint64_t i = 0; i < count; ++i, row += Dim + 1) {
            Nearest one{};
            std::copy_n(row, Dim, one.point);
            one.count = near_count;
            one.max_distance = row[Dim];
            std::memcpy(nearest.data() + i * sizeof one, &one, sizeof one);
        }
        data = nearest.data();
    }
    py::array kept;
    std::vector<py::array> kept_planes;
    std::vector<jostle_frustum> frusta;
    std::vector<char> nearest;
};

struct AskFilter
{
    AskFilter(std::optional<py::array> category, std::optional<py::array> mask,
              std::optional<py::array> owner, std::optional<std::array<std::uint32_t, 3>> by,
              std::optional<std::uint64_t> excluded, py::object function)
        : kept{category, mask, owner}, accept(std::move(function))
    {
        filter.struct_size = sizeof filter;
        filter.category = values_of<std::uint32_t>(category, "category");
        filter.mask = values_of<std::uint32_t>(mask, "mask");
        filter.owner = values_of<std::uint32_t>(owner, "owner");
        if (by) {
            asker = {(*by)[0], (*by)[1], (*by)[2]};
            filter.asker = &asker;
        }
        if (excluded) {
            exclude = *excluded;
            filter.exclude = &exclude;
        }
        if (accept.is_none()) return;
        filter.context = this;
        filter.accept = [](void* context, std::uint32_t question, std::uint64_t id) {
            auto* const self = static_cast<AskFilter*>(context);
            return self->pending.call([&] { return self->accept(question, id).cast<bool>(); });
        };
    }
    AskFilter(const AskFilter&) = delete;

    jostle_query_filter filter{};
    Pending pending;

  private:
    jostle_asker asker{};
    std::uint64_t exclude = 0;
    std::vector<std::optional<py::array>> kept;
    py::object accept;
};

/// The functions of an index or a world.
template <class Handle>
struct Asked
{
    jostle_status (*first)(const Handle*, jostle_question, const void*, std::uint64_t,
                           const jostle_query_filter*, jostle_hit*, jostle_error*);
    jostle_status (*all)(const Handle*, jostle_question, const void*, std::uint64_t,
                         const jostle_query_filter*, std::uint64_t, jostle_results*, jostle_error*);
    jostle_status (*any)(const Handle*, jostle_question, const void*, std::uint64_t,
                         const jostle_query_filter*, std::uint8_t*, jostle_error*);
    jostle_status (*count)(const Handle*, jostle_question, const void*, std::uint64_t,
                           const jostle_query_filter*, std::uint64_t*, jostle_error*);

    py::tuple ask_first(const Handle* handle, const Questions& questions, AskFilter& filter) const
    {
        std::vector<jostle_hit> hits(questions.count);
        call(
            [&](jostle_error* error) {
                return first(handle, questions.kind, questions.data, questions.count, &filter.filter,
                             hits.data(), error);
            },
            &filter.pending);
        Packed<std::uint64_t> ids(static_cast<py::ssize_t>(hits.size()));
        Packed<double> at(static_cast<py::ssize_t>(hits.size()));
        for (std::size_t i = 0; i < hits.size(); ++i) {
            ids.mutable_data()[i] = hits[i].id;
            at.mutable_data()[i] = hits[i].at;
        }
        return py::make_tuple(ids, at);
    }
    py::tuple ask_all(const Handle* handle, const Questions& questions, AskFilter& filter,
                      std::uint64_t max_results) const
    {
        const Results results = new_results();
        call(
            [&](jostle_error* error) {
                return all(handle, questions.kind, questions.data, questions.count, &filter.filter,
                           max_results, results.get(), error);
            },
            &filter.pending);
        jostle_lists lists;
        call([&](jostle_error* error) { return jostle_results_lists(results.get(), &lists, error); });
        return py::make_tuple(
            copy_array(lists.first, lists.questions + 1), copy_array(lists.ids, lists.count),
            lists.at == nullptr ? py::object(py::none()) : copy_array(lists.at, lists.count),
            copy_array(lists.more, lists.questions));
    }
    py::array ask_any(const Handle* handle, const Questions& questions, AskFilter& filter) const
    {
        Packed<std::uint8_t> answers(static_cast<py::ssize_t>(questions.count));
        std::uint8_t* const out = answers.mutable_data();
        call(
            [&](jostle_error* error) {
                return any(handle, questions.kind, questions.data, questions.count, &filter.filter, out,
                           error);
            },
            &filter.pending);
        return answers;
    }
    py::array ask_count(const Handle* handle, const Questions& questions, AskFilter& filter) const
    {
        Packed<std::uint64_t> answers(static_cast<py::ssize_t>(questions.count));
        std::uint64_t* const out = answers.mutable_data();
        call(
            [&](jostle_error* error) {
                return count(handle, questions.kind, questions.data, questions.count, &filter.filter, out,
                             error);
            },
            &filter.pending);
        return answers;
    }
};
constexpr Asked<jostle_index> of_index{jostle_index_first, jostle_index_all, jostle_index_any,
                                       jostle_index_count};
constexpr Asked<jostle_world> of_world{jostle_world_first, jostle_world_all, jostle_world_any,
                                       jostle_world_count};

// --- Index ---

class BoxIndex
{
  public:
    BoxIndex(jostle_space space, std::uint32_t threads) : space(space)
    {
        const Executor executor = executor_of(threads);
        const jostle_options options = options_of(executor);
        handle = make<IndexHandle>(
            [&](auto** out, auto* error) { return jostle_index_new(space, &options, out, error); });
    }
    template <class F>
    void change(const std::optional<Packed<std::uint32_t>>& ids, const py::array& boxes, F&& f)
    {
        const Boxes given = boxes_of(boxes, "boxes", space);
        if (ids) want_length(*ids, given.view.count, "ids");
        const std::uint32_t* const first = ids ? ids->data() : nullptr;
        call([&](jostle_error* error) { return f(handle.get(), first, &given.view, error); });
    }
    py::dict stats() const
    {
        jostle_index_stats s{};
        s.struct_size = sizeof s;
        call([&](jostle_error* error) { return jostle_index_stats_read(handle.get(), &s, error); });
        return py::dict("objects"_a = s.objects, "pages"_a = s.pages, "leaves"_a = s.leaves,
                        "nodes"_a = s.nodes, "depth"_a = s.depth, "bytes"_a = s.bytes, "sorts"_a = s.sorts,
                        "splits"_a = s.splits);
    }

    jostle_space space;
    IndexHandle handle;
};

// --- World ---

class World
{
  public:
    World(jostle_space given, double margin, py::object function, std::uint32_t threads)
        : space(given), accept(std::move(function)), pending(std::make_unique<Pending>())
    {
        const Executor executor = executor_of(threads);
        const jostle_options common = options_of(executor);
        jostle_world_options options{};
        options.struct_size = sizeof options;
        options.common = &common;
        options.margin = margin;
        if (!accept.is_none()) {
            asked = std::make_unique<Asks>(Asks{accept, pending.get()});
            options.context = asked.get();
            options.accept = [](void* context, jostle_id a, jostle_id b) {
                auto* const self = static_cast<Asks*>(context);
                return self->pending->call([&] { return self->accept(a, b).template cast<bool>(); });
            };
        }
        handle = make<WorldHandle>(
            [&](auto** out, auto* error) { return jostle_world_new(space, &options, out, error); });
    }
    using Ids = Packed<std::uint64_t>;

    template <class F>
    void with_boxes(const Ids& ids, const py::array& boxes, F&& f)
    {
        const Boxes given = boxes_of(boxes, "boxes", space);
        want_length(ids, given.view.count, "ids");
        const std::uint64_t* const first = ids.data();
        call([&](jostle_error* error) { return f(handle.get(), first, &given.view, error); }, pending.get());
    }
    template <class F>
    void with_ids(const Ids& ids, F&& f) const
    {
        const std::uint64_t count = length_of(ids, "ids");
        const std::uint64_t* const first = ids.data();
        call([&](jostle_error* error) { return f(handle.get(), first, count, error); });
    }
    template <class T, class F>
    py::array read(const Ids& ids, F&& f) const
    {
        Packed<T> out(static_cast<py::ssize_t>(length_of(ids, "ids")));
        T* const data = out.mutable_data();
        with_ids(ids, [&](auto* world, auto* first, auto count, auto* error) {
            return f(world, first, count, data, error);
        });
        return out;
    }
    template <class F>
    py::array read_boxes(const Ids& ids, F&& f) const
    {
        py::array out(number_of(space), {static_cast<py::ssize_t>(length_of(ids, "ids")), py::ssize_t(2),
                                         py::ssize_t(dim_of(space))});
        void* const data = out.mutable_data();
        with_ids(ids, [&](auto* world, auto* first, auto count, auto* error) {
            return f(world, first, count, data, error);
        });
        return out;
    }
    template <class F>
    py::array listed(F&& f) const
    {
        jostle_blocks pairs;
        call([&](jostle_error* error) { return f(handle.get(), &pairs, error); });
        return copy_pairs(pairs);
    }
    py::dict stats() const
    {
        jostle_world_stats s{};
        s.struct_size = sizeof s;
        call([&](jostle_error* error) { return jostle_world_stats_read(handle.get(), &s, error); });
        py::dict stats("objects"_a = s.objects, "resting"_a = s.resting, "active"_a = s.active,
                       "disabled"_a = s.disabled, "refused"_a = s.refused, "commands"_a = s.commands,
                       "dropped"_a = s.dropped, "changed"_a = s.changed, "woken"_a = s.woken,
                       "settled"_a = s.settled, "candidates"_a = s.candidates,
                       "false_positives"_a = s.false_positives, "listed"_a = s.listed, "began"_a = s.began,
                       "persisted"_a = s.persisted, "ended"_a = s.ended,
                       "bytes_reserved"_a = s.bytes_reserved);
        stats["us_total"] = s.us_total;
        stats["us_apply"] = s.us_apply;
        stats["us_active"] = s.us_active;
        stats["us_resting"] = s.us_resting;
        stats["us_events"] = s.us_events;
        stats["us_index"] = s.us_index;
        return stats;
    }

    jostle_space space;
    py::object accept;
    std::shared_ptr<Pending> pending;
    struct Asks
    {
        py::object accept;
        Pending* pending;
    };
    std::shared_ptr<Asks> asked; // a fork asks the same
    WorldHandle handle;
};

// --- Shapes and contacts ---

class Shape
{
  public:
    Shape(int given_dim, ShapeHandle given) : dim(given_dim), handle(std::move(given)) {}
    int dim;
    ShapeHandle handle;
};

class Shapes
{
  public:
    explicit Shapes(int given) : dim(given)
    {
        handle =
            make<ShapesHandle>([&](auto** out, auto* error) { return jostle_shapes_new(dim, out, error); });
    }
    [[nodiscard]] std::uint64_t size() const
    {
        std::uint64_t count = 0;
        call([&](jostle_error* error) { return jostle_shapes_size(handle.get(), &count, error); });
        return count;
    }
    int dim;
    ShapesHandle handle;
};

/// Shapes and poses, or motions.
struct Objects
{
    Objects(const Shapes& shapes, const py::array& rows, jostle_space space, bool moving, const char* name)
        : kept(rows)
    {
        const bool flat = dim_of(space) == 2;
        const py::ssize_t width = moving ? (flat ? 7 : 13) : (flat ? 4 : 7);
        want_number(rows, space, name);
        if (rows.ndim() != 2 || rows.shape(1) != width || rows.strides(1) != rows.itemsize())
            refuse(std::string(name) + " has the shape " + shape_text(rows) + ": it must be (n, " +
                   std::to_string(width) + ") with packed rows");
        view.shapes = shapes.handle.get();
        view.poses = {rows.data(), static_cast<std::uint64_t>(rows.shape(0)), rows.strides(0)};
    }
    py::array kept;
    jostle_objects view{};
};

template <class Contact>
void clear_unused(Contact* contacts, std::uint64_t count)
{
    for (std::uint64_t i = 0; i < count; ++i)
        for (std::size_t k = contacts[i].count; k < std::size(contacts[i].point); ++k)
            contacts[i].point[k] = {};
}

class ContactFinder
{
  public:
    ContactFinder(jostle_space given, std::uint32_t threads) : space(given)
    {
        const Executor executor = executor_of(threads);
        const jostle_options options = options_of(executor);
        handle = make<ContactFinderHandle>(
            [&](auto** out, auto* error) { return jostle_contact_finder_new(space, &options, out, error); });
    }
    /// Calls f(a, b or null, pairs, error).
    template <class F>
    void work(const Shapes& shapes_a, const py::array& rows_a, const Shapes* shapes_b,
              const std::optional<py::array>& rows_b, const Packed<std::uint32_t>& pairs, bool moving, F&& f)
    {
        const Objects a(shapes_a, rows_a, space, moving, moving ? "motions" : "poses");
        std::optional<Objects> b;
        if ((shapes_b != nullptr) != rows_b.has_value()) refuse("a second set needs shapes and poses");
        if (shapes_b != nullptr)
            b.emplace(*shapes_b, *rows_b, space, moving, moving ? "motions_b" : "poses_b");
        const Pairs all(pairs);
        call([&](jostle_error* error) { return f(&a.view, b ? &b->view : nullptr, &all.all, error); });
    }
    py::array find(const Shapes& shapes_a, const py::array& poses_a, const Shapes* shapes_b,
                   const std::optional<py::array>& poses_b, const Packed<std::uint32_t>& pairs, double margin,
                   const py::dtype& type)
    {
        jostle_blocks contacts{};
        work(shapes_a, poses_a, shapes_b, poses_b, pairs, false,
             [&](auto* a, auto* b, auto* all, auto* error) {
                 return jostle_contact_finder_find(handle.get(), a, b, all, margin, &contacts, error);
             });
        if (contacts.item_size != static_cast<std::uint64_t>(type.itemsize()))
            refuse("the dtype isn't a contact's");
        py::array out(type, std::vector<py::ssize_t>{static_cast<py::ssize_t>(contacts.count)});
        void* const data = out.mutable_data();
        call([&](jostle_error* error) { return jostle_blocks_copy(&contacts, contacts.count, data, error); });
        // The points that a contact doesn't have are whatever memory held; an array shows them.
        switch (space) {
        case JOSTLE_2F:
            clear_unused(static_cast<jostle_contact_2f*>(data), contacts.count);
            break;
        case JOSTLE_3F:
            clear_unused(static_cast<jostle_contact_3f*>(data), contacts.count);
            break;
        case JOSTLE_2D:
            clear_unused(static_cast<jostle_contact_2d*>(data), contacts.count);
            break;
        default:
            clear_unused(static_cast<jostle_contact_3d*>(data), contacts.count);
        }
        return out;
    }
    py::array rows(const Shapes& shapes_a, const py::array& rows_a, const Shapes* shapes_b,
                   const std::optional<py::array>& rows_b, const Packed<std::uint32_t>& pairs, double limit,
                   bool moving)
    {
        py::array out(number_of(space), {pairs.shape(0), py::ssize_t(3 * dim_of(space) + 1)});
        void* const data = out.mutable_data();
        work(shapes_a, rows_a, shapes_b, rows_b, pairs, moving,
             [&](auto* a, auto* b, auto* all, auto* error) {
                 return moving ? jostle_contact_finder_impacts(handle.get(), a, b, all, limit, data, error)
                               : jostle_contact_finder_distances(handle.get(), a, b, all, limit, data, error);
             });
        return out;
    }
    py::array touching(const Shapes& shapes_a, const py::array& poses_a, const Shapes* shapes_b,
                       const std::optional<py::array>& poses_b, const Packed<std::uint32_t>& pairs)
    {
        Packed<std::uint8_t> out(pairs.shape(0));
        std::uint8_t* const data = out.mutable_data();
        work(shapes_a, poses_a, shapes_b, poses_b, pairs, false,
             [&](auto* a, auto* b, auto* all, auto* error) {
                 return jostle_contact_finder_touching(handle.get(), a, b, all, data, error);
             });
        return out;
    }
    jostle_space space;
    ContactFinderHandle handle;
};

py::array sum_by_object(const Packed<std::uint32_t>& objects, const py::array& values,
                        std::uint32_t object_count, std::uint32_t threads)
{
    const py::dtype type = values.dtype();
    const jostle_number number = type.equal(py::dtype::of<float>())    ? JOSTLE_FLOAT
                                 : type.equal(py::dtype::of<double>()) ? JOSTLE_DOUBLE
                                                                       : JOSTLE_INT64;
    if (number == JOSTLE_INT64 && !type.equal(py::dtype::of<std::int64_t>()))
        refuse("values must be float32, float64 or int64, not " + std::string(py::str(py::handle(type))));
    if (values.ndim() != 2 || (values.flags() & py::array::c_style) == 0)
        refuse("values must be contiguous rows");
    want_length(objects, static_cast<std::uint64_t>(values.shape(0)), "objects");
    const Executor executor = executor_of(threads);
    const jostle_options common = options_of(executor);
    jostle_responses_options options{};
    options.struct_size = sizeof options;
    options.common = &common;
    const ResponsesHandle responses = make<ResponsesHandle>([&](auto** out, auto* error) {
        return jostle_responses_new(number, static_cast<std::uint32_t>(values.shape(1)), &options, out,
                                    error);
    });
    const void* sums = nullptr;
    const std::uint32_t* const of = objects.data();
    const void* const given = values.data();
    const auto count = static_cast<std::uint64_t>(values.shape(0));
    call([&](jostle_error* error) {
        return jostle_responses_sum(responses.get(), object_count, of, given, count, &sums, error);
    });
    py::array out(type, {static_cast<py::ssize_t>(object_count), values.shape(1)});
    if (out.nbytes() != 0) std::memcpy(out.mutable_data(), sums, static_cast<std::size_t>(out.nbytes()));
    return out;
}

template <class F>
Shape make_shape(int dim, F&& f)
{
    return {dim, make<ShapeHandle>(f)};
}

} // namespace

PYBIND11_MODULE(_core, m)
{
    using Array = py::array;
    using Maybe = std::optional<py::array>;
    using U32 = Packed<std::uint32_t>;
    using U64 = Packed<std::uint64_t>;
    using F64 = Packed<double>;

    m.doc() = "jostle.h with NumPy's arrays; use the package jostle";
    m.def(
        "version",
        [] {
            std::uint32_t major = 0, minor = 0, patch = 0;
            call([&](jostle_error* error) { return jostle_version(&major, &minor, &patch, error); });
            return std::to_string(major) + "." + std::to_string(minor) + "." + std::to_string(patch);
        },
        "The version of the library.");
    m.def(
        "instruction_sets",
        [] {
            const jostle_instruction_set* sets = nullptr;
            std::uint64_t count = 0;
            call([&](jostle_error* error) { return jostle_instruction_sets(&sets, &count, error); });
            std::vector<std::string> names;
            for (std::uint64_t i = 0; i < count; ++i) {
                const char* name = "";
                call([&](jostle_error* error) { return jostle_instruction_set_name(sets[i], &name, error); });
                names.emplace_back(name);
            }
            return names;
        },
        "The instruction sets that this build and this machine have, fastest first.");

    py::class_<PairFilter>(m, "PairFilter")
        .def(py::init<Maybe, Maybe, Maybe, Maybe, Maybe, Maybe, py::object>());
    m.def("find", [](const Array& boxes, const Maybe& other, PairFilter& filter, bool sorted,
                     std::uint32_t threads) { return find(boxes, other, filter, sorted, threads); });
    m.def("join", [](const Array& points, const Maybe& other, const F64& radii,
                     const std::optional<F64>& other_radii, bool sorted, std::uint32_t threads) {
        const auto view_of = [](const Array& from, const F64& reach) {
            if (from.ndim() != 2 || (from.shape(1) != 2 && from.shape(1) != 3))
                refuse("points has the shape " + shape_text(from) + ": it must be (n, 2) or (n, 3)");
            want_length(reach, static_cast<std::uint64_t>(from.shape(0)), "radii");
            jostle_boxes view{};
            for (py::ssize_t d = 0; d < from.shape(1); ++d)
                view.lo[d] = static_cast<const char*>(from.data()) + d * from.strides(1);
            view.count = static_cast<std::uint64_t>(from.shape(0));
            view.stride = from.strides(0);
            return view;
        };
        const jostle_boxes centers = view_of(points, radii);
        const bool single = points.dtype().equal(py::dtype::of<float>());
        const jostle_space space = space_of(points.shape(1), single);
        want_number(points, space, "points");
        const auto around = [&](const Array& from, const F64& reach, const char* name) {
            return single ? boxes_around<float>(from, reach, name) : boxes_around<double>(from, reach, name);
        };
        SphereFilter spheres{centers, centers, radii.data(), radii.data(), space};
        const Array boxes = around(points, radii, "points");
        Maybe other_boxes;
        if (other) {
            spheres.b = view_of(*other, other_radii.value());
            spheres.radii_b = other_radii->data();
            want_number(*other, space, "other");
            if (other->shape(1) != points.shape(1)) refuse("other has other dimensions than points");
            other_boxes = around(*other, *other_radii, "other");
        }
        PairFilter none({}, {}, {}, {}, {}, {}, py::none());
        return find(boxes, other_boxes, none, sorted, threads, &spheres);
    });
    py::class_<PairStream>(m, "PairStream")
        .def(py::init([](const Array& boxes, const Maybe& other, Maybe category, Maybe mask, Maybe owner,
                         Maybe category_b, Maybe mask_b, Maybe owner_b, py::object accept,
                         std::uint64_t chunk, std::uint32_t threads) {
            return std::make_unique<PairStream>(boxes, other,
                                                std::make_unique<PairFilter>(category, mask, owner,
                                                                             category_b, mask_b, owner_b,
                                                                             std::move(accept)),
                                                chunk, threads);
        }))
        .def("__iter__", [](py::object self) { return self; })
        .def("__next__", &PairStream::next)
        .def("close", &PairStream::close);

    py::class_<Questions>(m, "Questions")
        .def(py::init<jostle_question, const Array&, jostle_space, const std::vector<Array>&,
                      std::uint32_t>());
    py::class_<AskFilter>(m, "AskFilter")
        .def(py::init<Maybe, Maybe, Maybe, std::optional<std::array<std::uint32_t, 3>>,
                      std::optional<std::uint64_t>, py::object>());

    py::class_<BoxIndex>(m, "BoxIndex")
        .def(py::init<jostle_space, std::uint32_t>())
        .def("build", [](BoxIndex& self, const std::optional<U32>& ids,
                         const Array& boxes) { self.change(ids, boxes, jostle_index_build); })
        .def("insert", [](BoxIndex& self, const U32& ids,
                          const Array& boxes) { self.change(ids, boxes, jostle_index_insert); })
        .def("move", [](BoxIndex& self, const U32& ids,
                        const Array& boxes) { self.change(ids, boxes, jostle_index_move); })
        .def("erase",
             [](BoxIndex& self, const U32& ids) {
                 const std::uint64_t count = length_of(ids, "ids");
                 const std::uint32_t* const first = ids.data();
                 call([&](jostle_error* error) {
                     return jostle_index_erase(self.handle.get(), first, count, error);
                 });
             })
        .def("clear",
             [](BoxIndex& self) {
                 call([&](jostle_error* error) { return jostle_index_clear(self.handle.get(), error); });
             })
        .def("release_memory",
             [](BoxIndex& self) {
                 call([&](jostle_error* error) {
                     return jostle_index_release_memory(self.handle.get(), error);
                 });
             })
        .def("size",
             [](const BoxIndex& self) {
                 std::uint64_t size = 0;
                 call(
                     [&](jostle_error* error) { return jostle_index_size(self.handle.get(), &size, error); });
                 return size;
             })
        .def("contains",
             [](const BoxIndex& self, const U32& ids) {
                 Packed<std::uint8_t> out(static_cast<py::ssize_t>(length_of(ids, "ids")));
                 const std::uint32_t* const first = ids.data();
                 std::uint8_t* const data = out.mutable_data();
                 const auto count = static_cast<std::uint64_t>(out.shape(0));
                 call([&](jostle_error* error) {
                     return jostle_index_contains(self.handle.get(), first, count, data, error);
                 });
                 return out;
             })
        .def("boxes",
             [](const BoxIndex& self, const U32& ids) {
                 const std::uint64_t count = length_of(ids, "ids");
                 Array out(number_of(self.space), {static_cast<py::ssize_t>(count), py::ssize_t(2),
                                                   py::ssize_t(dim_of(self.space))});
                 const std::uint32_t* const first = ids.data();
                 void* const data = out.mutable_data();
                 call([&](jostle_error* error) {
                     return jostle_index_boxes(self.handle.get(), first, count, data, error);
                 });
                 return out;
             })
        .def("stats", &BoxIndex::stats)
        .def("join",
             [](BoxIndex& self, const Array& boxes) {
                 const Boxes given = boxes_of(boxes, "boxes", self.space);
                 const Results results = new_results();
                 call([&](jostle_error* error) {
                     return jostle_index_join(self.handle.get(), &given.view, results.get(), error);
                 });
                 return copy_pairs(results);
             })
        .def("first",
             [](const BoxIndex& self, const Questions& questions, AskFilter& filter) {
                 return of_index.ask_first(self.handle.get(), questions, filter);
             })
        .def("all",
             [](const BoxIndex& self, const Questions& questions, AskFilter& filter, std::uint64_t limit) {
                 return of_index.ask_all(self.handle.get(), questions, filter, limit);
             })
        .def("any", [](const BoxIndex& self, const Questions& questions,
                       AskFilter& filter) { return of_index.ask_any(self.handle.get(), questions, filter); })
        .def("count", [](const BoxIndex& self, const Questions& questions, AskFilter& filter) {
            return of_index.ask_count(self.handle.get(), questions, filter);
        });

    py::class_<World>(m, "World")
        .def(py::init<jostle_space, double, py::object, std::uint32_t>())
        .def("add",
             [](World& self, const Array& boxes, std::optional<std::array<std::uint32_t, 4>> filter,
                double margin, bool enabled) {
                 const Boxes given = boxes_of(boxes, "boxes", self.space);
                 jostle_object_filter wish{};
                 jostle_object_options options{};
                 options.struct_size = sizeof options;
                 options.margin = margin;
                 options.disabled = enabled ? 0 : 1;
                 if (filter) {
                     wish = {(*filter)[0], (*filter)[1], (*filter)[2],
                             static_cast<std::int32_t>((*filter)[3])};
                     options.filter = &wish;
                 }
                 U64 ids(static_cast<py::ssize_t>(given.view.count));
                 std::uint64_t* const out = ids.mutable_data();
                 call([&](jostle_error* error) {
                     return jostle_world_add(self.handle.get(), &given.view, &options, out, error);
                 });
                 return ids;
             })
        .def("remove",
             [](World& self, const U64& ids) {
                 self.with_ids(ids, [&](auto*, auto* first, auto count, auto* error) {
                     return jostle_world_remove(self.handle.get(), first, count, error);
                 });
             })
        .def("move",
             [](World& self, const U64& ids, const Array& boxes, const Maybe& displacements,
                std::uint32_t sequence) {
                 const void* by = nullptr;
                 if (displacements) {
                     want_rows(*displacements, self.space, dim_of(self.space),
                               static_cast<std::uint64_t>(boxes.ndim() > 0 ? boxes.shape(0) : 0),
                               "displacements");
                     by = displacements->data();
                 }
                 self.with_boxes(ids, boxes, [&](auto* world, auto* first, auto* given, auto* error) {
                     return jostle_world_move(world, first, given, by, sequence, error);
                 });
             })
        .def("teleport",
             [](World& self, const U64& ids, const Array& boxes, std::uint32_t sequence) {
                 self.with_boxes(ids, boxes, [&](auto* world, auto* first, auto* given, auto* error) {
                     return jostle_world_teleport(world, first, given, sequence, error);
                 });
             })
        .def("resize",
             [](World& self, const U64& ids, const Array& sizes, std::uint32_t sequence) {
                 want_rows(sizes, self.space, dim_of(self.space), length_of(ids, "ids"), "sizes");
                 const void* const data = sizes.data();
                 self.with_ids(ids, [&](auto*, auto* first, auto count, auto* error) {
                     return jostle_world_resize(self.handle.get(), first, count, data, sequence, error);
                 });
             })
        .def("set_filter",
             [](World& self, const U64& ids, const U32& filters, std::uint32_t sequence) {
                 static_assert(sizeof(jostle_object_filter) == 16);
                 if (filters.ndim() != 2 || filters.shape(1) != 4 ||
                     static_cast<std::uint64_t>(filters.shape(0)) != length_of(ids, "ids"))
                     refuse("filters must be as many as ids");
                 const auto* const data = reinterpret_cast<const jostle_object_filter*>(filters.data());
                 self.with_ids(ids, [&](auto*, auto* first, auto count, auto* error) {
                     return jostle_world_set_filter(self.handle.get(), first, count, data, sequence, error);
                 });
             })
        .def("set_margin",
             [](World& self, const U64& ids, const F64& margins, std::uint32_t sequence) {
                 want_length(margins, length_of(ids, "ids"), "margins");
                 const double* const data = margins.data();
                 self.with_ids(ids, [&](auto*, auto* first, auto count, auto* error) {
                     return jostle_world_set_margin(self.handle.get(), first, count, data, sequence, error);
                 });
             })
        .def("set_enabled",
             [](World& self, const U64& ids, const Packed<std::uint8_t>& enabled, std::uint32_t sequence) {
                 want_length(enabled, length_of(ids, "ids"), "enabled");
                 const std::uint8_t* const data = enabled.data();
                 self.with_ids(ids, [&](auto*, auto* first, auto count, auto* error) {
                     return jostle_world_set_enabled(self.handle.get(), first, count, data, sequence, error);
                 });
             })
        .def("report_again",
             [](World& self, const U64& ids, const std::optional<U64>& others) {
                 if (others) want_length(*others, length_of(ids, "ids"), "others");
                 const std::uint64_t* const second = others ? others->data() : nullptr;
                 self.with_ids(ids, [&](auto*, auto* first, auto count, auto* error) {
                     return jostle_world_report_again(self.handle.get(), first, second, count, error);
                 });
             })
        .def("clear",
             [](World& self) {
                 call([&](jostle_error* error) { return jostle_world_clear(self.handle.get(), error); });
             })
        .def("touching",
             [](const World& self, const U64& ids) {
                 const Results results = new_results();
                 jostle_lists lists;
                 self.with_ids(ids, [&](auto* world, auto* first, auto count, auto* error) {
                     return jostle_world_touching(world, first, count, results.get(), error);
                 });
                 call(
                     [&](jostle_error* error) { return jostle_results_lists(results.get(), &lists, error); });
                 return py::make_tuple(copy_array(lists.first, lists.questions + 1),
                                       copy_array(lists.ids, lists.count));
             })
        .def("bounds_of_all",
             [](const World& self) -> py::object {
                 Array out(number_of(self.space), {py::ssize_t(2), py::ssize_t(dim_of(self.space))});
                 void* const data = out.mutable_data();
                 std::int32_t any = 0;
                 call([&](jostle_error* error) {
                     return jostle_world_bounds_of_all(self.handle.get(), &any, data, error);
                 });
                 return any != 0 ? py::object(out) : py::object(py::none());
             })
        .def("update",
             [](World& self) {
                 call([&](jostle_error* error) { return jostle_world_update(self.handle.get(), error); },
                      self.pending.get());
             })
        .def("update_moves",
             [](World& self, const U64& ids, const Array& boxes) {
                 self.with_boxes(ids, boxes, jostle_world_update_moves);
             })
        .def("began",
             [](const World& self) {
                 const jostle_id_pair* pairs = nullptr;
                 std::uint64_t count = 0;
                 call([&](jostle_error* error) {
                     return jostle_world_began(self.handle.get(), &pairs, &count, error);
                 });
                 U64 out({static_cast<py::ssize_t>(count), py::ssize_t(2)});
                 if (count != 0) std::memcpy(out.mutable_data(), pairs, count * sizeof *pairs);
                 return out;
             })
        .def("ended",
             [](const World& self) {
                 const jostle_ended_pair* pairs = nullptr;
                 std::uint64_t count = 0;
                 call([&](jostle_error* error) {
                     return jostle_world_ended(self.handle.get(), &pairs, &count, error);
                 });
                 U64 out({static_cast<py::ssize_t>(count), py::ssize_t(2)});
                 Packed<std::uint8_t> reasons(static_cast<py::ssize_t>(count));
                 for (std::uint64_t i = 0; i < count; ++i) {
                     out.mutable_data()[2 * i] = pairs[i].a;
                     out.mutable_data()[2 * i + 1] = pairs[i].b;
                     reasons.mutable_data()[i] = static_cast<std::uint8_t>(pairs[i].reason);
                 }
                 return py::make_tuple(out, reasons);
             })
        .def("persisted", [](const World& self) { return self.listed(jostle_world_persisted); })
        .def("changed_pairs", [](const World& self) { return self.listed(jostle_world_changed_pairs); })
        .def("pairs",
             [](const World& self) {
                 const Results results = new_results();
                 call([&](jostle_error* error) {
                     return jostle_world_pairs(self.handle.get(), results.get(), error);
                 });
                 return copy_pairs(results);
             })
        .def("first",
             [](const World& self, const Questions& questions, AskFilter& filter) {
                 return of_world.ask_first(self.handle.get(), questions, filter);
             })
        .def("all",
             [](const World& self, const Questions& questions, AskFilter& filter, std::uint64_t limit) {
                 return of_world.ask_all(self.handle.get(), questions, filter, limit);
             })
        .def("any", [](const World& self, const Questions& questions,
                       AskFilter& filter) { return of_world.ask_any(self.handle.get(), questions, filter); })
        .def("count",
             [](const World& self, const Questions& questions, AskFilter& filter) {
                 return of_world.ask_count(self.handle.get(), questions, filter);
             })
        .def("join",
             [](World& self, const Array& boxes, AskFilter& filter) {
                 const Boxes given = boxes_of(boxes, "boxes", self.space);
                 const Results results = new_results();
                 call(
                     [&](jostle_error* error) {
                         return jostle_world_join(self.handle.get(), &given.view, &filter.filter,
                                                  results.get(), error);
                     },
                     &filter.pending);
                 return copy_pairs(results);
             })
        .def("size",
             [](const World& self) {
                 std::uint64_t size = 0;
                 call(
                     [&](jostle_error* error) { return jostle_world_size(self.handle.get(), &size, error); });
                 return size;
             })
        .def("index_end",
             [](const World& self) {
                 std::uint32_t end = 0;
                 call([&](jostle_error* error) {
                     return jostle_world_index_end(self.handle.get(), &end, error);
                 });
                 return end;
             })
        .def("contains", [](const World& self,
                            const U64& ids) { return self.read<std::uint8_t>(ids, jostle_world_contains); })
        .def("ids",
             [](const World& self, const U32& indices) {
                 U64 out(static_cast<py::ssize_t>(length_of(indices, "indices")));
                 const std::uint32_t* const first = indices.data();
                 std::uint64_t* const data = out.mutable_data();
                 const auto count = static_cast<std::uint64_t>(out.shape(0));
                 call([&](jostle_error* error) {
                     return jostle_world_ids(self.handle.get(), first, count, data, error);
                 });
                 return out;
             })
        .def("boxes",
             [](const World& self, const U64& ids) { return self.read_boxes(ids, jostle_world_boxes); })
        .def("bounds",
             [](const World& self, const U64& ids) { return self.read_boxes(ids, jostle_world_bounds); })
        .def("filters",
             [](const World& self, const U64& ids) {
                 U32 out({static_cast<py::ssize_t>(length_of(ids, "ids")), py::ssize_t(4)});
                 auto* const data = reinterpret_cast<jostle_object_filter*>(out.mutable_data());
                 self.with_ids(ids, [&](auto* world, auto* first, auto count, auto* error) {
                     return jostle_world_filters(world, first, count, data, error);
                 });
                 return out;
             })
        .def("enabled", [](const World& self,
                           const U64& ids) { return self.read<std::uint8_t>(ids, jostle_world_enabled); })
        .def("margins",
             [](const World& self, const U64& ids) { return self.read<double>(ids, jostle_world_margins); })
        .def("save",
             [](const World& self) {
                 const Results results = new_results();
                 const void* bytes = nullptr;
                 std::uint64_t count = 0;
                 call([&](jostle_error* error) {
                     return jostle_world_save(self.handle.get(), results.get(), error);
                 });
                 call([&](jostle_error* error) {
                     return jostle_results_bytes(results.get(), &bytes, &count, error);
                 });
                 return py::bytes(static_cast<const char*>(bytes), count);
             })
        .def("restore",
             [](World& self, const py::bytes& snapshot) {
                 char* bytes = nullptr;
                 py::ssize_t count = 0;
                 PyBytes_AsStringAndSize(snapshot.ptr(), &bytes, &count);
                 call([&](jostle_error* error) {
                     return jostle_world_restore(self.handle.get(), bytes, static_cast<std::uint64_t>(count),
                                                 error);
                 });
             })
        .def("fork",
             [](const World& self) {
                 auto fork = std::make_unique<World>(self.space, 0, py::none(), 1);
                 fork->handle = make<WorldHandle>([&](auto** out, auto* error) {
                     return jostle_world_fork(self.handle.get(), out, error);
                 });
                 fork->accept = self.accept;
                 fork->pending = self.pending;
                 fork->asked = self.asked;
                 return fork;
             })
        .def("stats", &World::stats)
        .def("explain",
             [](const World& self) {
                 const Results results = new_results();
                 const void* bytes = nullptr;
                 std::uint64_t count = 0;
                 call([&](jostle_error* error) {
                     return jostle_world_explain(self.handle.get(), results.get(), error);
                 });
                 call([&](jostle_error* error) {
                     return jostle_results_bytes(results.get(), &bytes, &count, error);
                 });
                 return py::str(static_cast<const char*>(bytes), count);
             })
        .def_readonly("accept", &World::accept);

    py::class_<Shape>(
        m, "Shape",
        "One collision shape, immutable: made by sphere, capsule, box, half_space, hull, mesh,\n"
        "height_field and compound.")
        .def_readonly("dim", &Shape::dim)
        .def("info",
             [](const Shape& self) {
                 jostle_shape_info info{};
                 call([&](jostle_error* error) {
                     return jostle_shape_info_read(self.handle.get(), &info, error);
                 });
                 return py::make_tuple(info.type, info.radius,
                                       std::vector<double>(info.size, info.size + info.dim), info.offset);
             })
        .def("vertices",
             [](const Shape& self) {
                 const double* vertices = nullptr;
                 std::uint64_t count = 0;
                 call([&](jostle_error* error) {
                     return jostle_shape_vertices(self.handle.get(), &vertices, &count, error);
                 });
                 F64 out({static_cast<py::ssize_t>(count), py::ssize_t(self.dim)});
                 if (count != 0)
                     std::memcpy(out.mutable_data(), vertices, static_cast<std::size_t>(out.nbytes()));
                 return out;
             })
        .def("faces", [](const Shape& self) {
            std::uint64_t count = 0;
            call([&](jostle_error* error) {
                return jostle_shape_face_count(self.handle.get(), &count, error);
            });
            py::list faces;
            for (std::uint64_t i = 0; i < count; ++i) {
                const std::uint32_t* corners = nullptr;
                std::uint64_t n = 0;
                call([&](jostle_error* error) {
                    return jostle_shape_face(self.handle.get(), i, &corners, &n, error);
                });
                faces.append(copy_array(corners, n));
            }
            return faces;
        });
    m.def("sphere", [](int dim, double radius) {
        return make_shape(
            dim, [&](auto** out, auto* error) { return jostle_shape_sphere(dim, radius, out, error); });
    });
    m.def("capsule", [](int dim, double half, double radius) {
        return make_shape(dim, [&](auto** out, auto* error) {
            return jostle_shape_capsule(dim, half, radius, out, error);
        });
    });
    m.def("box", [](const F64& half) {
        const int dim = static_cast<int>(length_of(half, "half"));
        const double* const data = half.data();
        return make_shape(dim,
                          [&](auto** out, auto* error) { return jostle_shape_box(dim, data, out, error); });
    });
    m.def("half_space", [](const F64& normal, double offset) {
        const int dim = static_cast<int>(length_of(normal, "normal"));
        const double* const data = normal.data();
        return make_shape(dim, [&](auto** out, auto* error) {
            return jostle_shape_half_space(dim, data, offset, out, error);
        });
    });
    m.def("hull", [](jostle_space space, const Array& points) {
        want_rows(points, space, dim_of(space),
                  static_cast<std::uint64_t>(points.ndim() == 2 ? points.shape(0) : 0), "points");
        const void* const data = points.data();
        const auto count = static_cast<std::uint64_t>(points.shape(0));
        return make_shape(dim_of(space), [&](auto** out, auto* error) {
            return jostle_shape_hull(space, data, count, out, error);
        });
    });
    m.def("mesh", [](jostle_space space, const Array& vertices, const U32& elements) {
        const auto count = static_cast<std::uint64_t>(vertices.ndim() == 2 ? vertices.shape(0) : 0);
        want_rows(vertices, space, dim_of(space), count, "vertices");
        if (elements.ndim() != 2 || elements.shape(1) != dim_of(space))
            refuse("elements has the shape " + shape_text(elements) + ": it must be (m, " +
                   std::to_string(dim_of(space)) + ")");
        const void* const data = vertices.data();
        const std::uint32_t* const indices = elements.data();
        const auto element_count = static_cast<std::uint64_t>(elements.shape(0));
        return make_shape(dim_of(space), [&](auto** out, auto* error) {
            return jostle_shape_mesh(space, data, count, indices, element_count, out, error);
        });
    });
    m.def("height_field", [](const F64& heights, double spacing_x, double spacing_z, double thickness) {
        if (heights.ndim() != 2)
            refuse("heights has the shape " + shape_text(heights) + ": it must be (rows, columns)");
        if (heights.shape(0) > UINT32_MAX || heights.shape(1) > UINT32_MAX) refuse("heights are too many");
        const void* const data = heights.data();
        const auto rows = static_cast<std::uint32_t>(heights.shape(0));
        const auto columns = static_cast<std::uint32_t>(heights.shape(1));
        return make_shape(3, [&](auto** out, auto* error) {
            return jostle_shape_height_field(JOSTLE_3D, data, columns, rows, spacing_x, spacing_z, thickness,
                                             out, error);
        });
    });
    m.def("compound", [](int dim, const std::vector<const Shape*>& children, const F64& poses) {
        std::vector<const jostle_shape*> handles;
        for (const Shape* child : children) {
            if (child == nullptr) refuse("a child is None");
            handles.push_back(child->handle.get());
        }
        want_rows(poses, dim == 2 ? JOSTLE_2D : JOSTLE_3D, dim == 2 ? 4 : 7, handles.size(), "poses");
        const double* const data = poses.data();
        return make_shape(dim, [&](auto** out, auto* error) {
            return jostle_shape_compound(dim, handles.data(), data, handles.size(), out, error);
        });
    });
    py::class_<Shapes>(m, "Shapes")
        .def(py::init<int>())
        .def_readonly("dim", &Shapes::dim)
        .def("size", &Shapes::size)
        .def("clear",
             [](Shapes& self) {
                 call([&](jostle_error* error) { return jostle_shapes_clear(self.handle.get(), error); });
             })
        .def("add",
             [](Shapes& self, const Shape& shape, std::uint64_t count) {
                 call([&](jostle_error* error) {
                     return jostle_shapes_add(self.handle.get(), shape.handle.get(), count, error);
                 });
             })
        .def("set",
             [](Shapes& self, std::uint64_t object, const Shape& shape) {
                 call([&](jostle_error* error) {
                     return jostle_shapes_set(self.handle.get(), object, shape.handle.get(), error);
                 });
             })
        .def("add_spheres",
             [](Shapes& self, const F64& radii) {
                 const std::uint64_t count = length_of(radii, "radii");
                 const double* const data = radii.data();
                 call([&](jostle_error* error) {
                     return jostle_shapes_add_spheres(self.handle.get(), data, count, error);
                 });
             })
        .def("add_capsules",
             [](Shapes& self, const F64& half_lengths, const F64& radii) {
                 const std::uint64_t count = length_of(radii, "radii");
                 want_length(half_lengths, count, "half_lengths");
                 const double *const halves = half_lengths.data(), *const data = radii.data();
                 call([&](jostle_error* error) {
                     return jostle_shapes_add_capsules(self.handle.get(), halves, data, count, error);
                 });
             })
        .def("add_boxes", [](Shapes& self, const F64& halves) {
            if (halves.ndim() != 2 || halves.shape(1) != self.dim)
                refuse("halves has the shape " + shape_text(halves) + ": it must be (n, " +
                       std::to_string(self.dim) + ")");
            const double* const data = halves.data();
            const auto count = static_cast<std::uint64_t>(halves.shape(0));
            call([&](jostle_error* error) {
                return jostle_shapes_add_boxes(self.handle.get(), data, count, error);
            });
        });
    m.def("bounds", [](jostle_space space, const Shapes& shapes, const Array& poses, double margin) {
        const Objects objects(shapes, poses, space, false, "poses");
        Array out(number_of(space),
                  {static_cast<py::ssize_t>(shapes.size()), py::ssize_t(2), py::ssize_t(dim_of(space))});
        void* const data = out.mutable_data();
        const Executor executor =
            make<Executor>([](auto** made, auto* error) { return jostle_executor_default(made, error); });
        call([&](jostle_error* error) {
            return jostle_bounds(space, &objects.view, margin, executor.get(), data, error);
        });
        return out;
    });
    py::class_<ContactFinder>(m, "ContactFinder")
        .def(py::init<jostle_space, std::uint32_t>())
        .def("find", &ContactFinder::find)
        .def("rows", &ContactFinder::rows)
        .def("touching", &ContactFinder::touching);
    m.def("sum_by_object", &sum_by_object);
}
