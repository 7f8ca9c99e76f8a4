// SPDX-License-Identifier: MIT
// jostle_recorder OUT.jrec [BODIES] [FRAMES]
//
// Bodies of seven shapes fall from a cloud into a walled tray with a mixing paddle, tumble and pile up, as
// Bullet simulates them; the world AABBs that its own broad phase works on are recorded, 60 frames a second.
#include <btBulletDynamicsCommon.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <exception>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "tool/scenes/random.hpp"
#include "tool/scenes/recording.hpp"

namespace {

using jostle_scenes::Random;

constexpr double frames_per_second = 60;

/// Bullet keeps plain pointers to all of these; the order is the order in which they may go.
struct World
{
    btDefaultCollisionConfiguration configuration;
    btCollisionDispatcher dispatcher{&configuration};
    btDbvtBroadphase broad_phase;
    btSequentialImpulseConstraintSolver solver;
    std::vector<std::unique_ptr<btCollisionShape>> shapes;
    std::vector<std::unique_ptr<btMotionState>> states;
    std::vector<std::unique_ptr<btRigidBody>> bodies;
    btDiscreteDynamicsWorld world{&dispatcher, &broad_phase, &solver, &configuration};

    World() { world.setGravity(btVector3(0, 0, btScalar(-9.81))); }
    ~World()
    {
        for (const auto& body : bodies)
            world.removeRigidBody(body.get());
    }

    btRigidBody& add(btCollisionShape* shape, btScalar mass, const btTransform& place)
    {
        btVector3 inertia(0, 0, 0);
        if (mass > 0) shape->calculateLocalInertia(mass, inertia);
        states.push_back(std::make_unique<btDefaultMotionState>(place));
        btRigidBody::btRigidBodyConstructionInfo info(mass, states.back().get(), shape, inertia);
        info.m_friction = btScalar(0.5);
        info.m_restitution = btScalar(0.25);
        info.m_rollingFriction = btScalar(0.01);
        bodies.push_back(std::make_unique<btRigidBody>(info));
        world.addRigidBody(bodies.back().get());
        return *bodies.back();
    }
};

btTransform at(btScalar x, btScalar y, btScalar z)
{
    return btTransform(btQuaternion::getIdentity(), btVector3(x, y, z));
}

/// A shape of about `size` across.
std::unique_ptr<btCollisionShape> make_shape(Random& random, btScalar size)
{
    const btScalar half = size / 2;
    const auto part = [&] { return half * btScalar(random.uniform(0.5, 1)); };
    switch (random.below(7)) {
    case 0:
        return std::make_unique<btSphereShape>(half);
    case 1:
        return std::make_unique<btCapsuleShape>(half * btScalar(0.4), size * btScalar(0.8));
    case 2:
        return std::make_unique<btCylinderShape>(btVector3(part(), part(), part()));
    case 3:
        return std::make_unique<btConeShape>(half, size);
    case 4: { // a rock
        auto hull = std::make_unique<btConvexHullShape>();
        for (int i = 0; i < 12; ++i) {
            btVector3 direction(btScalar(random.normal()), btScalar(random.normal()),
                                btScalar(random.normal()));
            hull->addPoint(direction.safeNormalize() * part());
        }
        return hull;
    }
    case 5: // a plank
        return std::make_unique<btBoxShape>(btVector3(size, half * btScalar(0.3), half * btScalar(0.3)));
    default:
        return std::make_unique<btBoxShape>(btVector3(part(), part(), part()));
    }
}

void record(const std::string& path, std::uint32_t count, std::uint32_t frames)
{
    World scene;
    Random random(2026);
    const auto edge = btScalar(std::cbrt(count)); // metres; the tray is as wide as the cloud above it

    // The ground, four walls, and the paddle.
    const auto still = [&](const btVector3& half, const btTransform& place) {
        scene.shapes.push_back(std::make_unique<btBoxShape>(half));
        scene.add(scene.shapes.back().get(), 0, place);
    };
    const btScalar wall = edge / 2;
    still({wall + 1, wall + 1, btScalar(0.5)}, at(0, 0, btScalar(-0.5)));
    still({btScalar(0.25), wall + 1, 2}, at(-wall - 1, 0, 2));
    still({btScalar(0.25), wall + 1, 2}, at(wall + 1, 0, 2));
    still({wall + 1, btScalar(0.25), 2}, at(0, -wall - 1, 2));
    still({wall + 1, btScalar(0.25), 2}, at(0, wall + 1, 2));
    scene.shapes.push_back(std::make_unique<btBoxShape>(btVector3(wall, btScalar(0.2), btScalar(0.6))));
    btRigidBody& paddle = scene.add(scene.shapes.back().get(), 0, at(0, 0, btScalar(0.7)));
    paddle.setCollisionFlags(paddle.getCollisionFlags() | btCollisionObject::CF_KINEMATIC_OBJECT);
    paddle.setActivationState(DISABLE_DEACTIVATION);

    while (scene.bodies.size() < count) {
        // Many small ones, few big ones.
        const double u = random.uniform();
        const auto size = btScalar(0.3 + 1.2 * u * u * u);
        scene.shapes.push_back(make_shape(random, size));
        btTransform place = at(btScalar(random.uniform(-wall, wall)), btScalar(random.uniform(-wall, wall)),
                               btScalar(random.uniform(2, edge + 2)));
        btQuaternion turn(btScalar(random.normal()), btScalar(random.normal()), btScalar(random.normal()),
                          btScalar(random.normal()));
        place.setRotation(turn.normalize());
        btRigidBody& body = scene.add(scene.shapes.back().get(), size * size * size, place);
        body.setAngularVelocity({btScalar(random.uniform(-3, 3)), btScalar(random.uniform(-3, 3)),
                                 btScalar(random.uniform(-3, 3))});
    }

    jostle_scenes::RecordingWriter<3, float> writer(
        path, count, frames_per_second,
        "Bullet " + std::to_string(btGetVersion()) + ": " + std::to_string(count) +
            " bodies of mixed shapes and sizes fall into a tray and are stirred; world AABBs, metres");
    std::vector<jostle::Aabb3f> boxes(count);
    for (std::uint32_t frame = 0; frame < frames; ++frame) {
        const auto angle = btScalar(0.8 * frame / frames_per_second);
        btTransform turned = at(0, 0, btScalar(0.7));
        turned.setRotation(btQuaternion(btVector3(0, 0, 1), angle));
        paddle.getMotionState()->setWorldTransform(turned);
        scene.world.stepSimulation(btScalar(1 / frames_per_second), 0);
        for (std::uint32_t i = 0; i < count; ++i) {
            btVector3 lo, hi;
            scene.bodies[i]->getAabb(lo, hi);
            for (int d = 0; d < 3; ++d) {
                boxes[i].lo[d] = static_cast<float>(lo[d]);
                boxes[i].hi[d] = static_cast<float>(hi[d]);
            }
        }
        writer.add_frame(boxes);
        std::fprintf(stderr, "\rframe %u of %u", frame + 1, frames);
    }
    std::fprintf(stderr, "\n");
    writer.finish();
}

std::uint32_t number(const char* text)
{
    std::uint32_t value = 0;
    const char* end = text + std::strlen(text);
    const auto [rest, error] = std::from_chars(text, end, value);
    if (error != std::errc() || rest != end || value < 10 || value > 1'000'000)
        throw std::runtime_error(std::string(text) + " is not a whole number from 10 to 1000000");
    return value;
}

} // namespace

int main(int argc, char** argv)
{
    try {
        if (argc < 2 || argc > 4 || argv[1][0] == '-')
            throw std::runtime_error("usage: jostle_recorder OUT.jrec [BODIES] [FRAMES]");
        record(argv[1], argc > 2 ? number(argv[2]) : 1500, argc > 3 ? number(argv[3]) : 220);
        return 0;
    } catch (const std::exception& error) {
        std::fprintf(stderr, "jostle_recorder: %s\n", error.what());
        return 2;
    }
}
