// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <initializer_list>
#include <memory>
#include <memory_resource>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include "jostle/block_buffer.hpp"
#include "jostle/error.hpp"
#include "jostle/executor.hpp"
#include "jostle/find_pairs.hpp"
#include "jostle/jostle.h"

// What every function of the C interface begins and ends with: handles opened, exceptions turned into a
// status.

namespace jostle::c_api {

/// Leaves a function as this status.
struct Failure
{
    jostle_status status;
    std::string message;
    std::uint64_t index = UINT64_MAX;
    std::int32_t callback_result = 0;
};

[[noreturn]] inline void refuse(std::string message, jostle_status status = JOSTLE_INVALID_ARGUMENT,
                                std::uint64_t index = UINT64_MAX)
{
    throw Failure{status, std::move(message), index};
}

/// Turns the exception being handled into a status, and fills in `error` if there is one.
jostle_status report(jostle_error* error) noexcept;

/// A call that this thread is in, and the handles that it has opened. A callback may make further calls, but
/// must neither free nor change what the calls around it go on with. Handles don't count their users instead:
/// queries from many threads would take turns at one number.
class Call
{
  public:
    Call() noexcept : Call(of_this_thread()) {}
    /// A task of another call, which may be another thread's.
    explicit Call(const Call* outer) noexcept;
    Call(const Call&) = delete;
    Call& operator=(const Call&) = delete;
    ~Call();
    void opens(const void* handle) noexcept
    {
        if (count_ < handles_.size()) handles_[count_++] = handle;
    }
    /// Whether one of the calls around this one has opened a handle.
    [[nodiscard]] bool is_open_outside(const void* handle) const noexcept;
    /// The innermost.
    [[nodiscard]] static Call* of_this_thread() noexcept;

  private:
    const Call* outer_;
    Call* before_; // on this thread
    std::size_t count_ = 0;
    std::array<const void*, 8> handles_; // no function that calls back has more
};

/// Runs the inside of a function. What it throws becomes the status.
template <class F>
jostle_status guarded(jostle_error* error, F&& inside) noexcept
{
    // Ids and hits are read and written here as other types of the same layout. With link-time optimisation
    // the caller's own accesses must not move across.
    std::atomic_signal_fence(std::memory_order_seq_cst);
    Call call; // not const: open() adds to it
    jostle_status status = JOSTLE_OK;
    try {
        inside();
        if (error != nullptr) {
            error->status = JOSTLE_OK;
            error->callback_result = 0;
            error->index = UINT64_MAX;
            error->message[0] = '\0';
        }
    } catch (...) {
        status = report(error);
    }
    std::atomic_signal_fence(std::memory_order_seq_cst);
    return status;
}

/// Leaves the call if a callback failed.
inline bool agreed(std::int32_t result)
{
    if (result < 0)
        throw Failure{JOSTLE_CALLBACK_FAILED, "a callback failed: it returned " + std::to_string(result),
                      UINT64_MAX, result};
    return result != 0;
}

/// A pointer that must not be NULL.
template <class T>
T& wanted(T* pointer, const char* name)
{
    if (pointer == nullptr) refuse(std::string(name) + " is NULL");
    return *pointer;
}
template <class Function>
void wanted_function(Function function, const char* name)
{
    if (function == nullptr) refuse(std::string(name) + " is NULL");
}

/// `count` elements of memory that the caller gave as `pointer`: there, aligned, and not longer than memory
/// is.
template <class T>
T* wanted_array(T* pointer, std::uint64_t count, const char* name)
{
    if (count == 0) return pointer;
    if (pointer == nullptr) refuse(std::string(name) + " is NULL");
    if (reinterpret_cast<std::uintptr_t>(pointer) % alignof(T) != 0)
        refuse(std::string(name) + " isn't aligned to " + std::to_string(alignof(T)) + " bytes");
    if (count > static_cast<std::uint64_t>(PTRDIFF_MAX) / sizeof(T))
        refuse(std::string(name) + " can't have " + std::to_string(count) + " elements",
               JOSTLE_TOO_MANY_OBJECTS);
    return pointer;
}
/// The same where the interface says void.
template <class T>
const T* wanted_array_of(const void* pointer, std::uint64_t count, const char* name)
{
    return wanted_array(static_cast<const T*>(pointer), count, name);
}
template <class T>
T* wanted_array_of(void* pointer, std::uint64_t count, const char* name)
{
    return wanted_array(static_cast<T*>(pointer), count, name);
}

/// One offset more than `count`, which `name` names.
inline std::span<const std::uint64_t> offsets_of(const std::uint64_t* offsets, std::uint64_t count,
                                                 const char* name)
{
    wanted(offsets, "offsets");
    if (count >= std::numeric_limits<std::size_t>::max() / sizeof *offsets)
        refuse(std::string(name) + " is " + std::to_string(count) + ": no memory holds so many offsets");
    return {offsets, static_cast<std::size_t>(count) + 1};
}

/// Calls work(i) for each of `count` objects; an error names the one at fault.
template <class F>
void for_each_object(std::size_t count, F&& work)
{
    for (std::size_t i = 0; i < count; ++i)
        try {
            work(i);
        } catch (const Error& error) {
            throw Failure{static_cast<jostle_status>(error.code()), error.what(), i};
        }
}

/// An option struct that begins with its size: what the caller has of it, and zeros.
template <class Options>
Options read_options(const Options* given, const char* name)
{
    Options options{};
    if (given == nullptr) return options;
    const std::uint64_t size = given->struct_size;
    if (size < sizeof size || size > 4096)
        refuse(std::string(name) + "::struct_size is " + std::to_string(size) + ": set it to sizeof(" + name +
               ")");
    const auto* const bytes = reinterpret_cast<const unsigned char*>(given);
    const std::size_t known = size < sizeof(Options) ? static_cast<std::size_t>(size) : sizeof(Options);
    std::copy_n(bytes, known, reinterpret_cast<unsigned char*>(&options));
    for (std::size_t i = known; i < size; ++i)
        if (bytes[i] != 0)
            refuse(std::string(name) + " has a member that this version of Jostle doesn't know");
    return options;
}
/// Number i of several that lie as far apart as the first one's size says. That one has been read.
template <class Options>
const Options* options_number(const Options* first, std::uint64_t i, const char* name)
{
    const std::uint64_t size = first->struct_size;
    if (size % alignof(Options) != 0)
        refuse(std::string(name) + "::struct_size is " + std::to_string(size) + ": set it to sizeof(" + name +
               ")");
    return reinterpret_cast<const Options*>(reinterpret_cast<const unsigned char*>(first) + i * size);
}
/// The other way round: as much of `values` as the caller has room for.
template <class Stats>
void write_stats(Stats* into, Stats values, const char* name)
{
    const std::uint64_t size = wanted(into, name).struct_size;
    if (size < sizeof size || size > 4096)
        refuse(std::string(name) + "::struct_size is " + std::to_string(size) + ": set it to sizeof(" + name +
               ")");
    values.struct_size = size;
    std::copy_n(reinterpret_cast<const unsigned char*>(&values),
                size < sizeof values ? static_cast<std::size_t>(size) : sizeof values,
                reinterpret_cast<unsigned char*>(into));
}

// --- Handles ---

/// What a handle stands for.
class Content
{
  public:
    Content() = default;
    Content(const Content&) = delete;
    Content& operator=(const Content&) = delete;
    virtual ~Content();

    // What C has one function for. Kinds without it say so by false, or nothing.
    virtual bool clear() { return false; }
    virtual bool release_memory() { return false; }
    [[nodiscard]] virtual std::optional<std::uint64_t> size() const { return {}; }
};

/// What a pointer to an opaque struct really points to. It outlives its content for a while, so that a handle
/// that was freed can be told from one that wasn't: see release().
struct Handle
{
    std::atomic<std::uint64_t> mark;
    const char* name;
    bool changes_in_callbacks;
    Content* content;
};

/// Kind, name and content of an opaque struct.
template <class Opaque>
struct Behind;
/// All marks are this one and the number of a kind.
inline constexpr std::uint64_t marks = 0x6a6f73746c650000U;
template <class Content, std::uint64_t number>
struct Kind
{
    using type = Content;
    static constexpr std::uint64_t mark = marks | number;
};

/// What callbacks may change while the call around them goes on: it looks after itself.
template <class Opaque>
inline constexpr bool changes_in_callbacks = false;
template <>
inline constexpr bool changes_in_callbacks<jostle_executor> = true;
template <>
inline constexpr bool changes_in_callbacks<jostle_world> = true;

Content& open(const void* handle, std::uint64_t mark, const char* name);
/// Which of these kinds a handle is of: `wanted` names them.
std::uint64_t mark_of(const void* handle, std::initializer_list<std::uint64_t> kinds, const char* wanted);
// Of any kind.
const Handle& open_any(const void* handle);
const Handle& open_any(void* handle);
void release(void* handle);
/// Refuses to free or change what a call around this one has opened.
void refuse_in_callback(const void* handle, const char* name, const char* verb);

/// To be read.
template <class Opaque>
auto& open(const Opaque* handle)
{
    using Of = Behind<Opaque>;
    return static_cast<typename Of::type&>(open(handle, Of::mark, Of::name));
}
/// To be changed.
template <class Opaque>
auto& open(Opaque* handle)
{
    auto& content = open(static_cast<const Opaque*>(handle));
    if (!changes_in_callbacks<Opaque>) refuse_in_callback(handle, Behind<Opaque>::name, "change");
    return content;
}
/// A handle of this content; `out` is written last, when nothing can fail any more.
template <class Opaque>
void hand_out(Opaque** out, std::unique_ptr<typename Behind<Opaque>::type> content)
{
    wanted(out, "out");
    auto* const handle = new Handle{
        {Behind<Opaque>::mark}, Behind<Opaque>::name, changes_in_callbacks<Opaque>, content.release()};
    *out = reinterpret_cast<Opaque*>(handle);
}

// --- Options ---

/// Whatever thread runs a task, the callbacks in it are within the call that asked for it.
class CallExecutor final : public Executor
{
  public:
    /// Null: the default one, which is made when it is first used: what needs no threads starts none.
    explicit CallExecutor(std::shared_ptr<Executor> given) noexcept : given_(std::move(given)) {}
    /// 1 where the default executor can't be made.
    [[nodiscard]] std::uint32_t concurrency() const noexcept override;
    void run(std::uint32_t count, FunctionRef<void(std::uint32_t)> task) override;

  private:
    [[nodiscard]] Executor& given() const { return given_ == nullptr ? default_executor() : *given_; }

    std::shared_ptr<Executor> given_;
};

class ExecutorContent final : public Content
{
  public:
    explicit ExecutorContent(std::shared_ptr<Executor> given)
        : executor(std::make_shared<CallExecutor>(std::move(given)))
    {
    }
    std::shared_ptr<Executor> executor;
};

/// What a handle was made with, kept as long as it lives.
struct Kept
{
    std::shared_ptr<Executor> executor; // never null
    std::shared_ptr<std::pmr::memory_resource> memory;
    InstructionSet instruction_set = supported_instruction_sets().front();
    bool all_points = false;

    [[nodiscard]] std::pmr::memory_resource* resource() const noexcept
    {
        return memory == nullptr ? std::pmr::get_default_resource() : memory.get();
    }
    /// FinderOptions, ContactOptions or WorldOptions.
    template <class Options>
    [[nodiscard]] Options options() const
    {
        Options options;
        options.executor = executor.get();
        options.memory = resource();
        options.instruction_set = instruction_set;
        if constexpr (requires { options.all_points; }) options.all_points = all_points;
        return options;
    }
};
Kept keep(const jostle_options* options);
/// NULL: the default one.
std::shared_ptr<Executor> keep_executor(const jostle_executor* executor);

// --- Spaces ---

template <int Dimensions, Coordinate Number>
struct Space
{
    static constexpr int dim = Dimensions;
    using T = Number;
};

[[noreturn]] void refuse_space(jostle_space space);

// All four, but of the npm package's modules some are a quarter as large for having one alone.
#ifdef JOSTLE_ONLY_SPACE
constexpr bool has_space(jostle_space space)
{
    return space == JOSTLE_ONLY_SPACE;
}
template <class In2f, class In3f, class, class>
using InSomeSpace = std::variant<std::monostate, std::conditional_t<has_space(JOSTLE_2F), In2f, In3f>>;
#else
constexpr bool has_space(jostle_space)
{
    return true;
}
/// What a handle holds whose space is known when it is made.
template <class In2f, class In3f, class In2d, class In3d>
using InSomeSpace = std::variant<std::monostate, In2f, In3f, In2d, In3d>;
#endif

/// Calls inside(held) with what a handle holds in its space.
template <class Variant, class F>
void on_held(Variant& variant, F&& inside)
{
    std::visit(
        [&]<class Held>(Held& held) {
            if constexpr (!std::same_as<const Held, const std::monostate>) inside(held);
        },
        variant);
}

template <class F>
void in_space(jostle_space space, F&& inside)
{
    if constexpr (has_space(JOSTLE_2F))
        if (space == JOSTLE_2F) return inside(Space<2, float>{});
    if constexpr (has_space(JOSTLE_3F))
        if (space == JOSTLE_3F) return inside(Space<3, float>{});
    if constexpr (has_space(JOSTLE_2D))
        if (space == JOSTLE_2D) return inside(Space<2, double>{});
    if constexpr (has_space(JOSTLE_3D))
        if (space == JOSTLE_3D) return inside(Space<3, double>{});
    refuse_space(space);
}
template <int Dim, Coordinate T>
constexpr jostle_space space_of =
    Dim == 2 ? (sizeof(T) == 4 ? JOSTLE_2F : JOSTLE_2D) : (sizeof(T) == 4 ? JOSTLE_3F : JOSTLE_3D);

// --- Input that is read in place ---

void check_stride(std::uint64_t count, std::int64_t stride, std::size_t alignment, const char* name);
/// Refuses rows of `size` bytes that overlap: the last number of one would be the first of the next. A stride
/// of 0, one row over and over, passes where rows may repeat.
void check_rows(const jostle_values& values, std::size_t size, const char* name, bool may_repeat);

template <int Dim, Coordinate T>
BoxView<Dim, T> view(const jostle_boxes* boxes, const char* name)
{
    const jostle_boxes& given = wanted(boxes, name);
    if (given.count == 0) return {};
    check_stride(given.count, given.stride, alignof(T), name);
    std::array<const T*, detail::axes<Dim>> lo, hi;
    for (std::size_t d = 0; d < Dim; ++d) {
        const auto bounds = [&](const void* const(&rows)[3], const char* side) {
            if (rows[d] == nullptr)
                refuse(std::string(name) + "::" + side + "[" + std::to_string(d) + "] is NULL");
            return wanted_array_of<T>(rows[d], 1, name);
        };
        lo[d] = bounds(given.lo, "lo");
        hi[d] = bounds(given.hi, "hi");
    }
    return BoxView<Dim, T>::arrays(lo, hi, static_cast<std::size_t>(given.count),
                                   static_cast<std::ptrdiff_t>(given.stride));
}
template <class T>
StridedView<T> view(const jostle_values& values, const char* name)
{
    if (values.count == 0) return {};
    check_stride(values.count, values.stride, alignof(T), name);
    return {wanted_array_of<T>(values.data, 1, name), static_cast<std::size_t>(values.count),
            static_cast<std::ptrdiff_t>(values.stride)};
}

/// Blocks as the caller sees them; `table` is where they are listed.
template <class Item>
jostle_blocks list_blocks(std::span<const std::span<const Item>> blocks, std::uint64_t count,
                          std::vector<jostle_block>& table)
{
    table.clear();
    table.reserve(blocks.size());
    for (const std::span<const Item> block : blocks)
        table.push_back({block.data(), block.size()});
    return {table.data(), table.size(), count, sizeof(Item)};
}
/// Checks blocks that a caller gave.
const jostle_blocks& wanted_blocks(const jostle_blocks* blocks, const char* name);
/// The same of pairs, and one block of them.
const jostle_blocks& wanted_pairs(const jostle_blocks* pairs);
std::span<const Pair> pairs_of(const jostle_block& block);
/// Pairs of the caller's: where they lie if that is one block, else copied to `scratch`.
std::span<const Pair> read_pairs(const jostle_blocks* pairs, std::vector<Pair>& scratch);

} // namespace jostle::c_api
