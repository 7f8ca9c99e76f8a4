// SPDX-License-Identifier: MIT
#include "bullet_shapes.hpp"

namespace jostle_bench {
namespace {

class BulletContacts final : public ContactPeer
{
  public:
    ~BulletContacts() override { stop(); }
    const char* name() const noexcept override { return "bullet"; }
    const char* how() const noexcept override
    {
        return "Bullet btCollisionDispatcher: one algorithm and manifold per pair kept from frame to frame, "
               "processCollision for each; margins as Bullet sets them";
    }

    bool has(BodyKind kind) const noexcept override { return kind != BodyKind::ellipsoid; }
    void start(std::span<const BodyShape> shapes, std::span<const jostle::Pair> pairs,
               jostle::Executor& executor) override
    {
        stop();
        executor_ = &executor;
        for (const BodyShape& body : shapes) {
            objects_.push_back(std::make_unique<btCollisionObject>());
            objects_.back()->setCollisionShape(shapes_.make(body));
        }
        const std::uint32_t count = executor.concurrency();
        for (std::uint32_t i = 0; i < count; ++i) {
            Run& run = *runs_.emplace_back(std::make_unique<Run>());
            const std::size_t first = pairs.size() * i / count, last = pairs.size() * (i + 1) / count;
            for (std::size_t k = first; k < last; ++k) {
                btCollisionObject& a = *objects_[pairs[k].a];
                btCollisionObject& b = *objects_[pairs[k].b];
                const btCollisionObjectWrapper wrap_a(nullptr, a.getCollisionShape(), &a,
                                                      a.getWorldTransform(), -1, -1);
                const btCollisionObjectWrapper wrap_b(nullptr, b.getCollisionShape(), &b,
                                                      b.getWorldTransform(), -1, -1);
                run.pairs.push_back(
                    {&a, &b,
                     run.dispatcher.findAlgorithm(&wrap_a, &wrap_b, nullptr, BT_CONTACT_POINT_ALGORITHMS)});
            }
        }
    }

    void move(std::span<const jostle::Pose3f> poses) override
    {
        for (std::size_t i = 0; i < poses.size(); ++i) {
            const auto& p = poses[i].position;
            const auto& q = poses[i].rotation;
            objects_[i]->setWorldTransform(
                btTransform(btQuaternion(q[0], q[1], q[2], q[3]), btVector3(p[0], p[1], p[2])));
        }
    }

    void frame() override
    {
        executor_->run(static_cast<std::uint32_t>(runs_.size()), [&](std::uint32_t i) {
            btDispatcherInfo info;
            for (const PairOfBodies& pair : runs_[i]->pairs) {
                const btCollisionObjectWrapper a(nullptr, pair.a->getCollisionShape(), pair.a,
                                                 pair.a->getWorldTransform(), -1, -1);
                const btCollisionObjectWrapper b(nullptr, pair.b->getCollisionShape(), pair.b,
                                                 pair.b->getWorldTransform(), -1, -1);
                btManifoldResult result(&a, &b);
                pair.algorithm->processCollision(&a, &b, info, &result);
            }
        });
    }

    ContactCounts counts() const override
    {
        ContactCounts counts;
        btManifoldArray manifolds;
        for (const auto& run : runs_)
            for (const PairOfBodies& pair : run->pairs) {
                manifolds.resize(0);
                pair.algorithm->getAllContactManifolds(manifolds);
                std::uint64_t points = 0;
                for (int m = 0; m < manifolds.size(); ++m)
                    for (int k = 0; k < manifolds[m]->getNumContacts(); ++k)
                        points += manifolds[m]->getContactPoint(k).getDistance() <= 0 ? 1 : 0;
                counts.touching += points != 0 ? 1 : 0;
                counts.points += points;
            }
        return counts;
    }

  private:
    struct PairOfBodies
    {
        btCollisionObject *a, *b;
        btCollisionAlgorithm* algorithm;
    };
    struct Run
    {
        btDefaultCollisionConfiguration configuration{make_info()};
        btCollisionDispatcher dispatcher{&configuration};
        std::vector<PairOfBodies> pairs;

        static btDefaultCollisionConstructionInfo make_info()
        {
            btDefaultCollisionConstructionInfo info;
            info.m_defaultMaxPersistentManifoldPoolSize = 65536;
            info.m_defaultMaxCollisionAlgorithmPoolSize = 65536;
            return info;
        }
        ~Run()
        {
            for (const PairOfBodies& pair : pairs) {
                pair.algorithm->~btCollisionAlgorithm();
                dispatcher.freeCollisionAlgorithm(pair.algorithm);
            }
        }
    };

    void stop()
    {
        runs_.clear();
        objects_.clear();
        shapes_.clear();
    }

    jostle::Executor* executor_ = nullptr;
    BulletShapes shapes_;
    std::vector<std::unique_ptr<btCollisionObject>> objects_;
    std::vector<std::unique_ptr<Run>> runs_;
};

} // namespace

std::unique_ptr<ContactPeer> make_bullet_contacts()
{
    return std::make_unique<BulletContacts>();
}

} // namespace jostle_bench
