// SPDX-License-Identifier: MIT
// What all WebAssembly modules but jostle-pairs and jostle-bush export as well: the chapter's grid to compare
// with, the engine's bricks for those who want to see them, and scenes.

#include <algorithm>
#include <bit>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <string_view>
#include <vector>

#include "engine/brick_store.hpp"
#include "engine/sample.hpp"
#include "engine/scatter.hpp"
#include "engine/tuner.hpp"
#include "extras/js/module.hpp"
#include "jostle/chapter.hpp"
#include "jostle/jostle.h"
#include "tool/scenes/scenes.hpp"

// ---- Other engines, to compare with ------------------------------------------------------------------

namespace {

using jostle::c_api::guarded;
using jostle::c_api::in_space;
using jostle::c_api::refuse;
using jostle_js::Info;

template <int Dim, class T>
jostle::BoxView<Dim, T> packed(const void* boxes, std::uint32_t count)
{
    return std::span(static_cast<const jostle::Aabb<Dim, T>*>(boxes), count);
}

enum class Engine
{
    chapter = 1,
    uniform = 2,
    brute = 3
};

template <int Dim, class T>
std::vector<jostle::Pair> find_uniform(const jostle::BoxView<Dim, T>& boxes, double cell_size,
                                       jostle::Executor& executor)
{
    namespace chapter = jostle::chapter;
    jostle::check_boxes(boxes);
    double cell = cell_size;
    for (std::size_t i = 0; cell_size == 0 && i < boxes.size(); ++i)
        for (int d = 0; d < Dim; ++d)
            cell = std::max(cell, double{boxes.hi(d, i)} - double{boxes.lo(d, i)});
    chapter::GridOptions<T> options;
    // An edge that rounds down wouldn't hold its box; points need some cell, too.
    options.cell_sizes = {cell > 0 ? static_cast<T>(cell * (1 + 1e-6)) : T{1}};
    options.buckets = static_cast<std::uint32_t>(std::bit_ceil(std::max<std::size_t>(boxes.size(), 16)));
    chapter::Grid<Dim, T> grid(options);
    for (std::size_t i = 0; i < boxes.size(); ++i)
        grid.add(boxes[i]);
    const auto pairs = grid.detect_proximity(executor);
    return {pairs.begin(), pairs.end()};
}

} // namespace

/// All pairs among packed boxes, by another engine. `found->items` is the caller's to free().
JOSTLE_JS jostle_status jostle_js_find(jostle_space space, const void* boxes, std::uint32_t count,
                                       std::uint32_t engine, double cell_size,
                                       const jostle_executor* executor, jostle_block* found,
                                       jostle_error* error)
{
    return guarded(error, [&] {
        in_space(space, [&](auto in) {
            constexpr int dim = decltype(in)::dim;
            using T = typename decltype(in)::T;
            const auto view = packed<dim, T>(boxes, count);
            const auto with = jostle::c_api::keep_executor(executor);
            jostle::Executor& on = with == nullptr ? jostle::serial_executor() : *with;
            std::vector<jostle::Pair> pairs;
            switch (static_cast<Engine>(engine)) {
            case Engine::chapter:
                pairs = jostle::chapter::find_pairs(view, on);
                break;
            case Engine::uniform:
                pairs = find_uniform(view, cell_size, on);
                break;
            case Engine::brute:
                pairs = jostle::find_pairs_brute_force(view);
                break;
            default:
                refuse("there is no engine " + std::to_string(engine));
            }
            void* const memory = std::malloc(pairs.size() * sizeof(jostle::Pair) + 1);
            if (memory == nullptr) throw std::bad_alloc();
            if (!pairs.empty()) std::memcpy(memory, pairs.data(), pairs.size() * sizeof(jostle::Pair));
            *found = {memory, pairs.size()};
        });
    });
}

// ---- Bricks ------------------------------------------------------------------------------------------

namespace {

/// The engine's outermost grid, and the records that it stores in it.
struct Bricks
{
    struct View
    {
        std::uint32_t bricks, records, sweep_axis, cells[3];
        double origin[3], edge[3];
        const std::uint32_t *at, *first, *objects;
        const std::uint8_t* copies;
        const std::uint16_t* bounds;
    } view{};
    std::vector<std::uint32_t> at, first, objects;
    std::vector<std::uint8_t> copies;
    std::vector<std::uint16_t> bounds;
};

template <int Dim, class T>
void fill(Bricks& out, const jostle::BoxView<Dim, T>& view)
{
    namespace engine = jostle::engine;
    jostle::check_boxes(view);
    if (view.size() > engine::index_mask)
        refuse("more boxes than one search of the engine takes", JOSTLE_TOO_MANY_OBJECTS);
    const engine::Boxes<Dim, T> boxes{view, {}, false};
    const auto sample = std::make_unique<engine::Sample>();
    engine::sample_boxes(boxes, *sample);
    const engine::Grid<T> grid = engine::tune<Dim, T>(*sample, view.size()).grid;
    const auto unit = std::make_unique<engine::Unit<T>>();
    engine::BrickStore store(std::pmr::get_default_resource());
    store.clear(grid.bricks());
    engine::Scatter<Dim, T> scatter(engine::kernels_for(jostle::supported_instruction_sets().front()), boxes,
                                    grid, *unit, store);
    for (std::uint32_t u = 0; u < engine::Scatter<Dim, T>::units_of(view.size()); ++u)
        scatter.add_unit(u);
    store.close();

    Bricks::View& to = out.view;
    to.sweep_axis = static_cast<std::uint32_t>(grid.axis[0]);
    for (int p = 0; p < Dim; ++p) {
        const auto axis = static_cast<std::size_t>(grid.axis[p]);
        to.cells[axis] = static_cast<std::uint32_t>(grid.cells[p]);
        to.origin[axis] = double{grid.origin[p]};
        to.edge[axis] = engine::quanta / double{grid.scale[p]};
    }
    out.first.push_back(0);
    for (std::uint32_t brick = 0; brick < grid.bricks(); ++brick) {
        const std::uint32_t count = store.size(brick);
        if (count == 0) continue;
        std::uint32_t rest = brick, place[3] = {0, 0, 0};
        for (int p = 0; p < Dim; ++p) {
            place[grid.axis[p]] = rest % static_cast<std::uint32_t>(grid.cells[p]);
            rest /= static_cast<std::uint32_t>(grid.cells[p]);
        }
        out.at.insert(out.at.end(), place, place + Dim);
        for (std::uint32_t i = 0; i < count; ++i) {
            constexpr std::uint32_t capacity = engine::BrickStore::Chunk::capacity;
            const engine::Record& record = store.chunk(brick, i / capacity)->record[i % capacity];
            out.objects.push_back(record.object & engine::index_mask);
            out.copies.push_back(static_cast<std::uint8_t>(record.object >> engine::index_bits & 7));
            std::uint16_t bounds[2 * Dim];
            for (int p = 0; p < Dim; ++p) {
                const std::uint32_t word = record.axis[p];
                // The high half is -(lo + 1), and 0 where the box began in a lower brick.
                bounds[2 * grid.axis[p]] =
                    static_cast<std::uint16_t>(word >> 16 == 0 ? 0 : 0xffff - (word >> 16));
                bounds[2 * grid.axis[p] + 1] = static_cast<std::uint16_t>((word & 0xffff) - 1);
            }
            out.bounds.insert(out.bounds.end(), bounds, bounds + 2 * Dim);
        }
        out.first.push_back(static_cast<std::uint32_t>(out.objects.size()));
    }
    to.bricks = static_cast<std::uint32_t>(out.first.size()) - 1;
    to.records = static_cast<std::uint32_t>(out.objects.size());
    to.at = out.at.data();
    to.first = out.first.data();
    to.objects = out.objects.data();
    to.copies = out.copies.data();
    to.bounds = out.bounds.data();
}

} // namespace

/// The bricks for packed boxes, by the engine's own plan and scatter. They begin with a Bricks::View.
JOSTLE_JS jostle_status jostle_js_bricks_new(jostle_space space, const void* boxes, std::uint32_t count,
                                             Bricks** out, jostle_error* error)
{
    return guarded(error, [&] {
        auto bricks = std::make_unique<Bricks>();
        in_space(space, [&](auto in) {
            fill(*bricks, packed<decltype(in)::dim, typename decltype(in)::T>(boxes, count));
        });
        *out = bricks.release();
    });
}
JOSTLE_JS void jostle_js_bricks_free(Bricks* bricks)
{
    delete bricks;
}

// ---- Scenes ------------------------------------------------------------------------------------------

namespace {

class AnyScene
{
  public:
    virtual ~AnyScene() = default;
    virtual void step() = 0;
    [[nodiscard]] virtual const void* boxes() const = 0;
};

template <int Dim, class T>
class SceneOf final : public AnyScene
{
  public:
    SceneOf(std::string_view name, std::uint32_t objects, std::uint64_t seed) : scene_(name, objects, seed) {}
    void step() override { scene_.step(); }
    [[nodiscard]] const void* boxes() const override { return scene_.boxes().data(); }

  private:
    jostle_scenes::Scene<Dim, T> scene_;
};

} // namespace

/// Writes what scene `i` is; returns how many there are.
JOSTLE_JS std::uint32_t jostle_js_scene_info(std::uint32_t i, Info* info)
{
    const auto scenes = jostle_scenes::scene_list();
    if (i < scenes.size()) {
        *info = jostle_js::info_of(scenes[i].name, scenes[i].summary);
        info->pairs_per_object = scenes[i].pairs_per_object;
        info->hostile = scenes[i].hostile;
    }
    return static_cast<std::uint32_t>(scenes.size());
}
JOSTLE_JS jostle_status jostle_js_scene_new(jostle_space space, const char* name, std::uint32_t name_size,
                                            std::uint32_t objects, std::uint64_t seed, AnyScene** out,
                                            jostle_error* error)
{
    return jostle_js::guarded_scene(error, [&] {
        in_space(space, [&](auto in) {
            *out = new SceneOf<decltype(in)::dim, typename decltype(in)::T>({name, name_size}, objects, seed);
        });
    });
}
JOSTLE_JS void jostle_js_scene_free(AnyScene* scene)
{
    delete scene;
}
JOSTLE_JS const void* jostle_js_scene_boxes(const AnyScene* scene)
{
    return scene->boxes();
}
JOSTLE_JS jostle_status jostle_js_scene_step(AnyScene* scene, jostle_error* error)
{
    return guarded(error, [&] { scene->step(); });
}
