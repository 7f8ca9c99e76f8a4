// SPDX-License-Identifier: MIT
#pragma once

#include <fcl/broadphase/broadphase_collision_manager.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <unordered_map>
#include <utility>
#include <vector>

#include "jostle/box.hpp"
#include "jostle/executor.hpp"
#include "jostle/fcl_tree.hpp"
#include "jostle/find_pairs.hpp"
#include "jostle/version.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace fcl {

/// A broad phase manager for FCL. In place of
///
///     fcl::DynamicAABBTreeCollisionManager<double> manager;
///
/// write
///
///     jostle::fcl::Manager<double> manager;
///
/// Boxes     are those that the objects had when they were registered or last updated, as with FCL's trees:
///           after moving an object call its computeAABB(), then update(). setup() is not needed.
/// Collide   calls back once for each pair whose boxes touch, in an order that depends on the calls made so
///           far alone, until the callback returns true. Always on the calling thread.
/// Distance  calls back for pairs whose boxes are nearer than the least distance so far, nearest first, which
///           takes few calls. As with FCL, the least distance is what the callback sets it to.
/// Objects   count once, however often they are registered. update() and unregisterObject() of an object that
///           isn't registered do nothing.
/// Odd boxes with NaN or upside down, such as those of empty meshes, are compared by FCL's own functions.
/// Others    collide() and distance() with a manager of another class ask that one for its objects.
/// Threads   const members from any number of threads at a time, and inside callbacks, while no other is
///           called. A callback may also update() objects, which later questions see, not register or
///           unregister them.
/// Cost      update() reads the boxes. What follows decides what is made of them: the pairs within the
///           manager are found from scratch; queries about single objects look through all boxes a few times
///           before a tree is refitted, or made.
/// Source    docs/guide/fcl.md
template <class S>
class Manager : public ::fcl::BroadPhaseCollisionManager<S>
{
  public:
    using Object = ::fcl::CollisionObject<S>;
    using Base = ::fcl::BroadPhaseCollisionManager<S>;
    using CollisionCallBack = ::fcl::CollisionCallBack<S>;
    using DistanceCallBack = ::fcl::DistanceCallBack<S>;

    /// Null means default_executor(). It must outlive the manager.
    explicit Manager(Executor* executor = nullptr)
        : executor_(executor), finder_(FinderOptions{.executor = executor})
    {
    }
    Manager(const Manager&) = delete;
    Manager& operator=(const Manager&) = delete;

    void registerObjects(const std::vector<Object*>& objects) override
    {
        // Twice as much at least, so that many small batches don't move everything each time.
        if (const std::size_t all = objects_.size() + objects.size(); all > objects_.capacity()) {
            const std::size_t room = std::max(all, 2 * objects_.capacity());
            objects_.reserve(room);
            boxes_.reserve(room);
            places_.reserve(room);
        }
        for (Object* const object : objects)
            registerObject(object);
    }
    void registerObject(Object* object) override
    {
        const auto place = static_cast<std::uint32_t>(objects_.size());
        make_room();
        if (!places_.emplace(object, place).second) return;
        objects_.push_back(object);
        boxes_.push_back(box_of(*object));
        odd_ += is_odd(boxes_.back());
        changed(place);
    }
    void unregisterObject(Object* object) override
    {
        const auto found = places_.find(object);
        if (found == places_.end()) return;
        const std::uint32_t place = found->second;
        places_.erase(found);
        odd_ -= is_odd(boxes_[place]);
        const auto last = static_cast<std::uint32_t>(objects_.size() - 1);
        changed(last);
        if (place != last) {
            objects_[place] = objects_[last];
            boxes_[place] = boxes_[last];
            places_[objects_[place]] = place;
            changed(place);
        }
        objects_.pop_back();
        boxes_.pop_back();
    }
    void setup() override {}
    void update() override
    {
        constexpr std::size_t ahead = 16; // objects are anywhere in memory
        for (std::uint32_t place = 0; place < objects_.size(); ++place) {
            if (place + ahead < objects_.size()) prefetch(objects_[place + ahead]->getAABB());
            update_place(place);
        }
    }
    void update(Object* object) override
    {
        if (const auto found = places_.find(object); found != places_.end()) update_place(found->second);
    }
    void update(const std::vector<Object*>& objects) override
    {
        for (Object* const object : objects)
            update(object);
    }
    void clear() override
    {
        objects_.clear();
        boxes_.clear();
        places_.clear();
        tree_.clear();
        odd_ = 0;
        all_changed_ = true;
        stale_ = true;
        pairs_known_ = false;
    }
    /// In no particular order.
    void getObjects(std::vector<Object*>& objects) const override { objects = objects_; }
    [[nodiscard]] bool empty() const override { return objects_.empty(); }
    [[nodiscard]] std::size_t size() const override { return objects_.size(); }

    /// The object may be one of the manager's: then it is found, too.
    void collide(Object* object, void* data, CollisionCallBack callback) const override
    {
        each_touching(box_of(*object), [&](Object* other) { return callback(object, other, data); });
    }
    void distance(Object* object, void* data, DistanceCallBack callback) const override
    {
        S least = std::numeric_limits<S>::max();
        each_near(box_of(*object), S(-1), least,
                  [&](std::uint32_t place) { return callback(object, objects_[place], data, least); });
    }

    void collide(void* data, CollisionCallBack callback) const override
    {
        if (objects_.size() <= few) {
            for (std::size_t a = 0; a < objects_.size(); ++a)
                for (std::size_t b = a + 1; b < objects_.size(); ++b)
                    if (touch(boxes_[a], boxes_[b]) && callback(objects_[a], objects_[b], data)) return;
            return;
        }
        if (odd_ > 0)
            for (std::size_t a = 0; a < objects_.size(); ++a)
                for (std::size_t b = is_odd(boxes_[a]) ? 0 : objects_.size(); b < objects_.size(); ++b)
                    if (b != a && !(is_odd(boxes_[b]) && b < a) && touch(boxes_[a], boxes_[b]) &&
                        callback(objects_[a], objects_[b], data))
                        return;
        const Lease lease(*this);
        for (const Pair pair : lease.pairs_within())
            if (callback(objects_[pair.a], objects_[pair.b], data)) return;
    }
    void distance(void* data, DistanceCallBack callback) const override
    {
        if (objects_.size() < 2) return;
        S least = std::numeric_limits<S>::max();
        nearest_pairs(*this, least, [&](std::uint32_t a, std::uint32_t b) {
            return callback(objects_[a], objects_[b], data, least);
        });
    }

    void collide(Base* given, void* data, CollisionCallBack callback) const override
    {
        if (given == this) return collide(data, callback);
        if (objects_.empty() || given->empty()) return;
        const auto* const other = dynamic_cast<const Manager*>(given);
        const bool sets =
            other && odd_ + other->odd_ == 0 && objects_.size() > few && other->objects_.size() > few;
        if (sets) {
            const Lease lease(*this);
            for (const Pair pair : lease.finder().find(box_view(boxes_), box_view(other->boxes_)))
                if (callback(objects_[pair.a], other->objects_[pair.b], data)) return;
            return;
        }
        std::vector<Object*> theirs;
        std::vector<Box> their_boxes;
        take(*given, other, theirs, their_boxes);
        for (std::size_t b = 0; b < theirs.size(); ++b)
            if (!each_touching(their_boxes[b], [&](Object* mine) { return callback(mine, theirs[b], data); }))
                return;
    }
    void distance(Base* given, void* data, DistanceCallBack callback) const override
    {
        if (given == this) return distance(data, callback);
        if (objects_.empty() || given->empty()) return;
        S least = std::numeric_limits<S>::max();
        const auto* const other = dynamic_cast<const Manager*>(given);
        if (other) {
            nearest_pairs(*other, least, [&](std::uint32_t a, std::uint32_t b) {
                return callback(objects_[a], other->objects_[b], data, least);
            });
            return;
        }
        std::vector<Object*> theirs;
        std::vector<Box> their_boxes;
        take(*given, other, theirs, their_boxes);
        for (std::size_t b = 0; b < theirs.size(); ++b)
            if (!each_near(their_boxes[b], S(-1), least,
                           [&](std::uint32_t a) { return callback(objects_[a], theirs[b], data, least); }))
                return;
    }

  private:
    using Box = Aabb<3, S>;
    static constexpr std::size_t few = 48; ///< objects that are simply looked through
    static constexpr std::uint32_t none = ~std::uint32_t{0};

    struct Near
    {
        S distance;
        std::uint32_t a, b;
        /// For a heap, whose first is the greatest: the nearest, and of equals the lowest.
        friend bool operator<(const Near& x, const Near& y) noexcept
        {
            return x.distance > y.distance ||
                   (x.distance == y.distance && (x.a > y.a || (x.a == y.a && x.b > y.b)));
        }
    };

    static void prefetch([[maybe_unused]] const ::fcl::AABB<S>& aabb) noexcept
    {
#ifdef __GNUC__
        __builtin_prefetch(aabb.min_.data());
        __builtin_prefetch(aabb.max_.data() + 2); // it may begin in one line of memory and end in the next
#endif
    }
    static Box box_of(const Object& object)
    {
        const ::fcl::AABB<S>& aabb = object.getAABB();
        Box box;
        for (int d = 0; d < 3; ++d) {
            box.lo[d] = aabb.min_[d];
            box.hi[d] = aabb.max_[d];
        }
        return box;
    }
    static bool is_odd(const Box& box) noexcept
    {
        return !(box.lo[0] <= box.hi[0] && box.lo[1] <= box.hi[1] && box.lo[2] <= box.hi[2]);
    }
    static bool is_finite(const Box& box) noexcept
    {
        bool finite = true;
        for (int d = 0; d < 3; ++d)
            finite = finite && std::isfinite(box.lo[d]) && std::isfinite(box.hi[d]);
        return finite;
    }
    /// What AABB::overlap says, with a NaN too.
    static bool touch(const Box& a, const Box& b) noexcept
    {
        bool apart = false;
        for (int d = 0; d < 3; ++d)
            apart |= static_cast<bool>(int{a.lo[d] > b.hi[d]} | int{a.hi[d] < b.lo[d]});
        return !apart;
    }
    /// What AABB::distance says.
    static S gap(const Box& a, const Box& b) noexcept { return std::sqrt(squared_gap(a, b)); }

    /// So that nothing fails once an object has a place, or has changed.
    void make_room()
    {
        if (objects_.size() == objects_.capacity()) objects_.reserve(2 * objects_.size() + 8);
        boxes_.reserve(objects_.capacity());
        changed_.reserve(objects_.capacity() / 8 + 1);
    }
    void changed(std::uint32_t place)
    {
        stale_ = true;
        pairs_known_ = false;
        if (changed_.size() >= objects_.size() / 8) all_changed_ = true;
        if (all_changed_)
            changed_.clear();
        else
            changed_.push_back(place);
    }
    void update_place(std::uint32_t place)
    {
        const Box box = box_of(*objects_[place]);
        Box& old = boxes_[place];
        bool same = true;
        for (int d = 0; d < 3; ++d)
            same = same && box.lo[d] == old.lo[d] && box.hi[d] == old.hi[d];
        if (same) return;
        odd_ += std::size_t{is_odd(box)} - std::size_t{is_odd(old)};
        old = box;
        changed(place);
    }
    static void take(const Base& given, const Manager* other, std::vector<Object*>& objects,
                     std::vector<Box>& boxes)
    {
        given.getObjects(objects);
        if (other) {
            boxes = other->boxes_;
        } else {
            for (const Object* object : objects)
                boxes.push_back(box_of(*object));
        }
    }

    // --- The tree ---

    /// Whether a question may go to the tree, which is brought up to date if looking through all boxes has
    /// cost about as much since it was. Not while others are asking it: then a callback has changed
    /// something.
    /// `price` is how much a look at a box costs, by that of testing whether two touch.
    bool tree_ready(std::size_t price) const
    {
        if (objects_.size() <= few) return false;
        if (!stale_) return true;
        const std::lock_guard lock(mutex_);
        if (!stale_) return true;
        if (asking_ % one_asked > 0) return false;
        scanned_ += price;
        const bool made = tree_.size() > 0;
        const std::size_t share = !made ? 12 : all_changed_ ? 3 : 1 + 16 * changed_.size() / objects_.size();
        if (scanned_ < share) return false;
        bring_up_to_date(made);
        return true;
    }
    void bring_up_to_date(bool made) const
    {
        if (made) {
            changes_ += all_changed_ ? objects_.size() : changed_.size();
            if (all_changed_)
                tree_.mend(boxes_);
            else
                tree_.mend(boxes_, changed_);
        }
        bool sort = !made;
        if (made && changes_ > objects_.size() / 8) {
            changes_ = 0;
            // Each question takes longer by about as much; sorting takes as long as some questions.
            const S excess = tree_.wear() - 1, asked = static_cast<S>(asking_ / one_asked);
            sort = excess > 3 || excess * (16 * asked + 64) > static_cast<S>(objects_.size());
        }
        if (sort) {
            tree_.sort(boxes_);
            asking_ = 0;
        }
        changed_.clear();
        all_changed_ = false;
        scanned_ = 0;
        stale_ = false;
    }
    /// While somebody goes through the tree.
    struct Asking
    {
        explicit Asking(const Manager& asked) : manager(asked) { manager.asking_ += one_asked + 1; }
        ~Asking() { --manager.asking_; }
        Asking(const Asking&) = delete;
        Asking& operator=(const Asking&) = delete;
        const Manager& manager;
    };

    /// Calls `visit` with each object whose box touches this one until it returns true; says whether it never
    /// did.
    template <class Visit>
    bool each_touching(const Box& box, const Visit& visit) const
    {
        if (is_odd(box) || !tree_ready(1)) {
            for (std::size_t place = 0; place < boxes_.size(); ++place)
                if (touch(box, boxes_[place]) && visit(objects_[place])) return false;
            return true;
        }
        if (odd_ > 0)
            for (std::size_t place = 0; place < boxes_.size(); ++place)
                if (is_odd(boxes_[place]) && touch(box, boxes_[place]) && visit(objects_[place]))
                    return false;
        const Asking asking(*this);
        return tree_.touching(box, [&](std::uint32_t place) { return !visit(objects_[place]); });
    }

    /// Calls `visit` with the places of objects, nearest first, that are further than `done` and nearer than
    /// `least`, which it may set, until it returns true; says whether it never did. `with_odd` says whether
    /// odd boxes are looked for.
    template <class Visit>
    bool each_near(const Box& box, S done, S& least, const Visit& visit, std::uint32_t first = 0,
                   bool with_odd = true) const
    {
        if (boxes_.size() <= few) return each_near_of_few(box, done, least, visit, first);
        const auto taken = [&](std::uint32_t place, S) {
            return place >= first && (done < 0 || gap(box, boxes_[place]) > done);
        };
        Near nearest{std::numeric_limits<S>::infinity(), none, 0};
        std::vector<Near> near;
        const auto keep = [&](std::uint32_t place, S squared) {
            if (taken(place, squared) && place != nearest.a) near.push_back({std::sqrt(squared), place, 0});
        };
        // The nearest first, after which there is little left that is nearer.
        if (!is_odd(box) && is_finite(box) && tree_ready(3)) {
            if (with_odd && odd_ > 0)
                for (std::uint32_t place = first; place < boxes_.size(); ++place)
                    if (is_odd(boxes_[place]))
                        if (const S distance = gap(box, boxes_[place]);
                            distance < least && distance > done && visit(place))
                            return false;
            const Asking asking(*this);
            const auto found = tree_.nearest(box, taken);
            nearest = {found.squared, found.place, 0};
            if (nearest.a == none || !(std::sqrt(nearest.distance) < least)) return true;
            if (visit(nearest.a)) return false;
            if (least > 0) tree_.nearer(box, least, keep);
        } else {
            for (std::uint32_t place = first; place < boxes_.size(); ++place)
                if (const S squared = squared_gap(box, boxes_[place]);
                    squared < nearest.distance && taken(place, squared))
                    nearest = {squared, place, 0};
            if (nearest.a != none) {
                if (!(std::sqrt(nearest.distance) < least)) return true;
                if (visit(nearest.a)) return false;
            }
            if (least > 0)
                for (std::uint32_t place = first; place < boxes_.size(); ++place)
                    if (const S squared = squared_gap(box, boxes_[place]); std::sqrt(squared) < least)
                        keep(place, squared);
        }
        return in_order(near, least, [&](const Near& found) { return visit(found.a); });
    }
    template <class Visit>
    bool each_near_of_few(const Box& box, S done, S& least, const Visit& visit, std::uint32_t first) const
    {
        std::array<S, few> squared;
        for (std::size_t place = first; place < boxes_.size(); ++place)
            squared[place] = squared_gap(box, boxes_[place]);
        while (least > 0) {
            S lowest = std::numeric_limits<S>::infinity();
            std::uint32_t next = none;
            for (std::uint32_t place = first; place < boxes_.size(); ++place)
                if (squared[place] < lowest && (done < 0 || std::sqrt(squared[place]) > done)) {
                    lowest = squared[place];
                    next = place;
                }
            if (next == none || !(std::sqrt(lowest) < least)) return true;
            squared[next] = std::numeric_limits<S>::infinity();
            if (visit(next)) return false;
        }
        return true;
    }
    template <class Visit>
    static bool in_order(std::vector<Near>& near, const S& least, const Visit& visit)
    {
        std::make_heap(near.begin(), near.end());
        for (auto end = near.end(); end != near.begin(); --end) {
            if (!(near.front().distance < least)) return true;
            const Near found = near.front();
            std::pop_heap(near.begin(), end);
            if (visit(found)) return false;
        }
        return true;
    }

    // --- Pairs ---

    /// Boxes that aren't odd, which a search takes, and their places.
    struct Good
    {
        explicit Good(const std::vector<Box>& all)
        {
            for (std::uint32_t place = 0; place < all.size(); ++place)
                if (!is_odd(all[place])) {
                    places.push_back(place);
                    boxes.push_back(all[place]);
                }
        }
        std::vector<std::uint32_t> places;
        std::vector<Box> boxes;
    };

    /// The finder, or another one if this thread or another is at it already.
    class Lease
    {
      public:
        explicit Lease(const Manager& manager) : manager_(manager), shared_(!manager.busy_.exchange(true))
        {
            if (!shared_) own_.emplace(FinderOptions{.executor = manager.executor_});
        }
        ~Lease()
        {
            if (shared_) manager_.busy_ = false;
        }
        Lease(const Lease&) = delete;
        Lease& operator=(const Lease&) = delete;
        [[nodiscard]] PairFinder& finder() const
        {
            if (!shared_) return *own_;
            manager_.pairs_known_ = false;
            return manager_.finder_;
        }
        /// All pairs but those of odd boxes, by place.
        [[nodiscard]] const std::vector<Pair>& pairs_within() const
        {
            std::vector<Pair>& pairs = shared_ ? manager_.pairs_ : own_pairs_;
            if (shared_ && manager_.pairs_known_) return pairs;
            pairs.clear();
            if (manager_.odd_ == 0) {
                for (const auto& block : finder().find(box_view(manager_.boxes_)).blocks())
                    pairs.insert(pairs.end(), block.begin(), block.end());
            } else {
                const Good good(manager_.boxes_);
                for (const Pair pair : finder().find(box_view(good.boxes)))
                    pairs.push_back({good.places[pair.a], good.places[pair.b]});
            }
            if (shared_) manager_.pairs_known_ = true;
            return pairs;
        }

      private:
        const Manager& manager_;
        bool shared_;
        mutable std::optional<PairFinder> own_;
        mutable std::vector<Pair> own_pairs_;
    };

    /// Calls `visit` with pairs of one of these objects and one of the other manager's, or with pairs of
    /// these, that are nearer than `least`, which it may set, roughly nearest first, until it returns true.
    template <class Visit>
    void nearest_pairs(const Manager& other, S& least, const Visit& visit) const
    {
        const bool within = &other == this;
        const auto count = static_cast<std::uint32_t>(boxes_.size());
        const auto others = static_cast<std::uint32_t>(other.boxes_.size());
        if (std::uint64_t{count} * others <= few * few) {
            nearest_pairs_of(other, Which::all, least, visit);
            return;
        }
        const bool some_odd = odd_ + other.odd_ > 0;
        if (some_odd && !nearest_pairs_of(other, Which::odd, least, visit)) return;
        // From here on without them.
        // First two neighbours in the tree, and the nearest to four objects, for a bound.
        std::vector<Near> seeds;
        S spacing = std::numeric_limits<S>::infinity();
        const auto goes_on = [&](S distance, std::uint32_t a, std::uint32_t b) {
            if (distance > 0) spacing = std::min(spacing, distance);
            const Near seed = within && b < a ? Near{distance, b, a} : Near{distance, a, b};
            if (!(distance < least) || is_among(seeds, seed.a, seed.b)) return true;
            seeds.push_back(seed);
            return !visit(seed.a, seed.b) && least > 0;
        };
        const bool tree = other.tree_ready(999);
        if (tree && within) {
            const auto [a, b] = tree_.near_pair(boxes_);
            const bool odd = some_odd && a != none && (is_odd(boxes_[a]) || is_odd(boxes_[b]));
            if (a != none && !odd && !goes_on(gap(boxes_[a], boxes_[b]), a, b)) return;
            spacing = std::numeric_limits<S>::infinity(); // they are nearer than others
        }
        for (std::uint32_t i = 0; i < 4; ++i) {
            const std::uint32_t a = static_cast<std::uint32_t>(std::uint64_t{i} * (count - 1) / 3);
            if (is_odd(boxes_[a])) continue;
            Near nearest{std::numeric_limits<S>::infinity(), a, none};
            if (tree && is_finite(boxes_[a])) {
                const Asking asking(other);
                const auto found =
                    other.tree_.nearest(boxes_[a], [&](std::uint32_t b, S) { return !(within && a == b); });
                nearest = {found.squared, a, found.place};
            } else {
                for (std::uint32_t b = 0; b < others; ++b)
                    if (const S squared = squared_gap(boxes_[a], other.boxes_[b]);
                        squared < nearest.distance && !(within && a == b) && !is_odd(other.boxes_[b]))
                        nearest = {squared, a, b};
            }
            if (nearest.b != none && !goes_on(std::sqrt(nearest.distance), a, nearest.b)) return;
        }
        const auto visit_unless_seed = [&](std::uint32_t a, std::uint32_t b) {
            return !is_among(seeds, a, b) && visit(a, b);
        };
        const auto visit_found = [&](const Near& found) { return visit_unless_seed(found.a, found.b); };
        // Then all that are within the bound, or within the distance of neighbours if that is less, found by
        // making boxes bigger. If there are many such pairs, or that isn't enough, each box in turn.
        S done = -1;
        const S reach = std::min(least, spacing);
        std::vector<Near> near;
        if (pairs_within(other, std::isfinite(reach) ? reach : 0, near)) {
            if (!in_order(near, least, visit_found)) return;
            if (!(reach < least)) return;
            done = std::isfinite(reach) ? reach : 0;
        }
        for (std::uint32_t a = 0; a < count; ++a) {
            if (is_odd(boxes_[a])) continue;
            const auto visit_other = [&](std::uint32_t b) {
                return !is_odd(other.boxes_[b]) && visit_unless_seed(a, b);
            };
            if (!other.each_near(boxes_[a], done, least, visit_other, within ? a + 1 : 0, false)) return;
        }
    }
    enum class Which
    {
        all,
        odd ///< those of which one or both boxes are
    };
    /// By looking through all pairs. False if `visit` has returned true, or nothing can be nearer.
    template <class Visit>
    bool nearest_pairs_of(const Manager& other, Which which, S& least, const Visit& visit) const
    {
        const bool within = &other == this;
        std::vector<std::uint32_t> odd;
        if (which == Which::odd)
            for (std::uint32_t b = 0; b < other.boxes_.size(); ++b)
                if (is_odd(other.boxes_[b])) odd.push_back(b);
        const auto each = [&](const auto& take) {
            for (std::uint32_t a = 0; a < boxes_.size(); ++a)
                if (which == Which::all || is_odd(boxes_[a])) {
                    for (std::uint32_t b = within ? a + 1 : 0; b < other.boxes_.size(); ++b)
                        if (!take(squared_gap(boxes_[a], other.boxes_[b]), a, b)) return;
                } else {
                    for (const std::uint32_t b : odd)
                        if ((!within || b > a) && !take(squared_gap(boxes_[a], other.boxes_[b]), a, b))
                            return;
                }
        };
        Near nearest{std::numeric_limits<S>::infinity(), none, none};
        each([&](S squared, std::uint32_t a, std::uint32_t b) {
            if (squared < nearest.distance) nearest = {squared, a, b};
            return nearest.distance > 0;
        });
        if (nearest.a == none || !(std::sqrt(nearest.distance) < least)) return true;
        if (visit(nearest.a, nearest.b) || !(least > 0)) return false;
        std::vector<Near> near;
        each([&](S squared, std::uint32_t a, std::uint32_t b) {
            if (const S distance = std::sqrt(squared);
                distance < least && !(a == nearest.a && b == nearest.b))
                near.push_back({distance, a, b});
            return true;
        });
        return in_order(near, least, [&](const Near& found) { return visit(found.a, found.b); }) && least > 0;
    }
    static bool is_among(const std::vector<Near>& seeds, std::uint32_t a, std::uint32_t b) noexcept
    {
        return std::any_of(seeds.begin(), seeds.end(),
                           [&](const Near& seed) { return seed.a == a && seed.b == b; });
    }
    /// The pairs that are at most `reach` apart, but for odd boxes; false if there are very many of them.
    bool pairs_within(const Manager& other, S reach, std::vector<Near>& near) const
    {
        const std::size_t most = 4096 + 16 * (boxes_.size() + other.boxes_.size());
        Good mine(boxes_);
        const Good theirs(other.boxes_);
        const bool within = &other == this;
        // What gap() says may be less than the truth, but not than the rounded difference of the bounds on an
        // axis, if the square of that is a normal number. So where it says no more than `reach`, the true
        // difference is less than the next number, or so small that its square isn't normal.
        constexpr S infinity = std::numeric_limits<S>::infinity();
        const S all = std::nextafter(reach, infinity) + 2 * std::sqrt(std::numeric_limits<S>::min());
        const S by = within ? all / 2 : all;
        for (Box& box : mine.boxes)
            for (int d = 0; d < 3; ++d) { // rounded outwards
                box.lo[d] = std::nextafter(box.lo[d] - by, -infinity);
                box.hi[d] = std::nextafter(box.hi[d] + by, infinity);
            }
        const auto sink = [&](const PairChunk& chunk) {
            for (const Pair pair : chunk.pairs) {
                const std::uint32_t a = mine.places[pair.a], b = theirs.places[pair.b];
                if (const S distance = gap(boxes_[a], other.boxes_[b]); distance <= reach)
                    near.push_back({distance, a, b});
            }
            return near.size() <= most;
        };
        // On this thread, so that it can stop at once.
        PairFinder finder(FinderOptions{.executor = &serial_executor()});
        return within ? finder.stream(box_view(mine.boxes), sink)
                      : finder.stream(box_view(mine.boxes), box_view(theirs.boxes), sink);
    }

    Executor* executor_;
    std::vector<Object*> objects_;
    std::vector<Box> boxes_; ///< as they were when registered or last updated
    std::unordered_map<const Object*, std::uint32_t> places_;
    std::size_t odd_ = 0; ///< boxes that FCL's own functions compare

    /// What asking_ grows by with each question; below that it counts those that are being answered.
    static constexpr std::uint64_t one_asked = std::uint64_t{1} << 32;
    mutable MendedTree<S> tree_;
    mutable std::atomic<bool> stale_ = true;
    mutable bool all_changed_ = true;
    mutable std::vector<std::uint32_t> changed_; ///< places since the tree was brought up to date, if not all
    mutable std::size_t scanned_ = 0;            ///< how often all boxes were looked through since
    mutable std::size_t changes_ = 0;            ///< boxes since its wear was looked at
    mutable std::atomic<std::uint64_t> asking_ = 0; ///< since its order was made
    mutable std::mutex mutex_;

    mutable PairFinder finder_;
    mutable std::atomic<bool> busy_ = false;
    mutable std::vector<Pair> pairs_;
    mutable bool pairs_known_ = false; ///< whether they are those of the boxes; belongs to who is busy
};

} // namespace fcl
JOSTLE_NAMESPACE_END
