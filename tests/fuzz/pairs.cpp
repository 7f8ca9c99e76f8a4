// SPDX-License-Identifier: MIT
// Pairs of one set and of two, with all filters, by every instruction set, in every form and layout, and
// by the chapter's grid, against the tests' own definition. Boxes come in copies, so that few bytes make
// a crowd.
#include <algorithm>
#include <limits>
#include <optional>

#include "choices.hpp"
#include "jostle/chapter.hpp"
#include "tests/contract/harness.hpp"

namespace {

using contract::Layout;
using contract::Manner;
using contract::Pair;

template <int Dim, class T>
contract::Boxes<Dim, T> some_boxes(fuzz::Input& in)
{
    contract::Boxes<Dim, T> boxes;
    for (std::uint32_t k = in.below(20); k > 0; --k)
        boxes.push_back(in.template box<Dim, T>());
    const std::size_t pattern = boxes.size();
    for (std::uint32_t copies = in.below(12); copies > 0; --copies) {
        jostle::Vec<Dim, T> by;
        for (T& each : by)
            each = static_cast<T>(in.template number<std::int8_t>()) / 2;
        for (std::size_t k = 0; k < pattern; ++k) {
            auto box = boxes[k];
            for (int d = 0; d < Dim; ++d) {
                box.lo[d] += by[static_cast<std::size_t>(d)];
                box.hi[d] += by[static_cast<std::size_t>(d)];
            }
            boxes.push_back(box);
        }
    }
    return boxes;
}

contract::Columns some_columns(fuzz::Choices& choices, std::size_t count, bool masks, bool owners)
{
    contract::Columns columns;
    for (std::size_t i = 0; i < count; ++i) {
        if (masks) {
            columns.category.push_back(1u << choices.below(3));
            columns.mask.push_back(choices.below(3) == 0 ? ~0u : choices.below(8));
        }
        if (owners)
            columns.owner.push_back(choices.below(4) == 0 ? jostle::Filter::no_owner : choices.below(4));
    }
    return columns;
}

template <int Dim, class T>
void tell(const contract::Boxes<Dim, T>& boxes, const char* name)
{
    fuzz::tell(std::string("std::vector<jostle::Aabb<") + std::to_string(Dim) + ", " +
               (sizeof(T) == 4 ? "float" : "double") + ">> " + name + "{");
    for (const auto& box : boxes)
        fuzz::tell("    " + fuzz::text(box) + ",");
    fuzz::tell("};");
}

} // namespace

JOSTLE_FUZZ_TARGET(pairs)
{
    static const std::unique_ptr<jostle::Executor> threads = jostle::make_thread_executor(3);
    fuzz::with_kind(in, [&]<int Dim, class T>() {
        contract::Question<Dim, T> question;
        question.cross = in.below(3) == 0;
        question.a = some_boxes<Dim, T>(in);
        if (question.cross) question.b = some_boxes<Dim, T>(in);
        const std::uint32_t filters = in.below(8);
        fuzz::Choices choices(in);
        question.columns_a = some_columns(choices, question.a.size(), filters & 1, filters & 2);
        question.columns_b = some_columns(choices, question.b.size(), filters & 1, filters & 2);
        if (filters & 4) question.accept_salt = 7;
        if (fuzz::telling()) {
            tell<Dim, T>(question.a, "a");
            tell<Dim, T>(question.b, "b");
            fuzz::tell("// cross: " + std::to_string(question.cross) +
                       ", filters: " + std::to_string(filters));
        }
        const std::vector<Pair> expected = contract::oracle(question);
        const std::size_t boxes = question.a.size() + question.b.size();
        std::optional<std::vector<Pair>> canonical;
        for (const jostle::InstructionSet set : jostle::supported_instruction_sets()) {
            Manner manner;
            manner.options.instruction_set = set;
            manner.options.executor = choices.below(16) == 15 ? threads.get() : &jostle::serial_executor();
            manner.form = static_cast<Manner::Form>(choices.below(Manner::forms));
            manner.layout = static_cast<Layout>(choices.below(static_cast<std::uint32_t>(Layout::count)));
            const std::vector<Pair> found = contract::ask(question, manner);
            if (manner.form == Manner::sorted) {
                fuzz::demand(found == expected, "other pairs than the definition's, sorted");
            } else {
                fuzz::demand(contract::sorted(found) == expected, "other pairs than the definition's");
                fuzz::demand(!canonical || found == *canonical, "another order on another instruction set");
                canonical = found;
            }
            fuzz::count_boxes(boxes);
        }
        if (question.cross || filters != 0) return;
        const jostle::BoxView<Dim, T> view(question.a);
        fuzz::demand(contract::sorted(jostle::chapter::find_pairs(view, jostle::serial_executor())) ==
                         expected,
                     "other pairs by the chapter's grid");
        fuzz::demand(jostle::find_pairs_brute_force(view) == expected, "other pairs by brute force");
        // The same boxes as scenes of their own.
        std::vector<std::uint64_t> offsets{0};
        while (offsets.back() < question.a.size())
            offsets.push_back(std::min<std::uint64_t>(question.a.size(), offsets.back() + choices.below(30)));
        jostle::PairFinder finder({.executor = &jostle::serial_executor()});
        const jostle::ScenePairs& scenes = finder.find_scenes(view, offsets);
        for (std::size_t k = 0; k + 1 < offsets.size(); ++k) {
            std::vector<Pair> of_scene;
            for (const Pair& pair : expected)
                if (pair.a >= offsets[k] && pair.b < offsets[k + 1])
                    of_scene.push_back({static_cast<std::uint32_t>(pair.a - offsets[k]),
                                        static_cast<std::uint32_t>(pair.b - offsets[k])});
            const auto found = scenes[k];
            fuzz::demand(contract::sorted({found.begin(), found.end()}) == of_scene,
                         "other pairs of a scene");
        }
        fuzz::count_boxes(3 * boxes);
    });
}
