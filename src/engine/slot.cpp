// SPDX-License-Identifier: MIT
#include "engine/slot.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace engine {

Job& JobPool::take(std::uint32_t records, std::pmr::memory_resource* memory)
{
    const std::lock_guard lock(mutex_);
    Job* best = nullptr;
    for (const std::unique_ptr<Job>& job : jobs_) {
        if (job->in_use) continue;
        const std::size_t room = job->records.capacity();
        const std::size_t best_room = best == nullptr ? 0 : best->records.capacity();
        const bool better = room >= records ? best_room < records || room < best_room : room > best_room;
        if (best == nullptr || better) best = job.get();
    }
    if (best == nullptr) {
        jobs_.push_back(std::make_unique<Job>(memory));
        best = jobs_.back().get();
    }
    best->in_use = true;
    return *best;
}

void JobPool::take_all_back() noexcept
{
    for (const std::unique_ptr<Job>& job : jobs_)
        job->in_use = false;
}

void JobPool::match(const JobPool& other, std::pmr::memory_resource* memory)
{
    while (jobs_.size() < other.jobs_.size())
        jobs_.push_back(std::make_unique<Job>(memory));
    for (std::size_t k = 0; k < other.jobs_.size(); ++k) {
        jobs_[k]->records.reserve_exactly(other.jobs_[k]->records.capacity());
        jobs_[k]->window_end.reserve_exactly(other.jobs_[k]->window_end.capacity());
    }
}

std::uint64_t JobPool::bytes() const noexcept
{
    std::uint64_t sum = 0;
    for (const std::unique_ptr<Job>& job : jobs_)
        sum += job->records.bytes() + job->window_end.bytes();
    return sum;
}

void Slot::start_search() noexcept
{
    segments.clear();
    jobs.clear();
    chunk_next = chunk_end = nullptr;
    counts = {};
    bad_box = false;
    error = nullptr;
}

void Slot::match(const Slot& other)
{
    const auto mine = buffers(*this);
    const auto theirs = buffers(other);
    const auto match_each = [&]<std::size_t... k>(std::index_sequence<k...>) {
        (std::get<k>(mine).reserve_exactly(std::get<k>(theirs).capacity()), ...);
    };
    match_each(std::make_index_sequence<std::tuple_size_v<decltype(mine)>>());
    segments.reserve(other.segments.capacity());
    jobs.reserve(other.jobs.capacity());
    for (std::size_t depth = 0; depth < other.nested.size(); ++depth)
        nested_store(static_cast<int>(depth)).match(*other.nested[depth]);
}

std::uint64_t Slot::bytes() const noexcept
{
    std::uint64_t sum = store.bytes() + segments.capacity() * sizeof(segments[0]);
    std::apply([&](const auto&... buffer) { ((sum += buffer.bytes()), ...); }, buffers(*this));
    for (const std::unique_ptr<BrickStore>& each : nested)
        sum += each->bytes();
    return sum;
}

BrickStore& Slot::nested_store(int depth)
{
    while (nested.size() <= static_cast<std::size_t>(depth))
        nested.push_back(std::make_unique<BrickStore>(memory));
    return *nested[static_cast<std::size_t>(depth)];
}

} // namespace engine
JOSTLE_NAMESPACE_END
