// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <memory_resource>
#include <optional>
#include <span>
#include <vector>

#include "base/checks.hpp"
#include "base/in_use.hpp"
#include "jostle/contact.hpp"
#include "jostle/process.hpp"
#include "narrow/interface/batches.hpp"
#include "narrow/interface/input_checks.hpp"

JOSTLE_NAMESPACE_BEGIN

template <int Dim, Coordinate T>
struct ContactFinder<Dim, T>::Implementation
{
    using Objects = jostle::Objects<Dim, T>;
    using MovingObjects = jostle::MovingObjects<Dim, T>;
    explicit Implementation(const ContactOptions& given)
        : options(given),
          kernels(&narrow::kernels_for(checked(given.instruction_set))),
          result(given.memory),
          points(given.memory)
    {
    }

    [[nodiscard]] Executor& executor() const
    {
        return options.executor != nullptr ? *options.executor : default_executor();
    }

    /// find_one() finds the contacts of one pair, relative to the first object of the arranged pair.
    struct Arranged
    {
        narrow::Placed<Dim> placed;
        bool swapped;
    };
    Arranged find_one(const Objects& set_a, const Objects& set_b, const Pair& pair, double margin,
                      narrow::FoundList<Dim>& found) const;
    /// The user-defined test for these two types, in either order; null if there is none.
    [[nodiscard]] const PairTest<Dim>* own_test(ShapeType a, ShapeType b) const;

    /// Made is Contact or PointContact.
    template <class Made>
    const BlockBuffer<Made>& find(const Objects& set_a, const Objects& set_b,
                                  std::span<const std::span<const Pair>> blocks, T margin,
                                  BlockBuffer<Made>& into);
    void touching(const Objects& set_a, const Objects& set_b, PairView pairs, std::span<std::uint8_t> out);
    void distances(const Objects& set_a, const Objects& set_b, PairView pairs, T max_distance,
                   std::span<Distance<Dim, T>> out);
    void first_touching(const Objects& set_a, const Objects& set_b, std::span<const Pair> pairs,
                        std::span<const std::uint64_t> offsets, std::span<std::uint64_t> out);
    void least_distances(const Objects& set_a, const Objects& set_b, std::span<const Pair> pairs,
                         std::span<const std::uint64_t> offsets, T max_distance,
                         std::span<Distance<Dim, T>> out, std::span<std::uint64_t> nearest);
    void impacts(const MovingObjects& set_a, const MovingObjects& set_b, PairView pairs, T tolerance,
                 std::span<Impact<Dim, T>> out);
    void ray_casts(StridedView<Ray<Dim, T>> rays, const Objects& objects, PairView pairs,
                   std::span<CastHit<Dim, T>> out);
    void shape_casts(const Objects& moving, StridedView<Vec<Dim, T>> displacements, const Objects& objects,
                     PairView pairs, std::span<CastHit<Dim, T>> out);
    template <class Set, class Out, class Answer>
    void ask(const Set& set_a, const Set& set_b, PairView pairs, std::span<Out> out, std::uint64_t block,
             const Answer& answer);

    /// A pair whose distance isn't known yet, and a lower bound of it.
    struct Pending
    {
        double at_least;
        std::uint64_t number;
    };
    struct alignas(64) Worker
    {
        explicit Worker(std::pmr::memory_resource* memory) : found(memory), one(memory), pending(memory) {}
        narrow::FoundList<Dim> found, one;
        std::pmr::vector<Pending> pending;
        narrow::PairLists lists;
        narrow::PairContacts<Dim> contacts[narrow::block_pairs];
    };
    /// A run of pairs of one given block.
    struct PairBlock
    {
        std::size_t block, first;
        std::uint64_t number; // of the first among all pairs
        std::size_t contacts; // found
    };
    /// Checks a block's pairs and groups them by their tests.
    void sort_groups(const Objects& set_a, const Objects& set_b, std::span<const Pair> pairs,
                     std::uint64_t first, Worker& worker) const;
    /// Runs the kernels on grouped pairs. Remaining pairs are in Group::other.
    void run_groups(const Objects& set_a, const Objects& set_b, std::span<const Pair> pairs, double margin,
                    Worker& worker) const;
    /// Finds the contacts of one block's pairs, the first of which is number `first`, and writes them to
    /// chunk_of(their greatest possible number). Returns their number.
    template <class Chunk>
    std::size_t find_in_block(const Objects& set_a, const Objects& set_b, std::span<const Pair> pairs,
                              std::uint64_t first, double margin, Worker& worker, const Chunk& chunk_of);
    /// The same if all are balls, written directly to the results. Or returns that this can't decide.
    template <class Chunk>
    static std::optional<std::size_t> find_balls(const Objects& set_a, const Objects& set_b,
                                                 std::span<const Pair> pairs, double margin,
                                                 const Chunk& chunk_of);
    /// Writes what a worker has found, in the order of the pairs. Returns the number of contacts.
    template <class Made>
    static std::size_t write(const Worker& worker, std::span<const Pair> pairs, std::span<Made> chunk);
    /// Whether a pair without a kernel touches.
    [[nodiscard]] bool touches(const Objects& set_a, const Objects& set_b, const Pair& pair,
                               narrow::FoundList<Dim>& scratch) const;
    void ready_workers(std::uint32_t count)
    {
        while (workers.size() < count)
            workers.emplace_back(options.memory);
    }

    ContactOptions options;
    const narrow::Kernels* kernels;
    std::pmr::vector<PairTest<Dim>> tests{options.memory};
    std::array<bool, narrow::groups> own_in_group{}; // whether any of these is for types of a group
    std::pmr::vector<Worker> workers{options.memory};
    std::pmr::vector<PairBlock> pair_blocks{options.memory};
    ContactBuffer<Dim, T> result;
    PointContactBuffer<Dim, T> points;
    std::atomic<bool> in_use{false};
};

JOSTLE_NAMESPACE_END
