// SPDX-License-Identifier: MIT
#pragma once

#include <BulletCollision/BroadphaseCollision/btBroadphaseInterface.h>
#include <BulletCollision/BroadphaseCollision/btBroadphaseProxy.h>
#include <BulletCollision/BroadphaseCollision/btOverlappingPairCache.h>
#include <BulletCollision/CollisionDispatch/btGhostObject.h>

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
#include <shared_mutex>
#include <type_traits>
#include <utility>
#include <vector>

#include "jostle/box.hpp"
#include "jostle/box_index.hpp"
#include "jostle/executor.hpp"
#include "jostle/query.hpp"
#include "jostle/version.hpp"
#include "jostle/world.hpp"

// Headers alone: they follow the host's btScalar and the macros that its Bullet was built with.

JOSTLE_NAMESPACE_BEGIN
namespace bullet {

struct BroadphaseOptions
{
    /// Null means default_executor(). It must outlive the broad phase.
    Executor* executor = nullptr;
    /// A box that moves is taken to be this much bigger on every side, and nothing happens until it leaves
    /// that: what Bullet calls gDbvtMargin, with Bullet's default. In the scene's units, at least 0. With 0
    /// all boxes are taken as they are.
    btScalar slack = btScalar(0.05);
    /// Whether user pointers of proxies that come with a dispatcher are btCollisionObjects, as they are in
    /// every btCollisionWorld. Pairs of ghosts among them are known at once, before the next step.
    bool collision_objects = true;
};

/// A broad phase for Bullet that keeps its boxes in a jostle::World. In place of
///
///     btDbvtBroadphase broadphase;
///
/// write
///
///     jostle::bullet::Broadphase broadphase;
///
/// Pairs     of all proxies whose bounds touch, and that the pair cache takes. Bounds are a proxy's box, from
///           its first move on with `slack` on every side: see bounds(). calculateOverlappingPairs() adds and
///           removes pairs ascending by m_uniqueId, so the cache's order depends on neither threads nor
///           executor. A pair that the cache refused, or that somebody else has taken out of it, is offered
///           again whenever one of its two gets new bounds, as btDbvtBroadphase does.
/// At once   Questions and getOverlappingPairCache() know of all that was created, moved and destroyed
///           before. Pairs with ghosts are added inside createProxy() and setAabb().
/// Questions rayTest() calls back for all bounds that are touched, nearest first, aabbTest() in the order of
///           creation. As with Bullet's own broad phases, what the callback returns doesn't end the search.
///           It may ask, create, move and destroy: it isn't called for what is gone by then.
/// Odd input Boxes with a NaN, or upside down, touch nothing until they are set again; so do questions. Rays
///           and sweeps of length zero find what they begin in.
/// Threads   rayTest() and aabbTest() from any number of threads at a time while nothing else is called.
/// Errors    None but std::bad_alloc.
/// Source    docs/guide/bullet.md
class Broadphase : public btBroadphaseInterface
{
  public:
    using Box = Aabb<3, btScalar>;

    /// The pair cache, if one is given, must outlive the broad phase, which otherwise makes a
    /// btHashedOverlappingPairCache of its own.
    explicit Broadphase(btOverlappingPairCache* pair_cache = nullptr, const BroadphaseOptions& options = {})
        : options_(options),
          own_cache_(pair_cache ? nullptr : new btHashedOverlappingPairCache),
          cache_(pair_cache ? pair_cache : own_cache_.get()),
          world_(WorldOptions{.executor = options.executor}),
          ghosts_(IndexOptions{.executor = options.executor}),
          cached_(cache_->getNumOverlappingPairs())
    {
    }
    explicit Broadphase(const BroadphaseOptions& options) : Broadphase(nullptr, options) {}
    Broadphase(const Broadphase&) = delete;
    Broadphase& operator=(const Broadphase&) = delete;

    btBroadphaseProxy* createProxy(const btVector3& lo, const btVector3& hi, int /*shape*/, void* user,
                                   int group, int mask, btDispatcher* dispatcher) override
    {
        if (free_.empty()) grow();
        Proxy& proxy = *free_.back();
        free_.pop_back();
        ++count_;
        proxy.m_clientObject = user;
        proxy.m_collisionFilterGroup = group;
        proxy.m_collisionFilterMask = mask;
        proxy.m_uniqueId = ++last_unique_id_;
        proxy.m_aabbMin = lo;
        proxy.m_aabbMax = hi;
        proxy.ghost = options_.collision_objects && dispatcher && user &&
                      btGhostObject::upcast(static_cast<btCollisionObject*>(user));
        place(proxy, grown(lo, hi, 0));
        return &proxy;
    }

    void destroyProxy(btBroadphaseProxy* given, btDispatcher* dispatcher) override
    {
        auto& proxy = static_cast<Proxy&>(*given);
        const int before = cache_->getNumOverlappingPairs();
        cache_->removeOverlappingPairsContainingProxy(&proxy, dispatcher);
        cached_ += cache_->getNumOverlappingPairs() - before;
        if (proxy.pending != Proxy::none) {
            pending_[proxy.pending] = nullptr;
            pending_bounds_[proxy.pending] = nowhere();
            proxy.pending = Proxy::none;
        }
        if (proxy.id.generation != 0) {
            removed_.push_back(proxy.id);
            slots_[proxy.id.index] = nullptr;
            proxy.id = {};
            proxy.disabled = false;
            unseen_ = true;
        }
        if (ghosts_.contains(proxy.number)) ghosts_.erase({&proxy.number, 1});
        proxy.m_uniqueId = 0;
        proxy.m_clientObject = nullptr;
        free_.push_back(&proxy);
        --count_;
    }

    void setAabb(btBroadphaseProxy* given, const btVector3& lo, const btVector3& hi, btDispatcher*) override
    {
        auto& proxy = static_cast<Proxy&>(*given);
        if (same(proxy.m_aabbMin, lo) && same(proxy.m_aabbMax, hi)) return;
        proxy.m_aabbMin = lo;
        proxy.m_aabbMax = hi;
        if (fits(proxy.bounds, lo, hi)) return;
        const Box bounds = grown(lo, hi, options_.slack);
        if (is_nowhere(bounds) && is_nowhere(proxy.bounds)) return;
        place(proxy, bounds);
    }

    void getAabb(btBroadphaseProxy* proxy, btVector3& lo, btVector3& hi) const override
    {
        lo = proxy->m_aabbMin;
        hi = proxy->m_aabbMax;
    }

    /// `lo` and `hi` are added to both ends of the ray: the box that is swept.
    void rayTest(const btVector3& from, const btVector3& to, btBroadphaseRayCallback& callback,
                 const btVector3& lo = btVector3(0, 0, 0), const btVector3& hi = btVector3(0, 0, 0)) override
    {
        Sweep<3, btScalar> sweep{};
        bool moves = false;
        for (int d = 0; d < 3; ++d) {
            sweep.box.lo[d] = from[d] + lo[d];
            sweep.box.hi[d] = from[d] + hi[d];
            sweep.motion[d] = to[d] - from[d];
            if (!(std::isfinite(sweep.box.lo[d]) && std::isfinite(sweep.box.hi[d]) &&
                  std::isfinite(sweep.motion[d]) && sweep.box.lo[d] <= sweep.box.hi[d]))
                return;
            moves |= std::isfinite(1 / sweep.motion[d]);
        }
        if (!moves)
            answer(sweep.box, callback);
        else if (same(lo, btVector3(0, 0, 0)) && same(hi, lo))
            answer(Ray<3, btScalar>{sweep.box.lo, sweep.motion, 1}, callback);
        else
            answer(sweep, callback);
    }

    void aabbTest(const btVector3& lo, const btVector3& hi, btBroadphaseAabbCallback& callback) override
    {
        const Box region = grown(lo, hi, 0);
        if (!is_nowhere(region)) answer(region, callback);
    }

    void calculateOverlappingPairs(btDispatcher* dispatcher) override
    {
        catch_up();
        in_order(ended_);
        for (const Meeting& pair : ended_)
            if (pair.alive() && !pair.touch()) cache_->removeOverlappingPair(pair.a, pair.b, dispatcher);
        ended_.clear();
        offer();
        if (cache_->hasDeferredRemoval()) remove_deferred(dispatcher);
        cached_ = cache_->getNumOverlappingPairs();
    }

    /// With the pairs of all that was created and moved before; pairs that have parted are removed by
    /// calculateOverlappingPairs().
    btOverlappingPairCache* getOverlappingPairCache() override
    {
        if (!pending_.empty() || !began_.empty()) {
            catch_up();
            offer();
            cached_ = cache_->getNumOverlappingPairs();
        }
        return cache_;
    }
    /// As the last call of any other member left it.
    const btOverlappingPairCache* getOverlappingPairCache() const override { return cache_; }

    /// Around all bounds; of nothing, zeros. Takes time in proportion to all proxies.
    void getBroadphaseAabb(btVector3& lo, btVector3& hi) const override
    {
        lo = hi = btVector3(0, 0, 0);
        bool first = true;
        for (const auto& chunk : chunks_)
            for (const Proxy& proxy : *chunk) {
                if (proxy.m_uniqueId == 0 || is_nowhere(proxy.bounds)) continue;
                const Box& box = proxy.bounds;
                const btVector3 low(box.lo[0], box.lo[1], box.lo[2]), high(box.hi[0], box.hi[1], box.hi[2]);
                if (first) {
                    lo = low;
                    hi = high;
                    first = false;
                }
                lo.setMin(low);
                hi.setMax(high);
            }
    }

    /// Without proxies: as new, so that the next scene gets the same numbers and the same order.
    void resetPool(btDispatcher*) override
    {
        if (count_ != 0) return;
        world_.clear();
        ghosts_.clear();
        slots_.clear();
        refused_.clear();
        pending_.clear();
        pending_bounds_.clear();
        removed_.clear();
        began_.clear();
        ended_.clear();
        free_.clear();
        for (auto chunk = chunks_.rbegin(); chunk != chunks_.rend(); ++chunk)
            for (auto proxy = (*chunk)->rbegin(); proxy != (*chunk)->rend(); ++proxy)
                free_.push_back(&*proxy);
        last_unique_id_ = 0;
        unseen_ = false;
        any_refused_ = offer_all_ = false;
        scanned_ = 0;
        cached_ = cache_->getNumOverlappingPairs();
    }

    /// Prints nothing: what there is to know is in world().explain().
    void printStats() override {}

    /// What the proxy is compared with others by. It is the box that createProxy() was given; when a box is
    /// set that leaves these bounds, or is smaller than they by more than four times the slack on a side, it
    /// becomes that box with the slack on every side. A box that touches nothing has bounds upside down.
    [[nodiscard]] static Box bounds(const btBroadphaseProxy* proxy) noexcept
    {
        return static_cast<const Proxy*>(proxy)->bounds;
    }
    /// For looking at: its stats() and explain() say where time goes.
    [[nodiscard]] const World<3, btScalar>& world() const noexcept { return world_; }

  private:
    struct alignas(64) Proxy final : btBroadphaseProxy
    {
        static constexpr std::uint32_t none = ~std::uint32_t{0};
        Box bounds = nowhere();
        ObjectId id = {};             ///< in the world; names nothing before the proxy is in it
        std::uint32_t pending = none; ///< its place among those whose bounds the world doesn't know yet
        std::uint32_t number = 0;     ///< of its memory, whatever object is in it
        bool ghost = false;
        bool disabled = false; ///< in the world, where it touches nothing
        Proxy() { m_uniqueId = 0; }
    };
    using Chunk = std::array<Proxy, 64>;
    /// Two proxies, the older one first, which may be gone since, and others in their place.
    struct Meeting
    {
        Proxy *a, *b;
        int a_id, b_id;
        Meeting(Proxy* x, Proxy* y) noexcept
            : a(x->m_uniqueId < y->m_uniqueId ? x : y),
              b(a == x ? y : x),
              a_id(a->m_uniqueId),
              b_id(b->m_uniqueId)
        {
        }
        [[nodiscard]] bool alive() const noexcept { return a->m_uniqueId == a_id && b->m_uniqueId == b_id; }
        [[nodiscard]] bool touch() const noexcept { return overlaps(a->bounds, b->bounds); }
        friend bool operator<(const Meeting& x, const Meeting& y) noexcept
        {
            return x.a_id < y.a_id || (x.a_id == y.a_id && x.b_id < y.b_id);
        }
    };
    struct Found
    {
        btScalar at;
        int unique_id;
        Proxy* proxy;
        friend bool operator<(const Found& x, const Found& y) noexcept
        {
            return x.at < y.at || (x.at == y.at && x.unique_id < y.unique_id);
        }
    };

    static Box nowhere() noexcept
    {
        constexpr btScalar infinity = std::numeric_limits<btScalar>::infinity();
        return {{infinity, infinity, infinity}, {-infinity, -infinity, -infinity}};
    }
    static bool is_nowhere(const Box& box) noexcept { return !(box.lo[0] <= box.hi[0]); }
    static bool same(const btVector3& a, const btVector3& b) noexcept
    {
        return a.x() == b.x() && a.y() == b.y() && a.z() == b.z();
    }
    static Box grown(const btVector3& lo, const btVector3& hi, btScalar by) noexcept
    {
        Box box;
        for (int d = 0; d < 3; ++d) {
            if (!(lo[d] <= hi[d])) return nowhere();
            box.lo[d] = lo[d] - by;
            box.hi[d] = hi[d] + by;
        }
        return box;
    }
    /// Whether bounds do for a box: it is inside, and nearly as big.
    bool fits(const Box& bounds, const btVector3& lo, const btVector3& hi) const noexcept
    {
        const btScalar most = 4 * options_.slack;
        int fit = 1; // without branches: most proxies of a scene at rest get here in every step
        for (int d = 0; d < 3; ++d) {
            fit &= int{bounds.lo[d] <= lo[d]} & int{hi[d] <= bounds.hi[d]};
            fit &= int{lo[d] - bounds.lo[d] <= most} & int{bounds.hi[d] - hi[d] <= most};
        }
        return fit != 0;
    }

    void grow()
    {
        chunks_.push_back(std::make_unique<Chunk>());
        auto number = static_cast<std::uint32_t>(chunks_.size() * std::tuple_size_v<Chunk>);
        for (auto proxy = chunks_.back()->rbegin(); proxy != chunks_.back()->rend(); ++proxy) {
            proxy->number = --number;
            free_.push_back(&*proxy);
        }
    }

    /// New bounds, which the world is told of when somebody wants to know.
    void place(Proxy& proxy, const Box& bounds)
    {
        proxy.bounds = bounds;
        if (proxy.pending == Proxy::none) {
            proxy.pending = static_cast<std::uint32_t>(pending_.size());
            pending_.push_back(&proxy);
            pending_bounds_.push_back(bounds);
        } else {
            pending_bounds_[proxy.pending] = bounds;
        }
        unseen_ = true;
        if (proxy.ghost) {
            place_ghost(proxy);
            meet(proxy, bounds);
        } else if (ghosts_.size() > 0 && !is_nowhere(bounds)) {
            ghosts_.all(bounds, near_ghosts_);
            std::vector<Proxy*> near;
            for (const std::uint32_t number : near_ghosts_)
                near.push_back(
                    &(*chunks_[number / std::tuple_size_v<Chunk>])[number % std::tuple_size_v<Chunk>]);
            std::sort(near.begin(), near.end(),
                      [](const Proxy* a, const Proxy* b) { return a->m_uniqueId < b->m_uniqueId; });
            for (Proxy* const ghost : near)
                add_early(proxy, *ghost);
        }
    }

    void place_ghost(const Proxy& proxy)
    {
        const bool known = ghosts_.contains(proxy.number);
        if (is_nowhere(proxy.bounds)) {
            if (known) ghosts_.erase({&proxy.number, 1});
        } else if (known) {
            ghosts_.move({&proxy.number, 1}, std::array{proxy.bounds});
        } else {
            ghosts_.insert({&proxy.number, 1}, std::array{proxy.bounds});
        }
    }

    void meet(Proxy& ghost, const Box& bounds)
    {
        if (is_nowhere(bounds)) return;
        std::vector<Found> found = std::exchange(found_early_, {});
        collect(bounds, found);
        std::sort(found.begin(), found.end());
        for (const Found& other : found)
            if (other.proxy != &ghost) add_early(ghost, *other.proxy);
        found.clear();
        found_early_ = std::move(found);
    }

    void add_early(Proxy& a, Proxy& b)
    {
        const int before = cache_->getNumOverlappingPairs();
        if (!cache_->addOverlappingPair(&a, &b)) return;
        cached_ += cache_->getNumOverlappingPairs() - before;
        ended_.emplace_back(&a, &b); // the world may never hear of it
    }

    /// Tells the world of all new bounds, and remembers what that did to the pairs.
    void catch_up()
    {
        // Other code changed the cache, so from now on all that move are offered again.
        if (cache_->getNumOverlappingPairs() != cached_) offer_all_ = true;
        if (!unseen_) return;
        new_.clear();
        new_bounds_.clear();
        moved_.clear();
        moved_bounds_.clear();
        for (std::size_t i = 0; i < pending_.size(); ++i) {
            Proxy* const proxy = pending_[i];
            if (!proxy) continue;
            proxy->pending = Proxy::none;
            if (is_nowhere(proxy->bounds)) {
                if (proxy->id.generation != 0) set_enabled(*proxy, false);
            } else if (proxy->id.generation == 0) {
                new_.push_back(proxy);
                new_bounds_.push_back(proxy->bounds);
            } else {
                set_enabled(*proxy, true);
                moved_.push_back(proxy->id);
                moved_bounds_.push_back(proxy->bounds);
            }
        }
        pending_.clear();
        pending_bounds_.clear();
        world_.remove(removed_);
        removed_.clear();
        new_ids_.resize(new_.size());
        world_.add(new_bounds_, new_ids_);
        for (std::size_t i = 0; i < new_.size(); ++i) {
            const std::uint32_t index = new_ids_[i].index;
            if (index >= slots_.size()) {
                slots_.resize(index + 1, nullptr);
                refused_.resize(index + 1, 0);
            }
            new_[i]->id = new_ids_[i];
            slots_[index] = new_[i];
            refused_[index] = 0;
        }
        world_.update(moved_, moved_bounds_);
        for (const EndedPair& pair : world_.ended()) {
            Proxy* const a = of(pair.a);
            Proxy* const b = of(pair.b);
            if (a && b) ended_.emplace_back(a, b);
        }
        for (const ObjectPair& pair : world_.began())
            began_.emplace_back(slots_[pair.a.index], slots_[pair.b.index]);
        if (offer_all_ || any_refused_)
            for (const Pair pair : world_.persisted())
                if (offer_all_ || (refused_[pair.a] & refused_[pair.b]))
                    began_.emplace_back(slots_[pair.a], slots_[pair.b]);
        scanned_ = 0;
        unseen_ = false;
    }

    void set_enabled(Proxy& proxy, bool enabled)
    {
        if (proxy.disabled != enabled) return;
        world_.set_enabled(proxy.id, enabled);
        proxy.disabled = !enabled;
    }

    Proxy* of(ObjectId id) const noexcept
    {
        Proxy* const proxy = slots_[id.index];
        return proxy && proxy->id == id ? proxy : nullptr;
    }
    static void in_order(std::vector<Meeting>& pairs)
    {
        if (!std::is_sorted(pairs.begin(), pairs.end())) std::sort(pairs.begin(), pairs.end());
    }

    /// Offers the cache what has begun since the last time, and still touches.
    void offer()
    {
        in_order(began_);
        for (const Meeting& pair : began_) {
            if (!pair.alive() || !pair.touch() || cache_->addOverlappingPair(pair.a, pair.b)) continue;
            any_refused_ = true;
            for (const Proxy* proxy : {pair.a, pair.b})
                if (proxy->id.generation != 0) refused_[proxy->id.index] = 1;
        }
        began_.clear();
    }

    /// What a btSortedOverlappingPairCache leaves to the broad phase: pairs that are there twice, and pairs
    /// that have parted.
    void remove_deferred(btDispatcher* dispatcher)
    {
        btBroadphasePairArray& pairs = cache_->getOverlappingPairArray();
        pairs.quickSort(btBroadphasePairSortPredicate());
        const btBroadphaseProxy *first = nullptr, *second = nullptr;
        int gone = 0;
        for (int i = 0; i < pairs.size(); ++i) {
            btBroadphasePair& pair = pairs[i];
            const bool twice = pair.m_pProxy0 == first && pair.m_pProxy1 == second;
            first = pair.m_pProxy0;
            second = pair.m_pProxy1;
            if (!twice && overlaps(bounds(first), bounds(second))) continue;
            cache_->cleanOverlappingPair(pair, dispatcher);
            pair.m_pProxy0 = pair.m_pProxy1 = nullptr;
            ++gone;
        }
        if (gone == 0) return;
        pairs.quickSort(btBroadphasePairSortPredicate());
        pairs.resize(pairs.size() - gone);
    }

    // --- Questions ---

    static std::optional<btScalar> reached(const Box& region, const Box& bounds) noexcept
    {
        return overlaps(region, bounds) ? std::optional<btScalar>(btScalar(0)) : std::nullopt;
    }
    template <class Line>
    static std::optional<btScalar> reached(const Line& line, const Box& bounds) noexcept
    {
        return is_nowhere(bounds) ? std::nullopt : hit_fraction(line, bounds);
    }

    /// What the world knows, but for what has changed since, and that.
    template <class Question>
    void collect(const Question& question, std::vector<Found>& found) const
    {
        const auto take = [&](ObjectId id) {
            Proxy* const proxy = slots_[id.index];
            if (proxy && proxy->pending == Proxy::none)
                if (const auto at = reached(question, proxy->bounds))
                    found.push_back({*at, proxy->m_uniqueId, proxy});
        };
        if constexpr (std::is_same_v<Question, Box>) {
            world_.visit(question, [&](ObjectId id) {
                take(id);
                return true;
            });
        } else { // in any order, some perhaps twice: they are sorted below
            const auto known = [&](std::uint32_t, ObjectId id) {
                take(id);
                return false;
            };
            (void)world_.any(question, {.accept = known});
        }
        for (std::size_t i = 0; i < pending_.size(); ++i)
            if (const auto at = reached(question, pending_bounds_[i]); at && pending_[i])
                found.push_back({*at, pending_[i]->m_uniqueId, pending_[i]});
    }

    template <class Question>
    void answer(const Question& question, btBroadphaseAabbCallback& callback)
    {
        // Of each thread, and handed over to the question that is being answered: a callback may ask another.
        thread_local std::vector<Found> kept;
        std::vector<Found> found = std::exchange(kept, {});
        if (!unseen_) {
            collect(question, found);
        } else {
            // Others may ask at the same time. Whoever finds that going through what the world doesn't know
            // has taken as long as telling it, tells it.
            bool enough;
            {
                const std::shared_lock lock(mutex_);
                collect(question, found);
                const std::uint64_t behind = pending_.size() + removed_.size();
                enough = (scanned_ += behind) > 8192 + 128 * behind;
            }
            if (enough) {
                const std::unique_lock lock(mutex_);
                catch_up();
            }
        }
        std::sort(found.begin(), found.end());
        const Found* last = nullptr;
        for (const Found& hit : found) {
            const bool again = last && last->proxy == hit.proxy;
            last = &hit;
            if (!again && hit.proxy->m_uniqueId == hit.unique_id) callback.process(hit.proxy);
        }
        found.clear();
        kept = std::move(found);
    }

    BroadphaseOptions options_;
    std::unique_ptr<btOverlappingPairCache> own_cache_;
    btOverlappingPairCache* cache_;
    World<3, btScalar> world_;
    BoxIndex<3, btScalar> ghosts_; ///< the bounds of ghosts, by the numbers of their memory

    std::vector<std::unique_ptr<Chunk>> chunks_;
    std::vector<Proxy*> free_;
    std::vector<Proxy*> slots_;         ///< by index in the world
    std::vector<std::uint8_t> refused_; ///< likewise: whether the cache has refused a pair of it
    std::size_t count_ = 0;
    int last_unique_id_ = 0;

    // What the world doesn't know yet. A pending proxy that was destroyed leaves a null pointer.
    std::vector<Proxy*> pending_;
    std::vector<Box> pending_bounds_;
    std::vector<ObjectId> removed_;
    std::atomic<bool> unseen_ = false; ///< whether there is anything
    std::atomic<std::uint64_t> scanned_ = 0;
    std::shared_mutex mutex_; ///< what questions read, while there is

    // What the cache doesn't know yet: pairs that may have begun, and that may have parted.
    std::vector<Meeting> began_, ended_;
    bool any_refused_ = false, offer_all_ = false;
    int cached_; ///< the size of the cache as this class left it

    // Working memory.
    std::vector<Proxy*> new_;
    std::vector<ObjectId> new_ids_, moved_;
    std::vector<Box> new_bounds_, moved_bounds_;
    std::vector<std::uint32_t> near_ghosts_;
    std::vector<Found> found_early_;
};

} // namespace bullet
JOSTLE_NAMESPACE_END
