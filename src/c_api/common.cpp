// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <cstring>

#include "c_api/results.hpp"
#include "jostle/version.hpp"

namespace jostle::c_api {
namespace {

class CallbackMemory final : public std::pmr::memory_resource
{
  public:
    explicit CallbackMemory(const jostle_allocator& allocator) : given_(allocator) {}

  private:
    void* do_allocate(std::size_t bytes, std::size_t alignment) override
    {
        void* const memory = given_.allocate(given_.context, bytes, alignment);
        if (memory == nullptr) throw std::bad_alloc();
        return memory;
    }
    void do_deallocate(void* memory, std::size_t bytes, std::size_t alignment) override
    {
        given_.deallocate(given_.context, memory, bytes, alignment);
    }
    [[nodiscard]] bool do_is_equal(const memory_resource& other) const noexcept override
    {
        return this == &other;
    }

    jostle_allocator given_;
};

/// The host's threads. Its function may report a failure.
class HostExecutor final : public Executor
{
  public:
    HostExecutor(std::uint32_t concurrency, jostle_run_function function, void* context)
        : concurrency_(concurrency), run_(function), context_(context)
    {
    }
    [[nodiscard]] std::uint32_t concurrency() const noexcept override { return concurrency_; }
    void run(std::uint32_t count, FunctionRef<void(std::uint32_t)> task) override
    {
        agreed(run_(
            context_, count,
            [](void* given, std::uint32_t i) { (*static_cast<FunctionRef<void(std::uint32_t)>*>(given))(i); },
            &task));
    }

  private:
    std::uint32_t concurrency_;
    jostle_run_function run_;
    void* context_;
};

constexpr InstructionSet instruction_sets[] = {InstructionSet::scalar, InstructionSet::sse4,
                                               InstructionSet::avx2,   InstructionSet::avx512,
                                               InstructionSet::neon,   InstructionSet::wasm_simd};
static_assert(JOSTLE_SCALAR == static_cast<int>(InstructionSet::scalar) + 1 &&
              JOSTLE_WASM_SIMD == static_cast<int>(InstructionSet::wasm_simd) + 1);

InstructionSet instruction_set_of(jostle_instruction_set set)
{
    if (set == JOSTLE_FASTEST) return supported_instruction_sets().front();
    if (set < JOSTLE_SCALAR || set > JOSTLE_WASM_SIMD)
        refuse("the instruction set is " + std::to_string(set) +
               ": it must be JOSTLE_FASTEST or one from JOSTLE_SCALAR to JOSTLE_WASM_SIMD");
    return instruction_sets[set - 1];
}

void hand_out_executor(jostle_executor** out, std::shared_ptr<Executor> executor)
{
    hand_out(out, std::make_unique<ExecutorContent>(std::move(executor)));
}
/// One that somebody else owns.
std::shared_ptr<Executor> lent(Executor& executor)
{
    return {std::shared_ptr<void>(), &executor};
}

} // namespace

std::shared_ptr<Executor> keep_executor(const jostle_executor* executor)
{
    if (executor != nullptr) return open(executor).executor;
    static const std::shared_ptr<Executor> all = std::make_shared<CallExecutor>(nullptr);
    return all;
}

Kept keep(const jostle_options* options)
{
    const jostle_options given = read_options(options, "jostle_options");
    Kept kept;
    kept.executor = keep_executor(given.executor);
    if (given.allocator != nullptr) {
        const jostle_allocator allocator = read_options(given.allocator, "jostle_allocator");
        wanted_function(allocator.allocate, "jostle_allocator::allocate");
        wanted_function(allocator.deallocate, "jostle_allocator::deallocate");
        kept.memory = std::make_shared<CallbackMemory>(allocator);
    }
    kept.instruction_set = instruction_set_of(given.instruction_set);
    kept.all_points = given.all_points != 0;
    return kept;
}

void ResultsContent::begin() noexcept
{
    holds = Holds::nothing;
    buffer.emplace<std::monostate>();
    buffer_memory.reset();
    blocks = {};
}

} // namespace jostle::c_api

using namespace jostle;
using namespace jostle::c_api;

extern "C" {

jostle_status jostle_version(uint32_t* major, uint32_t* minor, uint32_t* patch, jostle_error* error)
{
    return guarded(error, [&] {
        wanted(major, "major");
        wanted(minor, "minor");
        wanted(patch, "patch") = JOSTLE_VERSION_PATCH;
        *major = JOSTLE_VERSION_MAJOR;
        *minor = JOSTLE_VERSION_MINOR;
    });
}

jostle_status jostle_status_name(jostle_status status, const char** name, jostle_error* error)
{
    return guarded(error, [&] {
        wanted(name, "name");
        const auto name_of = [](jostle_status of) -> const char* {
            switch (of) {
            case JOSTLE_OK:
                return "ok";
            case JOSTLE_NAN_COORDINATE:
                return "nan_coordinate";
            case JOSTLE_INVERTED_BOX:
                return "inverted_box";
            case JOSTLE_TOO_MANY_OBJECTS:
                return "too_many_objects";
            case JOSTLE_SIZE_MISMATCH:
                return "size_mismatch";
            case JOSTLE_INVALID_ARGUMENT:
                return "invalid_argument";
            case JOSTLE_STALE_ID:
                return "stale_id";
            case JOSTLE_BAD_SNAPSHOT:
                return "bad_snapshot";
            case JOSTLE_FILE_ERROR:
                return "file_error";
            case JOSTLE_OUT_OF_MEMORY:
                return "out_of_memory";
            case JOSTLE_BAD_HANDLE:
                return "bad_handle";
            case JOSTLE_CALLBACK_FAILED:
                return "callback_failed";
            case JOSTLE_INTERNAL_ERROR:
                return "internal_error";
            default:
                return nullptr;
            }
        };
        const char* const found = name_of(status);
        if (found == nullptr) refuse("there is no status " + std::to_string(status));
        *name = found;
    });
}

jostle_status jostle_instruction_sets(const jostle_instruction_set** sets, uint64_t* count,
                                      jostle_error* error)
{
    return guarded(error, [&] {
        wanted(sets, "sets");
        wanted(count, "count");
        static const auto listed = [] {
            std::array<jostle_instruction_set, std::size(instruction_sets)> list{};
            std::transform(supported_instruction_sets().begin(), supported_instruction_sets().end(),
                           list.begin(),
                           [](InstructionSet set) { return static_cast<jostle_instruction_set>(set) + 1; });
            return list;
        }();
        *sets = listed.data();
        *count = supported_instruction_sets().size();
    });
}

jostle_status jostle_free(void* handle, jostle_error* error)
{
    return guarded(error, [&] { release(handle); });
}
jostle_status jostle_clear(void* handle, jostle_error* error)
{
    return guarded(error, [&] {
        const Handle& opened = open_any(handle);
        if (!opened.content->clear())
            refuse(std::string("a ") + opened.name + " can't be cleared", JOSTLE_BAD_HANDLE);
    });
}
jostle_status jostle_release_memory(void* handle, jostle_error* error)
{
    return guarded(error, [&] {
        const Handle& opened = open_any(handle);
        if (!opened.content->release_memory())
            refuse(std::string("a ") + opened.name + " has no memory to release", JOSTLE_BAD_HANDLE);
    });
}
jostle_status jostle_size(const void* handle, uint64_t* size, jostle_error* error)
{
    return guarded(error, [&] {
        const Handle& opened = open_any(handle);
        const std::optional<std::uint64_t> found = opened.content->size();
        if (!found) refuse(std::string("a ") + opened.name + " has no size", JOSTLE_BAD_HANDLE);
        wanted(size, "size") = *found;
    });
}

jostle_status jostle_instruction_set_name(jostle_instruction_set set, const char** out, jostle_error* error)
{
    return guarded(error, [&] { wanted(out, "name") = name(instruction_set_of(set)); });
}

// --- Executors ---

jostle_status jostle_executor_serial(jostle_executor** out, jostle_error* error)
{
    return guarded(error, [&] { hand_out_executor(out, lent(serial_executor())); });
}
jostle_status jostle_executor_default(uint32_t threads, jostle_executor** out, jostle_error* error)
{
    return guarded(error, [&] { hand_out_executor(out, lent(default_executor(threads))); });
}
jostle_status jostle_executor_threads(uint32_t threads, jostle_executor** out, jostle_error* error)
{
    return guarded(error, [&] {
        wanted(out, "out");
        hand_out_executor(out, make_thread_executor(threads));
    });
}
jostle_status jostle_executor_callback(uint32_t concurrency, jostle_run_function run, void* context,
                                       jostle_executor** out, jostle_error* error)
{
    return guarded(error, [&] {
        wanted_function(run, "run");
        if (concurrency == 0) refuse("the concurrency is 0: it must be at least 1");
        hand_out_executor(out, std::make_shared<HostExecutor>(concurrency, run, context));
    });
}
jostle_status jostle_executor_concurrency(const jostle_executor* executor, uint32_t* threads,
                                          jostle_error* error)
{
    return guarded(error, [&] {
        const ExecutorContent& content = open(executor);
        wanted(threads, "threads") = content.executor->concurrency();
    });
}

// --- Boxes ---

jostle_status jostle_boxes_check(jostle_space space, const jostle_boxes* boxes, jostle_error* error)
{
    return guarded(error, [&] {
        in_space(space,
                 [&](auto in) { check_boxes(view<in.dim, typename decltype(in)::T>(boxes, "boxes")); });
    });
}

// --- Results ---

jostle_status jostle_results_new(const jostle_options* options, jostle_results** out, jostle_error* error)
{
    return guarded(error, [&] {
        wanted(out, "out");
        hand_out(out, std::make_unique<ResultsContent>(keep(options)));
    });
}
jostle_status jostle_results_blocks(const jostle_results* results, jostle_blocks* out, jostle_error* error)
{
    return guarded(error, [&] {
        const ResultsContent& content = open(results);
        wanted(out, "out");
        if (content.holds != ResultsContent::Holds::blocks &&
            content.holds != ResultsContent::Holds::lists_and_blocks)
            refuse("these results have no pairs or contacts");
        *out = content.blocks;
    });
}
jostle_status jostle_results_lists(const jostle_results* results, jostle_lists* out, jostle_error* error)
{
    return guarded(error, [&] {
        const ResultsContent& content = open(results);
        wanted(out, "out");
        if (content.holds != ResultsContent::Holds::lists &&
            content.holds != ResultsContent::Holds::lists_and_blocks)
            refuse("these results have no lists of answers");
        const Lists& lists = content.lists;
        *out = {lists.more.size(),
                lists.ids.size(),
                lists.first.data(),
                lists.ids.data(),
                lists.has_at ? lists.at.data() : nullptr,
                lists.more.data()};
    });
}
jostle_status jostle_results_bytes(const jostle_results* results, const void** bytes, uint64_t* count,
                                   jostle_error* error)
{
    return guarded(error, [&] {
        const ResultsContent& content = open(results);
        wanted(bytes, "bytes");
        wanted(count, "count");
        if (content.holds != ResultsContent::Holds::bytes) refuse("these results have no bytes");
        *bytes = content.bytes.data();
        *count = content.byte_count;
    });
}
jostle_status jostle_blocks_copy(const jostle_blocks* blocks, uint64_t room, void* out, jostle_error* error)
{
    return guarded(error, [&] {
        const jostle_blocks& given = wanted_blocks(blocks, "blocks");
        if (room < given.count)
            refuse("there is room for " + std::to_string(room) + " items, and there are " +
                       std::to_string(given.count),
                   JOSTLE_SIZE_MISMATCH);
        auto* next = wanted_array_of<unsigned char>(out, given.count == 0 ? 0 : 1, "out");
        for (std::uint64_t i = 0; i < given.block_count; ++i) {
            const std::size_t size = static_cast<std::size_t>(given.blocks[i].count * given.item_size);
            if (size != 0) std::memcpy(next, given.blocks[i].items, size);
            next += size;
        }
    });
}
jostle_status jostle_pair_checksum(const jostle_blocks* pairs, uint64_t* checksum, jostle_error* error)
{
    return guarded(error, [&] {
        wanted(checksum, "checksum");
        const jostle_blocks& given = wanted_pairs(pairs);
        std::uint64_t sum = 0;
        for (std::uint64_t i = 0; i < given.block_count; ++i)
            sum += pair_checksum(pairs_of(given.blocks[i]));
        *checksum = sum;
    });
}

} // extern "C"
