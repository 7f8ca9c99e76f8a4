// SPDX-License-Identifier: MIT
#include "tool/scenes/scenes.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>

#include "tool/scenes/random.hpp"

namespace jostle_scenes {

namespace {

enum class Space
{
    cube,  ///< sized for the pairs
    slab,  ///< the last axis 4 long, the others sized for the pairs
    line,  ///< only the first axis has any length
    given, ///< fixed by the way the objects are placed
};

enum class Placing
{
    uniform,
    clumps,
    one_point,
    half_in_one_point,
    lattice,
    lattice_points,
};

double ordinary(Random& random)
{
    return random.uniform(0.9, 1.1);
}
double unit(Random&)
{
    return 1;
}
double zero(Random&)
{
    return 0;
}
double power_law(Random& random)
{
    // 0.25 (1 - u)^(-1/1.6), at most 64. The exponent 5/8 is a product of square roots, which are the same
    // everywhere; std::pow isn't.
    const double root = std::sqrt(1 - random.uniform());
    return std::min(64.0, 0.25 / (root * std::sqrt(std::sqrt(root))));
}
double mixed(Random& random)
{
    return random.uniform() < 0.01 ? random.uniform(10, 30) : random.uniform(0.5, 1.5);
}
double any_size(Random& random)
{
    // As many objects per doubling of the size all the way from 2^-10 to 2^10, which is 1 : 1,048,576.
    const double exponent = random.uniform(-10, 10);
    const double whole = std::floor(exponent);
    return std::ldexp(1 + (exponent - whole), static_cast<int>(whole));
}

struct Recipe
{
    SceneInfo info;
    double (*edge)(Random&) = ordinary; ///< of a box, before each axis is scaled
    bool scale_axes = true;             ///< by U(0.8, 1)
    Space space = Space::cube;
    Placing placing = Placing::uniform;
    double moving = 1;    ///< fraction of the objects
    double sized_for = 0; ///< pairs per object that the world is sized for, where they aren't those of `info`
    bool giant = false;   ///< object 0 holds all others
    bool far = false;     ///< 10^6 (double: 10^9) from the origin
};

constexpr Recipe recipes[] = {
    {.info = {"uniform", "unit boxes evenly spread", 2.16, false}},
    {.info = {"dense", "unit boxes, four times as crowded", 8.6, false}},
    {.info = {"powerlaw", "sizes from 0.25 to 64, ever fewer big ones", 2.0, false}, .edge = power_law},
    {.info = {"mixed", "one in a hundred is 20 times as big", 2.1, false}, .edge = mixed},
    {.info = {"clustered", "unit boxes in clumps", 5.9, false}, .placing = Placing::clumps},
    {.info = {"flat", "unit boxes in a thin layer", 1.95, false}, .space = Space::slab},
    {.info = {"resting", "uniform, but 19 of 20 lie still", 2.16, false}, .moving = 0.05},

    {.info = {"identical", "all boxes the same: n(n-1)/2 pairs", 0, true},
     .space = Space::given,
     .placing = Placing::one_point},
    {.info = {"half-identical", "every second box the same, among uniform ones", 0, true},
     .placing = Placing::half_in_one_point,
     .sized_for = 2.16},
    {.info = {"giant", "uniform, and one box that holds them all", 3.16, true},
     .sized_for = 2.16,
     .giant = true},
    {.info = {"line", "all on one axis", 2.16, true}, .space = Space::line},
    {.info = {"size-range", "sizes 1 : 1,000,000, each as common as the next", 2.0, true}, .edge = any_size},
    {.info = {"far", "uniform, but 10^6 (double: 10^9) from the origin", 0, true},
     .sized_for = 2.16,
     .far = true},
    {.info = {"lattice", "still unit cubes on exact cell borders, each touching all around it", 0, true},
     .edge = unit,
     .scale_axes = false,
     .space = Space::given,
     .placing = Placing::lattice,
     .moving = 0},
    {.info = {"points", "boxes of no size at whole-numbered places", 0, true},
     .edge = zero,
     .scale_axes = false,
     .space = Space::given,
     .placing = Placing::lattice_points},
};

constexpr std::size_t recipe_count = std::size(recipes);

const Recipe& recipe(std::string_view name)
{
    for (const Recipe& candidate : recipes)
        if (candidate.info.name == name) return candidate;
    std::string message = "there is no scene '" + std::string(name) + "'; there are";
    for (const Recipe& candidate : recipes)
        message += (&candidate == recipes ? " " : ", ") + std::string(candidate.info.name);
    throw std::invalid_argument(message);
}

/// Cube root by Newton's method: std::cbrt differs between libraries.
double cube_root(double x)
{
    if (x <= 0) return 0;
    int exponent = 0;
    (void)std::frexp(x, &exponent);
    double root = std::ldexp(1, exponent / 3 + 1); // above the root, so that the steps go down
    for (double next = root;; root = next) {
        next = (2 * root + x / (root * root)) / 3;
        if (!(next < root)) return root;
    }
}
double root(int dim, double x)
{
    return dim == 2 ? std::sqrt(x) : cube_root(x);
}

// What each stream of random numbers is drawn for.
enum Purpose : std::uint64_t
{
    for_size,
    for_place,
    for_velocity,
    for_clumps,
};

/// The probability that two boxes overlap on one axis is, for w = the sum of their edges, a polynomial in w
/// of degree 2: linear * w + quadratic * w^2.
struct AxisOdds
{
    double constant, linear, quadratic;
    /// Both centres uniform in [0, extent].
    static AxisOdds uniform(double extent)
    {
        if (extent <= 0) return {1, 0, 0};
        return {0, 1 / extent, -1 / (4 * extent * extent)};
    }
};

/// The sums over all objects of products of powers (0, 1, 2) of their edges. With them the expected number of
/// pairs, a sum over all pairs of objects, costs nothing, whatever the size of the world.
template <int Dim>
class Edges
{
  public:
    void add(const std::array<double, Dim>& edges)
    {
        ++count_;
        std::array<double, terms> products{1};
        std::size_t size = 1;
        for (const double edge : edges) {
            for (std::size_t k = 0; k < size; ++k) {
                products[k + size] = products[k] * edge;
                products[k + 2 * size] = products[k] * edge * edge;
            }
            size *= 3;
        }
        for (std::size_t k = 0; k < terms; ++k)
            sums_[k] += products[k];
    }

    /// Expected pairs per object when two objects overlap on each axis with the given odds, independently.
    double pairs_per_object(const std::array<AxisOdds, Dim>& odds) const
    {
        // w = s + t: w^2 = s^2 + 2 s t + t^2, so that the sum over all (s, t) is a sum of products of sums.
        double all = 0;
        for (std::size_t i = 0; i < terms; ++i)
            for (std::size_t j = 0; j < terms; ++j) {
                double factor = 1;
                std::size_t p = i, q = j; // the powers of s and of t, axis by axis, as digits to base 3
                for (const AxisOdds& axis : odds) {
                    const std::size_t degree = p % 3 + q % 3;
                    factor *= degree == 0   ? axis.constant
                              : degree == 1 ? axis.linear
                              : degree == 2 ? axis.quadratic * (p % 3 == 1 ? 2 : 1)
                                            : 0;
                    p /= 3, q /= 3;
                }
                all += factor * sums_[i] * sums_[j];
            }
        // Less every object with itself: w = 2 s.
        double self = 0;
        for (std::size_t i = 0; i < terms; ++i) {
            double factor = 1;
            std::size_t p = i;
            for (const AxisOdds& axis : odds) {
                factor *= p % 3 == 0 ? axis.constant : p % 3 == 1 ? 2 * axis.linear : 4 * axis.quadratic;
                p /= 3;
            }
            self += factor * sums_[i];
        }
        return (all - self) / (2 * static_cast<double>(count_));
    }

    double mean() const { return sums_[1] / static_cast<double>(count_); }

  private:
    static constexpr std::size_t terms = Dim == 2 ? 9 : 27;
    std::array<double, terms> sums_{};
    std::size_t count_ = 0;
};

/// sqrt(n)/4 clumps, each with 3 objects per unit volume at its centre.
struct Clumps
{
    std::uint32_t count;
    double deviation;

    Clumps(int dim, std::size_t objects)
        : count(std::max(1u, static_cast<std::uint32_t>(std::sqrt(static_cast<double>(objects)) / 4)))
    {
        // A normal distribution is 1 / (sqrt(2 pi) deviation)^dim at its centre.
        const double members = static_cast<double>(objects) / count;
        deviation = root(dim, members / 3) / std::sqrt(2 * 3.14159265358979324);
    }

    /// Pairs per object when clump centres are uniform in a cube and members beyond a wall are folded back.
    template <int Dim>
    double pairs_per_object(const Edges<Dim>& edges, double extent) const
    {
        // Members of one clump: their distance on an axis is normal with deviation sqrt(2) times theirs, so
        // their odds are erf(w / 4 deviation), here to the third order with the mean w; a wall that cuts a
        // clump folds it onto itself, which adds w / (2 extent).
        const double spread = edges.mean() / deviation;
        const double inside = (1 - spread * spread / 12) / (2 * std::sqrt(3.14159265358979324) * deviation);
        std::array<AxisOdds, Dim> same, other;
        same.fill({0, inside + 1 / (2 * extent), 0});
        other.fill(AxisOdds::uniform(extent)); // folding leaves the members of all clumps together uniform
        const double share = 1.0 / count;
        return share * edges.pairs_per_object(same) + (1 - share) * edges.pairs_per_object(other);
    }
};

/// The greatest extent at which the expected pairs reach `target`, or `smallest` if none does.
template <class Expected>
double solve_extent(double largest, double smallest, double target, Expected expected)
{
    double hi = largest;
    double lo = hi;
    while (lo > smallest && expected(lo) < target)
        lo = std::exchange(hi, lo) * 0.9;
    if (lo <= smallest) return smallest;
    hi = lo / 0.9;
    for (int i = 0; i < 50; ++i) {
        const double middle = (lo + hi) / 2;
        (expected(middle) < target ? hi : lo) = middle;
    }
    return lo;
}

} // namespace

std::span<const SceneInfo> scene_list() noexcept
{
    static const auto list = [] {
        std::array<SceneInfo, recipe_count> infos{};
        std::transform(std::begin(recipes), std::end(recipes), infos.begin(),
                       [](const Recipe& recipe) { return recipe.info; });
        return infos;
    }();
    return list;
}

const SceneInfo& scene_info(std::string_view name)
{
    return recipe(name).info;
}

template <int Dim, jostle::Coordinate T>
Scene<Dim, T>::Scene(std::string_view name, std::size_t objects, std::uint64_t seed)
{
    const Recipe& scene = recipe(name);
    info_ = &scene.info;
    if (objects > std::numeric_limits<std::uint32_t>::max())
        throw std::invalid_argument("a scene has at most 4294967295 objects, not " + std::to_string(objects));
    bodies_.resize(objects);
    boxes_.resize(objects);
    if (objects == 0) return;

    // Sizes first: the world is made to measure.
    Edges<Dim> edges;
    double biggest = 0;
    for (std::size_t i = 0; i < objects; ++i) {
        Random random(seed, i, for_size);
        const double edge = scene.edge(random);
        std::array<double, Dim> sizes;
        for (std::size_t d = 0; d < Dim; ++d) {
            sizes[d] = scene.scale_axes ? edge * random.uniform(0.8, 1) : edge;
            bodies_[i].half[d] = static_cast<T>(sizes[d] / 2);
            biggest = std::max(biggest, sizes[d]);
        }
        edges.add(sizes);
    }

    const Clumps clumps(Dim, objects);
    std::array<double, Dim> extent{};
    const auto axes = [&](double length) {
        std::array<double, Dim> all{};
        for (std::size_t d = 0; d < Dim; ++d) {
            const bool last = d + 1 == Dim;
            all[d] = scene.space == Space::slab && last    ? 4
                     : scene.space == Space::line && d > 0 ? 0
                                                           : length;
        }
        return all;
    };
    const auto side = static_cast<std::uint32_t>(std::ceil(root(Dim, static_cast<double>(objects)) - 1e-9));
    const auto point_side =
        std::max(1u, static_cast<std::uint32_t>(root(Dim, static_cast<double>(objects) / 4) + 0.5));
    if (scene.space != Space::given) {
        const double most = 4 * biggest * static_cast<double>(objects);
        const double target = scene.sized_for > 0 ? scene.sized_for : scene.info.pairs_per_object;
        extent = axes(solve_extent(most, edges.mean(), target, [&](double length) {
            if (scene.placing == Placing::clumps) return clumps.pairs_per_object(edges, length);
            std::array<AxisOdds, Dim> odds;
            const auto lengths = axes(length);
            std::transform(lengths.begin(), lengths.end(), odds.begin(), AxisOdds::uniform);
            return edges.pairs_per_object(odds);
        }));
    } else if (scene.placing == Placing::one_point) {
        extent.fill(10);
    } else if (scene.placing == Placing::lattice_points) {
        extent.fill(point_side - 1);
    } else {
        extent.fill(side);
    }
    for (std::size_t d = 0; d < Dim; ++d)
        extent_[d] = static_cast<T>(extent[d]);
    // Where neighbouring floats (doubles) are 1/16 (1/2^23) apart.
    if (scene.far) offset_ = sizeof(T) == sizeof(float) ? static_cast<T>(1e6) : static_cast<T>(1e9);

    for (std::size_t i = 0; i < objects; ++i) {
        Body& body = bodies_[i];
        // Objects that are to stay alike draw the numbers of the first.
        const bool alike = scene.placing == Placing::one_point ||
                           (scene.placing == Placing::half_in_one_point && i % 2 == 0);
        const std::size_t stream = alike ? 0 : i;
        if (alike) std::copy(std::begin(bodies_[0].half), std::end(bodies_[0].half), body.half);
        Random place(seed, stream, for_place);
        Random velocity(seed, stream, for_velocity);
        Random clump(seed, scene.placing == Placing::clumps ? place.below(clumps.count) : 0, for_clumps);
        const bool moves = velocity.uniform() < scene.moving;
        for (std::size_t d = 0, rest = i; d < Dim; ++d, rest /= side) {
            double centre = 0, speed = moves && extent[d] > 0 ? velocity.uniform(-0.1, 0.1) : 0;
            switch (scene.placing) {
            case Placing::clumps:
                centre = clump.uniform() * extent[d] + clumps.deviation * place.normal();
                while (centre < 0 || centre > extent[d])
                    centre = centre < 0 ? -centre : 2 * extent[d] - centre;
                break;
            case Placing::lattice:
                centre = static_cast<double>(rest % side) + 0.5;
                break;
            case Placing::lattice_points:
                centre = place.below(point_side);
                // Keeps whole numbers whole.
                speed = extent[d] > 0 ? static_cast<double>(velocity.below(3)) - 1 : 0;
                break;
            case Placing::uniform:
            case Placing::one_point:
            case Placing::half_in_one_point:
                centre = place.uniform() * extent[d];
                break;
            }
            body.centre[d] = std::min(static_cast<T>(centre), extent_[d]);
            body.velocity[d] = static_cast<T>(speed);
        }
    }
    if (scene.giant) {
        for (std::size_t d = 0; d < Dim; ++d) {
            bodies_[0].centre[d] = extent_[d] / 2;
            bodies_[0].half[d] = extent_[d]; // reaches every object wherever both go
            bodies_[0].velocity[d] = 0;
        }
    }
    for (std::size_t i = 0; i < objects; ++i)
        place_box(i);
}

template <int Dim, jostle::Coordinate T>
void Scene<Dim, T>::place_box(std::size_t i) noexcept
{
    const Body& body = bodies_[i];
    for (int d = 0; d < Dim; ++d) {
        boxes_[i].lo[d] = body.centre[d] - body.half[d] + offset_;
        boxes_[i].hi[d] = body.centre[d] + body.half[d] + offset_;
    }
}

template <int Dim, jostle::Coordinate T>
void Scene<Dim, T>::step()
{
    for (std::size_t i = 0; i < bodies_.size(); ++i) {
        Body& body = bodies_[i];
        for (int d = 0; d < Dim; ++d) {
            T next = body.centre[d] + body.velocity[d];
            if (next < 0) {
                next = -next;
                body.velocity[d] = -body.velocity[d];
            } else if (next > extent_[d]) {
                next = 2 * extent_[d] - next;
                body.velocity[d] = -body.velocity[d];
            }
            body.centre[d] = next;
        }
        place_box(i);
    }
}

template class Scene<2, float>;
template class Scene<2, double>;
template class Scene<3, float>;
template class Scene<3, double>;

} // namespace jostle_scenes
