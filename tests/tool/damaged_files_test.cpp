// SPDX-License-Identifier: MIT
// Files cut short and with bytes changed: read or refused, never a crash, never a file half-written.
#include <nlohmann/json.hpp>

#include "run_tool.hpp"
#include "tool/scenes/recording.hpp"

namespace tool_test {
namespace {

class DamagedFiles : public ToolTest
{
  protected:
    void expect_read_or_refused(const std::string& name, const std::string& bytes, const std::string& what)
    {
        write(name, bytes);
        std::filesystem::remove(folder / "out.jsonl");
        // Importers that find no end, as Assimp's for PLY, are cut off after a second here.
        const Result result =
            wait(start({"pairs", name, "-o", "out.jsonl", "--stats"}, "", RLIM_INFINITY, 1));
        SCOPED_TRACE(name + ": " + what);
        if (result.exit_code == 0) {
            ++read_;
            // Meshes have triangles: an importer that is cut off has found none, and isn't done.
            const auto stats = nlohmann::json::parse(result.out);
            EXPECT_GE(stats["objects"], name.starts_with("m.") ? 1 : 0);
            EXPECT_EQ(result.err, "");
            EXPECT_TRUE(exists("out.jsonl"));
            EXPECT_EQ(files().size(), 2u);
        } else {
            ++refused_;
            EXPECT_EQ(result.out, "");
            EXPECT_EQ(result.exit_code, 2) << result.err;
            // The file, or what the output can't hold: an id that isn't UTF-8 any more.
            EXPECT_TRUE(result.err.starts_with("jostle: " + name) ||
                        result.err.starts_with("jostle: out.jsonl: id "))
                << result.err;
            EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
            EXPECT_EQ(files(), std::vector<std::string>{name});
        }
    }

    void damage(const std::string& name, const std::string& good, int cuts = 25, int changes_of = 50)
    {
        std::uint64_t state = 0x9e3779b97f4a7c15;
        const auto below = [&state](std::uint64_t n) {
            state = state * 6364136223846793005 + 1442695040888963407;
            return (state >> 33) % n;
        };
        expect_read_or_refused(name, good, "whole");
        ASSERT_EQ(read_, 1);
        for (int i = 0; i < cuts; ++i) {
            const std::size_t size = below(good.size());
            expect_read_or_refused(name, good.substr(0, size), "cut to " + std::to_string(size));
        }
        for (int i = 0; i < changes_of; ++i) {
            std::string bad = good;
            std::string what = "changed";
            const std::uint64_t start = i % 2 == 0 ? std::min<std::size_t>(good.size(), 128) : good.size();
            for (std::uint64_t changes = 1 + below(4); changes > 0;
                 --changes) { // half of them near the start
                const std::size_t at = below(start);
                bad[at] = static_cast<char>(below(256));
                what +=
                    " " + std::to_string(at) + " to " + std::to_string(static_cast<unsigned char>(bad[at]));
            }
            expect_read_or_refused(name, bad, what);
        }
        EXPECT_GT(refused_, 5);
        std::filesystem::remove(folder / name);
    }

  private:
    int read_ = 0, refused_ = 0;
};

TEST_F(DamagedFiles, Csv)
{
    std::string text = "id,lo_x,lo_y,hi_x,hi_y\n";
    for (int i = 0; i < 20; ++i)
        text += "\"box, " + std::to_string(i) + "\"," + std::to_string(i) + ",0," + std::to_string(i + 1) +
                ",1e0\r\n";
    damage("b.csv", text);
}

TEST_F(DamagedFiles, Npy)
{
    damage("b.npy", npy(npy_values(lattice_boxes<3, float>(1, 40), true, true), "<f4", true, "(40, 2, 3)"));
}

TEST_F(DamagedFiles, Recording)
{
    jostle_scenes::RecordingWriter<3, float> writer(folder / "r.jrec", 40, 60, "lattice boxes");
    writer.add_frame(lattice_boxes<3, float>(0, 40));
    writer.finish();
    damage("r.jrec", read("r.jrec"));
}

// Importers of others, which may well crash: that must look like any other damaged file.
TEST_F(DamagedFiles, Obj)
{
    damage("m.obj", read_file("/usr/share/assimp/models/OBJ/box.obj"));
}
TEST_F(DamagedFiles, BinaryStl)
{
    damage("m.stl", read_file("/usr/share/assimp/models/STL/Spider_binary.stl"));
}
TEST_F(DamagedFiles, BinaryPly)
{
    damage("m.ply", read_file("/usr/share/assimp/models/PLY/cube_binary.ply"), 8,
           20); // fewer: on one in three the importer finds no end
}
TEST_F(DamagedFiles, Glb)
{
    damage("m.glb",
           read_file("/usr/share/assimp/models/glTF2/2CylinderEngine-glTF-Binary/2CylinderEngine.glb"));
}

} // namespace
} // namespace tool_test
