// SPDX-License-Identifier: MIT
// Every rank runs all tests. The first one reports as usual, the others only what fails there.
#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>
#include <random>
#include <string>

#include "jostle/mpi.hpp"
#include "scene.hpp"
#include "tests/global_new.hpp"

namespace {

class Failures : public testing::EmptyTestEventListener
{
  public:
    explicit Failures(int rank) : rank_(rank) {}

  private:
    void OnTestPartResult(const testing::TestPartResult& result) override
    {
        if (result.failed())
            std::fprintf(stderr, "rank %d: %s:%d: %s\n", rank_, result.file_name(), result.line_number(),
                         result.message());
    }
    int rank_;
};

} // namespace

namespace mpi_tests {

bool can_be_made(Shortage shortage)
{
    return JOSTLE_OWN_NEW || shortage == Shortage::of_resource;
}
Starving::Starving(Shortage shortage, FailingMemory& memory, std::uint64_t allocations) : memory_(memory)
{
    if (shortage == Shortage::of_resource) {
        memory.left = static_cast<std::int64_t>(allocations);
        return;
    }
    const std::uint64_t first = global_new::calls + allocations;
    global_new::fail_until = shortage == Shortage::of_one ? first + 1 : global_new::never;
    global_new::fail_at = first;
}
Starving::~Starving()
{
    global_new::fail_at = global_new::never;
    memory_.left = std::numeric_limits<std::int64_t>::max();
}

} // namespace mpi_tests

int main(int count, char** arguments)
{
    int provided = 0, rank = 0;
    MPI_Init_thread(&count, &arguments, MPI_THREAD_FUNNELED, &provided);
    MPI_Comm_rank(MPI_COMM_WORLD, &rank);
    // RapidCheck draws the same on all ranks, which it can't know.
    std::uint64_t seed = std::random_device()();
    MPI_Bcast(&seed, 1, MPI_UINT64_T, 0, MPI_COMM_WORLD);
    setenv("RC_PARAMS", ("max_success=15 seed=" + std::to_string(seed)).c_str(), 0);
    testing::InitGoogleTest(&count, arguments);
    auto& listeners = testing::UnitTest::GetInstance()->listeners();
    if (rank != 0) {
        delete listeners.Release(listeners.default_result_printer());
        listeners.Append(new Failures(rank));
    }
    int failed = RUN_ALL_TESTS();
    MPI_Allreduce(MPI_IN_PLACE, &failed, 1, MPI_INT, MPI_MAX, MPI_COMM_WORLD);
    MPI_Finalize();
    return failed;
}
