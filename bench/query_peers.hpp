// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "jostle/query.hpp"

/// Other systems that answer queries about boxes that lie still, behind one interface, so that they can be
/// timed beside Jostle and asked for their answers.
namespace jostle_bench {

using Boxes3 = std::span<const jostle::Aabb3f>;

enum class QueryKind
{
    first,   ///< the first box along a ray
    all,     ///< all boxes along a ray
    sweep,   ///< the first box that a moving box touches
    box,     ///< all boxes that touch a box
    sphere,  ///< all boxes that touch a sphere
    nearest, ///< the boxes nearest to a point
    frustum, ///< all boxes in a view volume
};

/// Queries of all kinds; each kind uses what it needs.
struct Queries
{
    std::vector<jostle::Ray<3, float>> rays;
    std::vector<jostle::Sweep<3, float>> sweeps;
    std::vector<jostle::Aabb3f> boxes;
    std::vector<jostle::Sphere<3, float>> spheres;
    std::vector<jostle::Nearest<3, float>> nearest;
    std::vector<std::array<jostle::Plane<3, float>, 6>> frustums;
};

/// What was found, for comparison: how many results, and a sum over them that names objects and, where
/// several may be equally near, distances only.
struct Answers
{
    std::uint64_t results = 0;
    std::uint64_t checksum = 0;
    void add_object(std::size_t query, std::uint32_t id) noexcept
    {
        ++results;
        checksum += (query + 1) * 0x9e3779b97f4a7c15u ^ ((id + std::uint64_t{1}) * 0xbf58476d1ce4e5b9u);
    }
    void add_distance(std::size_t query, float at) noexcept
    {
        std::uint32_t bits;
        static_assert(sizeof bits == sizeof at);
        __builtin_memcpy(&bits, &at, sizeof bits);
        add_object(query, bits);
    }
    friend bool operator==(const Answers&, const Answers&) = default;
};

/// What a system finds, query after query: kept as its users would, or only counted.
class Findings
{
  public:
    explicit Findings(bool keep) : keep_(keep) {}
    void clear() noexcept
    {
        count_ = 0;
        items_.clear();
        ends_.clear();
    }
    void add(std::uint32_t item)
    {
        if (keep_)
            items_.push_back(item);
        else
            ++count_;
    }
    void add_distance(float at)
    {
        std::uint32_t bits;
        static_assert(sizeof bits == sizeof at);
        __builtin_memcpy(&bits, &at, sizeof bits);
        add(bits);
    }
    void end_query() { ends_.push_back(keep_ ? items_.size() : count_); }
    /// Sums up; the first query has the number `query`.
    void sum(std::size_t query, Answers& answers) const
    {
        std::size_t begin = 0;
        for (const std::size_t end : ends_) {
            if (!keep_) answers.results += end - begin;
            for (std::size_t k = begin; keep_ && k < end; ++k)
                answers.add_object(query, items_[k]);
            begin = end;
            ++query;
        }
    }

  private:
    bool keep_;
    std::size_t count_ = 0;
    std::vector<std::uint32_t> items_;
    std::vector<std::size_t> ends_;
};

/// One system. Results that it offers are checked against the definitions in query.hpp, as any user of it
/// would have to with his own shapes.
///
/// Threads   ask() may be called from several threads at a time.
class QueryPeer
{
  public:
    virtual ~QueryPeer() = default;
    [[nodiscard]] virtual const char* name() const noexcept = 0;
    [[nodiscard]] virtual bool answers(QueryKind kind) const noexcept = 0;
    /// Takes the boxes, which must outlive it.
    virtual void build(Boxes3 boxes) = 0;
    /// Answers query i of a kind.
    virtual void ask(QueryKind kind, const Queries& queries, std::size_t i, Findings& found) const = 0;
};

[[nodiscard]] std::vector<std::unique_ptr<QueryPeer>> make_query_peers();

} // namespace jostle_bench
