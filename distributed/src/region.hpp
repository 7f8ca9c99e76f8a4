// SPDX-License-Identifier: MIT
#pragma once

#include <memory_resource>
#include <optional>
#include <span>
#include <tuple>
#include <vector>

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

    template <class Bytes>
    void write(Bytes& bytes) const
    {
        const bool there_before = before.presence == Presence::enabled;
        const bool with_home = enters || is_told;
        const bool with_filter = enters || before.filter != now.filter;
        const bool with_before = enters && there_before && changed();
        put(bytes, id);
        put(bytes, static_cast<std::uint8_t>(enters << 0 | leaves << 1 | with_home << 2 | with_filter << 3 |
                                             with_before << 4 | there_before << 5));
        put(bytes, static_cast<std::uint8_t>(now.presence));
        if (with_home) put(bytes, std::int32_t{home});
        if (with_filter) put(bytes, now.filter);
        if (now.presence == Presence::enabled) put(bytes, now.bounds);
        if (with_before) {
            put(bytes, before.filter);
            put(bytes, before.bounds);
        }
    }
    /// `known(id)` is called for an object that doesn't enter; it returns its home and its state before.
    template <class Known>
    [[nodiscard]] static Notice read(Reader& from, const Known& known)
    {
        Notice notice{};
        notice.id = from.take<std::uint64_t>();
        const auto flags = from.take<std::uint8_t>();
        notice.enters = (flags & 1) != 0;
        notice.leaves = (flags & 2) != 0;
        if (!notice.enters) std::tie(notice.home, notice.before) = known(notice.id);
        notice.now.filter = notice.before.filter;
        notice.now.presence = static_cast<Presence>(from.take<std::uint8_t>());
        if ((flags & 4) != 0) notice.home = from.take<std::int32_t>();
        if ((flags & 8) != 0) notice.now.filter = from.filter();
        if (notice.now.presence == Presence::enabled) notice.now.bounds = from.box<Dim, T>();
        if (notice.enters && (flags & 32) != 0) {
            notice.before = notice.now;
            if ((flags & 16) != 0) {
                notice.before.filter = from.filter();
                notice.before.bounds = from.box<Dim, T>();
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

/// The part of the scene that one rank searches: all objects that touch its region, whoever's they are, in
/// a jostle::World of their own. That world finds which pairs may have changed; what became of them follows
/// from the states of their objects before the update and after it, so it doesn't matter which ranks saw
/// them before.
template <int Dim, Coordinate T>
class Region
{
  public:
    using Notice = mpi::Notice<Dim, T>;

    Region(int rank, Executor* executor, std::pmr::memory_resource* memory)
        : rank_(rank),
          options_{.executor = executor, .memory = memory},
          world_(std::in_place, options_),
          places_(memory),
          names_(memory),
          members_(memory),
          touched_(memory),
          touched_of_(memory),
          ranks_(memory),
          entering_(memory),
          moved_(memory),
          moved_to_(memory),
          began_(memory),
          persisted_(memory),
          out_of_order_(memory)
    {
    }

    [[nodiscard]] std::size_t size() const noexcept { return places_.size(); }
    [[nodiscard]] std::size_t ghosts() const noexcept { return ghosts_; }

    /// Makes the local world anew where an update failed after it had changed it.
    void recover();

    // Questions to what is searched here: the local world's, and what its ids stand for.

    [[nodiscard]] const jostle::World<Dim, T>& searched() const noexcept { return *world_; }
    [[nodiscard]] Found found(ObjectId local) const noexcept
    {
        const Name& name = names_[local.index];
        return {name.id, name.home};
    }
    [[nodiscard]] const Aabb<Dim, T>& bounds(ObjectId local) const noexcept
    {
        return members_[local.index].state.bounds;
    }
    /// `ObjectId{}` for an object that isn't searched here.
    [[nodiscard]] ObjectId local(std::uint64_t id) const noexcept
    {
        const auto at = places_.find(id);
        return at == places_.end() ? ObjectId{} : members_[at->second].local;
    }

    // An update: hear() all notices, search(), tell(); then keep() it or undo() it.

    void hear(Reader& from);
    /// For a notice that doesn't come from elsewhere. `guess` is where the object may be, and becomes where
    /// it is: to look it up costs more than all else.
    void hear(const Notice& notice, std::uint32_t& guess);
    void search();
    /// Tells each pair that this rank is to report to another one, and all that ended; keeps in mind those of
    /// its own. `before` says how space was divided before the update.
    void tell(const Partition& before, const Partition& now, PairListener<Dim, T>& listener);
    /// Puts those of its own in order.
    void sort();
    /// Refills the lists with those, and with what other ranks have told of this rank's pairs, in order.
    void list(std::span<const Pair<Dim, T>> began_elsewhere,
              std::span<const Pair<Dim, T>> persisted_elsewhere, std::pmr::vector<Pair<Dim, T>>& began,
              std::pmr::vector<Pair<Dim, T>>& persisted) const;
    void keep() noexcept;
    void undo() noexcept;

  private:
    static constexpr std::uint32_t none = ~std::uint32_t{0};
    /// Apart from the rest, because all pairs look for it.
    struct Name
    {
        std::uint64_t id;
        int home;
    };
    struct Member
    {
        ObjectId local; ///< `ObjectId{}` where there is none
        State<Dim, T> state;
    };
    /// A pair of this rank's: ids, and where the objects lie.
    struct Own
    {
        std::uint64_t a, b;
        std::uint32_t i, j;
    };
    /// A member of which there was a notice.
    struct Touched
    {
        std::uint32_t index;
        int home_before;
        bool enters, leaves;
        State<Dim, T> before;
    };
    [[nodiscard]] const State<Dim, T>& before(std::uint32_t index) const noexcept
    {
        const std::uint32_t touched = touched_of_[index];
        return touched == none ? members_[index].state : touched_[touched].before;
    }
    [[nodiscard]] int home_before(std::uint32_t index) const noexcept
    {
        const std::uint32_t touched = touched_of_[index];
        return touched == none ? names_[index].home : touched_[touched].home_before;
    }
    [[nodiscard]] bool changed(std::uint32_t index) const noexcept
    {
        const State<Dim, T>&was = before(index), &is = members_[index].state;
        return touched_of_[index] != none &&
               (was.presence != is.presence || was.filter != is.filter || differ(was.bounds, is.bounds));
    }
    /// Whether this rank reports the pair, of those that know both objects: the one that has the lower id, if
    /// it does, else the lowest.
    [[nodiscard]] bool reports(const Partition& partition, const Aabb<Dim, T>& a, const Aabb<Dim, T>& b,
                               int home_of_lower);
    /// Of the members at i and j, of which i has the lower id.
    [[nodiscard]] Pair<Dim, T> pair(std::uint32_t i, std::uint32_t j) const noexcept
    {
        return {names_[i].id, names_[j].id, members_[i].state.bounds, members_[j].state.bounds,
                names_[j].home};
    }
    void enter(const Notice& notice);
    void forget() noexcept;
    void sort(std::pmr::vector<Own>& pairs);
    void list(const std::pmr::vector<Own>& own, std::span<const Pair<Dim, T>> elsewhere,
              std::pmr::vector<Pair<Dim, T>>& to) const;

    int rank_;
    jostle::WorldOptions options_;
    std::optional<jostle::World<Dim, T>> world_;
    Places places_;                              // of members, by id
    std::pmr::vector<Name> names_;               // of members, by their index in the local world
    std::pmr::vector<Member> members_;           // likewise
    std::pmr::vector<Touched> touched_;          // in this update
    std::pmr::vector<std::uint32_t> touched_of_; // where each member's lies there, or `none`
    Ranks ranks_;                                // of one question
    std::pmr::vector<Notice> entering_;          // in this update
    std::pmr::vector<ObjectId> moved_;           // in this update, by their ids in the local world
    std::pmr::vector<Aabb<Dim, T>> moved_to_;
    std::pmr::vector<Own> began_, persisted_, out_of_order_;
    std::size_t ghosts_ = 0;
    bool heard_ = false; // something, in this update
    bool stale_ = false; // the local world isn't what places_ and members_ say
};

extern template class Region<2, float>;
extern template class Region<2, double>;
extern template class Region<3, float>;
extern template class Region<3, double>;

} // namespace mpi
JOSTLE_NAMESPACE_END
