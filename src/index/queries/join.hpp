// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <memory>
#include <memory_resource>
#include <vector>

#include "base/buffer.hpp"
#include "index/kernels/kernels.hpp"
#include "index/tree/tree.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace index {

/// Finds what each of a batch of boxes touches: the boxes are ordered so that neighbours follow each other,
/// and searched 16 at a time; then the results are put back in the order of the batch. Keeps its working
/// memory.
template <int Dim, class T>
class Join
{
  public:
    explicit Join(const IndexOptions& options);
    ~Join();

    /// Writes the pairs to the room that `make_room` returns, which is called once with their number.
    void run(const Tree<Dim, T>& tree, Executor& executor, const BoxView<Dim, T>& boxes,
             FunctionRef<Pair*(std::size_t pairs)> make_room);
    /// What each of the boxes touches, for `around`.
    void look_around(const Tree<Dim, T>& tree, Executor& executor, const BoxView<Dim, T>& boxes);
    /// In any order; valid until the next run.
    [[nodiscard]] std::span<const Seen<Dim, T>> around(std::size_t position) const noexcept;
    void release_memory() noexcept;
    [[nodiscard]] std::uint64_t bytes() const noexcept;

  private:
    struct Slot;
    const std::uint64_t* order(const Tree<Dim, T>& tree, const BoxView<Dim, T>& boxes);
    /// Searches for all boxes, and leaves the results with the slots; lists_ tells where.
    void ask_all(const Tree<Dim, T>& tree, Executor& executor, const BoxView<Dim, T>& boxes, bool with_boxes);
    void ask(std::uint32_t slot, const Tree<Dim, T>& tree, const BoxView<Dim, T>& boxes, bool with_boxes,
             const std::uint64_t* order, std::uint32_t begin, std::uint32_t end);

    const Kernels<Dim, T>& kernels_;
    std::pmr::memory_resource* memory_;
    std::vector<std::unique_ptr<Slot>> slots_;
    Buffer<std::uint64_t> keys_, keys_to_; // place << 32 | position in the batch
    struct List
    {
        std::uint64_t begin;
        std::uint32_t slot, count;
    };
    Buffer<List> lists_;          // by position
    Buffer<std::uint64_t> first_; // where the pairs of each run of positions begin
};

} // namespace index
JOSTLE_NAMESPACE_END
