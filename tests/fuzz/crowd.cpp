// SPDX-License-Identifier: MIT
// About a thousand boxes, of the tests' hostile scenes and some of any numbers among them, against a loop
// over all pairs: by every instruction set, one set and two, with masks. The target `pairs` has more ways to
// ask; this one has more boxes a second.
#include <algorithm>
#include <array>
#include <optional>

#include "choices.hpp"
#include "tests/contract/harness.hpp"

namespace {

using contract::Manner;
using contract::Pair;
using contract::Scene;

template <int Dim, class T>
contract::Boxes<Dim, T> some_boxes(fuzz::Input& in)
{
    contract::Boxes<Dim, T> boxes;
    for (std::uint32_t scenes = 1 + in.below(3); scenes > 0; --scenes) {
        const auto scene = static_cast<Scene>(in.below(static_cast<std::uint32_t>(Scene::count)));
        const std::uint32_t most = contract::everything_touches(scene) ? 80 : 700;
        const auto made =
            contract::make_scene<Dim, T>(scene, in.below(most), in.template number<std::uint16_t>());
        boxes.insert(boxes.end(), made.begin(), made.end());
    }
    for (std::uint32_t k = in.below(8); k > 0; --k)
        boxes.push_back(in.template box<Dim, T>());
    return boxes;
}

template <class T>
using Column = std::vector<T>;

/// The boxes' bounds one by one, and of each box whom its mask lets it meet.
template <int Dim, class T>
struct Bounds
{
    std::array<Column<T>, 2 * Dim> at; ///< lo of each axis, then hi of each
    Column<std::uint32_t> category, mask;

    Bounds(const contract::Boxes<Dim, T>& boxes, const contract::Columns& columns)
        : category(columns.category), mask(columns.mask)
    {
        category.resize(boxes.size(), 1);
        mask.resize(boxes.size(), 1);
        for (std::size_t d = 0; d < Dim; ++d)
            for (const auto& box : boxes) {
                at[d].push_back(box.lo[d]);
                at[Dim + d].push_back(box.hi[d]);
            }
    }
};

/// The definition: every box against every other, with nothing left out early, which is what compilers make
/// fast code of.
template <int Dim, class T>
std::vector<Pair> by_definition(const contract::Question<Dim, T>& question)
{
    const Bounds<Dim, T> first(question.a, question.columns_a);
    const Bounds<Dim, T> other(question.cross ? question.b : question.a,
                               question.cross ? question.columns_b : question.columns_a);
    const auto count = static_cast<std::uint32_t>(other.category.size());
    std::vector<std::uint32_t> meet(count);
    std::vector<Pair> pairs;
    for (std::uint32_t a = 0; a < first.category.size(); ++a) {
        const std::uint32_t begin = question.cross ? 0 : a + 1;
        for (std::uint32_t b = begin; b < count; ++b)
            meet[b] = (first.category[a] & other.mask[b]) != 0 && (other.category[b] & first.mask[a]) != 0;
        for (std::size_t d = 0; d < Dim; ++d) {
            const T lo = first.at[d][a], hi = first.at[Dim + d][a];
            const T* const los = other.at[d].data();
            const T* const his = other.at[Dim + d].data();
            for (std::uint32_t b = begin; b < count; ++b)
                meet[b] &=
                    static_cast<std::uint32_t>(lo <= his[b]) & static_cast<std::uint32_t>(los[b] <= hi);
        }
        for (std::uint32_t b = begin; b < count; ++b)
            if (meet[b] != 0) pairs.push_back({a, b});
    }
    return pairs;
}

} // namespace

JOSTLE_FUZZ_TARGET(crowd)
{
    fuzz::with_kind(in, [&]<int Dim, class T>() {
        contract::Question<Dim, T> question;
        question.cross = in.below(4) == 3;
        const bool masks = in.below(4) == 3;
        question.a = some_boxes<Dim, T>(in);
        if (question.cross) question.b = some_boxes<Dim, T>(in);
        contract::Random random(in.number<std::uint16_t>());
        question.columns_a = contract::random_columns(random, question.a.size(), masks, false);
        question.columns_b = contract::random_columns(random, question.b.size(), masks, false);
        if (fuzz::telling()) {
            fuzz::tell("// cross: " + std::to_string(question.cross) + ", masks: " + std::to_string(masks));
            for (const auto* const boxes : {&question.a, &question.b})
                for (const auto& box : *boxes)
                    fuzz::tell(fuzz::text(box) + ",");
        }
        const std::vector<Pair> expected = by_definition(question);
        std::optional<std::vector<Pair>> canonical;
        for (const jostle::InstructionSet set : jostle::supported_instruction_sets()) {
            Manner manner;
            manner.options.instruction_set = set;
            manner.options.executor = &jostle::serial_executor();
            const std::vector<Pair> found = contract::ask(question, manner);
            if (!canonical) {
                fuzz::demand(contract::sorted(found) == expected, "other pairs than the definition's");
                canonical = found;
            }
            fuzz::demand(found == *canonical, "other pairs or another order on another instruction set");
            fuzz::count_boxes(question.a.size() + question.b.size());
        }
    });
}
