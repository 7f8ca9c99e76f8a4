// SPDX-License-Identifier: MIT
// World and ContactFinder together: balls fall on each other and come to rest. The world lists the pairs that
// began, persist and ended; the finder computes contacts of those that move. Sleeping balls are neither moved
// nor tested.
#include <jostle/jostle.hpp>

#include <algorithm>
#include <cstdio>
#include <vector>

int main()
{
    constexpr float dt = 1.0f / 60, bounce = 0.4f;
    jostle::World3f world;
    jostle::ContactFinder3f finder;
    struct Body
    {
        jostle::ObjectId id;
        float inverse_mass; ///< 0: never moves
        jostle::Vec<3, float> velocity = {};
        int still = 0; ///< for how many frames: asleep from 30 on
    };
    // By index of the object's id. Added from one thread, objects are numbered from 0.
    std::vector<jostle::Shape3> shapes;
    std::vector<jostle::Pose3f> poses;
    std::vector<Body> bodies;
    const auto add = [&](const jostle::Shape3& shape, const jostle::Vec<3, float>& at, float inverse_mass) {
        jostle::ObjectOptionsf options;
        options.filter.is_static = inverse_mass == 0;
        shapes.push_back(shape);
        poses.push_back({at});
        bodies.push_back({world.add(jostle::bounds(shape, poses.back()), options), inverse_mass});
    };
    add(jostle::Shape3::half_space({0, 1, 0}, 0), {}, 0); // the ground
    for (int k = 0; k < 60; ++k)
        add(jostle::Shape3::sphere(0.5),
            {0.6f * static_cast<float>(k % 7), 1 + 1.1f * static_cast<float>(k),
             0.4f * static_cast<float>(k % 5)},
            1);
    const auto awake = [](const Body& body) { return body.inverse_mass != 0 && body.still < 30; };

    std::size_t touching = 0, asleep = 0, frame = 0;
    for (; frame < 3000 && asleep < 60; ++frame) {
        for (std::size_t i = 0; i < bodies.size(); ++i) {
            if (!awake(bodies[i])) continue; // costs nothing
            bodies[i].velocity[1] -= 9.81f * dt;
            for (std::size_t d = 0; d < 3; ++d)
                poses[i].position[d] += dt * bodies[i].velocity[d];
            world.move(bodies[i].id, jostle::bounds(shapes[i], poses[i]));
        }
        world.update();

        // Pairs of which one box has moved, and the contacts of their shapes.
        for (const auto& contact : finder.find({shapes, poses}, world.changed_pairs())) {
            Body &a = bodies[contact.pair.a], &b = bodies[contact.pair.b];
            float closing = 0;
            for (std::size_t d = 0; d < 3; ++d)
                closing += contact.normal[d] * (a.velocity[d] - b.velocity[d]);
            const float ease = a.inverse_mass + b.inverse_mass, rebound = closing > 1 ? 1 + bounce : 1;
            const float impulse = std::max(0.0f, rebound * closing) / ease;
            const float push = 0.2f * std::max(0.0f, contact.point[0].depth - 0.005f) / ease;
            for (std::size_t d = 0; d < 3; ++d) {
                a.velocity[d] -= a.inverse_mass * impulse * contact.normal[d];
                b.velocity[d] += b.inverse_mass * impulse * contact.normal[d];
                poses[contact.pair.a].position[d] -= a.inverse_mass * push * contact.normal[d];
                poses[contact.pair.b].position[d] += b.inverse_mass * push * contact.normal[d];
            }
            if (closing > 0.5f) a.still = b.still = 0; // a hit wakes
        }
        // So does losing the body below.
        for (const jostle::EndedPair& pair : world.ended())
            bodies[pair.a.index].still = bodies[pair.b.index].still = 0;
        touching += world.began().size();
        touching -= world.ended().size();

        asleep = 0;
        for (Body& body : bodies) {
            float squared = 0;
            for (float& v : body.velocity) {
                v *= 0.99f; // air
                squared += v * v;
            }
            body.still = squared < 0.05f ? body.still + 1 : 0;
            asleep += body.inverse_mass != 0 && !awake(body) ? 1 : 0;
        }
    }
    std::printf("%zu of 60 balls asleep after %zu frames, %zu pairs of boxes touch\n%s", asleep, frame,
                touching, world.explain().c_str());
    return asleep == 60 && touching == world.pairs().size() ? 0 : 1;
}
