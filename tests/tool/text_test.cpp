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

TEST(Text, WholeNumbersAreReadAsPeopleWriteThem)
{
    for (const char* const million : {"1000000", "1,000,000", "1000k", "1000K", "1M", "1e6", "1E6", "1e+6",
                                      "10e5", "0.1e7", "1.0M", "0001000000", "0.001e9"})
        EXPECT_EQ(read_whole(million), 1'000'000u) << million;
    EXPECT_EQ(read_whole("0"), 0u);
    EXPECT_EQ(read_whole("0e9999"), 0u);
    EXPECT_EQ(read_whole("2.5k"), 2500u);
    EXPECT_EQ(read_whole("12,345"), 12345u);
    EXPECT_EQ(read_whole("18446744073709551615"), ~std::uint64_t{0});
    EXPECT_EQ(read_whole("18446744073709551.615k"), ~std::uint64_t{0});
    EXPECT_EQ(read_whole("18446744073709551.616k"), std::nullopt);
    for (const char* const none : {"",
                                   "k",
                                   "M",
                                   "e6",
                                   "1e",
                                   "1e+",
                                   "1e-3",
                                   "1e6x",
                                   "1kk",
                                   "1 k",
                                   "1.5",
                                   "1.",
                                   ".5k",
                                   "1.k",
                                   "1.2345k",
                                   "1.2.3M",
                                   "-1",
                                   "+1",
                                   "-1k",
                                   "1,00",
                                   "1,0000",
                                   "0,001",
                                   ",100",
                                   "1,",
                                   "1000,000",
                                   "1,000k",
                                   "18446744073709551616",
                                   "1e20",
                                   "1e99999999999999999999",
                                   "1e4294967296",
                                   "0x10",
                                   "inf"})
        EXPECT_EQ(read_whole(none), std::nullopt) << none;
    for (const std::uint64_t number : {1u, 999u, 1000u, 123456u, 98765432u})
        EXPECT_EQ(read_whole(grouped(number)), number);
}

TEST(Text, ListsHaveCommasAsGroupsOfDigitsHave)
{
    using List = std::vector<std::string>;
    EXPECT_EQ(read_list("1000"), List{"1000"});
    EXPECT_EQ(read_list("1,000,000"), List{"1000000"});
    EXPECT_EQ(read_list("10,000"), List{"10000"});
    EXPECT_EQ(read_list("100,200"), (List{"100", "200"}));
    EXPECT_EQ(read_list("1,2,4"), (List{"1", "2", "4"}));
    EXPECT_EQ(read_list("10k,1M"), (List{"10k", "1M"}));
    EXPECT_EQ(read_list("1,,2,"), (List{"1", "", "2", ""}));
    EXPECT_EQ(read_list(""), List{""});
}

TEST(Text, TimesHaveDigitsToSee)
{
    EXPECT_EQ(time_text(0), "0.0 us");
    EXPECT_EQ(time_text(0.00043), "0.4 us");
    EXPECT_EQ(time_text(0.0354), "35.4 us");
    EXPECT_EQ(time_text(0.1), "0.100 ms");
    EXPECT_EQ(time_text(12.3456), "12.346 ms");
    EXPECT_EQ(time_text(1500), "1.50 s");
    EXPECT_EQ(time_left(0.25, 4), ", about 12 s left");
    EXPECT_EQ(time_left(0.1, 100), ", about 15 min left");
    EXPECT_EQ(time_left(0.01, 4), "");
    EXPECT_EQ(time_left(1, 4), "");
}

TEST(Text, SuggestsWhatIsMostLikeAWord)
{
    const std::vector<std::string> names = {"pairs", "bench", "distribute", "distances"};
    EXPECT_EQ(suggestion("bnech", names), "; did you mean bench?");
    EXPECT_EQ(suggestion("benhc", names), "; did you mean bench?");
    EXPECT_EQ(suggestion("dmeo", {"demo"}), "; did you mean demo?"); // of four letters one slip counts
    EXPECT_EQ(suggestion("dxxo", {"demo"}), "; choose from demo");
    EXPECT_EQ(suggestion("pair", names), "; did you mean pairs?");
    EXPECT_EQ(suggestion("pears", names), "; did you mean pairs?");
    EXPECT_EQ(suggestion("dist", names), "; did you mean distribute?");
    EXPECT_EQ(suggestion("distence", names), "; did you mean distances?");
    EXPECT_EQ(suggestion("xyz", names), "; choose from pairs, bench, distribute, distances");
    EXPECT_EQ(suggestion("", names), "; choose from pairs, bench, distribute, distances");
    EXPECT_EQ(suggestion(std::string(100'000, 'b'), names),
              "; choose from pairs, bench, distribute, distances");
}

} // namespace
