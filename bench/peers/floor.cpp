// SPDX-License-Identifier: MIT
#include <array>
#include <bit>
#include <utility>

#include "jostle/find_pairs.hpp"
#include "peer_parts.hpp"

namespace jostle_bench {
namespace {

constexpr PeerInfo peer_info{
    "floor",
    "no system but what any would have to do at least: read the boxes once, sort n 32-bit keys with payloads "
    "by radix, write as many pairs as the scene has",
    100'000'000, true, false};

struct Item
{
    std::uint32_t key;
    std::uint32_t object;
};

/// An order-preserving map from floats to unsigned integers.
std::uint32_t sortable(float value)
{
    const auto bits = std::bit_cast<std::uint32_t>(value);
    return bits ^ ((bits >> 31) != 0 ? ~0u : 1u << 31);
}

template <int Dim>
class Floor final : public Peer<Dim>
{
  public:
    const PeerInfo& info() const noexcept override { return peer_info; }

    void start(Boxes<Dim> boxes, std::uint32_t threads) override
    {
        executor_ = jostle::make_thread_executor(threads);
        threads_ = threads;
        items_.resize(boxes.size());
        sorted_.resize(boxes.size());
        counts_.resize(threads);
        sums_.resize(threads);
        pairs_.assign(jostle::find_pairs(jostle::BoxView<Dim, float>(boxes)).size(), {0, 0});
    }

    void frame(Boxes<Dim> boxes, std::span<const std::uint32_t>) override
    {
        executor_->run(threads_, [&](std::uint32_t t) {
            Counts counts{}; // of the lowest digit
            std::uint32_t sum = 0;
            for (std::size_t i = begin(t, boxes.size()); i < begin(t + 1, boxes.size()); ++i) {
                for (int d = 0; d < Dim; ++d)
                    sum ^= std::bit_cast<std::uint32_t>(boxes[i].hi[d]) ^
                           std::bit_cast<std::uint32_t>(boxes[i].lo[d]);
                items_[i] = {sortable(boxes[i].lo[0]), static_cast<std::uint32_t>(i)};
                ++counts[items_[i].key % digits];
            }
            counts_[t] = counts;
            sums_[t].value = sum; // so that no compiler leaves out the reading
        });
        for (unsigned shift = 0; shift < 32; shift += digit_bits) {
            if (shift != 0)
                executor_->run(threads_, [&](std::uint32_t t) {
                    Counts counts{};
                    for (std::size_t i = begin(t, items_.size()); i < begin(t + 1, items_.size()); ++i)
                        ++counts[(items_[i].key >> shift) % digits];
                    counts_[t] = counts;
                });
            std::uint32_t next = 0;
            for (std::size_t digit = 0; digit < digits; ++digit)
                for (Counts& counts : counts_)
                    next += std::exchange(counts[digit], next);
            executor_->run(threads_, [&](std::uint32_t t) {
                Counts place = counts_[t]; // own copy: no cache line shared while writing
                for (std::size_t i = begin(t, items_.size()); i < begin(t + 1, items_.size()); ++i)
                    sorted_[place[(items_[i].key >> shift) % digits]++] = items_[i];
            });
            items_.swap(sorted_);
        }
        executor_->run(threads_, [&](std::uint32_t t) {
            for (std::size_t i = begin(t, pairs_.size()); i < begin(t + 1, pairs_.size()); ++i)
                pairs_[i] = {static_cast<std::uint32_t>(i), sums_[t].value};
        });
    }

    PeerResult result() const override { return {pairs_.size(), 0}; }

    void stop() override
    {
        executor_.reset();
        items_ = {};
        sorted_ = {};
        pairs_ = {};
    }

  private:
    static constexpr unsigned digit_bits = 8; // digits of 11 bits, three passes for four, take as long
    static constexpr std::size_t digits = 1u << digit_bits;
    using Counts = std::array<std::uint32_t, digits>;
    struct alignas(64) Sum
    {
        std::uint32_t value;
    };

    std::size_t begin(std::uint32_t thread, std::size_t size) const { return size * thread / threads_; }

    std::unique_ptr<jostle::Executor> executor_;
    std::uint32_t threads_ = 1;
    std::vector<Item> items_, sorted_;
    std::vector<Counts> counts_;
    std::vector<Sum> sums_;
    std::vector<jostle::Pair> pairs_;
};

} // namespace

template <int Dim>
std::unique_ptr<Peer<Dim>> make_floor()
{
    return std::make_unique<Floor<Dim>>();
}
template std::unique_ptr<Peer<2>> make_floor<2>();
template std::unique_ptr<Peer<3>> make_floor<3>();

} // namespace jostle_bench
