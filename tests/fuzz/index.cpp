// SPDX-License-Identifier: MIT
// A BoxIndex under all its changes, and every question, against the tests' twin, which goes through all
// boxes.
#include "choices.hpp"
#include "index/box_index_access.hpp"
#include "index/tree/tree.hpp"
#include "tests/index/twin.hpp"

namespace {

template <int Dim, class T>
void run(fuzz::Input& in)
{
    const auto kind = static_cast<twin::Kind>(in.below(static_cast<std::uint32_t>(twin::Kind::last) + 1));
    const auto sets = jostle::supported_instruction_sets();
    jostle::IndexOptions options;
    options.executor = &jostle::serial_executor();
    options.instruction_set = sets[in.below(static_cast<std::uint32_t>(sets.size()))];
    twin::Twin<Dim, T> twin(kind, twin::Random(fuzz::Choices(in)), options);
    for (int step = 0; step < 24 && in.left() != 0; ++step) {
        const std::uint32_t what = in.below(8);
        // Now and then as many as several pages hold.
        const std::uint32_t count = in.below(16) == 15 ? 300 : 1 + in.below(24);
        switch (what) {
        case 0:
        case 1:
            twin.insert(count);
            break;
        case 2:
            twin.erase(count);
            break;
        case 3:
        case 4:
            twin.move(count);
            break;
        case 5:
            twin.build();
            break;
        default:
            (void)twin.compare(1 + in.below(2));
            fuzz::count_boxes(twin.boxes().size());
        }
        if (const char* const what_is_wrong = jostle::BoxIndexAccess::tree(twin.index).validate())
            fuzz::fail(std::string("the tree is damaged: ") + what_is_wrong);
    }
    (void)twin.compare(1);
    fuzz::count_boxes(twin.boxes().size());
}

} // namespace

JOSTLE_FUZZ_TARGET(index)
{
    if (in.below(2) == 0)
        run<3, float>(in);
    else
        run<2, double>(in);
}
