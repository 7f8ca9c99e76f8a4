// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <initializer_list>
#include <memory>
#include <random>
#include <type_traits>
#include <utility>
#include <vector>

#include "jostle/contact.hpp"

/// Random numbers that are the same everywhere, or a fuzzer's.
class Random
{
  public:
    explicit Random(std::uint64_t seed) : engine_(std::mt19937_64(seed)) {}
    explicit Random(std::function<std::uint64_t()> engine) : engine_(std::move(engine)) {}
    double uniform(double lo, double hi)
    {
        return lo + (hi - lo) * (static_cast<double>(engine_() >> 11) * 0x1p-53);
    }
    std::uint32_t below(std::uint32_t n) { return static_cast<std::uint32_t>(engine_() % n); }
    bool chance(double p) { return uniform(0, 1) < p; }
    template <class T>
    std::array<T, 4> rotation()
    {
        std::array<double, 4> q{};
        double size = 0;
        while (size < 0.01 || size > 1) {
            size = 0;
            for (double& x : q)
                x = uniform(-1, 1), size += x * x;
        }
        std::array<T, 4> r{};
        for (std::size_t i = 0; i < 4; ++i)
            r[i] = static_cast<T>(q[i] / std::sqrt(size));
        return r;
    }
    /// Often one of the rotations that make faces and edges parallel.
    template <class T>
    jostle::Pose<3, T> pose(double spread)
    {
        jostle::Pose<3, T> p;
        for (T& x : p.position)
            x = static_cast<T>(uniform(-spread, spread));
        switch (below(4)) {
        case 0: // as it is
            break;
        case 1: { // about one axis
            const double angle = uniform(-3.2, 3.2);
            p.rotation = {};
            p.rotation[below(3)] = static_cast<T>(std::sin(angle / 2));
            p.rotation[3] = static_cast<T>(std::cos(angle / 2));
            break;
        }
        default:
            p.rotation = rotation<T>();
        }
        if (chance(0.2)) // on a lattice: touching, in one place
            for (T& x : p.position)
                x = static_cast<T>(std::round(static_cast<double>(x)));
        return p;
    }

    template <class T>
    jostle::Pose<2, T> pose2(double spread)
    {
        jostle::Pose<2, T> p;
        for (T& x : p.position)
            x = static_cast<T>(chance(0.2) ? std::round(uniform(-spread, spread)) : uniform(-spread, spread));
        const double quarter = chance(0.3) ? std::round(uniform(-2, 2)) : uniform(-2, 2);
        p.rotation = {static_cast<T>(std::cos(quarter * 1.5707963267948966)),
                      static_cast<T>(std::sin(quarter * 1.5707963267948966))};
        return p;
    }

  private:
    std::function<std::uint64_t()> engine_;
};

template <int Dim, class T>
jostle::Pose<Dim, T> random_pose(Random& random, double spread)
{
    if constexpr (Dim == 3)
        return random.pose<T>(spread);
    else
        return random.pose2<T>(spread);
}

/// contacts() with ContactOptions::all_points.
template <int Dim, class T>
std::vector<jostle::Contact<Dim, T>>
all_contacts(const jostle::Shape<Dim>& a, const jostle::Pose<Dim, T>& pose_a, const jostle::Shape<Dim>& b,
             const jostle::Pose<Dim, T>& pose_b, std::type_identity_t<T> margin = 0)
{
    static jostle::ContactFinder<Dim, T> finder([] {
        jostle::ContactOptions options;
        options.executor = &jostle::serial_executor();
        options.all_points = true;
        return options;
    }());
    const std::vector<jostle::Shape<Dim>> shapes = {a, b};
    const std::vector<jostle::Pose<Dim, T>> poses = {pose_a, pose_b};
    return finder.find({shapes, poses}, std::vector<jostle::Pair>{{0, 1}}, margin).to_vector();
}

/// One of everything there is, with whatever it points to.
template <int Dim>
struct Zoo
{
    std::vector<std::unique_ptr<jostle::ConvexHull<Dim>>> hulls;
    std::vector<std::unique_ptr<jostle::Mesh<Dim>>> meshes;
    std::vector<std::unique_ptr<jostle::HeightField>> fields;
    std::vector<std::unique_ptr<jostle::Compound<Dim>>> compounds;
    std::vector<jostle::Shape<Dim>> shapes;

    Zoo(Random& random, int of_each, bool degenerate = true)
    {
        using namespace jostle;
        constexpr std::size_t dim = Dim;
        const auto size = [&] { return degenerate && random.chance(0.1) ? 0.0 : random.uniform(0.1, 1); };
        const auto point = [&](double spread) {
            Vec<Dim, double> p;
            for (double& x : p)
                x = degenerate && random.chance(0.3) ? std::round(random.uniform(-spread, spread))
                                                     : random.uniform(-spread, spread);
            return p;
        };
        for (int i = 0; i < of_each; ++i) {
            shapes.push_back(Shape<Dim>::sphere(size()));
            shapes.push_back(Shape<Dim>::capsule(size(), size()));
            Vec<Dim, double> half;
            for (double& h : half)
                h = size();
            shapes.push_back(Shape<Dim>::box(half));
            std::vector<Vec<Dim, double>> points(degenerate ? 1 + random.below(20) : 20);
            for (auto& p : points)
                p = point(1);
            hulls.push_back(std::make_unique<ConvexHull<Dim>>(points));
            shapes.push_back(*hulls.back());
            shapes.push_back(Shape<Dim>::rounded_box(half, size()));
            shapes.push_back(Shape<Dim>::rounded_hull(*hulls.back(), size()));
            for (double& h : half)
                h = size();
            shapes.push_back(Shape<Dim>::ellipsoid(half));
            if constexpr (Dim == 3) {
                shapes.push_back(Shape<3>::cylinder(size(), size()));
                shapes.push_back(Shape<3>::cone(size(), size()));
            }
            Vec<Dim, double> normal{};
            while (normal == Vec<Dim, double>{})
                normal = point(1);
            shapes.push_back(Shape<Dim>::half_space(normal, random.uniform(-1, 1)));
            std::vector<typename Mesh<Dim>::Element> elements(12);
            std::vector<Vec<Dim, double>> vertices(10);
            for (auto& p : vertices)
                p = point(1.5);
            for (auto& e : elements)
                for (std::size_t k = 0; k < dim; ++k)
                    e[k] = random.below(10);
            meshes.push_back(std::make_unique<Mesh<Dim>>(vertices, elements));
            shapes.push_back(*meshes.back());
            std::vector<typename Compound<Dim>::Child> children;
            for (const ShapeType type :
                 {ShapeTypes::sphere, ShapeTypes::capsule, ShapeTypes::box, ShapeTypes::convex,
                  ShapeTypes::rounded_box, ShapeTypes::ellipsoid}) {
                if constexpr (Dim == 3)
                    children.push_back({last(type), random.pose<double>(1)});
                else
                    children.push_back({last(type), random.pose2<double>(1)});
            }
            compounds.push_back(std::make_unique<Compound<Dim>>(children));
            shapes.push_back(*compounds.back());
            if constexpr (Dim == 3) {
                std::vector<double> heights(20);
                for (double& h : heights)
                    h = random.uniform(-0.3, 0.3);
                fields.push_back(std::make_unique<HeightField>(HeightGrid<double>{heights, 5, 4, 0.7, 0.9}));
                shapes.push_back(*fields.back());
            }
        }
    }
    /// Any shape, or any of these types.
    const jostle::Shape<Dim>& any(Random& random) const
    {
        return shapes[random.below(static_cast<std::uint32_t>(shapes.size()))];
    }
    const jostle::Shape<Dim>& any(Random& random, std::initializer_list<jostle::ShapeType> types) const
    {
        while (true) {
            const jostle::Shape<Dim>& shape = any(random);
            if (std::find(types.begin(), types.end(), shape.type()) != types.end()) return shape;
        }
    }

  private:
    const jostle::Shape<Dim>& last(jostle::ShapeType type) const
    {
        return *std::find_if(shapes.rbegin(), shapes.rend(),
                             [&](const jostle::Shape<Dim>& shape) { return shape.type() == type; });
    }
};
