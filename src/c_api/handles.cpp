// SPDX-License-Identifier: MIT
#include "c_api/handles.hpp"

#include <algorithm>
#include <array>
#include <cstring>
#include <new>
#include <stdexcept>
#include <system_error>

#include "base/per_thread.hpp"

namespace jostle::c_api {
namespace {

constexpr std::uint64_t freed = marks | 0xff00U;

// Handles that were freed, the last 1024 of them: a pointer to one of these still says that it was freed. It
// is memory and nothing else: no result depends on it.
constexpr std::size_t remembered = 1024;
constinit std::array<std::atomic<Handle*>, remembered> graveyard{};
constinit std::atomic<std::size_t> next_grave{0};

void tell(jostle_error* error, jostle_status status, const char* message, std::uint64_t index,
          std::int32_t callback_result) noexcept
{
    if (error == nullptr) return;
    error->status = status;
    error->callback_result = callback_result;
    error->index = index;
    std::size_t size = std::strlen(message);
    if (size >= sizeof error->message) {
        size = sizeof error->message - 1;
        while (size > 0 &&
               (static_cast<unsigned char>(message[size]) & 0xC0U) == 0x80U) // not within a character
            --size;
    }
    std::memcpy(error->message, message, size);
    error->message[size] = '\0';
}

/// The handle that a pointer is: `wanted` says of which kind it should be.
Handle& handle_there(const void* pointer, const char* wanted)
{
    if (reinterpret_cast<std::uintptr_t>(pointer) % alignof(Handle) != 0)
        refuse(std::string("this is no ") + wanted, JOSTLE_BAD_HANDLE);
    auto& there = *static_cast<Handle*>(const_cast<void*>(pointer));
    const std::uint64_t mark = there.mark.load(std::memory_order_relaxed);
    if ((mark | 0xffffU) != (marks | 0xffffU)) refuse(std::string("this is no ") + wanted, JOSTLE_BAD_HANDLE);
    if (mark == freed) refuse(std::string("this ") + there.name + " was freed", JOSTLE_BAD_HANDLE);
    return there;
}

} // namespace

Content::~Content() = default;

Call::Call(const Call* outer) noexcept : outer_(outer), before_(of_this_thread())
{
    PerThread<Call>::set(this);
}
Call::~Call()
{
    PerThread<Call>::set(before_);
}
Call* Call::of_this_thread() noexcept
{
    return PerThread<Call>::get();
}
bool Call::is_open_outside(const void* handle) const noexcept
{
    for (const Call* call = outer_; call != nullptr; call = call->outer_)
        for (std::size_t i = 0; i < call->count_; ++i)
            if (call->handles_[i] == handle) return true;
    return false;
}

std::uint32_t CallExecutor::concurrency() const noexcept
{
    try {
        return given().concurrency();
    } catch (...) {
        return 1;
    }
}
void CallExecutor::run(std::uint32_t count, FunctionRef<void(std::uint32_t)> task)
{
    const Call* const call = Call::of_this_thread();
    given().run(count, [&](std::uint32_t i) {
        const Call within(call);
        task(i);
    });
}

jostle_status report(jostle_error* error) noexcept
{
    constexpr std::uint64_t none = UINT64_MAX;
    try {
        throw;
    } catch (const Failure& failure) {
        tell(error, failure.status, failure.message.c_str(), failure.index, failure.callback_result);
        return failure.status;
    } catch (const Error& thrown) {
        const auto status = static_cast<jostle_status>(thrown.code());
        tell(error, status, thrown.what(), thrown.index(), 0);
        return status;
    } catch (const std::bad_alloc&) {
        tell(error, JOSTLE_OUT_OF_MEMORY, "out of memory", none, 0);
        return JOSTLE_OUT_OF_MEMORY;
    } catch (const std::length_error&) {
        tell(error, JOSTLE_TOO_MANY_OBJECTS, "more elements than memory can hold", none, 0);
        return JOSTLE_TOO_MANY_OBJECTS;
    } catch (const std::system_error& thrown) {
        if (thrown.code() == std::errc::resource_unavailable_try_again) {
            tell(error, JOSTLE_OUT_OF_MEMORY, "the system has no memory for as many threads", none, 0);
            return JOSTLE_OUT_OF_MEMORY;
        }
        tell(error, JOSTLE_INTERNAL_ERROR, thrown.what(), none, 0);
    } catch (const std::exception& thrown) {
        tell(error, JOSTLE_INTERNAL_ERROR, thrown.what(), none, 0);
    } catch (...) {
        tell(error, JOSTLE_INTERNAL_ERROR, "an unknown exception", none, 0);
    }
    return JOSTLE_INTERNAL_ERROR;
}

std::uint64_t mark_of(const void* handle, std::initializer_list<std::uint64_t> kinds, const char* wanted)
{
    if (handle == nullptr) refuse(std::string("the ") + wanted + " is NULL");
    const Handle& there = handle_there(handle, wanted);
    const std::uint64_t mark = there.mark.load(std::memory_order_relaxed);
    if (std::find(kinds.begin(), kinds.end(), mark) == kinds.end())
        refuse(std::string("this is no ") + wanted + " but a " + there.name, JOSTLE_BAD_HANDLE);
    return mark;
}

Content& open(const void* handle, std::uint64_t mark, const char* name)
{
    (void)mark_of(handle, {mark}, name);
    if (Call* const call = Call::of_this_thread()) call->opens(handle);
    return *static_cast<const Handle*>(handle)->content;
}

void refuse_in_callback(const void* handle, const char* name, const char* verb)
{
    if (const Call* const call = Call::of_this_thread(); call != nullptr && call->is_open_outside(handle))
        refuse(std::string("this ") + name + " is in use by the call that runs this callback: " + verb +
               " it afterwards");
}

const Handle& open_any(const void* handle)
{
    if (handle == nullptr) refuse("the handle is NULL");
    const Handle& there = handle_there(handle, "handle");
    if (Call* const call = Call::of_this_thread()) call->opens(handle);
    return there;
}
const Handle& open_any(void* handle)
{
    const Handle& there = open_any(static_cast<const void*>(handle));
    if (!there.changes_in_callbacks) refuse_in_callback(handle, there.name, "change");
    return there;
}

void release(void* handle)
{
    if (handle == nullptr) return;
    Handle& opened = handle_there(handle, "handle");
    refuse_in_callback(handle, opened.name, "free");
    // Of two threads that free one handle, one does.
    if (opened.mark.exchange(freed) == freed)
        refuse(std::string("this ") + opened.name + " was freed", JOSTLE_BAD_HANDLE);
    delete std::exchange(opened.content, nullptr);
    delete graveyard[next_grave.fetch_add(1) % remembered].exchange(&opened);
}

void refuse_space(jostle_space space)
{
#ifdef JOSTLE_ONLY_SPACE
    if (space >= JOSTLE_2F && space <= JOSTLE_3D)
        refuse(std::string("this module has ") + (JOSTLE_ONLY_SPACE == JOSTLE_2F ? "2D" : "3D") +
               " in float32 alone: load another for double precision, or for another number of dimensions");
#endif
    refuse("the space is " + std::to_string(space) +
           ": it must be JOSTLE_2F, JOSTLE_3F, JOSTLE_2D or JOSTLE_3D");
}

void check_stride(std::uint64_t count, std::int64_t stride, std::size_t alignment, const char* name)
{
    if (stride % static_cast<std::int64_t>(alignment) != 0)
        refuse(std::string("the stride of ") + name + " is " + std::to_string(stride) +
               " bytes: it must be a multiple of " + std::to_string(alignment));
    const std::uint64_t step =
        stride < 0 ? 0 - static_cast<std::uint64_t>(stride) : static_cast<std::uint64_t>(stride);
    if (count > static_cast<std::uint64_t>(PTRDIFF_MAX) / (step == 0 ? 1 : step))
        refuse(std::string(name) + " can't have " + std::to_string(count) + " elements, " +
                   std::to_string(stride) + " bytes apart",
               JOSTLE_TOO_MANY_OBJECTS);
}

void check_rows(const jostle_values& values, std::size_t size, const char* name, bool may_repeat)
{
    const std::uint64_t step = values.stride < 0 ? 0 - static_cast<std::uint64_t>(values.stride)
                                                 : static_cast<std::uint64_t>(values.stride);
    if (values.count == 0 || step >= size || (step == 0 && may_repeat)) return;
    refuse(std::string("the stride of ") + name + " is " + std::to_string(values.stride) +
           " bytes, and one of them takes " + std::to_string(size));
}

const jostle_blocks& wanted_blocks(const jostle_blocks* blocks, const char* name)
{
    const jostle_blocks& given = wanted(blocks, name);
    wanted_array(given.blocks, given.block_count, name);
    std::uint64_t count = 0;
    for (std::uint64_t i = 0; i < given.block_count; ++i) {
        const jostle_block& block = given.blocks[i];
        if (block.count != 0 && block.items == nullptr)
            refuse(std::string(name) + "::blocks[" + std::to_string(i) + "].items is NULL");
        if (given.item_size != 0 && block.count > static_cast<std::uint64_t>(PTRDIFF_MAX) / given.item_size)
            refuse(std::string(name) + "::blocks[" + std::to_string(i) + "] can't have " +
                       std::to_string(block.count) + " items",
                   JOSTLE_TOO_MANY_OBJECTS);
        if (block.count > given.count - count) {
            count = UINT64_MAX;
            break;
        }
        count += block.count;
    }
    if (count != given.count)
        refuse(std::string(name) + "::count is " + std::to_string(given.count) +
                   ", which isn't what its blocks have",
               JOSTLE_SIZE_MISMATCH);
    return given;
}

const jostle_blocks& wanted_pairs(const jostle_blocks* pairs)
{
    static_assert(sizeof(Pair) == sizeof(jostle_pair));
    const jostle_blocks& given = wanted_blocks(pairs, "pairs");
    if (given.item_size != sizeof(Pair))
        refuse("pairs::item_size is " + std::to_string(given.item_size) + ": pairs have sizeof(jostle_pair)");
    return given;
}

std::span<const Pair> pairs_of(const jostle_block& block)
{
    return {wanted_array_of<Pair>(block.items, block.count, "pairs"), static_cast<std::size_t>(block.count)};
}

std::span<const Pair> read_pairs(const jostle_blocks* pairs, std::vector<Pair>& scratch)
{
    const jostle_blocks& given = wanted_pairs(pairs);
    if (given.block_count == 1) return pairs_of(given.blocks[0]);
    scratch.clear();
    scratch.reserve(static_cast<std::size_t>(given.count));
    for (std::uint64_t i = 0; i < given.block_count; ++i) {
        const std::span<const Pair> block = pairs_of(given.blocks[i]);
        scratch.insert(scratch.end(), block.begin(), block.end());
    }
    return scratch;
}

} // namespace jostle::c_api
