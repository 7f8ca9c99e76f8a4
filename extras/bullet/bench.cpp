// SPDX-License-Identifier: MIT
// jostle_bench_bullet [SCENE [SIZE [STEPS [REPEATS]]]]
//
// What broad phases take for the scenes of extras/bullet/scenes.hpp. A simulation with btDbvtBroadphase is
// recorded call by call, all but questions. Then the very same calls are made to each broad phase, in turn,
// and for each step the least time of all repeats counts. Beside it: whole steps of a simulation with each.
// The floor is what no broad phase can be faster than: it searches for nothing, because it has been told.
#include "extras/bullet/scenes.hpp"

#include <BulletCollision/BroadphaseCollision/btAxisSweep3.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <unordered_map>

#include "jostle/bullet.hpp"

namespace {

using Clock = std::chrono::steady_clock;

struct Call
{
    enum Kind
    {
        create,
        destroy,
        set,
        calculate
    } kind;
    std::uint32_t proxy;
    int group, mask;
    btVector3 lo, hi;
};

class Recorder final : public btBroadphaseInterface
{
  public:
    std::vector<Call> calls;
    std::uint32_t proxies = 0;

    btBroadphaseProxy* createProxy(const btVector3& lo, const btVector3& hi, int shape, void* user, int group,
                                   int mask, btDispatcher* dispatcher) override
    {
        btBroadphaseProxy* const made = tree_.createProxy(lo, hi, shape, user, group, mask, dispatcher);
        numbers_[made] = proxies;
        calls.push_back({Call::create, proxies++, group, mask, lo, hi});
        return made;
    }
    void destroyProxy(btBroadphaseProxy* proxy, btDispatcher* dispatcher) override
    {
        calls.push_back({Call::destroy, numbers_[proxy], 0, 0, {}, {}});
        tree_.destroyProxy(proxy, dispatcher);
    }
    void setAabb(btBroadphaseProxy* proxy, const btVector3& lo, const btVector3& hi,
                 btDispatcher* dispatcher) override
    {
        calls.push_back({Call::set, numbers_[proxy], 0, 0, lo, hi});
        tree_.setAabb(proxy, lo, hi, dispatcher);
    }
    void getAabb(btBroadphaseProxy* proxy, btVector3& lo, btVector3& hi) const override
    {
        tree_.getAabb(proxy, lo, hi);
    }
    void rayTest(const btVector3& from, const btVector3& to, btBroadphaseRayCallback& callback,
                 const btVector3& lo, const btVector3& hi) override
    {
        tree_.rayTest(from, to, callback, lo, hi);
    }
    void aabbTest(const btVector3& lo, const btVector3& hi, btBroadphaseAabbCallback& callback) override
    {
        tree_.aabbTest(lo, hi, callback);
    }
    void calculateOverlappingPairs(btDispatcher* dispatcher) override
    {
        calls.push_back({Call::calculate, 0, 0, 0, {}, {}});
        tree_.calculateOverlappingPairs(dispatcher);
    }
    btOverlappingPairCache* getOverlappingPairCache() override { return tree_.getOverlappingPairCache(); }
    const btOverlappingPairCache* getOverlappingPairCache() const override
    {
        return tree_.getOverlappingPairCache();
    }
    void getBroadphaseAabb(btVector3& lo, btVector3& hi) const override { tree_.getBroadphaseAabb(lo, hi); }
    void printStats() override {}

  private:
    btDbvtBroadphase tree_;
    std::unordered_map<const btBroadphaseProxy*, std::uint32_t> numbers_;
};

/// What becomes of the pairs in a step, by m_uniqueId.
struct Step
{
    std::vector<std::pair<int, int>> removed, added;
};

/// A pair cache that writes down what a broad phase does with it.
class Noting final : public btHashedOverlappingPairCache
{
  public:
    std::vector<Step> steps = std::vector<Step>(1);

    btBroadphasePair* addOverlappingPair(btBroadphaseProxy* a, btBroadphaseProxy* b) override
    {
        steps.back().added.emplace_back(a->m_uniqueId, b->m_uniqueId);
        return btHashedOverlappingPairCache::addOverlappingPair(a, b);
    }
    void* removeOverlappingPair(btBroadphaseProxy* a, btBroadphaseProxy* b, btDispatcher* dispatcher) override
    {
        if (!destroying) steps.back().removed.emplace_back(a->m_uniqueId, b->m_uniqueId);
        return btHashedOverlappingPairCache::removeOverlappingPair(a, b, dispatcher);
    }
    bool destroying = false;
};

/// Keeps boxes, and does to its pair cache what it has been told.
class Told final : public btBroadphaseInterface
{
  public:
    explicit Told(const std::vector<Step>& steps) : steps_(steps) {}

    btBroadphaseProxy* createProxy(const btVector3& lo, const btVector3& hi, int, void* user, int group,
                                   int mask, btDispatcher*) override
    {
        proxies_.push_back(std::make_unique<btBroadphaseProxy>(lo, hi, user, group, mask));
        proxies_.back()->m_uniqueId = static_cast<int>(proxies_.size()); // as Jostle numbers them
        return proxies_.back().get();
    }
    void destroyProxy(btBroadphaseProxy* proxy, btDispatcher* dispatcher) override
    {
        cache_.removeOverlappingPairsContainingProxy(proxy, dispatcher);
    }
    void setAabb(btBroadphaseProxy* proxy, const btVector3& lo, const btVector3& hi, btDispatcher*) override
    {
        proxy->m_aabbMin = lo;
        proxy->m_aabbMax = hi;
    }
    void getAabb(btBroadphaseProxy* proxy, btVector3& lo, btVector3& hi) const override
    {
        lo = proxy->m_aabbMin;
        hi = proxy->m_aabbMax;
    }
    void rayTest(const btVector3&, const btVector3&, btBroadphaseRayCallback&, const btVector3&,
                 const btVector3&) override
    {
    }
    void aabbTest(const btVector3&, const btVector3&, btBroadphaseAabbCallback&) override {}
    void calculateOverlappingPairs(btDispatcher* dispatcher) override
    {
        for (const auto& [a, b] : steps_[step_].removed)
            cache_.removeOverlappingPair(proxy(a), proxy(b), dispatcher);
        for (const auto& [a, b] : steps_[step_].added)
            cache_.addOverlappingPair(proxy(a), proxy(b));
        ++step_;
    }
    btOverlappingPairCache* getOverlappingPairCache() override { return &cache_; }
    const btOverlappingPairCache* getOverlappingPairCache() const override { return &cache_; }
    void getBroadphaseAabb(btVector3& lo, btVector3& hi) const override { lo = hi = btVector3(0, 0, 0); }
    void printStats() override {}

  private:
    [[nodiscard]] btBroadphaseProxy* proxy(int id) const
    {
        return proxies_[static_cast<std::size_t>(id - 1)].get();
    }
    const std::vector<Step>& steps_;
    std::size_t step_ = 0;
    std::vector<std::unique_ptr<btBroadphaseProxy>> proxies_;
    btHashedOverlappingPairCache cache_;
};

struct System
{
    const char* name;
    std::function<std::unique_ptr<btBroadphaseInterface>()> make;
};

/// Microseconds of each step; the first is that of all creation.
std::vector<double> replay(const std::vector<Call>& calls, std::uint32_t proxies,
                           btBroadphaseInterface& broadphase, int& pairs, Noting* noting = nullptr)
{
    std::vector<btBroadphaseProxy*> made(proxies, nullptr);
    std::vector<double> steps;
    auto start = Clock::now();
    for (const Call& call : calls) {
        btBroadphaseProxy*& proxy = made[call.proxy];
        switch (call.kind) {
        case Call::create:
            proxy = broadphase.createProxy(call.lo, call.hi, BOX_SHAPE_PROXYTYPE, nullptr, call.group,
                                           call.mask, nullptr);
            break;
        case Call::destroy:
            if (noting) noting->destroying = true;
            broadphase.destroyProxy(proxy, nullptr);
            if (noting) noting->destroying = false;
            proxy = nullptr;
            break;
        case Call::set:
            broadphase.setAabb(proxy, call.lo, call.hi, nullptr);
            break;
        case Call::calculate:
            broadphase.calculateOverlappingPairs(nullptr);
            const auto now = Clock::now();
            steps.push_back(std::chrono::duration<double, std::micro>(now - start).count());
            if (noting) noting->steps.emplace_back();
            start = now;
        }
    }
    pairs = broadphase.getOverlappingPairCache()->getNumOverlappingPairs();
    for (btBroadphaseProxy* proxy : made)
        if (proxy) broadphase.destroyProxy(proxy, nullptr);
    return steps;
}

} // namespace

int main(int count, char** words)
{
    const std::string wanted = count > 1 ? words[1] : "all";
    const double size = count > 2 ? std::atof(words[2]) : 1;
    const int steps = count > 3 ? std::atoi(words[3]) : 150;
    const int repeats = count > 4 ? std::atoi(words[4]) : 5;
    const btVector3 far(2000, 2000, 2000);
    std::vector<Step> told;
    const System systems[] = {
        {"jostle",
         [] {
             return std::make_unique<jostle::bullet::Broadphase>(
                 jostle::bullet::BroadphaseOptions{.executor = &jostle::serial_executor()});
         }},
        {"jostle, 2 threads",
         [&] {
             return std::make_unique<jostle::bullet::Broadphase>(
                 jostle::bullet::BroadphaseOptions{.executor = &jostle::default_executor(2)});
         }},
        {"Dbvt", [] { return std::make_unique<btDbvtBroadphase>(); }},
        {"Dbvt, deferred",
         [] {
             auto tree = std::make_unique<btDbvtBroadphase>();
             tree->m_deferedcollide = true;
             return tree;
         }},
        {"AxisSweep3",
         [&]() -> std::unique_ptr<btBroadphaseInterface> {
             return std::make_unique<bt32BitAxisSweep3>(-far, far, 120'000);
         }},
        {"floor", [&] { return std::make_unique<Told>(told); }},
    };
    std::printf("%-20s %8s  %-18s %9s %9s %9s %9s %8s\n", "scene", "objects", "broad phase", "ms/step", "x",
                "created", "ms whole", "pairs");
    for (const jostle_bullet::NamedScene& named : jostle_bullet::scenes) {
        if (wanted != "all" && wanted != named.name) continue;
        Recorder recorder;
        std::size_t last = 0;
        {
            jostle_bullet::Scene scene(recorder);
            named.make(scene, size);
            for (int i = 0; i < steps; ++i)
                scene.step();
            last = recorder.calls.size();
        }
        recorder.calls.resize(last); // without the end
        {
            Noting cache;
            jostle::bullet::Broadphase broadphase(&cache, {.executor = &jostle::serial_executor()});
            int unused = 0;
            (void)replay(recorder.calls, recorder.proxies, broadphase, unused, &cache);
            told = std::move(cache.steps);
        }
        std::vector<std::vector<double>> best(std::size(systems));
        std::vector<int> pairs(std::size(systems));
        for (int repeat = 0; repeat < repeats; ++repeat)
            for (std::size_t i = 0; i < std::size(systems); ++i) {
                if (std::string(systems[i].name) == "AxisSweep3" && recorder.proxies > 20'000)
                    continue; // minutes
                const auto broadphase = systems[i].make();
                const auto times = replay(recorder.calls, recorder.proxies, *broadphase, pairs[i]);
                if (best[i].empty()) best[i] = times;
                for (std::size_t k = 0; k < times.size(); ++k)
                    best[i][k] = std::min(best[i][k], times[k]);
            }
        const auto mean = [&](std::size_t i) {
            double sum = 0;
            for (std::size_t k = 1; k < best[i].size(); ++k)
                sum += best[i][k];
            return sum / 1000 / static_cast<double>(best[i].size() - 1);
        };
        for (std::size_t i = 0; i < std::size(systems); ++i) {
            if (best[i].empty()) continue;
            const bool is_floor = i + 1 == std::size(systems);
            if (is_floor && pairs[i] != pairs[0]) {
                std::fprintf(stderr, "%s: the floor ends with %d pairs\n", named.name, pairs[i]);
                return 1;
            }
            double whole = is_floor ? 0 : 1e300; // only boxes and pairs that are known can be replayed
            for (int repeat = 0; repeat < 2 && !is_floor; ++repeat) {
                const auto broadphase = systems[i].make();
                jostle_bullet::Scene scene(*broadphase);
                named.make(scene, size);
                scene.step();
                const auto start = Clock::now();
                for (int k = 1; k < steps; ++k)
                    scene.step();
                whole =
                    std::min(whole, std::chrono::duration<double, std::milli>(Clock::now() - start).count() /
                                        (steps - 1));
            }
            std::printf("%-20s %8u  %-18s %9.3f %9.2f %9.2f %9.2f %8d\n", named.name, recorder.proxies,
                        systems[i].name, mean(i), mean(i) / mean(0), best[i][0] / 1000, whole, pairs[i]);
            std::fflush(stdout);
        }
    }
}
