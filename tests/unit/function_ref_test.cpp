// SPDX-License-Identifier: MIT
#include "jostle/function_ref.hpp"

#include <gtest/gtest.h>

#include <memory>
#include <stdexcept>
#include <string>

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
