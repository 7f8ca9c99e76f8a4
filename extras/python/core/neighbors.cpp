// SPDX-License-Identifier: MIT
// Neighbour lists.
#include <algorithm>
#include <array>
#include <cstring>
#include <new>
#include <string>

#include "core/arrays.hpp"
#include "core/interrupts.hpp"
#include "core/module.hpp"
#include "core/users.hpp"

namespace jostle_python {

namespace {

using NeighborFinderHandle = Owned<jostle_neighbor_finder>;

/// What is asked, with the arrays that it reads.
struct NeighborQuery
{
    NeighborQuery(jostle_space space, const Array& points, const Maybe& others,
                  const std::optional<U64>& offsets, double cutoff, const Maybe& radii, const Maybe& radii_b,
                  bool greater, const std::optional<U32>& types, const std::optional<U32>& types_b,
                  const Maybe& table, const Maybe& cells, const std::optional<Packed<std::int32_t>>& repeats)
        : space(space),
          kept(py::make_tuple(points, others, offsets, radii, radii_b, types, types_b, table, cells, repeats))
    {
        const py::ssize_t dim = dim_of(space);
        const auto rows_of = [](const Array& array) {
            return array.ndim() == 0 ? std::uint64_t{0} : static_cast<std::uint64_t>(array.shape(0));
        };
        const auto numbers_of = [&](const Maybe& array, std::uint64_t count, const char* name) {
            if (!array) return static_cast<const void*>(nullptr);
            want_number(*array, space, name);
            if (static_cast<std::uint64_t>(array->size()) != count || (array->flags() & Array::c_style) == 0)
                refuse(std::string(name) + " has the shape " + shape_text(*array) + ": it must have " +
                       std::to_string(count) + " numbers side by side");
            return array->data();
        };
        const auto types_of = [&](const std::optional<U32>& array, std::uint64_t count, const char* name) {
            if (array) want_length(*array, count, name);
            return array ? array->data() : nullptr;
        };
        query.struct_size = sizeof query;
        query.count = rows_of(points);
        want_rows(points, space, dim, query.count, "points");
        query.points = points.data();
        if (others) {
            query.other_count = rows_of(*others);
            want_rows(*others, space, dim, query.other_count, "others");
            query.others = others->data();
        }
        if (offsets) {
            if (length_of(*offsets, "offsets") == 0)
                refuse(
                    "offsets is empty: it must have one number for each system's first point, and the end");
            query.offsets = offsets->data();
            query.system_count = static_cast<std::uint64_t>(offsets->shape(0)) - 1;
        }
        query.cutoff = cutoff;
        query.greater = greater ? 1 : 0;
        query.radii = numbers_of(radii, query.count, "cutoff");
        query.radii_b = numbers_of(radii_b, query.other_count, "cutoff_b");
        query.types = types_of(types, query.count, "types");
        query.types_b = types_of(types_b, query.other_count, "types_b");
        if (table) {
            query.type_count = rows_of(*table);
            query.table = numbers_of(table, query.type_count * query.type_count, "cutoff");
        }
        if (cells && repeats) {
            query.cell_count = rows_of(*cells);
            query.cells = numbers_of(cells, query.cell_count * static_cast<std::uint64_t>(dim * dim), "cell");
            if (static_cast<std::uint64_t>(repeats->size()) !=
                query.cell_count * static_cast<std::uint64_t>(dim))
                refuse("periodic has the shape " + shape_text(*repeats) +
                       ": it must have one for each axis of each cell");
            query.repeats = repeats->data();
        }
    }
    jostle_space space;
    py::tuple kept;
    jostle_neighbor_query query{};
};

/// Memory of a search of which arrays take the result over: what is freed and holds one of the parts that
/// were asked for stays, and is the array's from then on.
class HandedOver
{
  public:
    HandedOver()
    {
        allocator_ = *memory.allocator();
        allocator_.context = this;
        allocator_.allocate = [](void* context, std::uint64_t size, std::uint64_t alignment) {
            const jostle_allocator& from = *static_cast<HandedOver*>(context)->memory.allocator();
            return from.allocate(from.context, size, alignment);
        };
        allocator_.deallocate = [](void* context, void* block, std::uint64_t size, std::uint64_t alignment) {
            static_cast<HandedOver*>(context)->free(static_cast<char*>(block), size, alignment);
        };
    }
    HandedOver(const HandedOver&) = delete;
    ~HandedOver()
    {
        for (const Part& part : parts_)
            part.free();
    }
    [[nodiscard]] const jostle_allocator* allocator() const noexcept { return &allocator_; }

    /// Before the finder goes: the block with this byte is to stay.
    void keep(const void* inside) { parts_[count_++].inside = static_cast<const char*>(inside); }
    /// After that: an owner of the block with this byte, for an array.
    [[nodiscard]] py::capsule take(const void* inside)
    {
        Part& part = *std::find_if(parts_.begin(), parts_.end(),
                                   [&](const Part& each) { return each.inside == inside; });
        auto taken = std::make_unique<Part>(part);
        py::capsule owner(taken.get(), [](void* of) {
            const std::unique_ptr<Part> last(static_cast<Part*>(of));
            last->free();
        });
        (void)taken.release();
        part.block = nullptr; // it has another owner now
        return owner;
    }

    Interruptible memory;

  private:
    struct Part
    {
        const char* inside = nullptr;
        void* block = nullptr;
        std::uint64_t alignment = 0;
        void free() const noexcept
        {
            if (block != nullptr) ::operator delete(block, std::align_val_t(alignment));
        }
    };

    void free(char* block, std::uint64_t size, std::uint64_t alignment)
    {
        for (std::size_t k = 0; k < count_; ++k)
            if (parts_[k].inside >= block && parts_[k].inside < block + size) {
                parts_[k] = {parts_[k].inside, block, alignment};
                return;
            }
        ::operator delete(block, std::align_val_t(alignment));
    }

    jostle_allocator allocator_{};
    std::array<Part, 5> parts_{}; // as many as a list has arrays
    std::size_t count_ = 0;
};

/// An array of a list.
struct Column
{
    const void* data;
    py::dtype dtype;
    std::vector<py::ssize_t> shape;
    [[nodiscard]] bool is_empty() const
    {
        return std::find(shape.begin(), shape.end(), py::ssize_t{0}) != shape.end();
    }
};

/// Of a list, or of a block of so many rows.
Column column_of(const NeighborQuery& asked, const jostle_neighbor_list& list, std::uint64_t rows,
                 char letter)
{
    const auto count = static_cast<py::ssize_t>(list.count);
    const py::ssize_t dim = dim_of(asked.space);
    switch (letter) {
    case 'j':
        return {list.neighbors, py::dtype::of<std::uint32_t>(), {count}};
    case 'S':
        return {list.shifts, py::dtype::of<std::int32_t>(), {count, dim}};
    case 'D':
        return {list.vectors, number_of(asked.space), {count, dim}};
    case 'd':
        return {list.distances, number_of(asked.space), {count}};
    default: // 'o': below 2^63, and other whole numbers of NumPy are signed
        return {list.offsets, py::dtype::of<std::int64_t>(), {static_cast<py::ssize_t>(rows) + 1}};
    }
}

/// The point of each row, the first one's being `first`, as often as it has neighbours.
py::array row_of_each(const jostle_neighbor_list& list, std::uint64_t first, std::uint64_t rows)
{
    U32 points(static_cast<py::ssize_t>(list.count));
    std::uint32_t* const to = points.mutable_data();
    const py::gil_scoped_release without_python;
    for (std::uint64_t k = 0; k < rows; ++k)
        std::fill(to + list.offsets[k], to + list.offsets[k + 1], static_cast<std::uint32_t>(first + k));
    return points;
}

/// The arrays that letters stand for, each made by array_of(column).
template <class F>
py::tuple columns(const NeighborQuery& asked, const jostle_neighbor_list& list, const std::string& letters,
                  std::uint64_t rows, const py::object& points, F&& array_of)
{
    py::tuple told(letters.size());
    for (std::size_t k = 0; k < letters.size(); ++k) {
        if (letters[k] == 'i') {
            told[k] = points;
            continue;
        }
        const Column column = column_of(asked, list, rows, letters[k]);
        told[k] = column.is_empty() ? py::array(column.dtype, column.shape) : array_of(column);
    }
    return told;
}

bool has(const std::string& letters, char letter)
{
    return letters.find(letter) != std::string::npos;
}

NeighborFinderHandle new_finder(jostle_space space, std::uint32_t threads, const jostle_allocator* memory)
{
    const Executor executor = executor_of(threads);
    const jostle_options options = options_of(executor, memory);
    return make<NeighborFinderHandle>(
        [&](auto** out, auto* error) { return jostle_neighbor_finder_new(space, &options, out, error); });
}

jostle_neighbor_query query_of(const NeighborQuery& asked, bool full, const std::string& letters, double skin)
{
    jostle_neighbor_query query = asked.query;
    query.half = full ? 0 : 1;
    query.shifts = has(letters, 'S') ? 1 : 0;
    query.vectors = has(letters, 'D') ? 1 : 0;
    query.distances = has(letters, 'd') ? 1 : 0;
    query.skin = skin;
    return query;
}

jostle_neighbor_list search(jostle_neighbor_finder* finder, Interruptible& memory, const NeighborQuery& asked,
                            bool full, const std::string& letters, double skin)
{
    const jostle_neighbor_query query = query_of(asked, full, letters, skin);
    jostle_neighbor_list list{};
    memory.call(
        [&](jostle_error* error) { return jostle_neighbor_finder_find(finder, &query, &list, error); });
    return list;
}

py::object points_if_asked(const jostle_neighbor_list& list, const std::string& letters, std::uint64_t first,
                           std::uint64_t rows)
{
    return has(letters, 'i') ? py::object(row_of_each(list, first, rows)) : py::object(py::none());
}

/// `letters` has each at most once.
py::tuple neighbors(const NeighborQuery& asked, bool full, const std::string& letters, std::uint32_t threads)
{
    HandedOver memory;
    NeighborFinderHandle finder = new_finder(asked.space, threads, memory.allocator());
    const jostle_neighbor_list list = search(finder.get(), memory.memory, asked, full, letters, 0);
    const std::uint64_t rows = asked.query.count;
    const py::object points = points_if_asked(list, letters, 0, rows);
    for (const char letter : letters)
        if (letter != 'i') {
            const Column column = column_of(asked, list, rows, letter);
            if (!column.is_empty()) memory.keep(column.data);
        }
    finder.reset();
    return columns(asked, list, letters, rows, points, [&](const Column& column) {
        return py::array(column.dtype, column.shape, {}, column.data, memory.take(column.data));
    });
}

/// Keeps its memory, and what a skin keeps, from one search to the next of the same kind of points.
class NeighborFinder
{
  public:
    NeighborFinder(double skin, std::uint32_t threads) : skin_(skin), threads_(threads) {}

    py::tuple find(const NeighborQuery& asked, bool full, const std::string& letters)
    {
        const Users::Changing now(users_); // until the list is copied
        want_space(asked.space);
        const jostle_neighbor_list list = search(finder_.get(), memory_, asked, full, letters, skin_);
        searched_ = list.searched != 0;
        return copied(asked, list, letters, 0, asked.query.count);
    }
    /// Calls visit(first, tuple of arrays) with so many rows at a time; whether it was never stopped.
    bool stream(const NeighborQuery& asked, bool full, const std::string& letters, std::uint64_t rows,
                const py::object& visit)
    {
        struct Streamed
        {
            const NeighborQuery& asked;
            const std::string& letters;
            const py::object& visit;
            Pending pending;
        } streamed{asked, letters, visit, {}};
        const Users::Changing now(users_);
        want_space(asked.space);
        const jostle_neighbor_query query = query_of(asked, full, letters, skin_);
        const auto sink = [](void* context, std::uint64_t first, std::uint64_t count,
                             const jostle_neighbor_list* list) {
            auto& to = *static_cast<Streamed*>(context);
            return to.pending.call([&] {
                if (PyErr_CheckSignals() != 0) throw py::error_already_set();
                const py::object answer = to.visit(first, copied(to.asked, *list, to.letters, first, count));
                py::detail::make_caster<bool> truth; // Python's, or NumPy's
                if (!answer.is_none() && !truth.load(answer, false))
                    refuse("visit returned " + std::string(py::repr(answer)) +
                           ": it must return None, True or False");
                return answer.is_none() || static_cast<bool>(truth);
            });
        };
        std::int32_t finished = 0;
        memory_.call(
            [&](jostle_error* error) {
                return jostle_neighbor_finder_stream(finder_.get(), &query, rows, sink, &streamed, &finished,
                                                     error);
            },
            &streamed.pending);
        return finished != 0;
    }
    [[nodiscard]] bool searched() const noexcept { return searched_; }
    void release_memory()
    {
        const Users::Changing now(users_);
        if (finder_ != nullptr)
            call([&](jostle_error* error) { return jostle_release_memory(finder_.get(), error); });
    }

  private:
    void want_space(jostle_space space)
    {
        if (finder_ != nullptr && space_ == space) return;
        finder_ = new_finder(space, threads_, memory_.allocator());
        space_ = space;
    }
    static py::tuple copied(const NeighborQuery& asked, const jostle_neighbor_list& list,
                            const std::string& letters, std::uint64_t first, std::uint64_t rows)
    {
        return columns(
            asked, list, letters, rows, points_if_asked(list, letters, first, rows),
            [](const Column& column) { return py::array(column.dtype, column.shape, column.data); });
    }

    double skin_;
    std::uint32_t threads_;
    Users users_{"neighbor finder"};
    Interruptible memory_;
    NeighborFinderHandle finder_;
    jostle_space space_ = JOSTLE_3D;
    bool searched_ = false;
};

} // namespace

void define_neighbors(py::module_& m)
{
    define_class<NeighborQuery>(m, "NeighborQuery")
        .def(py::init<jostle_space, const Array&, const Maybe&, const std::optional<U64>&, double,
                      const Maybe&, const Maybe&, bool, const std::optional<U32>&, const std::optional<U32>&,
                      const Maybe&, const Maybe&, const std::optional<Packed<std::int32_t>>&>());
    define_class<NeighborFinder>(m, "NeighborFinder")
        .def(py::init<double, std::uint32_t>())
        .def("find", &NeighborFinder::find)
        .def("stream", &NeighborFinder::stream)
        .def("searched", &NeighborFinder::searched)
        .def("release_memory", &NeighborFinder::release_memory);
    m.def("neighbors", &neighbors);
}

} // namespace jostle_python
