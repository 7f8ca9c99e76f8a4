// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cstdlib>
#include <iomanip>
#include <memory>
#include <mutex>
#include <ostream>
#include <string>
#include <thread>
#include <type_traits>
#include <unordered_map>
#include <vector>

#include "jostle/find_pairs.hpp"
#include "oracle.hpp"

/// Asking the library a Question in every form it has.
namespace contract {

using jostle::BoxView;
using jostle::StridedView;

template <int D, class T>
struct Kind
{
    static constexpr int dim = D;
    using Number = T;
};

/// Calls f(Kind<...>{}) for 2D and 3D, float and double.
template <class F>
void for_each_kind(F&& f)
{
    f(Kind<2, float>{});
    f(Kind<3, float>{});
    f(Kind<2, double>{});
    f(Kind<3, double>{});
}

template <int Dim, class T>
std::string kind_name()
{
    return std::to_string(Dim) + (std::is_same_v<T, float> ? "f" : "d");
}

inline std::uint64_t environment_number(const char* variable, std::uint64_t otherwise)
{
    const char* text = std::getenv(variable);
    return text == nullptr ? otherwise : std::strtoull(text, nullptr, 0);
}

/// Runs the tasks last to first on the calling thread.
inline void run_backwards(void*, std::uint32_t count, void (*task)(void*, std::uint32_t), void* context)
{
    while (count-- > 0)
        task(context, count);
}

/// Runs every task on a thread of its own, all at the same time.
inline void run_on_new_threads(void*, std::uint32_t count, void (*task)(void*, std::uint32_t), void* context)
{
    std::vector<std::thread> threads;
    for (std::uint32_t i = 0; i < count; ++i)
        threads.emplace_back(task, context, i);
    for (std::thread& thread : threads)
        thread.join();
}

struct NamedExecutor
{
    std::string name;
    std::shared_ptr<jostle::Executor> executor;
};

/// One executor of each sort and size, made once.
inline const std::vector<NamedExecutor>& all_executors()
{
    static const std::vector<NamedExecutor> executors = [] {
        std::vector<NamedExecutor> all;
        all.push_back({"serial", {&jostle::serial_executor(), [](jostle::Executor*) {}}});
        for (const std::uint32_t threads : {1u, 2u, 3u, 7u, 16u}) {
            const std::string count = std::to_string(threads);
            all.push_back({"thread " + count, jostle::make_thread_executor(threads)});
            all.push_back(
                {"default " + count, {&jostle::default_executor(threads), [](jostle::Executor*) {}}});
        }
        all.push_back(
            {"backwards 5", std::make_shared<jostle::CallbackExecutor>(5u, nullptr, run_backwards)});
        all.push_back(
            {"new threads 4", std::make_shared<jostle::CallbackExecutor>(4u, nullptr, run_on_new_threads)});
        return all;
    }();
    return executors;
}

enum class Layout
{
    boxes, // an array of Aabb
    inside_structs,
    columns,   // one array per coordinate
    backwards, // a negative stride
    count
};

/// Boxes copied into memory of the given layout; what lies between them is NaN, so that a read beside them
/// shows.
template <int Dim, class T>
class BoxMemory
{
  public:
    BoxMemory(const Boxes<Dim, T>& boxes, Layout layout) : boxes_(boxes)
    {
        const std::size_t n = boxes.size();
        if (layout == Layout::boxes || n == 0) {
            view_ = BoxView<Dim, T>(boxes_);
        } else if (layout == Layout::columns) {
            memory_.assign(n * 2 * Dim, nan);
            std::array<const T*, Dim> lo, hi;
            for (std::size_t d = 0; d < Dim; ++d) {
                lo[d] = memory_.data() + 2 * d * n;
                hi[d] = memory_.data() + (2 * d + 1) * n;
                for (std::size_t i = 0; i < n; ++i) {
                    memory_[2 * d * n + i] = boxes[i].lo[d];
                    memory_[(2 * d + 1) * n + i] = boxes[i].hi[d];
                }
            }
            view_ = BoxView<Dim, T>::arrays(lo, hi, n);
        } else {
            // Inside structs: a number, lo, hi, two numbers. Backwards: a number, hi, a number, lo, a number.
            constexpr std::size_t step = 2 * Dim + 3;
            memory_.assign(n * step, nan);
            const bool backwards = layout == Layout::backwards;
            const std::size_t lo_at = backwards ? 2 + Dim : 1, hi_at = backwards ? 1 : 1 + Dim;
            for (std::size_t i = 0; i < n; ++i) {
                T* const here = memory_.data() + (backwards ? n - 1 - i : i) * step;
                std::copy_n(boxes[i].hi.data(), Dim, here + hi_at);
                std::copy_n(boxes[i].lo.data(), Dim, here + lo_at);
            }
            const T* const first = memory_.data() + (backwards ? (n - 1) * step : 0);
            const auto stride = static_cast<std::ptrdiff_t>(step * sizeof(T));
            view_ = BoxView<Dim, T>::strided(first + lo_at, first + hi_at, n, backwards ? -stride : stride);
        }
    }
    BoxMemory(const BoxMemory&) = delete;
    BoxMemory& operator=(const BoxMemory&) = delete;
    const BoxView<Dim, T>& view() const { return view_; }

  private:
    static constexpr T nan = std::numeric_limits<T>::quiet_NaN();
    Boxes<Dim, T> boxes_;
    std::vector<T> memory_;
    BoxView<Dim, T> view_;
};

/// How a Question is asked.
struct Manner
{
    enum Form
    {
        canonical,
        sorted,
        streamed,
        forms
    };
    Form form = canonical;
    Layout layout = Layout::boxes;
    bool free_function = false;
    jostle::FinderOptions options;
    jostle::PairFinder* finder = nullptr; ///< asked if given, else a new one
};

/// Collects the chunks of a stream and checks what is promised of each.
class Collector
{
  public:
    bool operator()(const jostle::PairChunk& chunk)
    {
        const std::lock_guard lock(mutex_);
        const auto [last, first_of_block] = last_part_.try_emplace(chunk.block, chunk.part);
        broken_ |= chunk.pairs.empty() || (!first_of_block && last->second >= chunk.part);
        last->second = chunk.part;
        chunks_.push_back({chunk.block, chunk.part, {chunk.pairs.begin(), chunk.pairs.end()}});
        return true;
    }
    /// All pairs, chunks ordered by (block, part); nothing if a chunk was empty or came before its turn.
    std::vector<Pair> pairs()
    {
        std::vector<Pair> all;
        if (broken_) return {{~0u, ~0u}};
        std::sort(chunks_.begin(), chunks_.end(), [](const Chunk& x, const Chunk& y) {
            return std::pair(x.block, x.part) < std::pair(y.block, y.part);
        });
        for (const Chunk& chunk : chunks_)
            all.insert(all.end(), chunk.pairs.begin(), chunk.pairs.end());
        return all;
    }

  private:
    struct Chunk
    {
        std::uint64_t block, part;
        std::vector<Pair> pairs;
    };
    std::mutex mutex_;
    std::vector<Chunk> chunks_;
    std::unordered_map<std::uint64_t, std::uint64_t> last_part_;
    bool broken_ = false;
};

/// The library's answer, in the order it came.
template <int Dim, class T>
std::vector<Pair> ask(const Question<Dim, T>& question, const Manner& manner = {})
{
    const BoxMemory<Dim, T> a(question.a, manner.layout), b(question.b, manner.layout);
    // Columns with a stride, every second value a trap.
    std::vector<std::vector<std::uint32_t>> strided;
    strided.reserve(6);
    const auto column = [&](const std::vector<std::uint32_t>& values) -> StridedView<std::uint32_t> {
        if (manner.layout == Layout::boxes || values.empty()) return std::span<const std::uint32_t>(values);
        std::vector<std::uint32_t>& memory = strided.emplace_back(values.size() * 2, 0xdeadbeefu);
        for (std::size_t i = 0; i < values.size(); ++i)
            memory[2 * i] = values[i];
        return {memory.data(), values.size(), 8};
    };
    const auto accept = [&](std::uint32_t i, std::uint32_t j) { return accepts(question.accept_salt, i, j); };

    const auto go = [&](const auto& filter, const auto&... views) -> std::vector<Pair> {
        const jostle::Order order =
            manner.form == Manner::sorted ? jostle::Order::sorted : jostle::Order::canonical;
        if (manner.form == Manner::streamed) {
            Collector collector;
            bool whole = false;
            if (manner.free_function)
                whole = jostle::PairFinder(manner.options).stream(views..., collector, filter);
            else if (manner.finder != nullptr)
                whole = manner.finder->stream(views..., collector, filter);
            else
                whole = jostle::PairFinder(manner.options).stream(views..., collector, filter);
            return whole ? collector.pairs() : std::vector<Pair>{{~0u, 0}};
        }
        if (manner.free_function)
            return jostle::find_pairs(views..., filter, order, manner.options).to_vector();
        if (manner.finder != nullptr) return manner.finder->find(views..., filter, order).to_vector();
        return jostle::PairFinder(manner.options).take(views..., filter, order).to_vector();
    };
    const Columns &of_a = question.columns_a, &of_b = question.columns_b;
    if (question.cross) {
        jostle::CrossFilter filter{column(of_a.category),
                                   column(of_a.mask),
                                   column(of_a.owner),
                                   column(of_b.category),
                                   column(of_b.mask),
                                   column(of_b.owner),
                                   {}};
        if (question.accept_salt != 0) filter.accept = accept;
        return go(filter, a.view(), b.view());
    }
    jostle::Filter filter{column(of_a.category), column(of_a.mask), column(of_a.owner), {}};
    filter.ghosts = question.ghosts;
    filter.vertices = std::span<const std::array<std::uint32_t, 3>>(question.vertices);
    if (question.accept_salt != 0) filter.accept = accept;
    return go(filter, a.view());
}

inline std::vector<Pair> sorted(std::vector<Pair> pairs)
{
    std::sort(pairs.begin(), pairs.end());
    return pairs;
}

/// Values that make every rule of the filters decide some pairs.
inline Columns random_columns(Random& random, std::size_t n, bool masks, bool owners)
{
    Columns columns;
    for (std::size_t i = 0; i < n; ++i) {
        if (masks) {
            columns.category.push_back(random.one_in(16) ? 0x80000000u : 1u << random.below(3));
            columns.mask.push_back(random.one_in(3) ? 0xffffffffu : random.below(8));
        }
        if (owners) columns.owner.push_back(random.one_in(4) ? jostle::Filter::no_owner : random.below(4));
    }
    return columns;
}

/// Few numbers for many objects, so that some share one, and some objects with fewer than three.
inline std::vector<std::array<std::uint32_t, 3>> random_vertices(Random& random, std::size_t n)
{
    std::vector<std::array<std::uint32_t, 3>> vertices(n);
    for (auto& each : vertices)
        for (std::uint32_t& vertex : each)
            vertex = random.one_in(3) ? jostle::Filter::no_owner : random.below(12);
    return vertices;
}

template <int Dim, class T>
void print(std::ostream& out, const Boxes<Dim, T>& boxes)
{
    out << std::hexfloat;
    for (std::size_t i = 0; i < boxes.size(); ++i) {
        out << "  " << i << ":";
        for (int d = 0; d < Dim; ++d)
            out << " [" << boxes[i].lo[d] << ", " << boxes[i].hi[d] << "]";
        out << "\n";
    }
    out << std::defaultfloat;
}

} // namespace contract
