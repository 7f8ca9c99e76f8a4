// SPDX-License-Identifier: MIT
// The interface of the distributed World: commands are checked and noted, lists shown, parts of snapshots
// written and read. What an update does stands in update.cpp.
#include <algorithm>
#include <limits>
#include <locale>
#include <sstream>

#include "agreement.hpp"
#include "implementation.hpp"
#include "snapshot.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace mpi {
namespace {

std::ostringstream plain_stream(int digits)
{
    std::ostringstream stream;
    stream.imbue(std::locale::classic());
    stream.precision(digits);
    return stream;
}

template <int Dim, class T>
void refuse_box(std::uint64_t id, const Aabb<Dim, T>& box)
{
    for (int d = 0; d < Dim; ++d) {
        const bool lo_nan = box.lo[d] != box.lo[d], hi_nan = box.hi[d] != box.hi[d];
        if (!lo_nan && !hi_nan && box.lo[d] <= box.hi[d]) continue;
        std::ostringstream message = plain_stream(std::numeric_limits<T>::max_digits10);
        const char axis = "xyz"[d];
        message << "object " << id << ": ";
        if (lo_nan || hi_nan) {
            message << (lo_nan ? "lo." : "hi.") << axis
                    << " is NaN; every bound must be a number (infinite is allowed)";
            throw Error(ErrorCode::nan_coordinate, message.str(), id);
        }
        message << "lo." << axis << " = " << box.lo[d] << " is greater than hi." << axis << " = " << box.hi[d]
                << "; swap them";
        throw Error(ErrorCode::inverted_box, message.str(), id);
    }
}
template <int Dim, class T>
void check_box(std::uint64_t id, const Aabb<Dim, T>& box)
{
    bool good = true;
    for (int d = 0; d < Dim; ++d)
        good = good && box.lo[d] <= box.hi[d]; // not for NaN
    if (!good) refuse_box(id, box);
}

/// `whose` is the world's or an object's, whose id is given then.
template <class T>
void check_margin(double margin, double together, const char* whose, std::uint64_t id)
{
    if (margin >= 0 && together <= double{std::numeric_limits<T>::max()}) return;
    std::ostringstream message = plain_stream(std::numeric_limits<T>::max_digits10);
    message << "margin " << margin << " of " << whose;
    if (id != Error::no_index) message << id;
    message << "; give a number from 0, with which the world's and an object's are together at most "
            << std::numeric_limits<T>::max();
    throw Error(ErrorCode::invalid_argument, message.str(), id);
}

/// What has to be the same on all ranks.
struct Terms
{
    double margin;
    std::uint32_t version[3], dimensions, coordinate_bytes, rebalance, migrate;

    void check_against(const Terms& first) const
    {
        const auto check = [](const char* what, double mine, double theirs) {
            if (mine == theirs) return;
            std::ostringstream message = plain_stream(17);
            message << what << " is " << mine << ", and " << theirs << " on rank 0; give all ranks the same";
            throw Error(ErrorCode::invalid_argument, message.str());
        };
        check("Jostle's major version", version[0], first.version[0]);
        check("Jostle's minor version", version[1], first.version[1]);
        check("Jostle's patch version", version[2], first.version[2]);
        check("the number of dimensions", dimensions, first.dimensions);
        check("the number of bytes in a coordinate", coordinate_bytes, first.coordinate_bytes);
        check("WorldOptions::margin", margin, first.margin);
        check("WorldOptions::rebalance (0 automatic, 1 on request)", rebalance, first.rebalance);
        check("WorldOptions::migrate", migrate, first.migrate);
    }
};

void check_threads(const Executor& executor)
{
    int provided = MPI_THREAD_SINGLE;
    MPI_Query_thread(&provided);
    if (provided != MPI_THREAD_SINGLE || executor.concurrency() == 1) return;
    throw Error(ErrorCode::invalid_argument,
                "MPI was told that there is one thread only, and the executor has " +
                    std::to_string(executor.concurrency()) +
                    "; call MPI_Init_thread with MPI_THREAD_FUNNELED, or give serial_executor()");
}

} // namespace

template <int Dim, Coordinate T>
World<Dim, T>::World(MPI_Comm comm, const WorldOptions& options)
{
    Communicator own(comm);
    const MPI_Comm handle = own.get();
    Agreement agreement(handle);
    const Terms mine{options.margin,
                     {JOSTLE_VERSION_MAJOR, JOSTLE_VERSION_MINOR, JOSTLE_VERSION_PATCH},
                     Dim,
                     sizeof(T),
                     static_cast<std::uint32_t>(options.rebalance),
                     options.migrate};
    Terms first = mine;
    MPI_Bcast(&first, sizeof first, MPI_BYTE, 0, handle);
    std::unique_ptr<Implementation> made;
    agreement.attempt([&] {
        check_margin<T>(options.margin, options.margin, "the world", Error::no_index); // NaN differs from NaN
        mine.check_against(first);
        if (options.memory == nullptr)
            throw Error(ErrorCode::invalid_argument, "WorldOptions::memory is null");
        Executor* const executor = options.executor != nullptr ? options.executor : &default_executor();
        check_threads(*executor);
        made = std::make_unique<Implementation>(handle, options, executor);
    });
    agreement.settle();
    made->comm = std::move(own);
    implementation_ = std::move(made);
}
template <int Dim, Coordinate T>
World<Dim, T>::World(World&&) noexcept = default;
template <int Dim, Coordinate T>
World<Dim, T>& World<Dim, T>::operator=(World&&) noexcept = default;
template <int Dim, Coordinate T>
World<Dim, T>::~World() = default;

template <int Dim, Coordinate T>
void World<Dim, T>::add(std::uint64_t id, const Box& box, const Options& options) noexcept
{
    auto& own = *implementation_;
    own.note([&] {
        check_box(id, box);
        check_margin<T>(options.margin, own.margin + options.margin, "object ", id);
        const auto* const entry = own.owned.find(id);
        if (entry != nullptr && (entry->exists || own.owned.exists(*entry)))
            throw Error(ErrorCode::invalid_argument,
                        "object " + std::to_string(id) + " is added, and this rank has it already" +
                            (entry->exists ? "" : ", until the update that removes it"),
                        id);
        own.owned.add(id, {box, {{}, options.margin, options.filter, options.enabled}});
    });
}

template <int Dim, Coordinate T>
void World<Dim, T>::add(std::span<const std::uint64_t> ids, const Boxes& boxes,
                        const Options& options) noexcept
{
    if (!sizes_agree(ids.size(), boxes.size())) return;
    for (std::size_t i = 0; i < ids.size(); ++i)
        add(ids[i], boxes[i], options);
}

template <int Dim, Coordinate T>
void World<Dim, T>::remove(std::uint64_t id) noexcept
{
    auto& own = *implementation_;
    own.note([&] { own.owned.remove(own.entry(id)); });
}

template <int Dim, Coordinate T>
void World<Dim, T>::move(std::uint64_t id, const Box& box) noexcept
{
    implementation_->note([&] {
        check_box(id, box);
        implementation_->owned.move(implementation_->entry(id), box, {});
    });
}

template <int Dim, Coordinate T>
void World<Dim, T>::move(std::span<const std::uint64_t> ids, const Boxes& boxes) noexcept
{
    if (!sizes_agree(ids.size(), boxes.size())) return;
    for (std::size_t i = 0; i < ids.size(); ++i)
        move(ids[i], boxes[i]);
}

template <int Dim, Coordinate T>
void World<Dim, T>::move(std::uint64_t id, const Box& box, const Vector& displacement) noexcept
{
    implementation_->note([&] {
        check_box(id, box);
        for (int d = 0; d < Dim; ++d)
            if (!(box.lo[d] + displacement[d] <= box.hi[d] + displacement[d])) {
                std::ostringstream message = plain_stream(std::numeric_limits<T>::max_digits10);
                message << "displacement of object " << id << ": displacement[" << d
                        << "] = " << displacement[d] << " doesn't take " << box.lo[d] << " to a number";
                throw Error(ErrorCode::nan_coordinate, message.str(), id);
            }
        implementation_->owned.move(implementation_->entry(id), box, displacement);
    });
}

template <int Dim, Coordinate T>
void World<Dim, T>::set_filter(std::uint64_t id, const ObjectFilter& filter) noexcept
{
    implementation_->change(id, [&](Details<Dim, T>& details) { details.filter = filter; });
}

template <int Dim, Coordinate T>
void World<Dim, T>::set_margin(std::uint64_t id, T margin) noexcept
{
    implementation_->change(id, [&](Details<Dim, T>& details) {
        check_margin<T>(margin, implementation_->margin + margin, "object ", id);
        details.margin = margin;
    });
}

template <int Dim, Coordinate T>
void World<Dim, T>::set_enabled(std::uint64_t id, bool enabled) noexcept
{
    implementation_->change(id, [&](Details<Dim, T>& details) { details.enabled = enabled; });
}

template <int Dim, Coordinate T>
bool World<Dim, T>::sizes_agree(std::size_t ids, std::size_t boxes) noexcept
{
    if (ids == boxes) return true;
    implementation_->note([&] {
        throw Error(ErrorCode::size_mismatch, std::to_string(ids) + " ids for " + std::to_string(boxes) +
                                                  " boxes; give one id for each box");
    });
    return false;
}

template <int Dim, Coordinate T>
void World<Dim, T>::request_rebalance() noexcept
{
    implementation_->rebalancing.request();
}

template <int Dim, Coordinate T>
void World<Dim, T>::update()
{
    implementation_->update();
}

template <int Dim, Coordinate T>
PairList<Dim, T> World<Dim, T>::began() const noexcept
{
    return implementation_->shown(implementation_->lists.began);
}
template <int Dim, Coordinate T>
std::span<const EndedPair> World<Dim, T>::ended() const noexcept
{
    return implementation_->lists.ended;
}
template <int Dim, Coordinate T>
PairList<Dim, T> World<Dim, T>::persisted() const noexcept
{
    return implementation_->shown(implementation_->lists.persisted);
}
template <int Dim, Coordinate T>
PairList<Dim, T> World<Dim, T>::changed_pairs() const
{
    const Lists<Dim, T>& lists = implementation_->lists;
    const PairList<Dim, T> first = began(), second = persisted();
    if (first.empty()) return second;
    ListedPairs<Dim, T>& both = lists.changed;
    if (both.places.empty()) {
        both.places.reserve(first.size() + second.size());
        both.told.reserve(lists.began.told.size() + lists.persisted.told.size());
        const auto take = [&](const ListedPairs<Dim, T>& from, std::size_t at) {
            jostle::Pair place = from.places[at];
            if (place.b == PairList<Dim, T>::told) {
                both.told.push_back(from.told[place.a]);
                place.a = static_cast<std::uint32_t>(both.told.size() - 1);
            }
            both.places.push_back(place);
        };
        for (std::size_t i = 0, j = 0; i < first.size() || j < second.size();)
            if (j == second.size() || (i < first.size() && ascends(first[i], second[j])))
                take(lists.began, i++);
            else
                take(lists.persisted, j++);
    }
    return implementation_->shown(both);
}
template <int Dim, Coordinate T>
std::span<const Arrival> World<Dim, T>::arrived() const noexcept
{
    return implementation_->lists.arrived;
}
template <int Dim, Coordinate T>
std::span<const std::uint64_t> World<Dim, T>::departed() const noexcept
{
    return implementation_->lists.departed;
}

template <int Dim, Coordinate T>
std::size_t World<Dim, T>::size() const noexcept
{
    return static_cast<std::size_t>(implementation_->stats.objects);
}
template <int Dim, Coordinate T>
void World<Dim, T>::ids(std::vector<std::uint64_t>& out) const
{
    out.clear();
    for (const auto& entry : implementation_->owned.entries())
        if (implementation_->owned.exists(entry)) out.push_back(entry.id);
    std::sort(out.begin(), out.end());
}
template <int Dim, Coordinate T>
bool World<Dim, T>::contains(std::uint64_t id) const noexcept
{
    const auto* const entry = implementation_->owned.find(id);
    return entry != nullptr && entry->exists;
}
template <int Dim, Coordinate T>
Aabb<Dim, T> World<Dim, T>::box(std::uint64_t id) const
{
    return implementation_->now(id).box;
}
template <int Dim, Coordinate T>
Aabb<Dim, T> World<Dim, T>::bounds(std::uint64_t id) const
{
    return implementation_->now(id).bounds(implementation_->margin);
}
template <int Dim, Coordinate T>
ObjectFilter World<Dim, T>::filter(std::uint64_t id) const
{
    return implementation_->now(id).details.filter;
}
template <int Dim, Coordinate T>
bool World<Dim, T>::enabled(std::uint64_t id) const
{
    return implementation_->now(id).details.enabled;
}
// --- Snapshots -------------------------------------------------------------------------------------------

template <int Dim, Coordinate T>
std::vector<std::byte> World<Dim, T>::save() const
{
    const Implementation& own = *implementation_;
    Agreement agreement(own.handle);
    std::vector<std::byte> bytes;
    std::uint64_t stamp =
        0; // of the whole snapshot: what all parts have in common, and other snapshots don't
    agreement.attempt([&] {
        SnapshotPart part{Dim,
                          sizeof(T),
                          own.margin,
                          static_cast<std::uint32_t>(own.rank),
                          static_cast<std::uint32_t>(own.ranks),
                          own.stats.objects};
        part.write_head(bytes);
        for (const auto& entry : own.owned.entries()) {
            if (!own.owned.exists(entry)) continue;
            put(bytes, entry.id);
            own.owned.now(entry).write(bytes);
        }
        stamp = checksum(bytes);
    });
    agreement.settle();
    MPI_Allreduce(MPI_IN_PLACE, &stamp, 1, MPI_UINT64_T, MPI_BXOR, own.handle);
    agreement.attempt([&] {
        put(bytes, stamp);
        put(bytes, checksum(bytes));
    });
    agreement.settle();
    return bytes;
}

template <int Dim, Coordinate T>
void World<Dim, T>::restore(std::span<const std::vector<std::byte>> parts)
{
    Implementation& own = *implementation_;
    Agreement agreement(own.handle);
    std::unique_ptr<Implementation> made;
    std::vector<SnapshotPart> heads;
    agreement.attempt([&] {
        for (const std::vector<std::byte>& bytes : parts) {
            Reader from(bytes);
            heads.push_back(SnapshotPart::read(bytes, from, Dim, sizeof(T)));
        }
    });
    agreement.settle();
    check_parts(agreement, own.handle, heads);
    agreement.attempt([&] {
        made = std::make_unique<Implementation>(own.handle, own.options, own.executor);
        for (const std::vector<std::byte>& bytes : parts) {
            Reader from(bytes);
            const SnapshotPart part = SnapshotPart::read(bytes, from, Dim, sizeof(T));
            for (std::uint64_t i = 0; i < part.objects; ++i) {
                const auto id = from.take<std::uint64_t>();
                const auto object = Object<Dim, T>::read(from);
                part.check_rest(from);
                check_box(id, object.box);
                if (made->owned.find(id) != nullptr) part.refuse_twice(id);
                made->owned.add(id, object);
            }
            part.check_end(from);
        }
    });
    double margin[] = {heads.empty() ? 0.0 : heads.front().margin}; // for those that were given no part
    agreement.settle(margin);
    made->margin = static_cast<T>(margin[0]);
    made->options.migrate = false;
    made->update();
    made->lists.clear();
    made->stats.began = 0;
    made->options = own.options;
    made->rebalancing.request(); // objects may lie far from the ranks that were given them
    made->comm = std::move(own.comm);
    implementation_ = std::move(made);
}

template <int Dim, Coordinate T>
const QueryStats& World<Dim, T>::query_stats() const noexcept
{
    return implementation_->query_stats;
}
template <int Dim, Coordinate T>
const WorldStats& World<Dim, T>::stats() const noexcept
{
    return implementation_->stats;
}

template class World<2, float>;
template class World<2, double>;
template class World<3, float>;
template class World<3, double>;

template <int Dim, Coordinate T>
std::vector<Pair<Dim, T>> find_pairs(MPI_Comm comm, const BoxView<Dim, T>& boxes,
                                     std::span<const std::uint64_t> ids, const WorldOptions& options)
{
    WorldOptions staying = options;
    staying.migrate = false;
    World<Dim, T> world(comm, staying);
    world.add(ids, boxes);
    world.update();
    std::vector<Pair<Dim, T>> pairs;
    Agreement agreement(comm);
    agreement.attempt([&] { pairs = world.began().to_vector(); });
    agreement.settle();
    return pairs;
}
template std::vector<Pair<2, float>> find_pairs(MPI_Comm, const BoxView<2, float>&,
                                                std::span<const std::uint64_t>, const WorldOptions&);
template std::vector<Pair<2, double>> find_pairs(MPI_Comm, const BoxView<2, double>&,
                                                 std::span<const std::uint64_t>, const WorldOptions&);
template std::vector<Pair<3, float>> find_pairs(MPI_Comm, const BoxView<3, float>&,
                                                std::span<const std::uint64_t>, const WorldOptions&);
template std::vector<Pair<3, double>> find_pairs(MPI_Comm, const BoxView<3, double>&,
                                                 std::span<const std::uint64_t>, const WorldOptions&);

} // namespace mpi
JOSTLE_NAMESPACE_END
