// SPDX-License-Identifier: MIT
#include "jostle/find_pairs.hpp"

#include <algorithm>

#include "pair_arena.hpp"

JOSTLE_NAMESPACE_BEGIN

struct PairFinder::Implementation
{
    FinderOptions options;
    PairBuffer result;
    Stats stats;
};

PairFinder::PairFinder(const FinderOptions& options)
    : implementation_(new Implementation{options, PairBuffer(options.memory), {}})
{
}
PairFinder::PairFinder(PairFinder&&) noexcept = default;
PairFinder& PairFinder::operator=(PairFinder&&) noexcept = default;
PairFinder::~PairFinder() = default;
const Stats& PairFinder::stats() const noexcept
{
    return implementation_->stats;
}
void PairFinder::release_memory() noexcept
{
    implementation_->result.release();
}

namespace {
void store(PairBuffer& buffer, const std::vector<Pair>& pairs)
{
    buffer.clear();
    if (pairs.empty()) return;
    PairBufferAccess access(buffer);
    std::span<Pair> chunk = access.chunk(0, pairs.size());
    std::copy(pairs.begin(), pairs.end(), chunk.begin());
    access.append(chunk.first(pairs.size()));
}
} // namespace

template <int Dim, Coordinate T>
const PairBuffer& PairFinder::find(const BoxView<Dim, T>& boxes, const Filter& filter, Order)
{
    store(implementation_->result, find_pairs_brute_force(boxes, filter));
    return implementation_->result;
}
template <int Dim, Coordinate T>
const PairBuffer& PairFinder::find(const BoxView<Dim, T>& a, const BoxView<Dim, T>& b,
                                   const CrossFilter& filter, Order)
{
    store(implementation_->result, find_pairs_brute_force(a, b, filter));
    return implementation_->result;
}
template <int Dim, Coordinate T>
bool PairFinder::stream(const BoxView<Dim, T>& boxes, PairSink sink, const Filter& filter)
{
    const PairBuffer& pairs = find(boxes, filter);
    return pairs.empty() || sink({pairs.blocks()[0], 0, 0});
}
template <int Dim, Coordinate T>
bool PairFinder::stream(const BoxView<Dim, T>& a, const BoxView<Dim, T>& b, PairSink sink,
                        const CrossFilter& filter)
{
    const PairBuffer& pairs = find(a, b, filter);
    return pairs.empty() || sink({pairs.blocks()[0], 0, 0});
}

template <int Dim, Coordinate T>
PairBuffer find_pairs(const BoxView<Dim, T>& boxes, const Filter& filter, Order order,
                      const FinderOptions& options)
{
    PairFinder finder(options);
    return std::move(const_cast<PairBuffer&>(finder.find(boxes, filter, order)));
}
template <int Dim, Coordinate T>
PairBuffer find_pairs(const BoxView<Dim, T>& a, const BoxView<Dim, T>& b, const CrossFilter& filter,
                      Order order, const FinderOptions& options)
{
    PairFinder finder(options);
    return std::move(const_cast<PairBuffer&>(finder.find(a, b, filter, order)));
}
template <int Dim, Coordinate T>
bool stream_pairs(const BoxView<Dim, T>& boxes, PairSink sink, const Filter& filter,
                  const FinderOptions& options)
{
    return PairFinder(options).stream(boxes, sink, filter);
}
template <int Dim, Coordinate T>
bool stream_pairs(const BoxView<Dim, T>& a, const BoxView<Dim, T>& b, PairSink sink,
                  const CrossFilter& filter, const FinderOptions& options)
{
    return PairFinder(options).stream(a, b, sink, filter);
}

std::span<const InstructionSet> supported_instruction_sets() noexcept
{
    static constexpr InstructionSet sets[] = {InstructionSet::scalar};
    return sets;
}
const char* name(InstructionSet set) noexcept
{
    switch (set) {
    case InstructionSet::scalar:
        return "scalar";
    case InstructionSet::sse4:
        return "sse4";
    case InstructionSet::avx2:
        return "avx2";
    case InstructionSet::avx512:
        return "avx512";
    case InstructionSet::neon:
        return "neon";
    case InstructionSet::wasm_simd:
        return "wasm_simd";
    }
    return "unknown";
}

#define JOSTLE_INSTANTIATE(Dim, T)                                                                           \
    template const PairBuffer& PairFinder::find(const BoxView<Dim, T>&, const Filter&, Order);               \
    template const PairBuffer& PairFinder::find(const BoxView<Dim, T>&, const BoxView<Dim, T>&,              \
                                                const CrossFilter&, Order);                                  \
    template bool PairFinder::stream(const BoxView<Dim, T>&, PairSink, const Filter&);                       \
    template bool PairFinder::stream(const BoxView<Dim, T>&, const BoxView<Dim, T>&, PairSink,               \
                                     const CrossFilter&);                                                    \
    template PairBuffer find_pairs(const BoxView<Dim, T>&, const Filter&, Order, const FinderOptions&);      \
    template PairBuffer find_pairs(const BoxView<Dim, T>&, const BoxView<Dim, T>&, const CrossFilter&,       \
                                   Order, const FinderOptions&);                                             \
    template bool stream_pairs(const BoxView<Dim, T>&, PairSink, const Filter&, const FinderOptions&);       \
    template bool stream_pairs(const BoxView<Dim, T>&, const BoxView<Dim, T>&, PairSink, const CrossFilter&, \
                               const FinderOptions&);
JOSTLE_INSTANTIATE(2, float)
JOSTLE_INSTANTIATE(2, double)
JOSTLE_INSTANTIATE(3, float)
JOSTLE_INSTANTIATE(3, double)
#undef JOSTLE_INSTANTIATE

JOSTLE_NAMESPACE_END
