// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <memory_resource>
#include <span>
#include <vector>

#include "index/groups.hpp"
#include "index/kernels/kernels.hpp"
#include "index/key.hpp"
#include "index/pool.hpp"
#include "jostle/box_index.hpp"
#include "jostle/function_ref.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace index {

inline constexpr std::uint32_t none = ~std::uint32_t{0};

/// The structure behind an index: which objects lie together, and the nodes that the searches go through.
///
/// Space is halved again and again, at fixed places and in turn along each axis, until no more than 256
/// objects are left: a brick. Which bricks there are follows from the objects, not from the order they came
/// in. Inside a brick, objects lie in blocks of 16. The halvings form a binary trie over the bricks; searches
/// use wide nodes that each stand for up to 16 leaves of a piece of the trie.
template <int Dim, class T>
class Tree
{
  public:
    using Box = Aabb<Dim, T>;
    using View = BoxView<Dim, T>;

    explicit Tree(const IndexOptions& options);

    // The arguments have been checked. Each leaves the tree as before if it throws.
    void insert(std::span<const std::uint32_t> ids, const View& boxes);
    void erase(std::span<const std::uint32_t> ids) noexcept;
    void move(std::span<const std::uint32_t> ids, const View& boxes);
    /// Fills in where objects are now, 256 at most at a time; asked from several threads. A NaN as lo[0] says
    /// that one is gone.
    using Where = FunctionRef<void(std::span<const std::uint32_t> ids, Box* boxes)>;
    /// Moves all objects at once. If it throws the tree is empty, and so it is if it returns false: then so
    /// many belong elsewhere that building it anew costs less.
    bool follow(const Where& where);
    void clear() noexcept;
    /// Of ids above the greatest in use; if there are no objects, all.
    void release_memory() noexcept;

    [[nodiscard]] std::size_t size() const noexcept { return size_; }
    /// One more than the greatest id that was in since clear or release_memory.
    [[nodiscard]] std::uint64_t id_end() const noexcept { return brick_of_.size(); }
    [[nodiscard]] bool contains(std::uint32_t id) const noexcept
    {
        return id < brick_of_.size() && brick_of_[id] != none;
    }
    [[nodiscard]] Box box(std::uint32_t id) const noexcept;
    [[nodiscard]] Child<Dim, T> root() const noexcept { return root_child_; }
    /// The bounds of everything.
    [[nodiscard]] Box hull() const noexcept { return hull_; }
    [[nodiscard]] const Frame<Dim>& frame() const noexcept { return frame_; }
    [[nodiscard]] IndexStats stats() const noexcept;
    /// Null if all is in order, else what isn't. For tests.
    [[nodiscard]] const char* validate() const;

  private:
    using BlockT = Block<Dim, T>;
    using NodeT = Node<Dim, T>;
    using KeyT = Key<Dim>;

    /// A leaf of the trie, or an inner node: bricks have the top bit set.
    using Ref = std::uint32_t;
    static constexpr Ref brick_bit = 1u << 31;

    struct Record
    {
        Box box;
        std::uint32_t id;
    };
    struct Brick
    {
        NodeT node;
        std::uint32_t block[lanes]; // numbers of the blocks, in the order of the node's lanes
        std::uint16_t live[lanes];  // which lanes of each block hold an object
        std::uint32_t blocks, count;
        std::uint32_t disorder;       // objects that came or went since it was put in order
        std::uint16_t changed;        // blocks whose bounds must be found anew
        bool listed, used;            // in the list of bricks to be finished; not given back
        bool drifted;                 // its blocks have become much bigger since it was put in order
        T spread;                     // how big its blocks were then: their edges together
        std::uint32_t parent;         // in the trie
        std::uint32_t wide;           // the wide node that it is a child of ...
        std::uint32_t lane;           // ... and where there
        KeyT key;                     // of some object that is or was in it: tells its place in the trie
        std::uint16_t leaving[lanes]; // while the tree follows: who belongs elsewhere, or nowhere
        Box hull;
    };
    struct Fork
    {
        KeyT key;  // of some object below
        int level; // the digit of the key that tells the sides apart
        std::uint32_t parent;
        Ref child[2];
        std::uint32_t leaves; // of the piece of the trie that begins here
        std::uint32_t wide;   // the wide node of that piece if one begins here, or none
    };
    struct Wide
    {
        NodeT node;
        std::uint32_t fork;
        std::uint32_t wide, lane; // what it is a child of
        std::uint32_t count;
        Box hull;
    };

    void build(std::span<const std::uint32_t> ids, const View& boxes);
    struct Building;
    Ref divide(Building& building, std::size_t begin, std::size_t end, std::uint32_t parent, int unsorted);
    void cut_below(Ref ref);

    std::uint32_t descend(const KeyT& key) const noexcept;
    std::uint32_t make_room(const KeyT& key);
    void add_fork(std::uint32_t parent, Ref before, int level, unsigned side, std::uint32_t fresh,
                  const KeyT& key) noexcept;
    void remove_one(std::uint32_t id) noexcept;
    void put(std::uint32_t brick, std::uint32_t id, const Box& box) noexcept;
    void split(std::uint32_t brick) noexcept;
    void arrange(std::uint32_t brick, Record* records, std::uint32_t count) noexcept;
    std::uint32_t gather(std::uint32_t brick, Record* records) const noexcept;
    void list(std::uint32_t brick) noexcept;
    void finish() noexcept;
    void finish_brick(std::uint32_t brick) noexcept;
    void remove_brick(std::uint32_t brick) noexcept;
    void list_below(Ref ref) noexcept;
    void follow_brick(Brick& brick, const Where& where) noexcept;
    T spread_of(const Brick& brick) const noexcept;
    bool merge(std::uint32_t brick) noexcept;
    struct Place
    {
        std::uint32_t block, lane;
    };
    Place find(std::uint32_t brick, std::uint32_t id) const noexcept;

    std::uint32_t new_brick(const KeyT& key) noexcept;
    void give_brick(std::uint32_t brick) noexcept;
    /// Replaces `before` by `after` below `parent`, or at the root.
    void replace(std::uint32_t parent, Ref before, Ref after) noexcept;
    void set_parent(Ref ref, std::uint32_t parent) noexcept;
    /// Brings the wide nodes in order from `fork` up to the root.
    void repack(std::uint32_t fork) noexcept;
    void cut(std::uint32_t fork) noexcept;
    void set_piece(Ref ref, bool begins) noexcept;
    void fill(std::uint32_t fork) noexcept;
    /// Tells what holds a brick or wide node about its bounds, up to the root.
    void refit(std::uint32_t wide, std::uint32_t lane, Child<Dim, T> child, const Box& hull) noexcept;
    void show_root() noexcept;
    [[nodiscard]] Child<Dim, T> child_of(const Brick& brick) const noexcept;
    [[nodiscard]] std::uint32_t leaves(Ref ref) const noexcept;

    std::pmr::memory_resource* memory_;
    Executor* executor_;
    const Kernels<Dim, T>& kernels_;
    Frame<Dim> frame_;
    Pool<BlockT> blocks_;
    Pool<Brick> bricks_;
    Pool<Fork> forks_;
    Pool<Wide> wides_;
    std::pmr::vector<std::uint32_t> brick_of_; // by id
    std::pmr::vector<std::uint32_t> listed_;   // bricks to be finished
    std::pmr::vector<Record> leaving_;         // working memory of follow
    Ref root_ = none;
    Child<Dim, T> root_child_;
    Box hull_;
    std::size_t size_ = 0;
    std::uint64_t sorts_ = 0, splits_ = 0, splits_before_ = 0;
};

} // namespace index
JOSTLE_NAMESPACE_END
