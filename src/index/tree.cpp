// SPDX-License-Identifier: MIT
#include "index/tree.hpp"

#include <algorithm>
#include <bit>
#include <functional>
#include <limits>
#include <numeric>
#include <utility>

#include "fetch.hpp"
#include "jostle/process.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace index {
namespace {

/// Bricks with fewer objects together become one.
constexpr std::uint32_t merge_below = 144;

/// A piece of the trie this small may go on upwards where its bigger neighbour is cut off.
constexpr std::uint32_t straggler = 3;

/// A brick is put in order again when this many objects came or went.
constexpr std::uint32_t tolerated_disorder(std::uint32_t count)
{
    return 2 + count / 32;
}

/// ... or, where all move a little in every frame, when its blocks' edges are that much longer.
constexpr double tolerated_spread = 1.125;

template <int Dim, class T>
bool same(const Aabb<Dim, T>& a, const Aabb<Dim, T>& b) noexcept
{
    for (int d = 0; d < Dim; ++d)
        if (a.lo[d] != b.lo[d] || a.hi[d] != b.hi[d]) return false;
    return true;
}

template <int Dim, class T>
bool inside(const Aabb<Dim, T>& a, const Aabb<Dim, T>& b) noexcept
{
    for (int d = 0; d < Dim; ++d)
        if (a.lo[d] < b.lo[d] || a.hi[d] > b.hi[d]) return false;
    return true;
}

/// A frame for a tree that begins with these boxes.
template <int Dim, class T>
Frame<Dim> choose_frame(const BoxView<Dim, T>& boxes)
{
    constexpr double furthest = 1e300;
    const std::size_t samples = std::min<std::size_t>(boxes.size(), 2048);
    std::vector<double> center(samples), size(samples, 0.0);
    Frame<Dim> frame;
    double world = 0;
    for (int d = 0; d < Dim; ++d) {
        for (std::size_t k = 0; k < samples; ++k) {
            // Somewhere in the k-th part of all: regular patterns of the user's mustn't show.
            const std::size_t begin = boxes.size() * k / samples, end = boxes.size() * (k + 1) / samples;
            const std::size_t i =
                begin + static_cast<std::size_t>(((k + 1) * 0x9e3779b97f4a7c15u) >> 32) % (end - begin);
            const double lo = std::max(-furthest, std::min(static_cast<double>(boxes.lo(d, i)), furthest));
            const double hi = std::max(-furthest, std::min(static_cast<double>(boxes.hi(d, i)), furthest));
            center[k] = 0.5 * lo + 0.5 * hi;
            size[k] = std::max(size[k], hi - lo);
        }
        const auto at = [&](std::size_t rank) {
            std::nth_element(center.begin(), center.begin() + static_cast<std::ptrdiff_t>(rank),
                             center.end());
            return center[rank];
        };
        const double low = at(samples / 64), high = at(samples - 1 - samples / 64);
        frame.origin[d] = 0.5 * low + 0.5 * high;
        world = std::max(world, high - low);
    }
    std::nth_element(size.begin(), size.begin() + static_cast<std::ptrdiff_t>(samples / 2), size.end());
    const double common = size[samples / 2];
    if (!(world > 0)) world = common; // all in one place
    if (!(world > 0)) world = 1;
    world = std::max(world, 1e-280);
    frame.scale = 4398046511104.0 / world; // 2^42
    for (double& origin : frame.origin)
        origin -= world;
    // Sixteen to a brick's edge if most have no size.
    frame.common_size = std::max(8 * common, world * 1e-4);
    return frame;
}

} // namespace

template <int Dim, class T>
Tree<Dim, T>::Tree(const IndexOptions& options)
    : memory_(options.memory),
      executor_(options.executor),
      kernels_(kernels_for<Dim, T>(options.instruction_set)),
      blocks_(memory_),
      bricks_(memory_),
      forks_(memory_),
      wides_(memory_),
      brick_of_(memory_),
      listed_(memory_),
      leaving_(memory_)
{
    show_root();
}

/// ---- Bricks --------------------------------------------------------------------------------------------

/// The objects of a brick on their way into blocks.
template <int Dim>
struct Ordering
{
    std::int32_t center[Dim][brick_capacity]; // 0 to 2^30 over the brick
    std::uint8_t order[brick_capacity];
    void (*sort_few)(std::uint32_t* numbers, std::uint32_t count);

    /// Splits [begin, end) so that neighbours come together in whole blocks.
    void run(std::uint32_t begin, std::uint32_t end) noexcept
    {
        const std::uint32_t count = end - begin;
        if (count <= lanes) return;
        int axis = 0;
        std::int32_t low_there = 0, widest = -1;
        for (int d = 0; d < Dim; ++d) {
            std::int32_t low = center[d][begin], high = low;
            for (std::uint32_t k = begin; k < end; ++k) {
                low = std::min(low, center[d][k]);
                high = std::max(high, center[d][k]);
            }
            if (high - low <= widest) continue;
            widest = high - low;
            low_there = low;
            axis = d;
        }
        // 24 bits of the place, and where to find the object.
        const int shift =
            std::max(0, static_cast<int>(std::bit_width(static_cast<std::uint32_t>(widest))) - 24);
        std::uint32_t keys[brick_capacity];
        for (std::uint32_t k = 0; k < count; ++k)
            keys[k] = static_cast<std::uint32_t>((center[axis][begin + k] - low_there) >> shift) << 8 | k;
        sort_few(keys, count);
        std::int32_t sorted[brick_capacity];
        for (int d = 0; d < Dim; ++d) {
            for (std::uint32_t k = 0; k < count; ++k)
                sorted[k] = center[d][begin + (keys[k] & 0xff)];
            std::copy_n(sorted, count, center[d] + begin);
        }
        for (std::uint32_t k = 0; k < count; ++k)
            sorted[k] = order[begin + (keys[k] & 0xff)];
        for (std::uint32_t k = 0; k < count; ++k)
            order[begin + k] = static_cast<std::uint8_t>(sorted[k]);
        const std::uint32_t blocks = (count + lanes - 1) / lanes;
        const std::uint32_t middle = begin + blocks / 2 * lanes;
        run(begin, middle);
        run(middle, end);
    }
};

template <int Dim, class T>
void Tree<Dim, T>::arrange(std::uint32_t number, Record* records, std::uint32_t count) noexcept
{
    Brick& brick = bricks_[number];
    Ordering<Dim> ordering;
    ordering.sort_few = kernels_.sort_few;
    constexpr T furthest = T(1e37), least = T(1e-30);
    T center[Dim][brick_capacity], low[Dim], extent = 0;
    for (int d = 0; d < Dim; ++d) {
        for (std::uint32_t k = 0; k < count; ++k)
            center[d][k] = std::max(-furthest, std::min(records[k].box.lo[d], furthest)) +
                           std::max(-furthest, std::min(records[k].box.hi[d], furthest));
        const auto [first, last] = std::minmax_element(center[d], center[d] + count);
        low[d] = *first;
        extent = std::max(extent, *last - *first);
    }
    const T scale = extent > least ? T(1 << 30) / extent : T(0);
    for (std::uint32_t k = 0; k < count; ++k) {
        ordering.order[k] = static_cast<std::uint8_t>(k);
        for (int d = 0; d < Dim; ++d)
            ordering.center[d][k] = static_cast<std::int32_t>((center[d][k] - low[d]) * scale);
    }
    ordering.run(0, count);

    const std::uint32_t blocks = (count + lanes - 1) / lanes;
    while (brick.blocks > blocks)
        blocks_.give(brick.block[--brick.blocks]);
    while (brick.blocks < blocks)
        brick.block[brick.blocks++] = blocks_.take();
    brick.node.bounds.clear();
    for (std::uint32_t b = 0; b < lanes; ++b) {
        if (b >= blocks) {
            brick.node.child[b] = {};
            brick.live[b] = 0;
            continue;
        }
        BlockT& block = blocks_[brick.block[b]];
        const std::uint32_t here = std::min(lanes, count - b * lanes);
        for (std::uint32_t k = 0; k < lanes; ++k) {
            if (k < here) {
                const Record& record = records[ordering.order[b * lanes + k]];
                block.bounds.set(k, record.box);
                block.id[k] = record.id;
            } else {
                block.bounds.clear(k);
                block.id[k] = no_id;
            }
        }
        brick.live[b] = static_cast<std::uint16_t>((1u << here) - 1);
        brick.node.bounds.set(b, block.bounds.hull());
        brick.node.child[b] = &block;
    }
    brick.count = count;
    brick.disorder = 0;
    brick.changed = 0;
    brick.hull = brick.node.bounds.hull();
    brick.drifted = false;
    brick.spread = spread_of(brick);
}

template <int Dim, class T>
T Tree<Dim, T>::spread_of(const Brick& brick) const noexcept
{
    T sum = 0;
    for (std::uint32_t b = 0; b < brick.blocks; ++b)
        if (brick.live[b] != 0)
            for (int d = 0; d < Dim; ++d)
                sum += brick.node.bounds.hi[d][b] - brick.node.bounds.lo[d][b];
    return sum;
}

template <int Dim, class T>
std::uint32_t Tree<Dim, T>::gather(std::uint32_t number, Record* records) const noexcept
{
    const Brick& brick = bricks_[number];
    std::uint32_t count = 0;
    for (std::uint32_t b = 0; b < brick.blocks; ++b) {
        const BlockT& block = blocks_[brick.block[b]];
        for (unsigned live = brick.live[b]; live != 0; live &= live - 1) {
            const auto lane = static_cast<std::uint32_t>(std::countr_zero(live));
            records[count++] = {block.bounds.get(lane), block.id[lane]};
        }
    }
    return count;
}

template <int Dim, class T>
auto Tree<Dim, T>::find(std::uint32_t number, std::uint32_t id) const noexcept -> Place
{
    const Brick& brick = bricks_[number];
    for (std::uint32_t b = 0;; ++b) {
        const BlockT& block = blocks_[brick.block[b]];
        unsigned found = 0;
        for (std::uint32_t lane = 0; lane < lanes; ++lane)
            found |= static_cast<unsigned>(block.id[lane] == id) << lane;
        if (found != 0) return {b, static_cast<std::uint32_t>(std::countr_zero(found))};
    }
}

/// Adds an object to a brick that has room for it, and for a block if it needs one.
template <int Dim, class T>
void Tree<Dim, T>::put(std::uint32_t number, std::uint32_t id, const Box& box) noexcept
{
    Brick& brick = bricks_[number];
    // Where it makes the bounds grow least.
    std::uint32_t best = lanes;
    T least = std::numeric_limits<T>::infinity();
    for (std::uint32_t b = 0; b < brick.blocks; ++b) {
        if (brick.live[b] == 0xffff) continue;
        T growth = 0;
        for (int d = 0; d < Dim; ++d)
            growth += std::max(T(0), brick.node.bounds.lo[d][b] - box.lo[d]) +
                      std::max(T(0), box.hi[d] - brick.node.bounds.hi[d][b]);
        if (best == lanes || growth < least) {
            least = growth;
            best = b;
        }
    }
    if (best == lanes) {
        best = brick.blocks++;
        brick.block[best] = blocks_.take();
        BlockT& fresh = blocks_[brick.block[best]];
        fresh.bounds.clear();
        std::fill_n(fresh.id, lanes, no_id);
        brick.live[best] = 0;
        brick.node.child[best] = &fresh;
    }
    BlockT& block = blocks_[brick.block[best]];
    const auto lane = static_cast<std::uint32_t>(std::countr_one(brick.live[best]));
    block.bounds.set(lane, box);
    block.id[lane] = id;
    brick.live[best] = static_cast<std::uint16_t>(brick.live[best] | (1u << lane));
    brick.changed = static_cast<std::uint16_t>(brick.changed | (1u << best));
    // The next object of this batch is to see it.
    for (int d = 0; d < Dim; ++d) {
        brick.node.bounds.lo[d][best] = std::min(brick.node.bounds.lo[d][best], box.lo[d]);
        brick.node.bounds.hi[d][best] = std::max(brick.node.bounds.hi[d][best], box.hi[d]);
    }
    ++brick.count;
    ++brick.disorder;
    brick_of_[id] = number;
    ++size_;
    list(number);
}

template <int Dim, class T>
void Tree<Dim, T>::remove_one(std::uint32_t id) noexcept
{
    const std::uint32_t number = brick_of_[id];
    Brick& brick = bricks_[number];
    const Place place = find(number, id);
    BlockT& block = blocks_[brick.block[place.block]];
    block.bounds.clear(place.lane);
    block.id[place.lane] = no_id;
    brick.live[place.block] = static_cast<std::uint16_t>(brick.live[place.block] & ~(1u << place.lane));
    brick.changed = static_cast<std::uint16_t>(brick.changed | (1u << place.block));
    --brick.count;
    ++brick.disorder;
    brick_of_[id] = none;
    --size_;
    list(number);
}

/// There is room in the list: see prepare.
template <int Dim, class T>
void Tree<Dim, T>::list(std::uint32_t number) noexcept
{
    Brick& brick = bricks_[number];
    if (brick.listed) return;
    brick.listed = true;
    listed_.push_back(number);
}

template <int Dim, class T>
std::uint32_t Tree<Dim, T>::new_brick(const KeyT& key) noexcept
{
    const std::uint32_t number = bricks_.take();
    Brick& brick = bricks_[number];
    brick.blocks = brick.count = brick.disorder = 0;
    brick.changed = 0;
    brick.listed = brick.drifted = false;
    brick.used = true;
    brick.spread = 0;
    brick.parent = brick.wide = none;
    brick.key = key;
    brick.node.bounds.clear();
    std::fill_n(brick.node.child, lanes, Child<Dim, T>());
    std::fill_n(brick.live, lanes, std::uint16_t{0});
    brick.hull = brick.node.bounds.hull();
    return number;
}

template <int Dim, class T>
void Tree<Dim, T>::give_brick(std::uint32_t number) noexcept
{
    Brick& brick = bricks_[number];
    while (brick.blocks > 0)
        blocks_.give(brick.block[--brick.blocks]);
    brick.used = false;
    bricks_.give(number);
}

/// ---- The trie ------------------------------------------------------------------------------------------

template <int Dim, class T>
void Tree<Dim, T>::set_parent(Ref ref, std::uint32_t parent) noexcept
{
    if (ref & brick_bit)
        bricks_[ref & ~brick_bit].parent = parent;
    else
        forks_[ref].parent = parent;
}

template <int Dim, class T>
void Tree<Dim, T>::replace(std::uint32_t parent, Ref before, Ref after) noexcept
{
    if (parent == none) {
        root_ = after;
    } else {
        Fork& fork = forks_[parent];
        fork.child[fork.child[0] == before ? 0 : 1] = after;
    }
    if (after != none) set_parent(after, parent);
}

/// The brick that a key leads to.
template <int Dim, class T>
std::uint32_t Tree<Dim, T>::descend(const KeyT& key) const noexcept
{
    Ref ref = root_;
    while (!(ref & brick_bit)) {
        const Fork& fork = forks_[ref];
        ref = fork.child[digit_of(key, fork.level)];
    }
    return ref & ~brick_bit;
}

/// Returns the brick that an object with this key belongs to, with room for it.
template <int Dim, class T>
std::uint32_t Tree<Dim, T>::make_room(const KeyT& key)
{
    for (;;) {
        std::size_t way = 0;
        const std::uint32_t number = root_ == none ? none : descend(key);
        if (number != none)
            for (std::uint32_t fork = bricks_[number].parent; fork != none; fork = forks_[fork].parent)
                ++way;
        // Everything below can't fail.
        const std::size_t undo = splits_ - splits_before_;
        blocks_.reserve(2 * lanes + 2 + undo);
        bricks_.reserve(1);
        forks_.reserve(1);
        wides_.reserve(2 * way + 4);
        if (listed_.capacity() < bricks_.in_use() + 1) listed_.reserve(2 * bricks_.in_use() + 64);

        if (number == none) {
            const std::uint32_t fresh = new_brick(key);
            root_ = fresh | brick_bit;
            return fresh;
        }
        Brick& brick = bricks_[number];
        const int level = first_difference(key, brick.key);
        if (brick.parent == none || level > forks_[brick.parent].level) {
            if (brick.count < brick_capacity) return number;
            split(number);
            continue;
        }
        // It lies outside of the space that the brick stands for: a new side of some fork above.
        std::uint32_t below = brick.parent;
        while (forks_[below].parent != none && forks_[forks_[below].parent].level > level)
            below = forks_[below].parent;
        const std::uint32_t fresh = new_brick(key);
        add_fork(forks_[below].parent, below, level, digit_of(key, level), fresh, key);
        return fresh;
    }
}

/// Puts a fork where `before` is, with the brick `fresh` on the given side and `before` on the other.
template <int Dim, class T>
void Tree<Dim, T>::add_fork(std::uint32_t parent, Ref before, int level, unsigned side, std::uint32_t fresh,
                            const KeyT& key) noexcept
{
    const std::uint32_t number = forks_.take();
    Fork& fork = forks_[number];
    fork.level = level;
    fork.wide = none;
    fork.key = key;
    replace(parent, before, number);
    fork.child[side] = fresh | brick_bit;
    fork.child[1 - side] = before;
    set_parent(fork.child[0], number);
    set_parent(fork.child[1], number);
    repack(number);
}

template <int Dim, class T>
void Tree<Dim, T>::split(std::uint32_t number) noexcept
{
    Record records[brick_capacity], other[brick_capacity];
    const std::uint32_t count = gather(number, records);
    KeyT keys[brick_capacity];
    keys[0] = key_of(frame_, records[0].box, records[0].id);
    int level = key_digits<Dim>;
    for (std::uint32_t k = 1; k < count; ++k) {
        keys[k] = key_of(frame_, records[k].box, records[k].id);
        level = std::min(level, first_difference(keys[k], keys[0]));
    }
    std::uint32_t stay = 0, go = 0;
    KeyT key_stay = keys[0], key_go = keys[0];
    for (std::uint32_t k = 0; k < count; ++k) {
        if (digit_of(keys[k], level) == 0) {
            key_stay = keys[k];
            records[stay++] = records[k];
        } else {
            key_go = keys[k];
            other[go++] = records[k];
        }
    }
    const std::uint32_t fresh = new_brick(key_go);
    bricks_[number].key = key_stay;
    arrange(number, records, stay);
    arrange(fresh, other, go);
    sorts_ += 2;
    for (std::uint32_t k = 0; k < go; ++k)
        brick_of_[other[k].id] = fresh;
    ++splits_;
    add_fork(bricks_[number].parent, number | brick_bit, level, 1, fresh, keys[0]);
}

/// Takes an empty brick out.
template <int Dim, class T>
void Tree<Dim, T>::remove_brick(std::uint32_t number) noexcept
{
    const std::uint32_t parent = bricks_[number].parent;
    give_brick(number);
    if (parent == none) {
        root_ = none;
        show_root();
        return;
    }
    const Fork& fork = forks_[parent];
    const Ref sibling = fork.child[fork.child[0] == (number | brick_bit) ? 1 : 0];
    const std::uint32_t above = fork.parent;
    if (fork.wide != none) wides_.give(fork.wide);
    replace(above, parent, sibling);
    forks_.give(parent);
    repack(above);
}

/// Joins a brick with the one beside it if both together are small.
template <int Dim, class T>
bool Tree<Dim, T>::merge(std::uint32_t number) noexcept
{
    const std::uint32_t parent = bricks_[number].parent;
    if (parent == none) return false;
    const Fork& fork = forks_[parent];
    const Ref sibling = fork.child[fork.child[0] == (number | brick_bit) ? 1 : 0];
    if (!(sibling & brick_bit)) return false;
    const std::uint32_t other = sibling & ~brick_bit;
    if (bricks_[number].count + bricks_[other].count > merge_below) return false;
    Record records[brick_capacity];
    std::uint32_t count = gather(number, records);
    const std::uint32_t own = count;
    count += gather(other, records + count);
    // No block too few: those of the other are given back first.
    Brick& gone = bricks_[other];
    while (gone.blocks > 0)
        blocks_.give(gone.block[--gone.blocks]);
    gone.count = 0;
    arrange(number, records, count);
    ++sorts_;
    for (std::uint32_t k = own; k < count; ++k)
        brick_of_[records[k].id] = number;
    remove_brick(other);
    return true;
}

/// ---- The wide nodes ------------------------------------------------------------------------------------

template <int Dim, class T>
Child<Dim, T> Tree<Dim, T>::child_of(const Brick& brick) const noexcept
{
    return &brick.node;
}

template <int Dim, class T>
std::uint32_t Tree<Dim, T>::leaves(Ref ref) const noexcept
{
    return ref & brick_bit ? 1 : forks_[ref].leaves;
}

/// Decides which children of a fork begin a piece of their own: pieces have at most 16 leaves, and where both
/// sides together have more, they are cut off; both, or the tree would be deeper than need be.
template <int Dim, class T>
void Tree<Dim, T>::cut(std::uint32_t number) noexcept
{
    Fork& fork = forks_[number];
    std::uint32_t left = leaves(fork.child[0]), right = leaves(fork.child[1]);
    bool begins[2] = {false, false};
    if (left + right > lanes) {
        begins[0] = left >= right || left > straggler;
        begins[1] = !begins[0] || right >= left || right > straggler;
        left = begins[0] ? 1 : left;
        right = begins[1] ? 1 : right;
    }
    fork.leaves = left + right;
    set_piece(fork.child[0], begins[0]);
    set_piece(fork.child[1], begins[1]);
}

template <int Dim, class T>
void Tree<Dim, T>::set_piece(Ref ref, bool begins) noexcept
{
    if (ref & brick_bit) return;
    Fork& fork = forks_[ref];
    if (begins == (fork.wide != none)) return;
    if (begins) {
        fork.wide = wides_.take();
        wides_[fork.wide].wide = none;
        fill(ref);
    } else {
        wides_.give(fork.wide);
        fork.wide = none;
    }
}

template <int Dim, class T>
void Tree<Dim, T>::fill(std::uint32_t number) noexcept
{
    const std::uint32_t own = forks_[number].wide;
    Wide& wide = wides_[own];
    wide.fork = number;
    wide.node.bounds.clear();
    std::fill_n(wide.node.child, lanes, Child<Dim, T>());
    wide.count = 0;
    Ref way[2 * lanes]; // a piece has fewer than 16 forks
    std::uint32_t depth = 0;
    way[depth++] = forks_[number].child[1];
    way[depth++] = forks_[number].child[0];
    while (depth > 0) {
        const Ref ref = way[--depth];
        const std::uint32_t lane = wide.count;
        if (ref & brick_bit) {
            Brick& brick = bricks_[ref & ~brick_bit];
            brick.wide = own;
            brick.lane = lane;
            wide.node.bounds.set(lane, brick.hull);
            wide.node.child[lane] = child_of(brick);
            ++wide.count;
        } else if (forks_[ref].wide != none) {
            Wide& below = wides_[forks_[ref].wide];
            below.wide = own;
            below.lane = lane;
            wide.node.bounds.set(lane, below.hull);
            wide.node.child[lane] = &below.node;
            ++wide.count;
        } else {
            way[depth++] = forks_[ref].child[1];
            way[depth++] = forks_[ref].child[0];
        }
    }
    wide.hull = wide.node.bounds.hull();
}

template <int Dim, class T>
void Tree<Dim, T>::repack(std::uint32_t fork) noexcept
{
    std::uint32_t below = none;
    for (; fork != none; fork = forks_[fork].parent) {
        const bool stood = below != none && forks_[below].wide != none;
        cut(fork);
        if (stood && forks_[below].wide != none) fill(below);
        below = fork;
    }
    if (below != none && forks_[below].wide != none) fill(below);
    if (root_ != none && !(root_ & brick_bit)) set_piece(root_, true);
    show_root();
}

template <int Dim, class T>
void Tree<Dim, T>::refit(std::uint32_t wide_number, std::uint32_t lane, Child<Dim, T> child,
                         const Box& hull) noexcept
{
    Box box = hull;
    while (wide_number != none) {
        Wide& wide = wides_[wide_number];
        wide.node.child[lane] = child;
        wide.node.bounds.set(lane, box);
        const Box whole = wide.node.bounds.hull();
        if (same(whole, wide.hull)) return;
        wide.hull = box = whole;
        child = &wide.node;
        lane = wide.lane;
        wide_number = wide.wide;
    }
    show_root();
}

template <int Dim, class T>
void Tree<Dim, T>::show_root() noexcept
{
    if (root_ == none) {
        root_child_ = {};
        Bounds<Dim, T> empty;
        empty.clear();
        hull_ = empty.hull();
    } else if (root_ & brick_bit) {
        Brick& brick = bricks_[root_ & ~brick_bit];
        brick.wide = none;
        root_child_ = child_of(brick);
        hull_ = brick.hull;
    } else {
        Wide& wide = wides_[forks_[root_].wide];
        wide.wide = none;
        root_child_ = &wide.node;
        hull_ = wide.hull;
    }
}

/// ---- Changes -------------------------------------------------------------------------------------------

template <int Dim, class T>
void Tree<Dim, T>::finish_brick(std::uint32_t number) noexcept
{
    Brick& brick = bricks_[number];
    if (brick.count == 0) {
        remove_brick(number);
        return;
    }
    if (brick.count < merge_below) {
        if (merge(number)) {
            Brick& merged = bricks_[number];
            refit(merged.wide, merged.lane, child_of(merged), merged.hull);
            if (merged.parent == none) show_root();
            return;
        }
    }
    if (brick.disorder > tolerated_disorder(brick.count)) {
        Record records[brick_capacity];
        const std::uint32_t count = gather(number, records);
        arrange(number, records, count);
        ++sorts_;
    } else {
        for (unsigned changed = brick.changed; changed != 0; changed &= changed - 1) {
            const auto b = static_cast<std::uint32_t>(std::countr_zero(changed));
            brick.node.bounds.set(b, blocks_[brick.block[b]].bounds.hull());
        }
        for (std::uint32_t b = brick.blocks; b-- > 0;) {
            if (brick.live[b] != 0) continue;
            blocks_.give(brick.block[b]);
            const std::uint32_t last = --brick.blocks;
            brick.block[b] = brick.block[last];
            brick.live[b] = brick.live[last];
            brick.node.child[b] = brick.node.child[last];
            brick.node.bounds.set(b, brick.node.bounds.get(last));
            brick.live[last] = 0;
            brick.node.child[last] = {};
            brick.node.bounds.clear(last);
        }
        brick.changed = 0;
        brick.hull = brick.node.bounds.hull();
    }
    if (brick.wide != none)
        refit(brick.wide, brick.lane, child_of(brick), brick.hull);
    else
        show_root();
}

template <int Dim, class T>
void Tree<Dim, T>::finish() noexcept
{
    for (const std::uint32_t number : listed_) {
        Brick& brick = bricks_[number];
        if (!brick.listed) continue; // given back meanwhile
        brick.listed = false;
        if (brick.used) finish_brick(number);
    }
    listed_.clear();
}

template <int Dim, class T>
void Tree<Dim, T>::insert(std::span<const std::uint32_t> ids, const View& boxes)
{
    if (ids.empty()) return;
    const std::size_t end_before = brick_of_.size();
    const std::size_t end =
        std::max<std::size_t>(end_before, std::size_t{*std::max_element(ids.begin(), ids.end())} + 1);
    std::size_t done = 0;
    try {
        // Half as many again for ids that come one by one, nothing extra for one far beyond.
        if (brick_of_.capacity() < end) brick_of_.reserve(std::max(end, end_before + end_before / 2));
        brick_of_.resize(end, none);
        if (size_ == 0) {
            build(ids, boxes);
            return;
        }
        splits_before_ = splits_;
        for (; done < ids.size(); ++done) {
            const Box box = boxes[done];
            put(make_room(key_of(frame_, box, ids[done])), ids[done], box);
        }
    } catch (...) {
        while (done > 0)
            remove_one(ids[--done]);
        finish();
        brick_of_.resize(end_before, none);
        throw;
    }
    finish();
}

template <int Dim, class T>
void Tree<Dim, T>::erase(std::span<const std::uint32_t> ids) noexcept
{
    for (const std::uint32_t id : ids)
        remove_one(id);
    finish();
}

template <int Dim, class T>
void Tree<Dim, T>::move(std::span<const std::uint32_t> ids, const View& boxes)
{
    std::pmr::vector<Box> before(memory_);
    before.reserve(ids.size());
    splits_before_ = splits_;
    const auto set = [&](std::uint32_t number, std::uint32_t id, const Box& box) {
        const Place place = find(number, id);
        Brick& brick = bricks_[number];
        blocks_[brick.block[place.block]].bounds.set(place.lane, box);
        brick.changed = static_cast<std::uint16_t>(brick.changed | (1u << place.block));
        if (!inside(box, brick.node.bounds.get(place.block))) ++brick.disorder;
        list(number);
    };
    try {
        for (std::size_t i = 0; i < ids.size(); ++i) {
            const std::uint32_t id = ids[i];
            const Box box = boxes[i];
            const KeyT key = key_of(frame_, box, id);
            before.push_back(this->box(id));
            const Brick& brick = bricks_[brick_of_[id]];
            if (brick.parent == none || first_difference(key, brick.key) > forks_[brick.parent].level) {
                set(brick_of_[id], id, box);
                continue;
            }
            const std::uint32_t to = make_room(key);
            remove_one(id);
            put(to, id, box);
        }
    } catch (...) {
        // Backwards, so that whatever was pushed out finds its place free again. Bricks only got smaller,
        // none was given back, and make_room keeps a block for each split.
        if (before.size() > 0) before.pop_back();
        for (std::size_t i = before.size(); i-- > 0;) {
            const std::uint32_t id = ids[i], to = descend(key_of(frame_, before[i], id));
            if (to == brick_of_[id]) {
                set(to, id, before[i]);
            } else {
                remove_one(id);
                put(to, id, before[i]);
            }
        }
        finish();
        throw;
    }
    finish();
}

template <int Dim, class T>
void Tree<Dim, T>::list_below(Ref ref) noexcept
{
    if (ref & brick_bit) {
        list(ref & ~brick_bit);
        return;
    }
    list_below(forks_[ref].child[0]);
    list_below(forks_[ref].child[1]);
}

/// Sets the boxes of a brick's objects and finds its blocks' bounds. Those who leave are marked, and are where
/// they were, with their new boxes.
template <int Dim, class T>
void Tree<Dim, T>::follow_brick(Brick& brick, const Where& where) noexcept
{
    std::uint32_t ids[brick_capacity], count = 0;
    Box boxes[brick_capacity];
    for (std::uint32_t b = 0; b < brick.blocks; ++b)
        fetch(blocks_[brick.block[b]].id);
    for (std::uint32_t b = 0; b < brick.blocks; ++b)
        for (unsigned live = brick.live[b]; live != 0; live &= live - 1)
            ids[count++] = blocks_[brick.block[b]].id[std::countr_zero(live)];
    where({ids, count}, boxes);
    const int level = brick.parent == none ? -1 : forks_[brick.parent].level;
    const Cell<Dim> cell(frame_, brick.key, level + 1);
    count = 0;
    for (std::uint32_t b = 0; b < brick.blocks; ++b) {
        BlockT& block = blocks_[brick.block[b]];
        Bounds<Dim, T> hull; // of which lane 0 is used
        hull.clear(0);
        unsigned leaving = 0;
        for (unsigned live = brick.live[b]; live != 0; live &= live - 1, ++count) {
            const auto lane = static_cast<std::uint32_t>(std::countr_zero(live));
            const Box& box = boxes[count];
            block.bounds.set(lane, box);
            if (!cell.holds(box) && (box.lo[0] != box.lo[0] ||
                                     first_difference(key_of(frame_, box, ids[count]), brick.key) <= level)) {
                leaving |= 1u << lane;
                continue;
            }
            for (int d = 0; d < Dim; ++d) {
                hull.lo[d][0] = std::min(hull.lo[d][0], box.lo[d]);
                hull.hi[d][0] = std::max(hull.hi[d][0], box.hi[d]);
            }
        }
        brick.node.bounds.set(b, hull.get(0));
        brick.live[b] = static_cast<std::uint16_t>(brick.live[b] & ~leaving);
        brick.leaving[b] = static_cast<std::uint16_t>(leaving);
    }
    brick.changed = 0;
    brick.drifted =
        static_cast<double>(spread_of(brick)) > tolerated_spread * static_cast<double>(brick.spread);
}

template <int Dim, class T>
bool Tree<Dim, T>::follow(const Where& where)
{
    if (root_ == none) return false;
    try {
        splits_before_ = splits_;
        list_below(root_);
        const ProcessOptions few_bricks{executor_, 8};
        const auto each_brick = [&](const auto& body) {
            process_items(
                listed_.size(),
                [&](std::uint64_t begin, std::uint64_t end, Work) {
                    for (std::size_t k = begin; k < end; ++k)
                        body(listed_[k], bricks_[listed_[k]]);
                },
                few_bricks);
        };
        each_brick([&](std::uint32_t, Brick& brick) { follow_brick(brick, where); });

        leaving_.clear();
        const std::size_t size_before = size_;
        for (const std::uint32_t number : listed_) {
            Brick& brick = bricks_[number];
            for (std::uint32_t b = 0; b < brick.blocks; ++b) {
                BlockT& block = blocks_[brick.block[b]];
                for (unsigned left = brick.leaving[b]; left != 0; left &= left - 1) {
                    const auto lane = static_cast<std::uint32_t>(std::countr_zero(left));
                    const Record record{block.bounds.get(lane), block.id[lane]};
                    if (record.box.lo[0] == record.box.lo[0]) leaving_.push_back(record);
                    block.bounds.clear(lane);
                    block.id[lane] = no_id;
                    brick_of_[record.id] = none;
                    --brick.count;
                    --size_;
                }
            }
        }
        // One that is put elsewhere costs three times as much as one that is built.
        if ((size_before - size_) * 3 > size_before) {
            clear();
            return false;
        }
        // A brick that needs fewer blocks gives some back: not by several threads.
        each_brick([&](std::uint32_t number, Brick& brick) {
            if (!brick.drifted || brick.blocks != (brick.count + lanes - 1) / lanes) return;
            Record records[brick_capacity];
            const std::uint32_t count = gather(number, records);
            arrange(number, records, count);
        });
        for (const Record& record : leaving_)
            put(make_room(key_of(frame_, record.box, record.id)), record.id, record.box);
        for (const std::uint32_t number : listed_) {
            // Who came in was put where it makes the blocks grow least; the next call sees whether that will do.
            Brick& brick = bricks_[number];
            brick.disorder = brick.drifted ? brick_capacity : 0;
        }
        finish();
    } catch (...) {
        clear();
        throw;
    }
    return true;
}

template <int Dim, class T>
void Tree<Dim, T>::clear() noexcept
{
    brick_of_.clear();
    listed_.clear();
    blocks_.clear();
    bricks_.clear();
    forks_.clear();
    wides_.clear();
    root_ = none;
    size_ = 0;
    show_root();
}

template <int Dim, class T>
void Tree<Dim, T>::release_memory() noexcept
{
    while (!brick_of_.empty() && brick_of_.back() == none)
        brick_of_.pop_back();
    brick_of_.shrink_to_fit();
    if (size_ != 0) return;
    listed_.shrink_to_fit();
    leaving_.clear();
    leaving_.shrink_to_fit();
    blocks_.release();
    bricks_.release();
    forks_.release();
    wides_.release();
}

template <int Dim, class T>
auto Tree<Dim, T>::box(std::uint32_t id) const noexcept -> Box
{
    const std::uint32_t number = brick_of_[id];
    const Place place = find(number, id);
    return blocks_[bricks_[number].block[place.block]].bounds.get(place.lane);
}

/// ---- From nothing --------------------------------------------------------------------------------------

template <int Dim, class T>
struct Tree<Dim, T>::Building
{
    struct Entry
    {
        std::uint64_t digits; // of its key, from the first on in which those around it differ
        std::uint32_t box;
    };
    struct Plan
    {
        std::uint32_t brick;
        std::size_t begin; // of its entries
    };
    const Frame<Dim>& frame;
    std::span<const std::uint32_t> ids;
    const View& boxes;
    Executor* executor;
    std::pmr::vector<Entry> entries, sorted;
    std::pmr::vector<std::uint32_t> places; // by part and digits: how many, then where to
    std::pmr::vector<Plan> bricks;

    [[nodiscard]] KeyT key(const Entry& entry) const noexcept
    {
        return key_of(frame, boxes[entry.box], ids[entry.box]);
    }

    /// Works on the parts of [begin, end), which depend on the number of entries alone.
    template <class Body>
    void in_parts(std::size_t begin, std::size_t end, const Body& body)
    {
        constexpr std::size_t least_part = 8192;
        const std::size_t count = end - begin;
        process_items(count,
                      [&](std::uint64_t from, std::uint64_t to, Work work) {
                          body(work.block, std::span<Entry>(entries).subspan(begin + from, to - from));
                      },
                      {executor, std::max(least_part, (count + most_parts - 1) / most_parts)});
    }
    static constexpr std::size_t most_parts = 8;

    /// Gives entries that don't differ in their digits some in which they do.
    void look_closer(std::size_t begin, std::size_t end)
    {
        constexpr int per_axis = 60 / Dim;
        const KeyT first = key(entries[begin]);
        std::uint64_t centers[most_parts] = {};
        std::uint32_t classes[most_parts] = {};
        in_parts(begin, end, [&](std::uint32_t part, std::span<Entry> some) {
            std::uint64_t differing = 0;
            for (const Entry& entry : some) {
                const KeyT here = key(entry);
                for (int d = 0; d < Dim; ++d)
                    differing |= here.center[d] ^ first.center[d];
                classes[part] |= here.size_class ^ first.size_class;
            }
            centers[part] = differing;
        });
        const std::uint64_t differing =
            std::accumulate(centers, centers + most_parts, std::uint64_t{0}, std::bit_or<>());
        const bool by_id =
            differing == 0 && std::accumulate(classes, classes + most_parts, 0u, std::bit_or<>()) == 0;
        const int shift = std::max(0, static_cast<int>(std::bit_width(differing)) - per_axis);
        in_parts(begin, end, [&](std::uint32_t, std::span<Entry> some) {
            for (Entry& entry : some) {
                const KeyT here = key(entry);
                std::uint64_t digits = here.size_class;
                digits <<= 60;
                for (int d = 0; d < Dim; ++d)
                    digits |= spread<Dim>((here.center[d] >> shift) & ((1u << per_axis) - 1))
                              << (Dim - 1 - d);
                entry.digits = by_id ? here.id : digits;
            }
        });
    }

    /// Sorts entries by a few digits, mostly enough to tell the bricks apart. Returns how many low digits it
    /// didn't look at.
    int sort(std::size_t begin, std::size_t end)
    {
        constexpr std::uint32_t to_a_cell = 64;
        constexpr int most_digits = 15;
        std::uint64_t differing = 0;
        for (int look = 0; differing == 0; ++look) {
            if (look != 0) look_closer(begin, end);
            for (std::size_t k = begin; k < end; ++k)
                differing |= entries[k].digits ^ entries[begin].digits;
        }
        const int wanted = std::min(static_cast<int>(std::bit_width((end - begin) / to_a_cell)), most_digits);
        const int shift = std::max(0, static_cast<int>(std::bit_width(differing)) - wanted);
        const std::size_t cells = std::size_t{1} << wanted;
        const auto cell_of = [&](const Entry& entry) {
            return static_cast<std::size_t>(entry.digits >> shift) & (cells - 1);
        };
        places.assign(most_parts * cells, 0);
        in_parts(begin, end, [&](std::uint32_t part, std::span<Entry> some) {
            for (const Entry& entry : some)
                ++places[part * cells + cell_of(entry)];
        });
        auto place = static_cast<std::uint32_t>(begin);
        for (std::size_t cell = 0; cell < cells; ++cell)
            for (std::size_t part = 0; part < most_parts; ++part)
                place += std::exchange(places[part * cells + cell], place);
        in_parts(begin, end, [&](std::uint32_t part, std::span<Entry> some) {
            for (const Entry& entry : some)
                sorted[places[part * cells + cell_of(entry)]++] = entry;
        });
        if (end - begin == entries.size())
            entries.swap(sorted);
        else
            std::copy(sorted.data() + begin, sorted.data() + end, entries.data() + begin);
        return shift;
    }
};

/// Of a tree that is empty.
template <int Dim, class T>
void Tree<Dim, T>::build(std::span<const std::uint32_t> ids, const View& boxes)
{
    try {
        frame_ = choose_frame(boxes);
        using Entries = std::pmr::vector<typename Building::Entry>;
        Building building{frame_,
                          ids,
                          boxes,
                          executor_,
                          Entries(ids.size(), memory_),
                          Entries(ids.size(), memory_),
                          std::pmr::vector<std::uint32_t>(memory_),
                          std::pmr::vector<typename Building::Plan>(memory_)};
        for (std::size_t i = 0; i < ids.size(); ++i)
            building.entries[i] = {0, static_cast<std::uint32_t>(i)};
        root_ = divide(building, 0, ids.size(), none, 63);
        process_items(building.bricks.size(),
                      [&](std::uint64_t begin, std::uint64_t end, Work) {
                          Record records[brick_capacity];
                          for (std::size_t b = begin; b < end; ++b) {
                              const auto [number, first] = building.bricks[b];
                              const std::uint32_t count = bricks_[number].count;
                              for (std::uint32_t k = 0; k < count; ++k) {
                                  const std::uint32_t box = building.entries[first + k].box;
                                  records[k] = {boxes[box], ids[box]};
                                  brick_of_[ids[box]] = number;
                              }
                              arrange(number, records, count);
                          }
                      },
                      {executor_, 16});
        sorts_ += building.bricks.size();
        wides_.reserve(1);
        cut_below(root_);
        if (!(root_ & brick_bit)) set_piece(root_, true);
        size_ = ids.size();
        show_root();
    } catch (...) {
        clear(); // as it was
        throw;
    }
}

/// Makes the forks and bricks of some entries, which are sorted but for the last digits; what is in the bricks
/// comes later.
template <int Dim, class T>
auto Tree<Dim, T>::divide(Building& building, std::size_t begin, std::size_t end, std::uint32_t parent,
                          int unsorted) -> Ref
{
    const auto& entries = building.entries;
    const std::size_t count = end - begin;
    if (count <= brick_capacity) {
        blocks_.reserve(lanes);
        bricks_.reserve(1);
        if (listed_.capacity() < bricks_.in_use() + 1) listed_.reserve(2 * bricks_.in_use() + 64);
        const std::uint32_t number = new_brick(building.key(entries[begin]));
        Brick& brick = bricks_[number];
        brick.parent = parent;
        brick.count = static_cast<std::uint32_t>(count);
        while (brick.blocks * lanes < brick.count)
            brick.block[brick.blocks++] = blocks_.take();
        building.bricks.push_back({number, begin});
        return number | brick_bit;
    }
    if ((entries[begin].digits ^ entries[end - 1].digits) >> unsorted == 0)
        unsorted = building.sort(begin, end);
    forks_.reserve(1);
    const std::uint32_t number = forks_.take();
    forks_[number].key = building.key(entries[begin]);
    forks_[number].level = first_difference(forks_[number].key, building.key(entries[end - 1]));
    forks_[number].parent = parent;
    forks_[number].wide = none;
    const auto first = entries.begin() + static_cast<std::ptrdiff_t>(begin);
    const std::uint64_t mark = std::bit_floor(entries[begin].digits ^ entries[end - 1].digits);
    const auto middle = std::partition_point(first, first + static_cast<std::ptrdiff_t>(count),
                                             [&](const auto& entry) { return (entry.digits & mark) == 0; });
    const auto split = begin + static_cast<std::size_t>(middle - first);
    const Ref left = divide(building, begin, split, number, unsorted);
    const Ref right = divide(building, split, end, number, unsorted);
    forks_[number].child[0] = left;
    forks_[number].child[1] = right;
    return number;
}

/// Makes the wide nodes below a fork and decides where it is cut.
template <int Dim, class T>
void Tree<Dim, T>::cut_below(Ref ref)
{
    if (ref & brick_bit) return;
    cut_below(forks_[ref].child[0]);
    cut_below(forks_[ref].child[1]);
    wides_.reserve(2);
    cut(ref);
}

/// ---- Looking at it -------------------------------------------------------------------------------------

template <int Dim, class T>
IndexStats Tree<Dim, T>::stats() const noexcept
{
    IndexStats stats;
    stats.objects = size_;
    stats.bricks = bricks_.in_use();
    stats.blocks = blocks_.in_use();
    stats.nodes = wides_.in_use();
    stats.sorts = sorts_;
    stats.splits = splits_;
    stats.bytes = blocks_.bytes() + bricks_.bytes() + forks_.bytes() + wides_.bytes() +
                  (brick_of_.capacity() + listed_.capacity()) * sizeof(std::uint32_t) +
                  leaving_.capacity() * sizeof(Record);
    return stats;
}

template <int Dim, class T>
const char* Tree<Dim, T>::validate() const
{
    const auto holds = [](const Box& outer, const Box& inner) { return inside(inner, outer); };
    std::size_t objects = 0;
    std::uint64_t bricks = 0, wides = 0, blocks = 0, forks = 0;
    std::vector<Ref> way;
    if (root_ != none) way.push_back(root_);
    while (!way.empty()) {
        const Ref ref = way.back();
        way.pop_back();
        if (!(ref & brick_bit)) {
            const Fork& fork = forks_[ref];
            ++forks;
            if (fork.leaves < 2 || fork.leaves > lanes) return "a piece has too many leaves or too few";
            for (const Ref child : fork.child) {
                const std::uint32_t parent =
                    child & brick_bit ? bricks_[child & ~brick_bit].parent : forks_[child].parent;
                if (parent != ref) return "a child names another parent";
                if (!(child & brick_bit) && forks_[child].level <= fork.level)
                    return "a fork is above a higher digit";
                way.push_back(child);
            }
            if (fork.wide == none) continue;
            ++wides;
            const Wide& wide = wides_[fork.wide];
            if (wide.fork != ref || wide.count != fork.leaves) return "a wide node doesn't know its fork";
            if (!same(wide.hull, wide.node.bounds.hull())) return "a wide node's bounds are stale";
            if (wide.wide == none) {
                if (ref != root_) return "a wide node hangs nowhere";
                continue;
            }
            const Wide& above = wides_[wide.wide];
            if (!(above.node.child[wide.lane] == Child<Dim, T>(&wide.node)))
                return "a wide node isn't where it says";
            if (!same(above.node.bounds.get(wide.lane), wide.hull))
                return "the bounds above a wide node are stale";
            continue;
        }
        const std::uint32_t number = ref & ~brick_bit;
        const Brick& brick = bricks_[number];
        ++bricks;
        if (!brick.used || brick.listed) return "a brick is unfinished";
        if (brick.count == 0 || brick.count > brick_capacity) return "a brick is empty or overfull";
        if (brick.wide != none) {
            const Wide& above = wides_[brick.wide];
            if (!(above.node.child[brick.lane] == child_of(brick))) return "a brick isn't where it says";
            if (!same(above.node.bounds.get(brick.lane), brick.hull))
                return "the bounds above a brick are stale";
        }
        std::uint32_t count = 0;
        for (std::uint32_t b = 0; b < brick.blocks; ++b) {
            const BlockT& block = blocks_[brick.block[b]];
            ++blocks;
            if (block.live() != brick.live[b] || brick.live[b] == 0)
                return "a block's objects are miscounted";
            if (!(brick.node.child[b] == Child<Dim, T>(&block))) return "a brick's node names another block";
            if (!same(brick.node.bounds.get(b), block.bounds.hull()))
                return "the bounds of a block are stale";
            for (unsigned live = brick.live[b]; live != 0; live &= live - 1) {
                const auto lane = static_cast<std::uint32_t>(std::countr_zero(live));
                if (brick_of_[block.id[lane]] != number) return "an object is noted in another brick";
                if (!holds(hull_, block.bounds.get(lane))) return "an object lies outside of everything";
                if (descend(key_of(frame_, block.bounds.get(lane), block.id[lane])) != number)
                    return "an object belongs into another brick";
                ++count;
            }
        }
        if (count != brick.count) return "a brick's objects are miscounted";
        objects += count;
    }
    if (objects != size_) return "objects are lost";
    if (bricks != bricks_.in_use() || blocks != blocks_.in_use() || wides != wides_.in_use() ||
        forks != forks_.in_use())
        return "something is in use that nothing refers to";
    return nullptr;
}

template class Tree<2, float>;
template class Tree<2, double>;
template class Tree<3, float>;
template class Tree<3, double>;

} // namespace index
JOSTLE_NAMESPACE_END
