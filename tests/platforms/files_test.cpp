// SPDX-License-Identifier: MIT
// Files that one platform wrote are read by all: the golden ones hold small_scene(), frame after frame.
#include "golden.hpp"
#include "tool/io/boxes.hpp"
#include "tool/io/input_file.hpp"
#include "tool/scenes/recording.hpp"

namespace platforms_test {
namespace {

TEST(Files, ARecordingIsReadEverywhere)
{
    jostle_scenes::RecordingReader reader(golden("recorder.jrec"));
    EXPECT_EQ(reader.info().frames, 3u);
    EXPECT_EQ(reader.info().frames_per_second, 60);
    auto scene = small_scene();
    std::vector<jostle::Aabb3f> boxes;
    for (int frame = 0; frame < 3; ++frame, scene.step()) {
        ASSERT_TRUE(reader.next(boxes));
        EXPECT_TRUE(std::equal(boxes.begin(), boxes.end(), scene.boxes().begin(), scene.boxes().end(), same));
    }
    EXPECT_FALSE(reader.next(boxes));
}

TEST(Files, AnArrayOfNumPyIsReadEverywhere)
{
    // In both orders of bytes, and with NumPy's own names for them.
    const auto scene = small_scene();
    for (const char order : {'<', '>'}) {
        std::string bytes = "\x93NUMPY\x01";
        bytes += std::string("\0\x76\0", 3);
        std::string header =
            std::string("{'descr': '") + order + "f4', 'fortran_order': False, 'shape': (60, 2, 3), }";
        header.resize(0x75, ' ');
        bytes += header + "\n";
        for (const jostle::Aabb3f& box : scene.boxes())
            for (const auto& side : {box.lo, box.hi})
                for (const float x : side) {
                    const auto bits = std::bit_cast<std::uint32_t>(x);
                    for (int byte = 0; byte < 4; ++byte)
                        bytes += static_cast<char>(bits >> 8 * (order == '<' ? byte : 3 - byte) & 0xff);
                }
        const std::string name = order == '<' ? "little.npy" : "big.npy";
        expect_golden(name, bytes);
        jostle_tool::InputFile file(golden(name));
        const jostle_tool::BoxSet set = jostle_tool::read_npy(file);
        const auto& boxes = std::get<std::vector<jostle::Aabb3f>>(set.boxes);
        EXPECT_TRUE(std::equal(boxes.begin(), boxes.end(), scene.boxes().begin(), scene.boxes().end(), same));
    }
}

} // namespace
} // namespace platforms_test
