// SPDX-License-Identifier: MIT
// The text of the errors: what a user reads when the data is wrong.
#include "jostle/error.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "base/number_text.hpp"
#include "jostle/find_pairs.hpp"

using namespace jostle;

namespace {

template <class F>
std::string message_of(F&& call)
{
    try {
        call();
    } catch (const std::runtime_error& error) { // the documented base
        return error.what();
    }
    return "nothing was thrown";
}

std::string message_of_boxes(const std::vector<Aabb3f>& boxes)
{
    return message_of([&] { check_boxes(BoxView<3, float>(boxes)); });
}

TEST(Error, KeepsWhatItIsGiven)
{
    const Error error(ErrorCode::inverted_box, "text", 7);
    EXPECT_EQ(error.code(), ErrorCode::inverted_box);
    EXPECT_EQ(error.index(), 7u);
    EXPECT_STREQ(error.what(), "text");
    EXPECT_EQ(Error(ErrorCode::invalid_argument, "").index(), Error::no_index);
    const Error copy = error;
    EXPECT_STREQ(copy.what(), "text");
}

TEST(ErrorMessage, OfBoxes)
{
    const float nan = std::numeric_limits<float>::quiet_NaN();
    const Aabb3f good{{0, 0, 0}, {1, 1, 1}};
    EXPECT_EQ(message_of_boxes({good, good}), "nothing was thrown");
    EXPECT_EQ(message_of_boxes({good, {{0, nan, 0}, {1, 1, 1}}}),
              "box 1: lo.y is NaN; every bound must be a number (infinite is allowed)");
    EXPECT_EQ(message_of_boxes({{{0, 0, 0}, {1, 1, nan}}, good}),
              "box 0: hi.z is NaN; every bound must be a number (infinite is allowed)");
    EXPECT_EQ(message_of_boxes({good, good, {{2.5f, 0, 0}, {-1, 1, 1}}}),
              "box 2: lo.x = 2.5 is greater than hi.x = -1; swap them or drop the box");
    // Values that differ in the last digit are told apart.
    EXPECT_EQ(message_of_boxes({{{1.00000012f, 0, 0}, {1, 1, 1}}}),
              "box 0: lo.x = 1.00000012 is greater than hi.x = 1; swap them or drop the box");
}

TEST(ErrorMessage, HasNumbersOfNoLocale)
{
    const std::string printed[][2] = {{"2.5", "2.5"},
                                      {"-9,99999968e-21", "-9.99999968e-21"},
                                      {"2\xD9\xAB"
                                       "5",
                                       "2.5"}, // as in ps_AF: two bytes
                                      {"1e+30", "1e+30"},
                                      {"-inf", "-inf"},
                                      {"nan", "nan"},
                                      {"-0", "-0"}};
    for (const auto& [by_printf, expected] : printed)
        EXPECT_EQ(with_a_point(by_printf.c_str()), expected);
}

TEST(ErrorMessage, OfDoublesAndTwoSets)
{
    const std::vector<Aabb2d> good = {{{0, 0}, {1, 1}}}, bad = {{{0, 0.1 + 0.2}, {1, 0.3}}};
    const BoxView<2, double> good_view(good), bad_view(bad);
    EXPECT_EQ(
        message_of([&] { (void)find_pairs(good_view, bad_view); }),
        "box b 0: lo.y = 0.30000000000000004 is greater than hi.y = 0.29999999999999999; swap them or drop "
        "the box");
    EXPECT_EQ(message_of([&] { (void)find_pairs(bad_view, good_view); }).substr(0, 8), "box a 0:");
}

TEST(ErrorMessage, OfFilters)
{
    const std::vector<Aabb2d> boxes(3, Aabb2d{{0, 0}, {1, 1}});
    const BoxView<2, double> view(boxes);
    const std::vector<std::uint32_t> two(2), three(3);
    Filter filter;
    filter.owner = std::span<const std::uint32_t>(two);
    EXPECT_EQ(message_of([&] { (void)find_pairs(view, filter); }),
              "filter owner has 2 entries for 3 objects; give one per object, or none");
    filter.owner = {};
    filter.mask = std::span<const std::uint32_t>(three);
    EXPECT_EQ(message_of([&] { (void)find_pairs(view, filter); }),
              "filter mask is given without category; give both or neither");
}

} // namespace
