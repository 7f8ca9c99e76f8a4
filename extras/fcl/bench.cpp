// SPDX-License-Identifier: MIT
// jostle_bench_fcl [OBJECTS...]
//
// jostle::fcl::Manager beside FCL's managers: microseconds, the least of several runs, of spheres and boxes
// thrown into a cube so that each touches about one other. Callbacks count (collide) or measure the distance
// of the boxes, so that what is compared is the broad phase.
#include "jostle/fcl.hpp"

#include <fcl/broadphase/broadphase_SSaP.h>
#include <fcl/broadphase/broadphase_SaP.h>
#include <fcl/broadphase/broadphase_bruteforce.h>
#include <fcl/broadphase/broadphase_dynamic_AABB_tree.h>
#include <fcl/broadphase/broadphase_dynamic_AABB_tree_array.h>
#include <fcl/geometry/shape/box.h>
#include <fcl/geometry/shape/sphere.h>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "tool/scenes/random.hpp"

namespace {

using Object = fcl::CollisionObjectd;
using Base = fcl::BroadPhaseCollisionManagerd;
using Clock = std::chrono::steady_clock;
using jostle_scenes::Random;

struct System
{
    const char* name;
    std::size_t most; ///< objects; more take too long
    std::function<std::unique_ptr<Base>()> make;
};

class Cube
{
  public:
    explicit Cube(std::size_t count) : edge_(std::cbrt(static_cast<double>(count)) * 1.6)
    {
        const auto sphere = std::make_shared<fcl::Sphered>(0.5);
        const auto box = std::make_shared<fcl::Boxd>(1, 1, 1);
        for (std::size_t i = 0; i < count + 999; ++i) {
            fcl::Transform3d place = fcl::Transform3d::Identity();
            for (int d = 0; d < 3; ++d)
                place.translation()[d] = random_.uniform(0, edge_);
            std::shared_ptr<fcl::CollisionGeometryd> geometry = sphere;
            if (i % 2) geometry = box;
            (i < count ? owned_ : askers_).push_back(std::make_unique<Object>(geometry, place));
            (i < count ? owned_ : askers_).back()->computeAABB();
            if (i < count) objects.push_back(owned_.back().get());
        }
        for (const auto& asker : askers_)
            askers.push_back(asker.get());
    }
    void move(std::size_t i)
    {
        fcl::Vector3d place = objects[i]->getTranslation();
        for (int d = 0; d < 3; ++d)
            place[d] = std::fmin(edge_, std::fmax(0, place[d] + random_.uniform(-0.1, 0.1)));
        objects[i]->setTranslation(place);
        objects[i]->computeAABB();
    }
    std::vector<Object*> objects, askers;

  private:
    Random random_{5};
    double edge_;
    std::vector<std::unique_ptr<Object>> owned_, askers_;
};

std::size_t calls = 0;
bool count_pair(Object*, Object*, void*)
{
    ++calls;
    return false;
}
bool measure(Object* a, Object* b, void* data, double& least)
{
    ++calls;
    double& so_far = *static_cast<double*>(data);
    so_far = std::fmin(so_far, a->getAABB().distance(b->getAABB()));
    least = so_far;
    return least <= 0;
}

double timed(const std::function<void()>& work)
{
    const auto start = Clock::now();
    work();
    return std::chrono::duration<double, std::micro>(Clock::now() - start).count();
}

} // namespace

int main(int count, char** words)
{
    std::vector<std::size_t> sizes;
    for (int i = 1; i < count; ++i)
        sizes.push_back(static_cast<std::size_t>(std::atoll(words[i])));
    if (sizes.empty()) sizes = {9, 90, 3'000, 30'000, 120'000};
    const System systems[] = {
        {"jostle", 1'000'000,
         [] { return std::make_unique<jostle::fcl::Manager<double>>(&jostle::serial_executor()); }},
        {"jostle, all threads", 1'000'000, [] { return std::make_unique<jostle::fcl::Manager<double>>(); }},
        {"DynamicAABBTree", 1'000'000,
         [] { return std::make_unique<fcl::DynamicAABBTreeCollisionManagerd>(); }},
        {"DynamicAABBTree_Array", 1'000'000,
         [] { return std::make_unique<fcl::DynamicAABBTreeCollisionManager_Array<double>>(); }},
        {"SaP", 3'000, [] { return std::make_unique<fcl::SaPCollisionManagerd>(); }},
        {"SSaP", 3'000, [] { return std::make_unique<fcl::SSaPCollisionManagerd>(); }},
        {"Naive", 100, [] { return std::make_unique<fcl::NaiveCollisionManagerd>(); }},
    };
    const char* const columns[] = {"register",     "update()",   "self",      "both",      "999 collide",
                                   "999 distance", "distance()", "update(o)", "made for 1"};
    std::printf("%-8s %-22s", "objects", "manager");
    for (const char* column : columns)
        std::printf(" %12s", column);
    std::printf("\n");
    for (const std::size_t size : sizes) {
        const std::size_t repeats = size <= 3000 ? 41 : 7;
        std::vector<std::vector<double>> best(std::size(systems),
                                              std::vector<double>(std::size(columns), 1e300));
        for (std::size_t repeat = 0; repeat < repeats; ++repeat)
            for (std::size_t s = 0; s < std::size(systems); ++s) {
                if (size > systems[s].most) continue;
                Cube cube(size);
                const auto manager = systems[s].make();
                const auto note = [&](std::size_t column, double time) {
                    best[s][column] = std::fmin(best[s][column], time);
                };
                note(0, timed([&] {
                         manager->registerObjects(cube.objects);
                         manager->setup();
                     }));
                manager->collide(nullptr, count_pair);
                const auto move_all = [&] {
                    for (std::size_t i = 0; i < size; ++i)
                        cube.move(i);
                };
                move_all();
                const double update = timed([&] { manager->update(); });
                const double self = timed([&] { manager->collide(nullptr, count_pair); });
                note(1, update);
                note(2, self);
                note(3, update + self);
                const auto ask = [&](std::size_t column, bool distance) {
                    for (int k = 0; k < 3; ++k) {
                        move_all();
                        note(column, timed([&] {
                                 manager->update();
                                 for (Object* asker : cube.askers) {
                                     double least = std::numeric_limits<double>::max();
                                     if (distance)
                                         manager->distance(asker, &least, measure);
                                     else
                                         manager->collide(asker, nullptr, count_pair);
                                 }
                             }));
                    }
                };
                ask(4, false);
                ask(5, true);
                move_all();
                note(6, timed([&] {
                         manager->update();
                         double least = std::numeric_limits<double>::max();
                         manager->distance(&least, measure);
                     }));
                const std::size_t some = std::max<std::size_t>(1, size / 100);
                if (size <= 30'000 || systems[s].name[0] == 'j') // FCL's take seconds
                    for (int k = 0; k < 3; ++k) {
                        for (std::size_t i = 0; i < some; ++i)
                            cube.move(i);
                        note(7, timed([&] {
                                 for (std::size_t i = 0; i < some; ++i)
                                     manager->update(cube.objects[i]);
                                 manager->collide(cube.askers[0], nullptr, count_pair);
                             }));
                    }
                note(8, timed([&] {
                         const auto fresh = systems[s].make();
                         fresh->registerObjects(cube.objects);
                         fresh->setup();
                         fresh->collide(cube.askers[0], nullptr, count_pair);
                     }));
            }
        for (std::size_t s = 0; s < std::size(systems); ++s) {
            if (size > systems[s].most) continue;
            std::printf("%-8zu %-22s", size, systems[s].name);
            for (const double time : best[s])
                time < 1e300 ? std::printf(" %12.2f", time) : std::printf(" %12s", "-");
            std::printf("\n");
            std::fflush(stdout);
        }
    }
}
