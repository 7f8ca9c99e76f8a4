// SPDX-License-Identifier: MIT
// What messages and tables make of text from files, and of times.
#include <string>

#include <gtest/gtest.h>

#include "tool/numbers.hpp"
#include "tool/text.hpp"

namespace {

using namespace jostle_tool;

TEST(Text, WhatCanBeShownStaysAsItIs)
{
    const std::string text =
        " aZ~\\\" \xc2\xa0\xc3\xa9 \xe2\x82\xac \xed\x9f\xbf\xee\x80\x80 \xf0\x9f\x98\x80 "
        "\xf4\x8f\xbf\xbf";
    EXPECT_EQ(printable(text), text);
    EXPECT_EQ(printable(""), "");
}

TEST(Text, ControlCharactersAndWhatIsNoUtf8AreEscaped)
{
    EXPECT_EQ(printable(std::string("a\0b\x1b[31m\n\r\t\x7f", 12)), "a\\x00b\\x1b[31m\\x0a\\x0d\\x09\\x7f");
    EXPECT_EQ(printable("\xc2\x9b\xc2\x80"), "\\xc2\\x9b\\xc2\\x80"); // control characters of two bytes
    EXPECT_EQ(printable("\x80\xbf\xff\xfe"), "\\x80\\xbf\\xff\\xfe");
    EXPECT_EQ(printable("\xc3"), "\\xc3"); // cut off
    EXPECT_EQ(printable("\xe2\x82"), "\\xe2\\x82");
    EXPECT_EQ(printable("\xe2\x28\xa1"), "\\xe2(\\xa1");
    EXPECT_EQ(printable("\xc1\x81"), "\\xc1\\x81"); // longer than it needs to be
    EXPECT_EQ(printable("\xe0\x81\x81"), "\\xe0\\x81\\x81");
    EXPECT_EQ(printable("\xf0\x82\x82\xac"), "\\xf0\\x82\\x82\\xac");
    EXPECT_EQ(printable("\xed\xa0\x80"), "\\xed\\xa0\\x80");          // half of a UTF-16 pair
    EXPECT_EQ(printable("\xf4\x90\x80\x80"), "\\xf4\\x90\\x80\\x80"); // above the last character
    EXPECT_EQ(printable("\xf8\x88\x80\x80\x80"), "\\xf8\\x88\\x80\\x80\\x80");
    const std::string once = printable("\x1b\xff");
    EXPECT_EQ(printable(once), once);
}

TEST(Text, LongTextIsCutBetweenCharacters)
{
    EXPECT_EQ(quote(std::string(40, 'y')), '"' + std::string(40, 'y') + '"');
    EXPECT_EQ(quote(std::string(41, 'y')), '"' + std::string(40, 'y') + "...\"");
    EXPECT_EQ(quote(std::string(1000000, '\x1b')).size(), 40u * 4 + 5);
    EXPECT_EQ(shortened("abcd", 3), "abc...");
    std::string text = "y";
    for (int i = 0; i < 30; ++i)
        text += "\xe2\x82\xac";
    EXPECT_EQ(shortened(text), text.substr(0, 40) + "...");             // 1 + 13 x 3
    EXPECT_EQ(shortened("y" + text), "y" + text.substr(0, 37) + "..."); // not 38 or 39
    EXPECT_EQ(shortened(std::string(50, '\x80'), 8).substr(0, 8), "\\x80\\x80");
}

TEST(Numbers, MedianIsTheMeanOfTheTwoInTheMiddle)
{
    EXPECT_EQ(median({}), 0);
    EXPECT_EQ(median({3}), 3);
    EXPECT_EQ(median({5, 1}), 3);
    EXPECT_EQ(median({9, 1, 2}), 2);
    EXPECT_EQ(median({100, 1, 4, 2}), 3);
}

TEST(Numbers, AreGroupedRoundedAndHex)
{
    EXPECT_EQ(grouped(0), "0");
    EXPECT_EQ(grouped(999), "999");
    EXPECT_EQ(grouped(1000), "1,000");
    EXPECT_EQ(grouped(123456), "123,456");
    EXPECT_EQ(grouped(~std::uint64_t{0}), "18,446,744,073,709,551,615");
    EXPECT_EQ(hex(0xab), "00000000000000ab");
    EXPECT_EQ(rounded(0.12344999), 0.1234);
}

} // namespace
