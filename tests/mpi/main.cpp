// SPDX-License-Identifier: MIT
// Every rank runs all tests. The first one reports as usual, the others only what fails there.
#include <gtest/gtest.h>

#include <cstdio>

#include "jostle/mpi.hpp"

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

int main(int count, char** arguments)
{
    int provided = 0, rank = 0;
    MPI_Init_thread(&count, &arguments, MPI_THREAD_FUNNELED, &provided);
    MPI_Comm_rank(MPI_COMM_WORLD, &rank);
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
