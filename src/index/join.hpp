// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <memory>
#include <memory_resource>
#include <vector>

#include "engine/buffer.hpp"
#include "index/kernels/kernels.hpp"
#include "index/tree.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace index {

/// Finds what each of a batch of boxes touches: the boxes are put in an order in which neighbours follow each
/// other and asked 16 at a time, then the results are put back in the order of the batch. Keeps working
/// memory.
template <int Dim, class T>
class Join
{
  public:
    explicit Join(const IndexOptions& options);
    ~Join();

    /// Box a is searched for in starts[a], or in the tree where that is nothing; `starts` may be empty.
    void run(const Tree<Dim, T>& tree, Executor& executor, const BoxView<Dim, T>& boxes,
             std::span<const Start<Dim, T>> starts, std::pmr::vector<Pair>& out);
    [[nodiscard]] std::uint64_t bytes() const noexcept;

  private:
    struct Slot;
    const std::uint64_t* order(const Tree<Dim, T>& tree, const BoxView<Dim, T>& boxes,
                               std::span<const Start<Dim, T>> starts);
    void ask(std::uint32_t slot, const Tree<Dim, T>& tree, const BoxView<Dim, T>& boxes,
             std::span<const Start<Dim, T>> starts, const std::uint64_t* order, std::uint32_t begin,
             std::uint32_t end);

    const Kernels<Dim, T>& kernels_;
    std::pmr::memory_resource* memory_;
    std::vector<std::unique_ptr<Slot>> slots_;
    engine::Buffer<std::uint64_t> keys_, keys_to_; // place << 32 | position in the batch
    struct List
    {
        std::uint64_t begin;
        std::uint32_t slot, count;
    };
    engine::Buffer<List> lists_;          // by position
    engine::Buffer<std::uint64_t> first_; // where the pairs of each run of positions begin
};

} // namespace index
JOSTLE_NAMESPACE_END
