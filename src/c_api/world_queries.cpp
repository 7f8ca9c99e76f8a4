// SPDX-License-Identifier: MIT
#include "c_api/queries.hpp"
#include "c_api/world.hpp"

namespace jostle::c_api {
namespace {

class WorldFilter
{
  public:
    using Filter = ObjectQueryFilter;
    explicit WorldFilter(const jostle_query_filter* given)
        : given_(read_options(given, "jostle_query_filter"))
    {
        if (given_.category.count != 0 || given_.mask.count != 0 || given_.owner.count != 0)
            refuse("a world knows its objects' filters: give no category, mask or owner but the asker's");
        if (given_.asker != nullptr) {
            filter.category = given_.asker->category;
            filter.mask = given_.asker->mask;
            filter.owner = given_.asker->owner;
        }
        if (given_.exclude != nullptr) filter.exclude = from_c(*given_.exclude);
        if (given_.accept != nullptr) filter.accept = accept_;
    }
    WorldFilter(const WorldFilter&) = delete;
    WorldFilter& operator=(const WorldFilter&) = delete;

    ObjectQueryFilter filter;

  private:
    struct Accept
    {
        const jostle_query_filter* given;
        bool operator()(std::uint32_t query, ObjectId id) const
        {
            return agreed(given->accept(given->context, query, to_c(id)));
        }
    };
    jostle_query_filter given_;
    Accept accept_{&given_};
};

} // namespace

template <>
struct WishTo<WorldContent>
{
    using type = WorldFilter;
};
template struct Ask<WorldContent>;
template bool visit_closest(const WorldContent&, const WorldContent&, double,
                            jostle_visit_close_pair_function, void*);
template void join_boxes(WorldContent&, const jostle_boxes*, const jostle_query_filter*, ResultsContent&);

} // namespace jostle::c_api
