// SPDX-License-Identifier: MIT
// A spatial order of boxes: the order in which an index is built, except inside its pages.
#include "jostle/spatial_order.hpp"

#include <limits>
#include <string>
#include <vector>

#include "base/checks.hpp"
#include "base/exact_floats.hpp"
#include "base/instantiate.hpp"
#include "index/tree/key_order.hpp"
#include "jostle/error.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace {

/// About as many boxes as one brick of a search has: more order gains nothing.
constexpr std::size_t near_enough = 64, to_a_cell = 16;

/// Runs on the user's threads, none of which flushes denormals to zero meanwhile: if threads computed keys in
/// different ways, there would be no order at all.
class ExactExecutor final : public Executor
{
  public:
    explicit ExactExecutor(Executor& given) : given_(given) {}
    [[nodiscard]] std::uint32_t concurrency() const noexcept override { return given_.concurrency(); }
    void run(std::uint32_t count, FunctionRef<void(std::uint32_t)> task) override
    {
        const auto exactly = [&](std::uint32_t number) {
            const ExactFloats exact;
            task(number);
        };
        given_.run(count, exactly);
    }

  private:
    Executor& given_;
};

/// Sorts entries that are sorted except for the last `unsorted` digits, until only a few are in one place,
/// unless they can't be told apart.
template <int Dim, class T>
void sort_further(index::KeyOrder<Dim, T>& order, std::size_t begin, std::size_t end, int unsorted)
{
    const auto& entries = order.entries;
    while (begin < end) {
        std::size_t next = begin + 1;
        while (next < end && order.same_place(entries[begin], entries[next], unsorted))
            ++next;
        if (next - begin > near_enough) sort_further(order, begin, next, order.sort(begin, next, to_a_cell));
        begin = next;
    }
}

} // namespace

template <int Dim, Coordinate T>
void detail::write_spatial_order(const BoxView<Dim, T>& boxes, std::span<std::uint32_t> order,
                                 const FinderOptions& options)
{
    if (boxes.size() > std::numeric_limits<std::uint32_t>::max())
        throw Error(ErrorCode::too_many_objects,
                    std::to_string(boxes.size()) + " boxes; an order has at most 4294967295, sort parts");
    if (boxes.size() != order.size())
        throw Error(ErrorCode::size_mismatch, "there are " + std::to_string(boxes.size()) +
                                                  " boxes and room for " + std::to_string(order.size()) +
                                                  " positions; give one for each");
    check_memory(options.memory);
    check_pointers(boxes);
    const ExactFloats exact;
    check_boxes(boxes);
    if (boxes.size() == 0) return;
    const index::Frame<Dim> frame = index::choose_frame(boxes);
    ExactExecutor executor(options.executor != nullptr ? *options.executor : default_executor());
    index::KeyMemory memory(options.memory);
    index::KeyOrder<Dim, T> sorted(index::kernels_for<Dim, T>(checked(options.instruction_set)), frame, {},
                                   boxes, &executor, memory);
    sorted.make_entries();
    sort_further(sorted, 0, boxes.size(), sorted.all_digits);
    for (std::size_t k = 0; k < order.size(); ++k)
        order[k] = sorted.entries[k].box;
}

void detail::throw_not_ordered(std::size_t order, std::size_t size, std::size_t array)
{
    throw Error(ErrorCode::size_mismatch, "array " + std::to_string(array) + " has " + std::to_string(size) +
                                              " elements, and the order " + std::to_string(order) +
                                              "; give one for each");
}

void detail::check_order(std::span<const std::uint32_t> order)
{
    std::vector<bool> is_there(order.size());
    for (std::size_t k = 0; k < order.size(); ++k) {
        const std::uint32_t position = order[k];
        if (position >= order.size())
            throw Error(ErrorCode::invalid_argument,
                        "order[" + std::to_string(k) + "] is " + std::to_string(position) +
                            ", but there are " + std::to_string(order.size()) +
                            " elements; it must have every position once",
                        k);
        if (is_there[position])
            throw Error(ErrorCode::invalid_argument,
                        "order[" + std::to_string(k) + "] is " + std::to_string(position) +
                            ", which came before; it must have every position once",
                        k);
        is_there[position] = true;
    }
}

#define JOSTLE_INSTANTIATE(Dim, T)                                                                           \
    template JOSTLE_API void detail::write_spatial_order(const BoxView<Dim, T>&, std::span<std::uint32_t>,   \
                                                         const FinderOptions&);
JOSTLE_FOR_EACH_SPACE(JOSTLE_INSTANTIATE)
#undef JOSTLE_INSTANTIATE

JOSTLE_NAMESPACE_END
