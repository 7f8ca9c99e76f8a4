// SPDX-License-Identifier: MIT
#pragma once

#include <memory_resource>
#include <optional>
#include <span>
#include <tuple>
#include <vector>

#include "lists.hpp"
#include "object.hpp"
#include "partition.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace mpi {

/// What the rank of an object tells those who search it in an update: if it changed, touches their region for
/// the first time or no longer, or has gone to another rank.
template <int Dim, class T>
struct Notice
{
    std::uint64_t id;
    int home;     ///< whose it is after the update
    bool is_told; ///< that it has another home than before
    bool enters, leaves;
    State<Dim, T> before, now;

    [[nodiscard]] bool changed() const noexcept
    {
        return before.presence != now.presence || before.filter != now.filter ||
               differ(before.bounds, now.bounds);
    }

    /// All but the id. What the receiver knows, the state before unless it enters there, isn't repeated.
    template <class Bytes>
    void write(Bytes& bytes) const
    {
        const State<Dim, T> known = enters ? State<Dim, T>{} : before;
        const bool there_before = before.presence == Presence::enabled;
        const bool with_home = enters || is_told;
        const bool with_before = enters && there_before && changed();
        const bool with_filter = now.filter != known.filter || (with_before && now.filter != before.filter);
        put(bytes, static_cast<std::uint8_t>(enters << 0 | leaves << 1 | with_home << 2 | with_filter << 3 |
                                             with_before << 4 | there_before << 5 |
                                             static_cast<int>(now.presence) << 6));
        if (with_home) put_short(bytes, static_cast<std::uint32_t>(home));
        if (with_filter) put(bytes, now.filter);
        if (now.presence == Presence::enabled) put_near(bytes, now.bounds, known.bounds);
        if (with_before) {
            if (with_filter) put(bytes, before.filter);
            put_near(bytes, before.bounds, now.bounds);
        }
    }
    /// `known()` is called for an object that doesn't enter; it returns its home and its state before.
    template <class Known>
    [[nodiscard]] static Notice read(Reader& from, std::uint64_t id, const Known& known)
    {
        Notice notice{};
        notice.id = id;
        const auto flags = from.take<std::uint8_t>();
        notice.enters = (flags & 1) != 0;
        notice.leaves = (flags & 2) != 0;
        if (!notice.enters) std::tie(notice.home, notice.before) = known();
        notice.now.filter = notice.before.filter;
        notice.now.presence = static_cast<Presence>(flags >> 6);
        if ((flags & 4) != 0) notice.home = static_cast<int>(from.take_short());
        if ((flags & 8) != 0) notice.now.filter = from.filter();
        if (notice.now.presence == Presence::enabled) notice.now.bounds = from.box_near(notice.before.bounds);
        if (notice.enters && (flags & 32) != 0) {
            notice.before = notice.now;
            if ((flags & 16) != 0) {
                if ((flags & 8) != 0) notice.before.filter = from.filter();
                notice.before.bounds = from.box_near(notice.now.bounds);
            }
        }
        return notice;
    }
};

/// What the region of one rank has found out about a pair, and whose it is to know.
template <int Dim, class T>
class PairListener
{
  public:
    virtual void began(int rank, const Pair<Dim, T>& pair) = 0;
    virtual void persisted(int rank, const Pair<Dim, T>& pair) = 0;
    virtual void ended(int rank, const EndedPair& pair) = 0;

  protected:
    ~PairListener() = default;
};

/// The part of the scene that one rank searches: all objects that touch its region, also other ranks', in a
/// jostle::World. That world finds the pairs that may have changed; their events follow from the states of
/// their objects before and after the update, so it doesn't matter which ranks saw them before.
template <int Dim, Coordinate T>
class Region
{
  public:
    using Notice = mpi::Notice<Dim, T>;

    Region(int rank, Executor* executor, std::pmr::memory_resource* memory,
           const std::vector<QueryLayer>& layers)
        : rank_(rank),
          options_{.executor = executor, .memory = memory, .layers = layers},
          world_(std::in_place, options_),
          places_(memory),
          objects_(memory),
          shown_(memory),
          members_(memory),
          flags_(memory),
          touched_(memory),
          touched_of_(memory),
          ranks_(memory),
          entering_(memory),
          moved_(memory),
          moved_to_(memory),
          moved_from_(memory),
          began_(memory),
          persisted_(memory)
    {
    }

    [[nodiscard]] std::size_t size() const noexcept { return places_.size(); }
    [[nodiscard]] std::size_t ghosts() const noexcept { return ghosts_; }

    /// Rebuilds the local world if an update failed after changing it.
    void recover(const Partition& partition);

    // Queries to what is searched here: the local world's, and what its ids stand for.

    [[nodiscard]] const jostle::World<Dim, T>& searched() const noexcept { return *world_; }
    [[nodiscard]] Found found(ObjectId local) const noexcept
    {
        const Object& object = objects_[local.index];
        return {object.id, object.rank};
    }
    [[nodiscard]] const Aabb<Dim, T>& bounds(ObjectId local) const noexcept
    {
        return objects_[local.index].bounds;
    }
    /// `ObjectId{}` for an object that isn't searched here.
    [[nodiscard]] ObjectId local(std::uint64_t id) const noexcept
    {
        const auto at = places_.find(id);
        return at == places_.end() ? ObjectId{} : members_[at->second].local;
    }

    /// What lists of pairs show: the objects by their index in the local world of the last update.
    [[nodiscard]] const typename PairList<Dim, T>::Object* shown() const noexcept
    {
        return shown_.empty() ? objects_.data() : shown_.data();
    }

    // An update: hear() all notices, search(), tell(); then keep() it or undo() it.

    void hear(std::uint64_t id, Reader& from);
    /// In place of a notice, where an object is this rank's, enabled and strictly inside the region and stays
    /// so; false where it isn't. `guess` is where it may be, and becomes where it is: to look it up costs
    /// more than all else.
    [[nodiscard]] bool move_inside(std::uint64_t id, std::uint32_t& guess, const Aabb<Dim, T>& to);
    void search();
    /// Tells each pair that this rank is to report to another one, and all that ended, and lists those of its
    /// own. `before` says how space was divided before the update.
    void tell(const Partition& before, const Partition& now, PairListener<Dim, T>& listener,
              Lists<Dim, T>& lists);
    /// Puts those that were listed in order.
    void put_in_order(Lists<Dim, T>& lists);
    /// Puts what other ranks have told where it belongs in the lists.
    void add_told(Lists<Dim, T>& lists);
    void keep(const Partition& now, bool divided) noexcept;
    void undo(const Partition& before) noexcept;

  private:
    static constexpr std::uint32_t none = ~std::uint32_t{0};
    // Of a member. A pair of two members of which both have the latter two needs no look at anything else.
    // Where space is divided anew that holds as well: every pair in a list has a member of which there was a
    // notice.
    static constexpr std::uint8_t here = 1;     ///< there is one
    static constexpr std::uint8_t in_order = 2; ///< its id is behind those of all such members before it
    static constexpr std::uint8_t inside = 4;   ///< it is this rank's, and touches no other region
    static constexpr std::uint8_t plain = in_order | inside;

    using Object = typename PairList<Dim, T>::Object;
    struct Member
    {
        ObjectId local; ///< `ObjectId{}` where there is none
        ObjectFilter filter;
        Presence presence = Presence::absent;
    };
    /// A pair that isn't found in the order of ids: these, and its place.
    struct Other
    {
        std::uint64_t a, b;
        jostle::Pair place;
    };
    /// A member of which there was a notice.
    struct Touched
    {
        std::uint32_t index;
        int home_before;
        bool enters, leaves;
        State<Dim, T> before;
    };
    [[nodiscard]] State<Dim, T> state(std::uint32_t index) const noexcept
    {
        return {objects_[index].bounds, members_[index].filter, members_[index].presence};
    }
    /// Null where there was no notice.
    [[nodiscard]] const Touched* touched(std::uint32_t index) const noexcept
    {
        const std::uint32_t at = touched_of_[index];
        return at < touched_.size() && touched_[at].index == index ? &touched_[at] : nullptr;
    }
    [[nodiscard]] bool moved_inside(std::uint32_t index) const noexcept
    {
        const std::uint32_t at = touched_of_[index];
        return at < moved_.size() && moved_[at].index == index;
    }
    [[nodiscard]] State<Dim, T> before(std::uint32_t index) const noexcept
    {
        if (const Touched* const found = touched(index)) return found->before;
        State<Dim, T> result = state(index);
        if (moved_inside(index)) result.bounds = moved_from_[touched_of_[index]];
        return result;
    }
    [[nodiscard]] int home_before(std::uint32_t index) const noexcept
    {
        const Touched* const found = touched(index);
        return found == nullptr ? objects_[index].rank : found->home_before;
    }
    [[nodiscard]] bool changed(std::uint32_t index) const noexcept
    {
        const State<Dim, T> was = before(index), is = state(index);
        return was.presence != is.presence || was.filter != is.filter || differ(was.bounds, is.bounds);
    }
    [[nodiscard]] bool both_are(std::uint8_t wanted, std::uint32_t i, std::uint32_t j) const noexcept
    {
        return (flags_[i] & flags_[j] & wanted) == wanted;
    }
    /// Whether this rank reports the pair, of those that know both objects: the one that has the lower id, if
    /// it does, else the lowest.
    [[nodiscard]] bool reports(const Partition& partition, const Aabb<Dim, T>& a, const Aabb<Dim, T>& b,
                               int home_of_lower);
    /// Of the members at i and j, of which i has the lower id.
    [[nodiscard]] Pair<Dim, T> pair(std::uint32_t i, std::uint32_t j) const noexcept
    {
        return {objects_[i].id, objects_[j].id, objects_[i].bounds, objects_[j].bounds, objects_[j].rank};
    }
    void hear(const Notice& notice, std::uint32_t index);
    void change_bounds(std::uint32_t index, const Aabb<Dim, T>& from, const Aabb<Dim, T>& to);
    void enter(const Notice& notice);
    [[nodiscard]] bool fits_in_order(std::uint32_t index, std::uint64_t id) const noexcept;
    void note_inside(std::uint32_t index, const Partition& partition) noexcept;
    void note_all_insides(const Partition& partition) noexcept;
    void forget() noexcept;
    void merge(std::pmr::vector<jostle::Pair>& places, std::pmr::vector<Other>& others) const;
    void add_told(ListedPairs<Dim, T>& list, std::pmr::vector<Other>& others) const;

    int rank_;
    jostle::WorldOptions options_;
    std::optional<jostle::World<Dim, T>> world_;
    Places places_;                        // of members, by id
    std::pmr::vector<Object> objects_;     // members, by their index in the local world
    std::pmr::vector<Object> shown_;       // by lists that were made before recover(), until the next are
    std::pmr::vector<Member> members_;     // what else there is to say of them
    std::pmr::vector<std::uint8_t> flags_; // and what all pairs look for
    std::pmr::vector<Touched> touched_;    // in this update
    // Where there, or in moved_, a member lies, if that one is about it: so nothing is to be reset.
    std::pmr::vector<std::uint32_t> touched_of_;
    Ranks ranks_;                       // of one query
    std::pmr::vector<Notice> entering_; // in this update
    std::pmr::vector<ObjectId> moved_;  // in this update, by their ids in the local world
    std::pmr::vector<Aabb<Dim, T>> moved_to_, moved_from_;
    std::pmr::vector<Other> began_, persisted_; // those that aren't found in order
    std::size_t ghosts_ = 0;
    bool heard_ = false; // something, in this update
    bool stale_ = false; // the local world isn't what the members are
};

extern template class Region<2, float>;
extern template class Region<2, double>;
extern template class Region<3, float>;
extern template class Region<3, double>;

} // namespace mpi
JOSTLE_NAMESPACE_END
