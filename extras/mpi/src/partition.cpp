// SPDX-License-Identifier: MIT
#include "partition.hpp"

#include <zoltan.h>

#include <algorithm>
#include <limits>
#include <string>
#include <utility>

JOSTLE_NAMESPACE_BEGIN
namespace mpi {
namespace {

void check(int code, const char* what)
{
    if (code == ZOLTAN_OK || code == ZOLTAN_WARN) return;
    if (code == ZOLTAN_MEMERR) throw std::bad_alloc();
    throw Error(ErrorCode::invalid_argument, std::string("Zoltan couldn't ") + what);
}

// What Zoltan asks for while it divides space.
struct Given
{
    int dimensions;
    const WeightedPoints& points;
};
const Given& given(void* data)
{
    return *static_cast<const Given*>(data);
}
int count_objects(void* data, int* code)
{
    *code = ZOLTAN_OK;
    return static_cast<int>(given(data).points.weights.size());
}
void list_objects(void* data, int, int, ZOLTAN_ID_PTR ids, ZOLTAN_ID_PTR, int, float* weights, int* code)
{
    const auto& all = given(data).points.weights;
    for (std::size_t i = 0; i < all.size(); ++i)
        ids[i] = static_cast<ZOLTAN_ID_TYPE>(i);
    std::copy(all.begin(), all.end(), weights);
    *code = ZOLTAN_OK;
}
int count_dimensions(void* data, int* code)
{
    *code = ZOLTAN_OK;
    return given(data).dimensions;
}
void list_points(void* data, int, int, int, ZOLTAN_ID_PTR, ZOLTAN_ID_PTR, int, double* points, int* code)
{
    std::copy(given(data).points.points.begin(), given(data).points.points.end(), points);
    *code = ZOLTAN_OK;
}

} // namespace

double Partition::infinity() noexcept
{
    return std::numeric_limits<double>::infinity();
}

Partition::Partition(MPI_Comm comm, int dimensions, const WeightedPoints& points, int regions)
{
    MPI_Comm_rank(comm, &rank_);
    MPI_Comm_size(comm, &ranks_);
    float version = 0;
    check(Zoltan_Initialize(0, nullptr, &version), "start");
    zoltan_ = Zoltan_Create(comm);
    if (zoltan_ == nullptr) throw std::bad_alloc();
    try {
        const std::pair<const char*, const char*> parameters[] = {
            {"DEBUG_LEVEL", "0"},     {"LB_METHOD", "RCB"},      {"KEEP_CUTS", "1"},
            {"RETURN_LISTS", "NONE"}, {"OBJ_WEIGHT_DIM", "1"},   {"NUM_LID_ENTRIES", "0"},
            {"CHECK_GEOM", "0"},      {"RCB_OUTPUT_LEVEL", "0"}, {"REDUCE_DIMENSIONS", "0"}};
        for (const auto& [name, value] : parameters)
            check(Zoltan_Set_Param(zoltan_, name, value), "set a parameter");
        if (regions != 0) {
            ranks_ = regions;
            check(Zoltan_Set_Param(zoltan_, "NUM_GLOBAL_PARTS", std::to_string(regions).c_str()),
                  "set a parameter");
        }
        Given all{dimensions, points};
        Zoltan_Set_Num_Obj_Fn(zoltan_, count_objects, &all);
        Zoltan_Set_Obj_List_Fn(zoltan_, list_objects, &all);
        Zoltan_Set_Num_Geom_Fn(zoltan_, count_dimensions, &all);
        Zoltan_Set_Geom_Multi_Fn(zoltan_, list_points, &all);
        int changes = 0, gid_entries = 0, lid_entries = 0, imports = 0, exports = 0;
        ZOLTAN_ID_PTR import_gids = nullptr, import_lids = nullptr, export_gids = nullptr,
                      export_lids = nullptr;
        int *import_ranks = nullptr, *import_parts = nullptr, *export_ranks = nullptr,
            *export_parts = nullptr;
        check(Zoltan_LB_Partition(zoltan_, &changes, &gid_entries, &lid_entries, &imports, &import_gids,
                                  &import_lids, &import_ranks, &import_parts, &exports, &export_gids,
                                  &export_lids, &export_ranks, &export_parts),
              "divide space");
        Zoltan_LB_Free_Part(&import_gids, &import_lids, &import_ranks, &import_parts);
        Zoltan_LB_Free_Part(&export_gids, &export_lids, &export_ranks, &export_parts);
        int known = 0;
        check(Zoltan_RCB_Box(zoltan_, rank_, &known, &region_[0], &region_[1], &region_[2], &region_[3],
                             &region_[4], &region_[5]),
              "tell a region");
        if (ranks_ == 1) // Zoltan tells none
            for (std::size_t d = 0; d < 3; ++d) {
                region_[d] = -infinity();
                region_[3 + d] = infinity();
            }
        for (auto d = static_cast<std::size_t>(dimensions); d < 3; ++d) {
            region_[d] = -1;
            region_[3 + d] = 1;
        }
    } catch (...) {
        Zoltan_Destroy(&zoltan_);
        throw;
    }
}

Partition::Partition(Partition&& from) noexcept
    : zoltan_(std::exchange(from.zoltan_, nullptr)),
      rank_(from.rank_),
      ranks_(from.ranks_),
      region_(from.region_)
{
}

Partition& Partition::operator=(Partition&& from) noexcept
{
    std::swap(zoltan_, from.zoltan_);
    rank_ = from.rank_;
    ranks_ = from.ranks_;
    region_ = from.region_;
    return *this;
}

Partition::~Partition()
{
    int ended = 0;
    MPI_Finalized(&ended);
    if (zoltan_ != nullptr && ended == 0) Zoltan_Destroy(&zoltan_);
}

void Partition::ask(const std::array<double, 6>& bounds, Ranks& ranks) const
{
    if (zoltan_ == nullptr) return ranks.push_back(0);
    // Each rank has one part, of its own number; asked for ranks, Zoltan would clear a list of all of them.
    ranks.resize(static_cast<std::size_t>(ranks_));
    int rank_count = 0, part_count = 0;
    check(Zoltan_LB_Box_PP_Assign(zoltan_, bounds[0], bounds[1], bounds[2], bounds[3], bounds[4], bounds[5],
                                  nullptr, &rank_count, ranks.data(), &part_count),
          "say which regions a box touches");
    ranks.resize(static_cast<std::size_t>(part_count));
    std::sort(ranks.begin(), ranks.end());
}

int Partition::at(std::array<double, 3> point) const
{
    if (zoltan_ == nullptr) return 0;
    int rank = 0, part = 0;
    check(Zoltan_LB_Point_PP_Assign(zoltan_, point.data(), &rank, &part), "say whose region a point is in");
    return part;
}

} // namespace mpi
JOSTLE_NAMESPACE_END
