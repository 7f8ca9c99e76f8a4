// SPDX-License-Identifier: MIT
#pragma once

#include "tool/scenes/random.hpp" // before Bullet, whose headers bring a global `seed`

#include <BulletCollision/CollisionDispatch/btGhostObject.h>
#include <BulletDynamics/Character/btKinematicCharacterController.h>
#include <BulletDynamics/Vehicle/btRaycastVehicle.h>
#include <BulletSoftBody/btSoftBodyHelpers.h>
#include <BulletSoftBody/btSoftBodyRigidBodyCollisionConfiguration.h>
#include <BulletSoftBody/btSoftRigidDynamicsWorld.h>
#include <btBulletDynamicsCommon.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <functional>
#include <memory>
#include <string>
#include <vector>

// Scenes on Bullet's own classes, for any broad phase: what the adapter is tested and measured with.

namespace jostle_bullet {

using jostle_scenes::Random;

inline btTransform at(btScalar x, btScalar y, btScalar z)
{
    return btTransform(btQuaternion::getIdentity(), btVector3(x, y, z));
}

/// A world of soft and rigid bodies, y upwards, and all that Bullet only keeps pointers to.
class Scene
{
  public:
    explicit Scene(btBroadphaseInterface& broadphase, std::uint64_t first = 1)
        : random(first),
          broadphase_(broadphase),
          dispatcher_(&configuration_),
          world_(&dispatcher_, &broadphase, &solver_, &configuration_)
    {
        world_.setGravity(btVector3(0, -10, 0));
        broadphase.getOverlappingPairCache()->setInternalGhostPairCallback(&ghost_callback_);
        world_.getWorldInfo().m_gravity = btVector3(0, -10, 0);
        world_.getWorldInfo().m_broadphase = &broadphase;
        world_.getWorldInfo().m_dispatcher = &dispatcher_;
        world_.getWorldInfo().m_sparsesdf.Initialize();
    }
    Scene(const Scene&) = delete;
    Scene& operator=(const Scene&) = delete;
    ~Scene()
    {
        for (int i = world_.getNumConstraints() - 1; i >= 0; --i)
            world_.removeConstraint(world_.getConstraint(i));
        for (const auto& action : actions)
            world_.removeAction(action.get());
        for (int i = world_.getSoftBodyArray().size() - 1; i >= 0; --i) {
            btSoftBody* const body = world_.getSoftBodyArray()[i];
            world_.removeSoftBody(body);
            delete body;
        }
        for (int i = world_.getNumCollisionObjects() - 1; i >= 0; --i)
            world_.removeCollisionObject(world_.getCollisionObjectArray()[i]);
    }

    template <class Shape, class... Arguments>
    Shape* shape(Arguments&&... arguments)
    {
        auto made = std::make_unique<Shape>(std::forward<Arguments>(arguments)...);
        Shape* const pointer = made.get();
        shapes_.push_back(std::move(made));
        return pointer;
    }
    btRigidBody* body(btCollisionShape* shape, btScalar mass, const btTransform& place)
    {
        btVector3 inertia(0, 0, 0);
        if (mass > 0) shape->calculateLocalInertia(mass, inertia);
        states_.push_back(std::make_unique<btDefaultMotionState>(place));
        btRigidBody::btRigidBodyConstructionInfo info(mass, states_.back().get(), shape, inertia);
        bodies.push_back(std::make_unique<btRigidBody>(info));
        world_.addRigidBody(bodies.back().get());
        return bodies.back().get();
    }
    btRigidBody* floor(btScalar half = 200)
    {
        return body(shape<btBoxShape>(btVector3(half, 1, half)), 0, at(0, -1, 0));
    }

    /// Rolling ground of 2 * squares * squares triangles.
    btRigidBody* landscape(int squares, btScalar step)
    {
        const int side = squares + 1;
        auto& points = ground_points_;
        auto& corners = ground_corners_;
        for (int z = 0; z < side; ++z)
            for (int x = 0; x < side; ++x) {
                const auto height = btScalar(std::sin(x * 0.7) + std::cos(z * 0.5) * 0.8);
                points.push_back(btVector3((btScalar(x) - btScalar(squares) / 2) * step, height,
                                           (btScalar(z) - btScalar(squares) / 2) * step));
            }
        for (int z = 0; z < squares; ++z)
            for (int x = 0; x < squares; ++x) {
                const int i = z * side + x;
                corners.insert(corners.end(), {i, i + side, i + 1, i + 1, i + side, i + side + 1});
            }
        mesh_ = std::make_unique<btTriangleIndexVertexArray>(
            static_cast<int>(corners.size() / 3), corners.data(), static_cast<int>(3 * sizeof(int)),
            static_cast<int>(points.size()), &points[0][0], static_cast<int>(sizeof(btVector3)));
        return body(shape<btBvhTriangleMeshShape>(mesh_.get(), true), 0, at(0, 0, 0));
    }

    btConvexHullShape* rock(btScalar size)
    {
        auto* const hull = shape<btConvexHullShape>();
        for (int i = 0; i < 12; ++i) {
            btVector3 direction(btScalar(random.normal()), btScalar(random.normal()),
                                btScalar(random.normal()));
            hull->addPoint(direction.safeNormalize() * size * btScalar(random.uniform(0.7, 1)), i == 11);
        }
        return hull;
    }
    /// One of seven shapes, about `size` across.
    btCollisionShape* any_shape(btScalar size)
    {
        const btScalar half = size / 2;
        switch (random.below(7)) {
        case 0:
            return shape<btSphereShape>(half);
        case 1:
            return shape<btCapsuleShape>(half * btScalar(0.5), half);
        case 2:
            return shape<btCylinderShape>(btVector3(half, half, half));
        case 3:
            return shape<btConeShape>(half, size);
        case 4:
            return rock(half);
        case 5: {
            auto* const compound = shape<btCompoundShape>();
            compound->addChildShape(at(half / 2, 0, 0), shape<btSphereShape>(half / 2));
            compound->addChildShape(at(-half / 2, 0, 0),
                                    shape<btBoxShape>(btVector3(half / 2, half / 3, half / 3)));
            return compound;
        }
        default:
            return shape<btBoxShape>(btVector3(half, half * btScalar(0.7), half * btScalar(0.5)));
        }
    }
    btTransform anywhere(btScalar width, btScalar low, btScalar high)
    {
        btTransform place = at(btScalar(random.uniform(-width, width)), btScalar(random.uniform(low, high)),
                               btScalar(random.uniform(-width, width)));
        btQuaternion turn(btScalar(random.normal()), btScalar(random.normal()), btScalar(random.normal()),
                          btScalar(random.normal()));
        place.setRotation(turn.normalize());
        return place;
    }
    btPairCachingGhostObject* ghost(btCollisionShape* shape, const btTransform& place, int group, int mask)
    {
        ghosts.push_back(std::make_unique<btPairCachingGhostObject>());
        btPairCachingGhostObject* const made = ghosts.back().get();
        made->setCollisionShape(shape);
        made->setWorldTransform(place);
        made->setCollisionFlags(made->getCollisionFlags() | btCollisionObject::CF_NO_CONTACT_RESPONSE);
        world_.addCollisionObject(made, group, mask);
        return made;
    }
    void remove(std::size_t i)
    {
        world_.removeRigidBody(bodies[i].get());
        bodies.erase(bodies.begin() + static_cast<std::ptrdiff_t>(i));
    }

    void step()
    {
        if (each_step) each_step();
        world_.stepSimulation(btScalar(1. / 60), 0);
        ++steps;
    }
    [[nodiscard]] btSoftRigidDynamicsWorld& world() noexcept { return world_; }
    [[nodiscard]] btBroadphaseInterface& broadphase() noexcept { return broadphase_; }
    [[nodiscard]] btCollisionDispatcher& dispatcher() noexcept { return dispatcher_; }

    /// Of all places and turns, bit by bit.
    [[nodiscard]] std::uint64_t bits() const
    {
        std::uint64_t sum = 0xcbf29ce484222325u;
        const auto add = [&](btScalar value) {
            std::uint64_t raw = 0;
            std::memcpy(&raw, &value, sizeof value);
            sum = (sum ^ raw) * 0x100000001b3u;
        };
        const btCollisionObjectArray& objects = world_.getCollisionObjectArray();
        for (int i = 0; i < objects.size(); ++i) {
            const btTransform& place = objects[i]->getWorldTransform();
            for (int r = 0; r < 3; ++r) {
                add(place.getOrigin()[r]);
                for (int c = 0; c < 3; ++c)
                    add(place.getBasis()[r][c]);
            }
        }
        for (int i = 0; i < world_.getSoftBodyArray().size(); ++i)
            for (int n = 0; n < world_.getSoftBodyArray()[i]->m_nodes.size(); ++n)
                for (int d = 0; d < 3; ++d)
                    add(world_.getSoftBodyArray()[i]->m_nodes[n].m_x[d]);
        return sum ^ answers;
    }

    Random random;
    std::vector<std::unique_ptr<btRigidBody>> bodies;
    std::vector<std::unique_ptr<btPairCachingGhostObject>> ghosts;
    std::vector<std::unique_ptr<btActionInterface>> actions;
    std::vector<std::unique_ptr<btTypedConstraint>> constraints;
    std::function<void()> each_step;
    std::uint64_t answers = 0; ///< of what each_step asked
    int steps = 0;

  private:
    friend void add_vehicle(Scene& scene);
    btBroadphaseInterface& broadphase_;
    btSoftBodyRigidBodyCollisionConfiguration configuration_;
    btCollisionDispatcher dispatcher_;
    btSequentialImpulseConstraintSolver solver_;
    btGhostPairCallback ghost_callback_;
    std::vector<std::unique_ptr<btCollisionShape>> shapes_;
    std::vector<std::unique_ptr<btDefaultMotionState>> states_;
    std::vector<btVector3> ground_points_;
    std::vector<int> ground_corners_;
    std::unique_ptr<btTriangleIndexVertexArray> mesh_;
    std::unique_ptr<btDefaultVehicleRaycaster> raycaster_;
    btRaycastVehicle::btVehicleTuning tuning_;
    btSoftRigidDynamicsWorld world_;
};

/// Boxes in a loose block above the floor.
inline void falling_boxes(Scene& scene, int count)
{
    scene.floor();
    auto* const box = scene.shape<btBoxShape>(btVector3(1, 1, 1));
    const int side = static_cast<int>(std::ceil(std::cbrt(count)));
    for (int i = 0; i < count; ++i) {
        const int x = i % side, y = i / side / side, z = i / side % side;
        const auto lean = btScalar(0.15) * btScalar(y);
        scene.body(box, 2,
                   at(btScalar(x - side / 2) * btScalar(2.6) + lean, 2 + btScalar(y) * btScalar(2.4),
                      btScalar(z - side / 2) * btScalar(2.6) - lean));
    }
}

/// Walls of bricks, a pyramid and a round tower, which stand.
inline void stacks(Scene& scene, int height)
{
    scene.floor();
    auto* const brick = scene.shape<btBoxShape>(btVector3(1, btScalar(0.5), btScalar(0.5)));
    for (int wall = 0; wall < 3; ++wall)
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < height; ++x)
                scene.body(brick, 1,
                           at(btScalar(2 * x) + btScalar(y % 2) - btScalar(height),
                              btScalar(y) + btScalar(0.5), btScalar(wall * 8 - 30)));
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < height - y; ++x)
            for (int z = 0; z < height - y; ++z)
                if (x == 0 || z == 0 || x == height - y - 1 || z == height - y - 1)
                    scene.body(brick, 1,
                               at(btScalar(2 * x + y) + 30, btScalar(y) + btScalar(0.5),
                                  btScalar(z) + btScalar(y) / 2));
    const int around = 16;
    for (int y = 0; y < height; ++y)
        for (int i = 0; i < around; ++i) {
            const btScalar angle = SIMD_2_PI * (btScalar(i) + btScalar(y % 2) / 2) / btScalar(around);
            btTransform place =
                at(7 * std::cos(angle), btScalar(y) + btScalar(0.5), 7 * std::sin(angle) + 30);
            place.setRotation(btQuaternion(btVector3(0, 1, 0), SIMD_HALF_PI - angle));
            scene.body(brick, 1, place);
        }
}

/// Figures of eleven capsules and ten joints.
inline void ragdolls(Scene& scene, int count)
{
    scene.floor();
    struct Limb
    {
        btScalar radius, length, x, y;
        int parent;
    };
    static const Limb limbs[] = {
        {.15f, .2f, 0, 1, -1},        {.15f, .28f, 0, 1.2f, 0},     {.1f, .05f, 0, 1.6f, 1},
        {.07f, .45f, -.18f, .65f, 0}, {.05f, .37f, -.18f, .2f, 3},  {.07f, .45f, .18f, .65f, 0},
        {.05f, .37f, .18f, .2f, 5},   {.05f, .33f, -.4f, 1.45f, 1}, {.04f, .25f, -.7f, 1.45f, 7},
        {.05f, .33f, .4f, 1.45f, 1},  {.04f, .25f, .7f, 1.45f, 9}};
    for (int figure = 0; figure < count; ++figure) {
        const btVector3 place(btScalar(figure % 8) * 2 - 8, 1 + btScalar(figure / 64) * 3,
                              btScalar(figure / 8 % 8) * btScalar(1.3));
        std::vector<btRigidBody*> parts;
        for (const Limb& limb : limbs) {
            auto* const capsule = scene.shape<btCapsuleShape>(limb.radius * 3, limb.length * 3);
            parts.push_back(scene.body(
                capsule, 1, at(place.x() * 3 + limb.x * 3, place.y() * 3 + limb.y * 3, place.z() * 3)));
            parts.back()->setDamping(btScalar(0.05), btScalar(0.85));
            if (limb.parent < 0) continue;
            const btVector3 joint = (limb.y > 1.4f ? btVector3(limb.x, limb.y, 0)
                                                   : btVector3(limb.x, limb.y + limb.length / 2, 0)) *
                                        3 +
                                    place * 3;
            btRigidBody& a = *parts[static_cast<std::size_t>(limb.parent)];
            btRigidBody& b = *parts.back();
            auto made = std::make_unique<btPoint2PointConstraint>(
                a, b, a.getWorldTransform().inverse() * joint, b.getWorldTransform().inverse() * joint);
            scene.world().addConstraint(made.get(), true);
            scene.constraints.push_back(std::move(made));
        }
    }
}

inline void falling_rocks(Scene& scene, int count)
{
    scene.floor();
    btConvexHullShape* rocks[8];
    for (auto& rock : rocks)
        rock = scene.rock(btScalar(scene.random.uniform(0.8, 1.4)));
    const auto width = btScalar(std::cbrt(count) * 1.2);
    for (int i = 0; i < count; ++i)
        scene.body(rocks[i % 8], 1, scene.anywhere(width, 3, 3 + 3 * width));
}

/// Bodies of seven shapes, on the floor or on a landscape of triangles.
inline void mixed(Scene& scene, int count, int ground_squares = 0)
{
    const auto width = btScalar(std::cbrt(count) * 1.3);
    if (ground_squares > 0)
        scene.landscape(ground_squares, 4 * (width + 20) / btScalar(ground_squares));
    else
        scene.floor();
    std::vector<btCollisionShape*> shapes;
    for (int i = 0; i < 28; ++i)
        shapes.push_back(scene.any_shape(btScalar(scene.random.uniform(0.6, 2))));
    for (int i = 0; i < count; ++i)
        scene.body(shapes[scene.random.below(28)], 1, scene.anywhere(width, 5, 5 + 3 * width));
}

inline void rocks_on_landscape(Scene& scene, int count, int ground_squares)
{
    const auto width = btScalar(std::sqrt(count) * 1.5);
    scene.landscape(ground_squares, 4 * (width + 20) / btScalar(ground_squares));
    for (int i = 0; i < count; ++i)
        scene.body(scene.rock(1), 1, scene.anywhere(width, 5, 30));
}

struct Answers
{
    static std::uint64_t mix(std::uint64_t sum, std::uint64_t value)
    {
        return (sum ^ value) * 0x9e3779b97f4a7c15u + (sum >> 29);
    }
};

/// Rays in each step, round about, as a sensor would send them.
inline void rays(Scene& scene, int count)
{
    scene.each_step = [&scene, count, before = scene.each_step] {
        if (before) before();
        for (int i = 0; i < count; ++i) {
            const btScalar angle = SIMD_2_PI * btScalar(i) / btScalar(count);
            const btVector3 from(0, 8, 0), to(40 * std::cos(angle), -6, 40 * std::sin(angle));
            btCollisionWorld::ClosestRayResultCallback closest(from, to);
            scene.world().rayTest(from, to, closest);
            if (!closest.hasHit()) continue;
            float fraction = static_cast<float>(closest.m_closestHitFraction);
            std::uint32_t raw;
            std::memcpy(&raw, &fraction, sizeof raw);
            scene.answers = Answers::mix(scene.answers, raw);
        }
    };
}

/// A thing that was cut into pieces by planes between scattered points, and falls.
inline void shards(Scene& scene, int count)
{
    scene.floor();
    std::vector<btVector3> seeds;
    for (int i = 0; i < count; ++i)
        seeds.emplace_back(btScalar(scene.random.uniform(-4, 4)), btScalar(scene.random.uniform(-2, 2)),
                           btScalar(scene.random.uniform(-4, 4)));
    for (const btVector3& center : seeds) {
        // The lattice points of its neighbourhood that are nearer to it than to any other.
        auto* const hull = scene.shape<btConvexHullShape>();
        int points = 0;
        for (int k = 0; k < 400; ++k) {
            const btVector3 offset(btScalar(scene.random.normal()), btScalar(scene.random.normal()),
                                   btScalar(scene.random.normal()));
            const btVector3 point = center + offset;
            if (std::any_of(seeds.begin(), seeds.end(), [&](const btVector3& other) {
                    return (point - other).length2() < offset.length2();
                }))
                continue;
            hull->addPoint(offset * btScalar(0.95), false);
            if (++points == 24) break;
        }
        if (points < 4) continue;
        hull->recalcLocalAabb();
        scene.body(hull, 1, at(center.x(), center.y() + 6, center.z()));
    }
}

/// A car with four wheels that are rays.
inline void add_vehicle(Scene& scene)
{
    auto* const frame = scene.shape<btBoxShape>(btVector3(1, btScalar(0.5), 2));
    btRigidBody* const chassis = scene.body(frame, 800, at(0, 4, 0));
    chassis->setActivationState(DISABLE_DEACTIVATION);
    scene.raycaster_ = std::make_unique<btDefaultVehicleRaycaster>(&scene.world());
    auto vehicle = std::make_unique<btRaycastVehicle>(scene.tuning_, chassis, scene.raycaster_.get());
    vehicle->setCoordinateSystem(0, 1, 2);
    for (int i = 0; i < 4; ++i) {
        vehicle->addWheel(btVector3(i % 2 ? 1 : -1, 0, i / 2 ? btScalar(1.5) : btScalar(-1.5)),
                          btVector3(0, -1, 0), btVector3(-1, 0, 0), btScalar(0.6), btScalar(0.5),
                          scene.tuning_, i / 2 == 1);
        vehicle->applyEngineForce(1500, i);
    }
    scene.world().addAction(vehicle.get());
    scene.actions.push_back(std::move(vehicle));
}

/// Someone who walks, and jumps now and then.
inline void add_character(Scene& scene)
{
    auto* const capsule = scene.shape<btCapsuleShape>(btScalar(0.5), 1);
    btPairCachingGhostObject* const ghost =
        scene.ghost(capsule, at(btScalar(-6), 6, 0), btBroadphaseProxy::CharacterFilter,
                    btBroadphaseProxy::StaticFilter | btBroadphaseProxy::DefaultFilter);
    ghost->setCollisionFlags(btCollisionObject::CF_CHARACTER_OBJECT);
    auto walker =
        std::make_unique<btKinematicCharacterController>(ghost, capsule, btScalar(0.35), btVector3(0, 1, 0));
    auto* const controller = walker.get();
    scene.world().addAction(controller);
    scene.actions.push_back(std::move(walker));
    scene.each_step = [&scene, controller, before = scene.each_step] {
        if (before) before();
        controller->setWalkDirection(
            btVector3(btScalar(0.06), 0, scene.steps % 100 < 50 ? btScalar(0.03) : btScalar(-0.03)));
        if (scene.steps % 70 == 60 && controller->canJump()) controller->jump(btVector3(0, 6, 0));
    };
}

/// Zones that only look who is inside.
inline void add_zones(Scene& scene, int count)
{
    for (int i = 0; i < count; ++i)
        scene.ghost(scene.shape<btBoxShape>(btVector3(3, 3, 3)), scene.anywhere(10, 0, 10),
                    btBroadphaseProxy::SensorTrigger,
                    btBroadphaseProxy::AllFilter & ~btBroadphaseProxy::SensorTrigger);
    scene.each_step = [&scene, before = scene.each_step] {
        if (before) before();
        for (const auto& ghost : scene.ghosts) {
            scene.answers =
                Answers::mix(scene.answers, static_cast<std::uint64_t>(ghost->getNumOverlappingObjects()));
            scene.answers = Answers::mix(
                scene.answers,
                static_cast<std::uint64_t>(ghost->getOverlappingPairCache()->getNumOverlappingPairs()));
        }
    };
}

/// A ball and a cloth that aren't stiff.
inline void add_soft_bodies(Scene& scene)
{
    btSoftBodyWorldInfo& info = scene.world().getWorldInfo();
    btSoftBody* const ball =
        btSoftBodyHelpers::CreateEllipsoid(info, btVector3(0, 12, 0), btVector3(2, 2, 2), 64);
    ball->m_materials[0]->m_kLST = btScalar(0.45);
    ball->m_cfg.kDF = btScalar(0.5);
    ball->setTotalMass(10, true);
    scene.world().addSoftBody(ball);
    btSoftBody* const cloth =
        btSoftBodyHelpers::CreatePatch(info, btVector3(-5, 9, -5), btVector3(5, 9, -5), btVector3(-5, 9, 5),
                                       btVector3(5, 9, 5), 10, 10, 1 + 2 + 4 + 8, true);
    cloth->setTotalMass(5);
    scene.world().addSoftBody(cloth);
}

/// Things that never move on a wide floor, and some that do.
inline void statics_and_movers(Scene& scene, int statics, int movers)
{
    const auto width = btScalar(std::sqrt(statics) * 1.5);
    scene.floor(width + 50);
    auto* const post = scene.shape<btBoxShape>(btVector3(btScalar(0.5), 1, btScalar(0.5)));
    auto* const ball = scene.shape<btSphereShape>(btScalar(0.5));
    const int side = static_cast<int>(std::ceil(std::sqrt(statics)));
    for (int i = 0; i < statics; ++i)
        scene.body(post, 0, at(btScalar(i % side - side / 2) * 3, 1, btScalar(i / side - side / 2) * 3));
    for (int i = 0; i < movers; ++i) {
        btRigidBody* const body = scene.body(ball, 1, scene.anywhere(width, 3, 8));
        body->setLinearVelocity(
            btVector3(btScalar(scene.random.uniform(-8, 8)), 0, btScalar(scene.random.uniform(-8, 8))));
        body->setActivationState(DISABLE_DEACTIVATION);
        body->setRestitution(btScalar(0.9));
    }
}

/// Bodies go and others come: between steps, and inside the callback after each step.
inline void churn(Scene& scene, int a_time)
{
    static const auto exchange = [](Scene& changed, int count) {
        for (int i = 0; i < count && changed.bodies.size() > 20; ++i)
            changed.remove(2 + changed.random.below(static_cast<std::uint32_t>(changed.bodies.size() - 2)));
        for (int i = 0; i < count; ++i)
            changed.body(changed.any_shape(1), 1, changed.anywhere(6, 2, 12));
    };
    scene.each_step = [&scene, a_time, before = scene.each_step] {
        if (before) before();
        if (scene.steps % 3 == 0) exchange(scene, a_time);
    };
    scene.world().setInternalTickCallback(
        [](btDynamicsWorld* world, btScalar) {
            auto& changed = *static_cast<Scene*>(world->getWorldUserInfo());
            if (changed.steps % 4 == 1) exchange(changed, 2);
        },
        &scene);
}

struct NamedScene
{
    const char* name;
    void (*make)(Scene& scene, double size);
};

/// Size 1 is what is measured; tests take a part of it.
inline const NamedScene scenes[] = {
    {"boxes", [](Scene& scene, double size) { falling_boxes(scene, static_cast<int>(3000 * size)); }},
    {"stacks",
     [](Scene& scene, double size) { stacks(scene, std::max(3, static_cast<int>(14 * std::cbrt(size)))); }},
    {"ragdolls", [](Scene& scene, double size) { ragdolls(scene, static_cast<int>(136 * size)); }},
    {"rocks", [](Scene& scene, double size) { falling_rocks(scene, static_cast<int>(1000 * size)); }},
    {"landscape",
     [](Scene& scene, double size) {
         mixed(scene, static_cast<int>(1000 * size), static_cast<int>(220 * std::sqrt(size)));
     }},
    {"rocks_on_landscape",
     [](Scene& scene, double size) {
         rocks_on_landscape(scene, static_cast<int>(1000 * size), static_cast<int>(100 * std::sqrt(size)));
     }},
    {"rays",
     [](Scene& scene, double size) {
         rocks_on_landscape(scene, static_cast<int>(1000 * size), static_cast<int>(100 * std::sqrt(size)));
         rays(scene, static_cast<int>(500 * size));
     }},
    {"shards", [](Scene& scene, double size) { shards(scene, std::max(20, static_cast<int>(91 * size))); }},
    {"mixed", [](Scene& scene, double size) { mixed(scene, static_cast<int>(8000 * size)); }},
    {"vehicle",
     [](Scene& scene, double size) {
         mixed(scene, static_cast<int>(300 * size), 60);
         add_vehicle(scene);
     }},
    {"ghosts",
     [](Scene& scene, double size) {
         mixed(scene, static_cast<int>(600 * size), 40);
         add_zones(scene, 6);
         add_character(scene);
     }},
    {"soft",
     [](Scene& scene, double size) {
         mixed(scene, static_cast<int>(200 * size));
         add_soft_bodies(scene);
     }},
    {"statics",
     [](Scene& scene, double size) {
         statics_and_movers(scene, static_cast<int>(100000 * size), static_cast<int>(1000 * size));
     }},
    {"churn",
     [](Scene& scene, double size) {
         mixed(scene, static_cast<int>(2000 * size), 40);
         add_zones(scene, 3);
         rays(scene, 20);
         churn(scene, 10);
     }},
};

} // namespace jostle_bullet
