// SPDX-License-Identifier: MIT

#include "c_api/results.hpp"
#include "jostle/find_pairs.hpp"
#include "jostle/periodic.hpp"

#include <limits>
#include <variant>

namespace jostle::c_api {
namespace {

class FinderContent final : public Content
{
  public:
    explicit FinderContent(Kept given) : kept(std::move(given)), finder(kept.options<FinderOptions>()) {}
    bool release_memory() override
    {
        finder.release_memory();
        return true;
    }

    Kept kept;
    PairFinder finder;
    std::vector<jostle_block> table;
};

/// How a filter of images refers to Filter::images: as values of a second set, of which there are none in
/// such a search, with a stride that no values have. A member of its own would change the binary interface.
jostle_values images_mark(const void* rule)
{
    return {rule, 0, std::numeric_limits<std::int64_t>::min()};
}

/// A search's arguments, as the C++ interface wants them.
class Search
{
  public:
    explicit Search(const jostle_filter* given) : given_(read_options(given, "jostle_filter")) {}

    [[nodiscard]] Filter filter()
    {
        if (given_.category_b.count != 0 || given_.mask_b.count != 0 || given_.owner_b.count != 0)
            refuse("a filter for one set has values for a second one");
        Filter filter;
        filter.category = view<std::uint32_t>(given_.category, "category");
        filter.mask = view<std::uint32_t>(given_.mask, "mask");
        filter.owner = view<std::uint32_t>(given_.owner, "owner");
        if (given_.accept != nullptr) filter.accept = accept_;
        filter.ghosts = given_.ghosts;
        filter.vertices = view<std::array<std::uint32_t, 3>>(given_.vertices, "vertices");
        if (is_of_images()) filter.images = static_cast<const ImageRule*>(given_.owner_b.data);
        return filter;
    }
    [[nodiscard]] CrossFilter cross_filter()
    {
        if (is_of_images()) refuse("a filter of images is for a search within one set");
        if (given_.ghosts != 0 || given_.vertices.count != 0)
            refuse("a filter with ghosts or vertices is for a search within one set");
        CrossFilter filter;
        filter.category_a = view<std::uint32_t>(given_.category, "category");
        filter.mask_a = view<std::uint32_t>(given_.mask, "mask");
        filter.owner_a = view<std::uint32_t>(given_.owner, "owner");
        filter.category_b = view<std::uint32_t>(given_.category_b, "category_b");
        filter.mask_b = view<std::uint32_t>(given_.mask_b, "mask_b");
        filter.owner_b = view<std::uint32_t>(given_.owner_b, "owner_b");
        if (given_.accept != nullptr) filter.accept = accept_;
        return filter;
    }

  private:
    [[nodiscard]] bool is_of_images() const
    {
        const jostle_values mark = images_mark(given_.owner_b.data);
        return given_.owner_b.count == mark.count && given_.owner_b.stride == mark.stride;
    }
    struct Accept
    {
        const jostle_filter* given;
        bool operator()(std::uint32_t a, std::uint32_t b) const
        {
            return agreed(given->accept(given->context, a, b));
        }
    };
    jostle_filter given_;
    Accept accept_{&given_};
};

class ImagesContent final : public Content
{
  public:
    ImagesContent(jostle_space given, const Kept& with) : kept(with)
    {
        in_space(given, [&](auto in) {
            using Images = PeriodicImages<decltype(in)::dim, typename decltype(in)::T>;
            images.emplace<Images>(kept.options<FinderOptions>());
        });
    }
    Kept kept;
    InSomeSpace<PeriodicImages<2, float>, PeriodicImages<3, float>, PeriodicImages<2, double>,
                PeriodicImages<3, double>>
        images;
    // Of the last filter.
    jostle_filter of_originals{};
    Filter of_all;
    const std::uint32_t* origin = nullptr;

    /// Calls inside(images).
    template <class F>
    void visit(F&& inside)
    {
        on_held(images, inside);
    }
    static std::int32_t accept(void* context, std::uint32_t a, std::uint32_t b) noexcept
    {
        const auto& self = *static_cast<const ImagesContent*>(context);
        return self.of_originals.accept(self.of_originals.context, self.origin[a], self.origin[b]);
    }
};

template <class T>
jostle_values values_of(const StridedView<T>& view)
{
    if (view.empty()) return {};
    return {&view[0], view.size(), sizeof(T)};
}

Order order_of(jostle_order order)
{
    if (order != JOSTLE_CANONICAL && order != JOSTLE_SORTED)
        refuse("the order is " + std::to_string(order) + ": it must be JOSTLE_CANONICAL or JOSTLE_SORTED");
    return order == JOSTLE_SORTED ? Order::sorted : Order::canonical;
}

/// Calls one(a, filter) or two(a, b, filter).
template <class One, class Two>
void search(jostle_space space, const jostle_boxes* a, const jostle_boxes* b, const jostle_filter* filter,
            One&& one, Two&& two)
{
    Search given(filter);
    in_space(space, [&](auto in) {
        constexpr int dim = decltype(in)::dim;
        using T = typename decltype(in)::T;
        const BoxView<dim, T> first = view<dim, T>(a, "a");
        if (b == nullptr)
            one(first, given.filter());
        else
            two(first, view<dim, T>(b, "b"), given.cross_filter());
    });
}

} // namespace

template <>
struct Behind<jostle_finder> : Kind<FinderContent, 0x03>
{
    static constexpr const char* name = "jostle_finder";
};

template <>
struct Behind<jostle_images> : Kind<ImagesContent, 0x10>
{
    static constexpr const char* name = "jostle_images";
};

} // namespace jostle::c_api

using namespace jostle;
using namespace jostle::c_api;

extern "C" {

jostle_status jostle_finder_new(const jostle_options* options, jostle_finder** out, jostle_error* error)
{
    return guarded(error, [&] {
        wanted(out, "out");
        hand_out(out, std::make_unique<FinderContent>(keep(options)));
    });
}

jostle_status jostle_finder_find(jostle_finder* finder, jostle_space space, const jostle_boxes* a,
                                 const jostle_boxes* b, const jostle_filter* filter, jostle_order order,
                                 jostle_blocks* pairs, jostle_error* error)
{
    return guarded(error, [&] {
        FinderContent& content = open(finder);
        wanted(pairs, "pairs");
        const Order wanted_order = order_of(order);
        const auto list = [&](const PairBuffer& found) {
            *pairs = list_blocks<Pair>(found.blocks(), found.size(), content.table);
        };
        search(
            space, a, b, filter,
            [&](const auto& boxes, const Filter& wish) {
                list(content.finder.find(boxes, wish, wanted_order));
            },
            [&](const auto& first, const auto& second, const CrossFilter& wish) {
                list(content.finder.find(first, second, wish, wanted_order));
            });
    });
}

jostle_status jostle_finder_take(jostle_finder* finder, jostle_space space, const jostle_boxes* a,
                                 const jostle_boxes* b, const jostle_filter* filter, jostle_order order,
                                 jostle_results* results, jostle_error* error)
{
    return guarded(error, [&] {
        FinderContent& content = open(finder);
        ResultsContent& into = open(results);
        const Order wanted_order = order_of(order);
        into.begin();
        search(
            space, a, b, filter,
            [&](const auto& boxes, const Filter& wish) {
                into.take(content.finder.take(boxes, wish, wanted_order), content.kept.memory);
            },
            [&](const auto& first, const auto& second, const CrossFilter& wish) {
                into.take(content.finder.take(first, second, wish, wanted_order), content.kept.memory);
            });
    });
}

jostle_status jostle_finder_find_scenes(jostle_finder* finder, jostle_space space, const jostle_boxes* boxes,
                                        const uint64_t* offsets, uint64_t scene_count,
                                        const jostle_scene_filter* filter, jostle_blocks* pairs,
                                        jostle_error* error)
{
    return guarded(error, [&] {
        FinderContent& content = open(finder);
        wanted(pairs, "pairs");
        const std::span<const std::uint64_t> all_offsets = offsets_of(offsets, scene_count, "scene_count");
        const jostle_scene_filter given = read_options(filter, "jostle_scene_filter");
        const auto accept = [&](std::size_t scene, std::uint32_t a, std::uint32_t b) {
            return agreed(given.accept(given.context, scene, a, b));
        };
        SceneFilter wish;
        wish.category = view<std::uint32_t>(given.category, "category");
        wish.mask = view<std::uint32_t>(given.mask, "mask");
        wish.owner = view<std::uint32_t>(given.owner, "owner");
        if (given.accept != nullptr) wish.accept = accept;
        in_space(space, [&](auto in) {
            const ScenePairs& found = content.finder.find_scenes(
                view<decltype(in)::dim, typename decltype(in)::T>(boxes, "boxes"), all_offsets, wish);
            content.table.clear();
            content.table.reserve(found.scenes());
            for (std::size_t scene = 0; scene < found.scenes(); ++scene)
                content.table.push_back({found[scene].data(), found[scene].size()});
            *pairs = {content.table.data(), content.table.size(), found.size(), sizeof(Pair)};
        });
    });
}

jostle_status jostle_finder_stream(jostle_finder* finder, jostle_space space, const jostle_boxes* a,
                                   const jostle_boxes* b, const jostle_filter* filter,
                                   jostle_sink_function sink, void* context, int32_t* finished,
                                   jostle_error* error)
{
    return guarded(error, [&] {
        FinderContent& content = open(finder);
        wanted_function(sink, "sink");
        wanted(finished, "finished");
        const auto hand_over = [&](const PairChunk& chunk) {
            return agreed(sink(context, reinterpret_cast<const jostle_pair*>(chunk.pairs.data()),
                               chunk.pairs.size(), chunk.block, chunk.part));
        };
        bool to_the_end = true;
        search(
            space, a, b, filter,
            [&](const auto& boxes, const Filter& wish) {
                to_the_end = content.finder.stream(boxes, hand_over, wish);
            },
            [&](const auto& first, const auto& second, const CrossFilter& wish) {
                to_the_end = content.finder.stream(first, second, hand_over, wish);
            });
        *finished = to_the_end ? 1 : 0;
    });
}

jostle_status jostle_finder_stats(const jostle_finder* finder, jostle_stats* stats, jostle_error* error)
{
    return guarded(error, [&] {
        const Stats s = open(finder).finder.stats();
        write_stats(stats,
                    jostle_stats{0, s.objects, s.pairs, s.records, s.candidates, s.ties, s.bricks,
                                 s.nested_grids, s.bytes_reserved, s.ms_total, s.ms_tune, s.ms_scatter,
                                 s.ms_sweep, s.ms_finish},
                    "jostle_stats");
    });
}

jostle_status jostle_find_pairs(jostle_space space, const jostle_boxes* a, const jostle_boxes* b,
                                const jostle_filter* filter, jostle_order order,
                                const jostle_options* options, jostle_results* results, jostle_error* error)
{
    return guarded(error, [&] {
        ResultsContent& into = open(results);
        const Kept kept = keep(options);
        const Order wanted_order = order_of(order);
        into.begin();
        search(
            space, a, b, filter,
            [&](const auto& boxes, const Filter& wish) {
                into.take(find_pairs(boxes, wish, wanted_order, kept.options<FinderOptions>()), kept.memory);
            },
            [&](const auto& first, const auto& second, const CrossFilter& wish) {
                into.take(find_pairs(first, second, wish, wanted_order, kept.options<FinderOptions>()),
                          kept.memory);
            });
    });
}

jostle_status jostle_find_pairs_brute_force(jostle_space space, const jostle_boxes* a, const jostle_boxes* b,
                                            const jostle_filter* filter, jostle_results* results,
                                            jostle_error* error)
{
    return guarded(error, [&] {
        ResultsContent& into = open(results);
        into.begin();
        search(
            space, a, b, filter,
            [&](const auto& boxes, const Filter& wish) { into.pairs = find_pairs_brute_force(boxes, wish); },
            [&](const auto& first, const auto& second, const CrossFilter& wish) {
                into.pairs = find_pairs_brute_force(first, second, wish);
            });
        into.show(std::span<const Pair>(into.pairs));
    });
}

jostle_status jostle_images_new(jostle_space space, const jostle_options* options, jostle_images** out,
                                jostle_error* error)
{
    return guarded(error, [&] {
        wanted(out, "out");
        hand_out(out, std::make_unique<ImagesContent>(space, keep(options)));
    });
}

jostle_status jostle_images_build(jostle_images* images, const jostle_boxes* boxes, const void* period,
                                  jostle_error* error)
{
    return guarded(error, [&] {
        open(images).visit([&]<int Dim, class T>(PeriodicImages<Dim, T>& each) {
            const T* const lengths = wanted_array_of<T>(period, Dim, "period");
            Vec<Dim, T> along;
            std::copy_n(lengths, Dim, along.data());
            each.build(view<Dim, T>(boxes, "boxes"), along);
        });
    });
}

jostle_status jostle_images_view_read(const jostle_images* images, jostle_images_view* out,
                                      jostle_error* error)
{
    return guarded(error, [&] {
        ImagesContent& content = open(images);
        wanted(out, "out");
        content.visit([&]<int Dim, class T>(const PeriodicImages<Dim, T>& each) {
            jostle_images_view read{};
            if (!each.boxes().empty())
                for (std::size_t d = 0; d < Dim; ++d) {
                    read.boxes.lo[d] = each.boxes().front().lo.data() + d;
                    read.boxes.hi[d] = each.boxes().front().hi.data() + d;
                }
            read.boxes.count = each.boxes().size();
            read.boxes.stride = sizeof(Aabb<Dim, T>);
            read.origin = each.origin().data();
            read.shift = each.shift().data();
            read.originals = each.originals();
            *out = read;
        });
    });
}

jostle_status jostle_images_filter(jostle_images* images, const jostle_filter* originals, jostle_filter* out,
                                   jostle_error* error)
{
    return guarded(error, [&] {
        ImagesContent& content = open(images);
        wanted(out, "out");
        jostle_filter given = read_options(originals, "jostle_filter");
        const jostle_accept_pair_function accept = std::exchange(given.accept, nullptr);
        Search search(&(given.struct_size = sizeof given, given));
        content.visit([&](auto& each) {
            content.of_all = each.filter(search.filter());
            content.origin = each.origin().data();
        });
        given.accept = accept;
        content.of_originals = given;
        jostle_filter all{};
        all.struct_size = sizeof all;
        all.category = values_of(content.of_all.category);
        all.mask = values_of(content.of_all.mask);
        all.owner = values_of(content.of_all.owner);
        all.vertices = values_of(content.of_all.vertices);
        all.owner_b = images_mark(content.of_all.images);
        if (accept != nullptr) {
            all.accept = ImagesContent::accept;
            all.context = &content;
        }
        *out = all;
    });
}

} // extern "C"
