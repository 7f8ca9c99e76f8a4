// SPDX-License-Identifier: MIT
#include <jostle/mpi.hpp>

int main(int count, char** arguments)
{
    int provided = 0;
    MPI_Init_thread(&count, &arguments, MPI_THREAD_FUNNELED, &provided);
    std::vector<jostle::Aabb3f> boxes; // a row in which each touches the next
    std::vector<std::uint64_t> ids;
    for (int i = 0; i < 100; ++i) {
        boxes.push_back({{float(i), 0, 0}, {float(i + 1), 1, 1}});
        ids.push_back(std::uint64_t{1} << 40 | static_cast<unsigned>(i));
    }
    const auto pairs = jostle::mpi::find_pairs(MPI_COMM_WORLD, boxes, ids);
    MPI_Finalize();
    return pairs.size() == 99 ? 0 : 1;
}
