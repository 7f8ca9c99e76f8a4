// SPDX-License-Identifier: MIT
#include <iterator>
#include <optional>
#include <vector>

#include "core/interrupts.hpp"
#include "core/module.hpp"
#include "core/pair_groups.hpp"
#include "core/shapes.hpp"
#include "core/users.hpp"

namespace jostle_python {

namespace {

template <class Contact>
void clear_unused(Contact* contacts, std::uint64_t count)
{
    for (std::uint64_t i = 0; i < count; ++i)
        for (std::size_t k = contacts[i].count; k < std::size(contacts[i].point); ++k)
            contacts[i].point[k] = {};
}

class ContactFinder
{
  public:
    ContactFinder(jostle_space given, bool all_points, std::uint32_t threads) : space(given)
    {
        const Executor executor = executor_of(threads);
        jostle_options options = options_of(executor, memory.allocator());
        options.all_points = all_points ? 1 : 0;
        handle = make<ContactFinderHandle>(
            [&](auto** out, auto* error) { return jostle_contact_finder_new(space, &options, out, error); });
    }
    /// What a call is about, and that the finder is in use while it lasts.
    struct Given
    {
        Given(Users& users, jostle_space space, const Shapes& shapes_a, const py::array& rows_a,
              const Shapes* shapes_b, const std::optional<py::array>& rows_b,
              const Packed<std::uint32_t>& pairs, bool moving)
            : now(users), a(shapes_a, rows_a, space, moving, moving ? "motions" : "poses"), all(pairs)
        {
            if ((shapes_b != nullptr) != rows_b.has_value()) refuse("a second set needs shapes and poses");
            if (shapes_b != nullptr)
                b.emplace(*shapes_b, *rows_b, space, moving, moving ? "motions_b" : "poses_b");
        }
        Users::Changing now;
        Objects a;
        std::optional<Objects> b;
        Pairs all;
    };
    /// Calls f(a, b or null, some of the pairs, the number of the first of these, error).
    template <class F>
    void work_in_parts(const Shapes& shapes_a, const py::array& rows_a, const Shapes* shapes_b,
                       const std::optional<py::array>& rows_b, const Packed<std::uint32_t>& pairs,
                       bool moving, F&& f)
    {
        const Given given(users, space, shapes_a, rows_a, shapes_b, rows_b, pairs, moving);
        for_parts(given.all, [&](auto* some, std::uint64_t first, auto* error) {
            return f(&given.a.view, given.b ? &given.b->view : nullptr, some, first, error);
        });
    }
    template <class F>
    static void for_parts(const Pairs& all, F&& f)
    {
        call_in_parts(
            all.block.count, nullptr, [&](std::uint64_t first, std::uint64_t count, jostle_error* error) {
                const jostle_block block{static_cast<const jostle_pair*>(all.block.items) + first, count};
                const jostle_blocks some{&block, 1, count, sizeof(jostle_pair)};
                return f(&some, first, error);
            });
    }
    py::array find(const Shapes& shapes_a, const py::array& poses_a, const Shapes* shapes_b,
                   const std::optional<py::array>& poses_b, const Packed<std::uint32_t>& pairs, double margin,
                   const py::dtype& type)
    {
        py::array out =
            found(jostle_contact_finder_find, shapes_a, poses_a, shapes_b, poses_b, pairs, margin, type);
        // The points that a contact doesn't have are whatever memory held; an array shows them.
        void* const data = out.mutable_data();
        const auto count = static_cast<std::uint64_t>(out.shape(0));
        switch (space) {
        case JOSTLE_2F:
            clear_unused(static_cast<jostle_contact_2f*>(data), count);
            break;
        case JOSTLE_3F:
            clear_unused(static_cast<jostle_contact_3f*>(data), count);
            break;
        case JOSTLE_2D:
            clear_unused(static_cast<jostle_contact_2d*>(data), count);
            break;
        default:
            clear_unused(static_cast<jostle_contact_3d*>(data), count);
        }
        return out;
    }
    py::array find_points(const Shapes& shapes_a, const py::array& poses_a, const Shapes* shapes_b,
                          const std::optional<py::array>& poses_b, const Packed<std::uint32_t>& pairs,
                          double margin, const py::dtype& type)
    {
        return found(jostle_contact_finder_find_points, shapes_a, poses_a, shapes_b, poses_b, pairs, margin,
                     type);
    }
    /// What a search finds, copied out of the finder's memory before another one may begin.
    template <class Search>
    py::array found(const Search& search, const Shapes& shapes_a, const py::array& poses_a,
                    const Shapes* shapes_b, const std::optional<py::array>& poses_b,
                    const Packed<std::uint32_t>& pairs, double margin, const py::dtype& type)
    {
        jostle_blocks contacts{};
        const Given given(users, space, shapes_a, poses_a, shapes_b, poses_b, pairs, false);
        memory.call([&](jostle_error* error) {
            return search(handle.get(), &given.a.view, given.b ? &given.b->view : nullptr, &given.all.all,
                          margin, &contacts, error);
        });
        if (contacts.item_size != static_cast<std::uint64_t>(type.itemsize()))
            refuse("the dtype isn't a contact's");
        py::array out(type, std::vector<py::ssize_t>{static_cast<py::ssize_t>(contacts.count)});
        void* const data = out.mutable_data();
        call([&](jostle_error* error) { return jostle_blocks_copy(&contacts, contacts.count, data, error); });
        return out;
    }
    py::array rows(const Shapes& shapes_a, const py::array& rows_a, const Shapes* shapes_b,
                   const std::optional<py::array>& rows_b, const Packed<std::uint32_t>& pairs, double limit,
                   bool moving)
    {
        py::array out(number_of(space), {pairs.shape(0), py::ssize_t(3 * dim_of(space) + 1)});
        auto* const data = static_cast<char*>(out.mutable_data());
        const py::ssize_t row = out.strides(0);
        work_in_parts(
            shapes_a, rows_a, shapes_b, rows_b, pairs, moving,
            [&](auto* a, auto* b, auto* some, std::uint64_t first, auto* error) {
                void* const rows = data + first * static_cast<std::uint64_t>(row);
                return moving ? jostle_contact_finder_impacts(handle.get(), a, b, some, limit, rows, error)
                              : jostle_contact_finder_distances(handle.get(), a, b, some, limit, rows, error);
            });
        return out;
    }
    py::array touching(const Shapes& shapes_a, const py::array& poses_a, const Shapes* shapes_b,
                       const std::optional<py::array>& poses_b, const Packed<std::uint32_t>& pairs)
    {
        Packed<std::uint8_t> out(pairs.shape(0));
        std::uint8_t* const data = out.mutable_data();
        work_in_parts(shapes_a, poses_a, shapes_b, poses_b, pairs, false,
                      [&](auto* a, auto* b, auto* some, std::uint64_t first, auto* error) {
                          return jostle_contact_finder_touching(handle.get(), a, b, some, data + first,
                                                                error);
                      });
        return out;
    }
    /// Of each group the number of a pair, and where distances are asked for, its row.
    py::tuple groups(const Shapes& shapes_a, const py::array& poses_a, const Shapes* shapes_b,
                     const std::optional<py::array>& poses_b, const Packed<std::uint32_t>& pairs,
                     const Packed<std::uint64_t>& offsets, std::optional<double> max_distance)
    {
        if (length_of(offsets, "offsets") == 0)
            refuse("offsets has the shape (0,): it must have one number more than there are groups");
        const Given given(users, space, shapes_a, poses_a, shapes_b, poses_b, pairs, false);
        const jostle_block& all = given.all.block;
        PairGroups groups(offsets, max_distance, space);
        const auto ask = [&](std::uint64_t first, std::uint64_t last, const auto& bounds, double limit,
                             void* distances, std::uint64_t* numbers, jostle_error* error) {
            const jostle_block block{static_cast<const jostle_pair*>(all.items) + first, last - first};
            const jostle_blocks some{&block, 1, block.count, sizeof(jostle_pair)};
            const jostle_objects* const b = given.b ? &given.b->view : nullptr;
            const std::uint64_t count = bounds.size() - 1;
            return max_distance ? jostle_contact_finder_least_distances(handle.get(), &given.a.view, b, &some,
                                                                        bounds.data(), count, limit,
                                                                        distances, numbers, error)
                                : jostle_contact_finder_first_touching(handle.get(), &given.a.view, b, &some,
                                                                       bounds.data(), count, numbers, error);
        };
        if (groups.can_be_cut(all.count))
            call_in_parts(all.count, nullptr, [&](auto first, auto count, jostle_error* error) {
                return groups.ask_some(first, first + count, error, ask);
            });
        else // the library says what is wrong with them
            call([&](jostle_error* error) { return groups.ask_all(all.count, error, ask); });
        return groups.answers();
    }
    /// Rays, or shapes that move by displacements where `moving` is given, against objects.
    py::array casts(const Shapes* moving, const std::optional<py::array>& moving_poses,
                    const py::array& given, const Shapes& shapes, const py::array& poses,
                    const Packed<std::uint32_t>& pairs, const py::dtype& type)
    {
        const Users::Changing now(users);
        const py::ssize_t width = moving == nullptr ? 2 * dim_of(space) + 1 : dim_of(space);
        const auto count = static_cast<std::uint64_t>(given.ndim() == 2 ? given.shape(0) : 0);
        want_rows(given, space, width, count, moving == nullptr ? "rays" : "displacements");
        const jostle_values numbers{given.data(), count, given.strides(0)};
        const Objects of(shapes, poses, space, false, "poses");
        std::optional<Objects> movers;
        if ((moving != nullptr) != moving_poses.has_value()) refuse("shapes that move need poses");
        if (moving != nullptr) movers.emplace(*moving, *moving_poses, space, false, "moving_poses");
        const Pairs all(pairs);
        py::array out(type, std::vector<py::ssize_t>{pairs.shape(0)});
        auto* const data = static_cast<char*>(out.mutable_data());
        const auto size = static_cast<std::uint64_t>(type.itemsize());
        for_parts(all, [&](auto* some, std::uint64_t first, auto* error) {
            void* const hits = data + first * size;
            return movers
                       ? jostle_contact_finder_shape_casts(handle.get(), &movers->view, &numbers, &of.view,
                                                           some, hits, error)
                       : jostle_contact_finder_ray_casts(handle.get(), &numbers, &of.view, some, hits, error);
        });
        return out;
    }
    jostle_space space;
    Users users{"contact finder"};
    Interruptible memory;
    ContactFinderHandle handle;
};

} // namespace

void define_contacts(py::module_& m)
{
    define_class<ContactFinder>(m, "ContactFinder")
        .def(py::init<jostle_space, bool, std::uint32_t>())
        .def("find", &ContactFinder::find)
        .def("find_points", &ContactFinder::find_points)
        .def("rows", &ContactFinder::rows)
        .def("groups", &ContactFinder::groups)
        .def("casts", &ContactFinder::casts)
        .def("touching", &ContactFinder::touching);
}

} // namespace jostle_python
