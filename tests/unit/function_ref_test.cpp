// SPDX-License-Identifier: MIT
#include "jostle/function_ref.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>

#include "jostle/find_pairs.hpp"
#include "jostle/query.hpp"
#include "jostle/world.hpp"

using namespace jostle;

namespace {

int call_with_three(FunctionRef<int(int)> function)
{
    return function(3);
}
int doubled(int x)
{
    return 2 * x;
}

TEST(FunctionRef, IsTwoPointersAndEmptyByDefault)
{
    static_assert(sizeof(FunctionRef<int(int)>) == 2 * sizeof(void*));
    static_assert(std::is_trivially_copyable_v<FunctionRef<int(int)>>);
    EXPECT_FALSE(FunctionRef<int(int)>());
    EXPECT_FALSE((FunctionRef<int(int)>{}));
}

TEST(FunctionRef, CallsWhatItRefersTo)
{
    int calls = 0;
    auto counting = [&calls](int x) { return ++calls + x; };
    const FunctionRef<int(int)> reference = counting;
    EXPECT_TRUE(reference);
    EXPECT_EQ(reference(10), 11);
    const FunctionRef<int(int)> copy = reference;
    EXPECT_EQ(copy(10), 12);
    EXPECT_EQ(calls, 2);
}

TEST(FunctionRef, TakesLambdasConstObjectsAndPlainFunctions)
{
    EXPECT_EQ(call_with_three([](int x) { return x * x; }), 9);
    const auto constant = [](int x) { return x + 1; };
    EXPECT_EQ(call_with_three(constant), 4);
    int (*pointer)(int) = doubled;
    EXPECT_EQ(call_with_three(pointer), 6);
    auto counting = [calls = 0](int) mutable { return ++calls; };
    EXPECT_EQ(call_with_three(counting), 1);
    EXPECT_EQ(call_with_three(counting), 2); // the object itself, not a copy
}

TEST(FunctionRef, KeepsFunctionsByValueAndRefusesToBeAssignedWhatWouldDie)
{
    using Reference = FunctionRef<int(int)>;
    Reference reference = doubled;
    EXPECT_EQ(reference(4), 8);
    reference = Reference(); // forgets it
    EXPECT_FALSE(reference);
    reference = &doubled; // the pointer is a temporary, the function isn't
    EXPECT_EQ(reference(5), 10);
    auto named = [](int x) { return x - 1; };
    reference = named;
    EXPECT_EQ(reference(5), 4);
    static_assert(std::is_assignable_v<Reference&, decltype(named)&>);
    static_assert(!std::is_assignable_v<Reference&, decltype(named)>);
    struct Holder
    {
        Reference accept = {};
    };
    const auto ask = [](const Holder& holder) { return holder.accept(1); };
    EXPECT_EQ(ask({.accept = [](int x) { return x + 6; }}), 7); // lives as long as the call
}

// A visitor that forgets to return whether to go on isn't taken; where nothing is wanted, any result is
// dropped.
struct ReturnsNothing
{
    void operator()(int) const {}
};
template <class Visitor>
concept MayVisit = requires(const World3f& world, Visitor visitor) { world.visit(Aabb3f(), visitor); };
static_assert(!std::is_constructible_v<FunctionRef<bool(int)>, ReturnsNothing>);
static_assert(!std::is_convertible_v<ReturnsNothing&, FunctionRef<bool(int)>>);
static_assert(!std::is_constructible_v<StoredFunctionRef<bool(int)>, ReturnsNothing&>);
static_assert(!std::is_constructible_v<FunctionRef<bool(int)>, void (*)(int)>);
static_assert(std::is_convertible_v<int (*)(int), FunctionRef<void(int)>>);
static_assert(std::is_convertible_v<int (*)(int), FunctionRef<bool(int)>>);
static_assert(MayVisit<bool (*)(ObjectId)> && !MayVisit<void (*)(ObjectId)> && !MayVisit<bool (*)(int)>);

bool is_less(std::uint32_t a, std::uint32_t b)
{
    return a < b;
}

/// Whether a struct of options takes what lasts and nothing that doesn't.
template <class Stored, class Lambda>
constexpr bool keeps_only_what_lasts()
{
    return std::is_base_of_v<StoredFunctionRef<bool(typename Lambda::First, typename Lambda::Second)>,
                             Stored> &&
           std::is_convertible_v<Lambda&, Stored> && std::is_convertible_v<const Lambda&, Stored> &&
           !std::is_constructible_v<Stored, Lambda> && !std::is_constructible_v<Stored, const Lambda> &&
           !std::is_convertible_v<Lambda, Stored> && std::is_assignable_v<Stored&, Lambda&> &&
           !std::is_assignable_v<Stored&, Lambda>;
}
template <class A, class B>
struct Callable
{
    using First = A;
    using Second = B;
    bool operator()(A, B) const { return true; }
};
static_assert(keeps_only_what_lasts<decltype(Filter::accept), Callable<std::uint32_t, std::uint32_t>>());
static_assert(keeps_only_what_lasts<decltype(CrossFilter::accept), Callable<std::uint32_t, std::uint32_t>>());
static_assert(keeps_only_what_lasts<decltype(QueryFilter::accept), Callable<std::uint32_t, std::uint32_t>>());
static_assert(
    keeps_only_what_lasts<decltype(ObjectQueryFilter::accept), Callable<std::uint32_t, ObjectId>>());

TEST(FunctionRef, AStoredOneTakesNothingThatWouldBeGone)
{
    using Reference = FunctionRef<bool(std::uint32_t, std::uint32_t)>;
    using Stored = decltype(Filter::accept);
    static_assert(sizeof(Stored) == sizeof(Reference) && std::is_trivially_copyable_v<Stored>);
    static_assert(std::is_constructible_v<Stored, Reference&> && !std::is_constructible_v<Stored, Reference>);
    static_assert(!std::is_constructible_v<Stored, std::function<bool(std::uint32_t, std::uint32_t)>>);
    static_assert(!std::is_constructible_v<Stored, std::string&>);

    EXPECT_FALSE(Filter().accept);
    const auto is_greater = [](std::uint32_t a, std::uint32_t b) { return a > b; };
    Filter filter{.accept = is_greater};
    EXPECT_TRUE(filter.accept(2, 1));
    filter.accept = is_less; // the address of a function is a temporary, the function isn't
    EXPECT_FALSE(filter.accept(2, 1));
    filter.accept = &is_less;
    EXPECT_TRUE(filter.accept(1, 2));
    filter.accept = {};
    EXPECT_FALSE(filter.accept);
}

TEST(FunctionRef, CopiesOfAStoredOneReferToWhatItRefersTo)
{
    const auto is_greater = [](std::uint32_t a, std::uint32_t b) { return a > b; };
    FunctionRef<bool(std::uint32_t, std::uint32_t)> reference;
    StoredFunctionRef<bool(std::uint32_t, std::uint32_t)> copy;
    {
        StoredFunctionRef<bool(std::uint32_t, std::uint32_t)> first = is_greater;
        copy = first;
        reference = first;
        first = is_less; // neither of the others refers to the first one
    }
    EXPECT_TRUE(copy(2, 1));
    EXPECT_TRUE(reference(2, 1));
    StoredFunctionRef<bool(std::uint32_t, std::uint32_t)> from_reference = reference;
    reference = is_less;
    EXPECT_TRUE(from_reference(2, 1));
}

TEST(FunctionRef, PassesReferencesMoveOnlyValuesAndExceptions)
{
    std::string text = "a";
    auto append = [](std::string& to) { to += "b"; };
    const FunctionRef<void(std::string&)> by_reference = append;
    by_reference(text);
    EXPECT_EQ(text, "ab");
    auto take = [](std::unique_ptr<int> value) { return *value; };
    EXPECT_EQ(FunctionRef<int(std::unique_ptr<int>)>(take)(std::make_unique<int>(5)), 5);
    auto fail = []() -> int { throw std::runtime_error("passed on"); };
    const FunctionRef<int()> failing = fail;
    EXPECT_THROW(failing(), std::runtime_error);
}

} // namespace
