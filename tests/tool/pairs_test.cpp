// SPDX-License-Identifier: MIT
// jostle pairs on good input: every format, dimension, precision, engine and number of threads gives the
// pairs of the definition.
#include <csignal>
#include <cstdio>
#include <numeric>

#include <nlohmann/json.hpp>

#include "run_tool.hpp"
#include "tool/scenes/recording.hpp"

namespace tool_test {
namespace {

using jostle::Pair;
using nlohmann::json;

std::string hex(std::uint64_t number)
{
    char text[17];
    std::snprintf(text, sizeof text, "%016llx", static_cast<unsigned long long>(number));
    return text;
}

std::string pairs_csv(const std::vector<Pair>& pairs)
{
    std::string text = "a,b\n";
    for (const Pair& pair : pairs)
        text += std::to_string(pair.a) + "," + std::to_string(pair.b) + "\n";
    return text;
}

/// Shortest text that reads back as the same number.
template <class T>
std::string exact(T value)
{
    char text[40];
    std::snprintf(text, sizeof text, "%.17g", static_cast<double>(value));
    return text;
}

template <int Dim, class T>
std::string boxes_csv(const std::vector<jostle::Aabb<Dim, T>>& boxes)
{
    std::string text = Dim == 2 ? "lo_x,lo_y,hi_x,hi_y\n" : "lo_x,lo_y,lo_z,hi_x,hi_y,hi_z\n";
    for (const auto& box : boxes) {
        for (int i = 0; i < 2 * Dim; ++i)
            text += (i == 0 ? "" : ",") + exact(i < Dim ? box.lo[i] : box.hi[i - Dim]);
        text += '\n';
    }
    return text;
}

class Pairs : public ToolTest
{
  protected:
    /// --stats of the file with every engine and number of threads equals what the definition says.
    void expect_stats(const std::string& file, std::size_t objects, const std::vector<Pair>& pairs,
                      const std::vector<std::string>& more = {})
    {
        for (const char* engine : {"default", "chapter", "brute"})
            for (const int threads : {1, 2, 7}) {
                std::vector<std::string> arguments{
                    "pairs", file, "--stats", "--threads", std::to_string(threads), "--engine", engine};
                arguments.insert(arguments.end(), more.begin(), more.end());
                const Result result = run(arguments);
                SCOPED_TRACE(file + " " + engine + " " + std::to_string(threads));
                ASSERT_EQ(result.err, ""); // also: no word from oneTBB about too many threads
                ASSERT_EQ(result.exit_code, 0);
                const json stats = json::parse(result.out);
                EXPECT_EQ(stats["objects"], objects);
                EXPECT_EQ(stats["pairs"], pairs.size());
                EXPECT_EQ(stats["checksum"], hex(jostle::pair_checksum(pairs)));
                EXPECT_EQ(stats["threads"], threads);
            }
    }

    /// Also the pairs themselves, in every output format.
    void expect_pairs(const std::string& file, const std::vector<Pair>& pairs, const std::string& threads,
                      const std::string& engine = "default")
    {
        SCOPED_TRACE(file + " on " + threads + " by " + engine);
        const std::vector<std::string> start{"pairs", file, "--threads", threads, "--engine", engine};
        const auto with = [&](std::vector<std::string> more) {
            more.insert(more.begin(), start.begin(), start.end());
            return more;
        };
        Result result = run(start);
        EXPECT_EQ(result.err, "");
        EXPECT_EQ(result.out, pairs_csv(pairs));

        result = run(with({"-o", "out.csv", "--stats"}));
        EXPECT_EQ(result.err, "");
        EXPECT_EQ(json::parse(result.out)["pairs"], pairs.size());
        EXPECT_EQ(json::parse(result.out)["checksum"], hex(jostle::pair_checksum(pairs)));
        EXPECT_EQ(read("out.csv"), pairs_csv(pairs));

        result = run(with({"-o", "out.jsonl"}));
        EXPECT_EQ(result.err + result.out, "");
        std::string lines;
        for (const Pair& pair : pairs)
            lines += "{\"a\":" + std::to_string(pair.a) + ",\"b\":" + std::to_string(pair.b) + "}\n";
        EXPECT_EQ(read("out.jsonl"), lines);

        result = run(with({"-o", "out.npy"}));
        EXPECT_EQ(result.err + result.out, "");
        std::vector<std::uint32_t> numbers;
        for (const Pair& pair : pairs)
            numbers.insert(numbers.end(), {pair.a, pair.b});
        EXPECT_EQ(read("out.npy"), npy(numbers, "<u4", false, "(" + std::to_string(pairs.size()) + ", 2)"));
    }
};

template <class Box>
struct BoxType;
template <int D, class T>
struct BoxType<jostle::Aabb<D, T>>
{
    static constexpr int dim = D;
    using Number = T;
};

template <class Box>
class EveryBoxType : public Pairs
{
};
using BoxTypes = testing::Types<jostle::Aabb2f, jostle::Aabb2d, jostle::Aabb3f, jostle::Aabb3d>;
TYPED_TEST_SUITE(EveryBoxType, BoxTypes);

TYPED_TEST(EveryBoxType, HasThePairsOfTheDefinitionFromEveryFormat)
{
    constexpr int dim = BoxType<TypeParam>::dim;
    using T = typename BoxType<TypeParam>::Number;
    const auto boxes = lattice_boxes<dim, T>(7 + dim, 700);
    const std::vector<Pair> pairs = jostle::find_pairs_brute_force(jostle::BoxView<dim, T>(boxes));
    ASSERT_GT(pairs.size(), 500u);

    this->write("boxes.csv", boxes_csv(boxes));
    this->expect_stats("boxes.csv", boxes.size(), pairs);
    this->expect_pairs("boxes.csv", pairs, "7");
    this->expect_pairs("boxes.csv", pairs, "2", "chapter");
    this->expect_pairs("boxes.csv", pairs, "2", "brute");

    const std::string type = sizeof(T) == 4 ? "f4" : "f8";
    const std::string n = std::to_string(boxes.size()), d = std::to_string(dim), d2 = std::to_string(2 * dim);
    this->write("plain.npy",
                npy(npy_values(boxes, false, false), "<" + type, false, "(" + n + ", " + d2 + ")"));
    this->expect_stats("plain.npy", boxes.size(), pairs);
    this->expect_pairs("plain.npy", pairs, "1");
    for (const int version : {1, 2, 3})
        for (const bool fortran : {false, true})
            for (const bool nested : {false, true})
                for (const char* order : {"<", ">"}) {
                    SCOPED_TRACE(std::to_string(version) + (fortran ? " F" : " C") +
                                 (nested ? " nested " : " flat ") + order);
                    const std::string shape =
                        nested ? "(" + n + ", 2, " + d + ")" : "(" + n + ", " + d2 + ")";
                    this->write("b.npy", npy(npy_values(boxes, fortran, nested), order + type, fortran, shape,
                                             version));
                    const Result result = this->run({"pairs", "b.npy"});
                    EXPECT_EQ(result.err, "");
                    EXPECT_EQ(result.out, pairs_csv(pairs));
                }
}

/// Arrays longer than what is read at once.
TEST_F(Pairs, LongArraysAreReadWhole)
{
    std::vector<jostle::Aabb2f> boxes;
    std::vector<Pair> pairs;
    for (std::uint32_t i = 0; i < 300'000; ++i) {
        const bool meets_the_next = i % 1000 == 999 && i + 1 < 300'000;
        const float x = 2 * static_cast<float>(i);
        boxes.push_back({{x, 0}, {x + (meets_the_next ? 2 : 1), 1}});
        if (meets_the_next) pairs.push_back({i, i + 1});
    }
    for (const bool fortran : {false, true})
        for (const bool nested : {false, true})
            for (const char* order : {"<f4", ">f4"}) {
                SCOPED_TRACE(std::string(fortran ? "F" : "C") + (nested ? " nested " : " flat ") + order);
                write("long.npy", npy(npy_values(boxes, fortran, nested), order, fortran,
                                      nested ? "(300000, 2, 2)" : "(300000, 4)"));
                const Result result = run({"pairs", "long.npy"});
                EXPECT_EQ(result.err, "");
                EXPECT_TRUE(result.out == pairs_csv(pairs));
            }
}

/// Brute force shares out blocks of boxes: the last of which may have a single one.
TEST_F(Pairs, OfAnyNumberOfBoxesNoneIsLeftOut)
{
    for (const std::size_t n :
         {std::size_t{2}, std::size_t{255}, std::size_t{256}, std::size_t{257}, std::size_t{513}}) {
        std::vector<jostle::Aabb3f> boxes = lattice_boxes<3, float>(n, n);
        boxes.back() = {{-1000, -1000, -1000}, {1000, 1000, 1000}};
        const std::vector<Pair> pairs = jostle::find_pairs_brute_force(jostle::BoxView<3, float>(boxes));
        ASSERT_GE(pairs.size(), n - 1);
        write("boxes.csv", boxes_csv(boxes));
        expect_stats("boxes.csv", n, pairs);
    }
}

// Float boxes must be compared as floats: made into anything else, or read through text with too few digits,
// neighbours one ulp apart would touch.
TYPED_TEST(EveryBoxType, ComparesTheNumbersOfTheFileExactly)
{
    constexpr int dim = BoxType<TypeParam>::dim;
    using T = typename BoxType<TypeParam>::Number;
    std::vector<TypeParam> boxes(3);
    const T third = T{1} / T{3};
    for (int d = 0; d < dim; ++d) {
        boxes[0].lo[d] = 0;
        boxes[0].hi[d] = third;
        boxes[1].lo[d] = third; // touches box 0
        boxes[1].hi[d] = third;
        boxes[2].lo[d] = std::nextafter(third, T{1}); // misses both
        boxes[2].hi[d] = 1;
    }
    const std::string n_by_2d = "(3, " + std::to_string(2 * dim) + ")";
    this->write("b.npy",
                npy(npy_values(boxes, false, false), sizeof(T) == 4 ? "<f4" : "<f8", false, n_by_2d));
    EXPECT_EQ(this->run({"pairs", "b.npy"}).out, "a,b\n0,1\n");
    this->write("b.csv", boxes_csv(boxes));
    EXPECT_EQ(this->run({"pairs", "b.csv"}).out, "a,b\n0,1\n");
}

TYPED_TEST(EveryBoxType, HasThePairsOfEveryFrameOfARecording)
{
    constexpr int dim = BoxType<TypeParam>::dim;
    using T = typename BoxType<TypeParam>::Number;
    jostle_scenes::RecordingWriter<dim, T> writer(this->folder / "r.jrec", 300, 60, "lattice boxes");
    for (std::uint64_t frame = 0; frame < 3; ++frame)
        writer.add_frame(lattice_boxes<dim, T>(frame, 300));
    writer.finish();
    for (std::uint64_t frame = 0; frame < 3; ++frame) {
        const auto boxes = lattice_boxes<dim, T>(frame, 300);
        const auto pairs = jostle::find_pairs_brute_force(jostle::BoxView<dim, T>(boxes));
        ASSERT_GT(pairs.size(), 100u);
        const Result result = this->run({"pairs", "r.jrec", "--frame", std::to_string(frame)});
        EXPECT_EQ(result.err, "");
        EXPECT_EQ(result.out, pairs_csv(pairs));
        if (frame == 0) { // the first is the default
            EXPECT_EQ(this->run({"pairs", "r.jrec"}).out, pairs_csv(pairs));
        }
    }
    const auto last = lattice_boxes<dim, T>(2, 300);
    this->expect_stats("r.jrec", 300, jostle::find_pairs_brute_force(jostle::BoxView<dim, T>(last)),
                       {"--frame", "2"});
}

TEST_F(Pairs, CsvMayLookAsProgramsWriteIt)
{
    const std::string two_touch_one_apart = "a,b\n0,1\n";
    write("order.csv", "hi_y,lo_x,hi_x,lo_y\n1,0,1,0\n2,1,2,1\n9,8,9,8\n");
    write("crlf.csv", "lo_x,lo_y,hi_x,hi_y\r\n0,0,1,1\r\n1,1,2,2\r\n8,8,9,9\r\n");
    write("cr.csv", "lo_x,lo_y,hi_x,hi_y\r0,0,1,1\r1,1,2,2\r8,8,9,9\r");
    write("blank.csv", "\n \t\nlo_x,lo_y,hi_x,hi_y\n\n0,0,1,1\n\r\n1,1,2,2\n  \n8,8,9,9\n\n\n");
    write("spaces.csv", " lo_x , lo_y,hi_x\t,hi_y \n 0, 0 ,1,\t1\n1,1,2,2  \n8,8,9,9\n");
    write("quotes.csv", "\"lo_x\",\"lo_y\",hi_x,hi_y\n\"0\",0,\"1\" ,1\n 1,1, \"2\",2\n8,8,9,9\n");
    write("no_end.csv", "lo_x,lo_y,hi_x,hi_y\n0,0,1,1\n1,1,2,2\n8,8,9,9");
    write("mark.csv", "\xef\xbb\xbflo_x,lo_y,hi_x,hi_y\n0,0,1,1\n1,1,2,2\n8,8,9,9\n");
    write("CAPITALS.CSV", "LO_X,LO_Y,HI_X,HI_Y\n0,0,1,1\n1,1,2,2\n8,8,9,9\n");
    write("numbers.csv", "lo_x,lo_y,hi_x,hi_y\n-0,+0.0,1e0,.1E+1\n1.,1.00000,2,2\n8,8,9,9\n");
    const std::string rows = "\n0,0,1,1\n1,1,2,2\n8,8,9,9\n";
    write("without.csv", rows);
    write("without_mark.csv", "\xef\xbb\xbf" + rows.substr(1));
    write("without3.csv", "0,0,0,1,1,1\n1,1,1,2,2,2\n8,8,8,9,9,9\n");
    for (const std::string names : {"minx,miny,maxx,maxy", "xmin,ymin,xmax,ymax", "min_x,min_y,max_x,max_y",
                                    "x_min,y_min,x_max,y_max", "X,Y,hi_x,ymax"})
        write(names + ".csv", names + rows);
    write("size.csv", "x,y,w,h\n0,0,1,1\n1,1,1,1\n8,8,1,1\n");
    write("one_size.csv", "w,ymin,xmin,ymax\n1,0,0,1\n1,1,1,2\n1,8,8,9\n");
    write("size3.csv", "id,d,x,y,z,w,h\n0,1,0,0,0,1,1\n1,1,1,1,1,1,1\n2,1,8,8,8,1,1\n");
    for (const std::string& file : files()) {
        const Result result = run({"pairs", file});
        EXPECT_EQ(result.err, "") << file;
        EXPECT_EQ(result.out, two_touch_one_apart) << file;
    }
    EXPECT_EQ(run({"pairs", "-"}, read("crlf.csv")).out, two_touch_one_apart);
}

TEST_F(Pairs, UnboundedAndEmptyBoxesAreValid)
{
    write("b.csv", "lo_x,lo_y,hi_x,hi_y\n-inf,0,inf,0\n5,0,5,0\n-Infinity,-inf,INF,+infinity\n5,1,5,1\n");
    EXPECT_EQ(run({"pairs", "b.csv"}).out, "a,b\n0,1\n0,2\n1,2\n2,3\n");
}

TEST_F(Pairs, NoBoxesHaveNoPairs)
{
    write("none.csv", "lo_x,lo_y,hi_x,hi_y\n");
    EXPECT_EQ(run({"pairs", "none.csv"}).out, "a,b\n");
    write("none.npy", npy(std::vector<float>(), "<f4", false, "(0, 2, 3)"));
    expect_stats("none.npy", 0, {});
    expect_pairs("none.npy", {}, "2");
}

TEST_F(Pairs, IdsTakeThePlaceOfPositions)
{
    // Ascending by position: the order of the ids doesn't matter.
    write("whole.csv", "id,lo_x,lo_y,hi_x,hi_y\n700,0,0,1,1\n12,1,1,2,2\n0,2,2,3,3\n");
    EXPECT_EQ(run({"pairs", "whole.csv"}).out, "a,b\n700,12\n12,0\n");
    EXPECT_EQ(run({"pairs", "whole.csv", "-o", "out.jsonl"}).err, "");
    EXPECT_EQ(read("out.jsonl"), "{\"a\":700,\"b\":12}\n{\"a\":12,\"b\":0}\n");
    EXPECT_EQ(run({"pairs", "whole.csv", "-o", "out.npy"}).err, "");
    EXPECT_EQ(read("out.npy"), npy(std::vector<std::uint32_t>{700, 12, 12, 0}, "<u4", false, "(2, 2)"));

    write("names.csv",
          "lo_x,lo_y,hi_x,hi_y,id\n0,0,1,1,\"left, \"\"upper\"\"\"\n1,1,2,2, arm \n2,2,3,3,\"two\nlines\"\n"
          "3,3,4,4,\" x\"\n4,4,5,5,007\n5,5,6,6,\"5\"\"\"\n");
    EXPECT_EQ(run({"pairs", "names.csv"}).out,
              "a,b\n\"left, \"\"upper\"\"\",arm\narm,\"two\nlines\"\n\"two\nlines\",\" x\"\n\" "
              "x\",007\n007,\"5\"\"\"\n");
    EXPECT_EQ(run({"pairs", "names.csv", "-o", "out.jsonl"}).err, "");
    EXPECT_EQ(read("out.jsonl"),
              "{\"a\":\"left, \\\"upper\\\"\",\"b\":\"arm\"}\n{\"a\":\"arm\",\"b\":\"two\\nlines\"}\n"
              "{\"a\":\"two\\nlines\",\"b\":\" x\"}\n{\"a\":\" "
              "x\",\"b\":\"007\"}\n{\"a\":\"007\",\"b\":\"5\\\"\"}\n");
    // Numbers in JSON only where all of them come back from any reader as they are, digit by digit.
    const auto lines_of = [&](const std::string& a, const std::string& b) {
        write("two.csv", "id,lo_x,lo_y,hi_x,hi_y\n" + a + ",0,0,1,1\n" + b + ",1,1,2,2\n");
        EXPECT_EQ(run({"pairs", "two.csv", "-o", "out.jsonl"}).err, "");
        return read("out.jsonl");
    };
    EXPECT_EQ(lines_of("-3", "999999999999999"), "{\"a\":-3,\"b\":999999999999999}\n");
    for (const std::string text :
         {"007", "00", "-0", "-07", "+7", "1000000000000000", "1.0", "1e3", "0x1", "-"}) {
        EXPECT_EQ(lines_of("5", text), "{\"a\":\"5\",\"b\":\"" + text + "\"}\n");
        EXPECT_EQ(lines_of(text, "5"), "{\"a\":\"" + text + "\",\"b\":\"5\"}\n");
    }
    // The checksum is of the positions, whatever the ids are.
    write("plain.csv", "lo_x,lo_y,hi_x,hi_y\n0,0,1,1\n1,1,2,2\n2,2,3,3\n");
    EXPECT_EQ(json::parse(run({"pairs", "plain.csv", "--stats"}).out)["checksum"],
              json::parse(run({"pairs", "whole.csv", "--stats"}).out)["checksum"]);
}

TEST_F(Pairs, ManyIdsStayApart)
{
    std::string text = "id,lo_x,lo_y,hi_x,hi_y\n", expected = "a,b\n";
    for (int i = 0; i < 5000; ++i) {
        const std::string x = std::to_string(i);
        text += "n" + x + "," + x + ",0," + std::to_string(i + 1) + ",1\n";
        if (i > 0) expected += "n" + std::to_string(i - 1) + ",n" + x + "\n";
    }
    write("ids.csv", text);
    EXPECT_EQ(run({"pairs", "ids.csv"}).out, expected);
    write("ids.csv", text + "n17,0,0,1,1\n"); // and none is forgotten
    EXPECT_EQ(run({"pairs", "ids.csv"}).err, "jostle: ids.csv:5002:1: id \"n17\" already names box 17 (the "
                                             "first is 0); make them differ, or leave "
                                             "the column out\n");
}

TEST_F(Pairs, StatsAreOneObjectInThisOrder)
{
    write("b.csv", "lo_x,lo_y,hi_x,hi_y\n0,0,1,1\n1,1,2,2\n");
    const Result result = run({"pairs", "b.csv", "--stats", "--threads", "2"});
    // mix(0 << 32 | 1), worked out by hand from the definition of the checksum
    const std::string start =
        "{\"objects\":2,\"pairs\":1,\"checksum\":\"910a2dec89025cc1\",\"threads\":2,\"ms\":{\"read\":";
    EXPECT_EQ(result.out.substr(0, start.size()), start);
    const auto stats = nlohmann::ordered_json::parse(result.out);
    std::vector<std::string> stages;
    for (const auto& [stage, ms] : stats["ms"].items()) {
        stages.push_back(stage);
        EXPECT_GE(ms.get<double>(), 0);
    }
    EXPECT_EQ(stages, (std::vector<std::string>{"read", "find", "write"}));
    EXPECT_EQ(std::count(result.out.begin(), result.out.end(), '\n'), 1);
    EXPECT_EQ(files(), std::vector<std::string>{"b.csv"});
}

TEST_F(Pairs, ManyPairsAreWrittenWhole)
{
    // Every box touches every other: output many times the size of all buffers, from several blocks of pairs.
    std::string boxes = "lo_x,lo_y,hi_x,hi_y\n";
    std::vector<Pair> pairs;
    const std::uint32_t n = 1200;
    for (std::uint32_t a = 0; a < n; ++a) {
        boxes += "0,0,1," + std::to_string(a + 1) + "\n";
        for (std::uint32_t b = a + 1; b < n; ++b)
            pairs.push_back({a, b});
    }
    write("b.csv", boxes);
    expect_pairs("b.csv", pairs, "7");
    expect_stats("b.csv", n, pairs); // which come in many chunks
}

TEST_F(Pairs, AFileThatWasThereIsReplacedAndKeepsItsPermissions)
{
    write("b.csv", "lo_x,lo_y,hi_x,hi_y\n0,0,1,1\n1,1,2,2\n");
    write("out.csv", std::string(100000, 'x'));
    std::filesystem::permissions(folder / "out.csv", std::filesystem::perms(0640));
    std::filesystem::create_symlink("out.csv", folder / "link.csv");
    EXPECT_EQ(run({"pairs", "b.csv", "-o", "link.csv"}).err, "");
    EXPECT_EQ(read("out.csv"), "a,b\n0,1\n");
    EXPECT_TRUE(std::filesystem::is_symlink(folder / "link.csv"));
    EXPECT_EQ(std::filesystem::status(folder / "out.csv").permissions(), std::filesystem::perms(0640));
    EXPECT_EQ(files(), (std::vector<std::string>{"b.csv", "link.csv", "out.csv"}));
}

// ---- Meshes ----

TEST_F(Pairs, MeshesGiveABoxPerTriangle)
{
    // A quad, whose two triangles touch, and a triangle by itself.
    write("m.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 5 5 5\nv 6 5 5\nv 5 6 5\nf 1 2 3 4\nf 5 6 7\n");
    EXPECT_EQ(run({"pairs", "m.obj"}).out, "a,b\n0,1\n");
    expect_stats("m.obj", 3, {{0, 1}});
    write("m.stl",
          "solid s\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 "
          "0\nendloop\nendfacet\n"
          "facet normal 0 0 1\nouter loop\nvertex 1 1 0\nvertex 2 1 0\nvertex 1 2 0\nendloop\nendfacet\n"
          "facet normal 0 0 1\nouter loop\nvertex 1 1 3\nvertex 2 1 3\nvertex 1 2 3\nendloop\nendfacet\n"
          "endsolid s\n");
    EXPECT_EQ(run({"pairs", "m.stl"}).out, "a,b\n0,1\n");
    write("m.ply",
          "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
          "element face 2\nproperty list uchar int vertex_indices\nend_header\n"
          "0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2\n3 0 2 3\n");
    EXPECT_EQ(run({"pairs", "m.ply"}).out, "a,b\n0,1\n");
}

/// One triangle (0,0,0) (1,0,0) (0,1,0), placed by three nodes: as it is, moved right by `x`, and, from
/// there, up by 1.
std::string gltf(const std::string& x)
{
    return R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0,1]}],
"nodes":[{"mesh":0},{"mesh":0,"translation":[)" +
           x + R"(,0,0],"children":[2]},{"mesh":0,"translation":[0,1,0]}],
"meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],
"accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]}],
"bufferViews":[{"buffer":0,"byteLength":36}],
"buffers":[{"byteLength":36,"uri":"data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}]})";
}

TEST_F(Pairs, PartsArePlacedByTheirNodes)
{
    write("touching.gltf", gltf("1"));
    write("apart.gltf", gltf("1.5"));
    // One triangle per part: the same boxes.
    for (const std::vector<std::string>& more : {std::vector<std::string>{}, {"--parts"}}) {
        std::vector<std::string> arguments{"pairs", "touching.gltf"};
        arguments.insert(arguments.end(), more.begin(), more.end());
        EXPECT_EQ(run(arguments).out, "a,b\n0,1\n0,2\n1,2\n");
        arguments[1] = "apart.gltf";
        EXPECT_EQ(run(arguments).out, "a,b\n1,2\n");
    }
}

TEST_F(Pairs, NodesArePlacedInTheirParentsSpace)
{
    // The parent doubles, the child moves by 1: by 2 in all, and the triangle is twice as big. The other
    // order would move by 1.
    const std::string start = R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0,1,3]}],"nodes":[
{"mesh":0},{"scale":[2,2,2],"children":[2]},{"mesh":0,"translation":[1,0,0]},{"mesh":0,"translation":[)";
    const std::string end = gltf("0").substr(gltf("0").find("\"meshes\""));
    for (const auto& [x, pairs] : {std::pair{"1.9", "a,b\n1,2\n"}, {"4", "a,b\n1,2\n"}, {"4.1", "a,b\n"}}) {
        write("m.gltf", start + x + ",0,0]}],\n" + end);
        EXPECT_EQ(run({"pairs", "m.gltf"}).out, pairs) << x;
        EXPECT_EQ(run({"pairs", "m.gltf", "--parts"}).out, pairs) << x;
    }
}

/// A node with several meshes has the boxes of each; a part without triangles has none.
TEST_F(Pairs, PartsAreWhatHasTriangles)
{
    std::string two = gltf("9");
    const std::string one = R"({"attributes":{"POSITION":0}})";
    two.insert(two.find(one), one + ",");
    write("two.gltf", two);
    for (const char* form : {"--stats", "--parts"}) {
        const json stats = json::parse(run({"pairs", "two.gltf", "--stats", form}).out);
        EXPECT_EQ(stats["objects"], 6);
        EXPECT_EQ(stats["pairs"], 7); // each touches its twin, and the moved ones touch the one above
    }
    write("lines.obj", "o lines\nv 0 0 0\nv 1 0 0\nv 0 1 0\nl 1 2\nl 2 3\no flat\nv 5 0 0\nv 6 0 0\n"
                       "v 5 1 0\nf 4 5 6\n");
    EXPECT_EQ(json::parse(run({"pairs", "lines.obj", "--stats", "--parts"}).out)["objects"], 1);
    EXPECT_EQ(json::parse(run({"pairs", "lines.obj", "--stats"}).out)["objects"], 1);
}

TEST_F(Pairs, ModelsOfTheAssimpPackage)
{
    const std::filesystem::path models = "/usr/share/assimp/models";
    ASSERT_TRUE(std::filesystem::exists(models)) << "install the Debian package assimp-testmodels";
    struct Model
    {
        const char* file;
        std::size_t triangles;
    };
    // The counts are the files' own: lines "f" of the OBJ, "facet" of the ASCII STL, the header of the PLY.
    for (const Model& model :
         {Model{"OBJ/spider.obj", 1368}, Model{"STL/Spider_ascii.stl", 1368},
          Model{"STL/Spider_binary.stl", 1368}, Model{"OBJ/box.obj", 12}, Model{"PLY/cube.ply", 12}}) {
        const std::string file = (models / model.file).string();
        const json brute = json::parse(run({"pairs", file, "--stats", "--engine", "brute"}).out);
        EXPECT_EQ(brute["objects"], model.triangles) << file;
        EXPECT_GT(brute["pairs"], model.triangles) << file; // neighbours touch
        for (const char* engine : {"default", "chapter"})
            for (const char* threads : {"1", "2", "7"}) {
                const Result result =
                    run({"pairs", file, "--stats", "--threads", threads, "--engine", engine});
                EXPECT_EQ(result.err, "");
                const json stats = json::parse(result.out);
                EXPECT_EQ(stats["pairs"], brute["pairs"]) << file << threads << engine;
                EXPECT_EQ(stats["checksum"], brute["checksum"]) << file << threads << engine;
            }
    }
    // The same spider, in parts: 19 groups in the OBJ.
    const std::string spider = (models / "OBJ/spider.obj").string();
    EXPECT_EQ(json::parse(run({"pairs", spider, "--stats", "--parts"}).out)["objects"], 19);
}

TEST_F(Pairs, TheRecordingInTheRepository)
{
    const std::string file = JOSTLE_DATA_DIR "/tumble.jrec";
    const json brute =
        json::parse(run({"pairs", file, "--frame", "200", "--stats", "--engine", "brute"}).out);
    ASSERT_GT(brute["pairs"], 1000);
    for (const char* engine : {"default", "chapter"})
        for (const char* threads : {"1", "2", "7"}) {
            const Result result =
                run({"pairs", file, "--frame", "200", "--stats", "--threads", threads, "--engine", engine});
            EXPECT_EQ(result.err, "");
            const json stats = json::parse(result.out);
            EXPECT_EQ(stats["pairs"], brute["pairs"]) << threads << engine;
            EXPECT_EQ(stats["checksum"], brute["checksum"]) << threads << engine;
        }
}

// ---- Help ----

TEST_F(Pairs, HelpHasExamples)
{
    const Result all = run({"--help"});
    EXPECT_EQ(all.exit_code, 0);
    EXPECT_NE(all.out.find("Examples:"), std::string::npos);
    // Every subcommand that the help lists.
    std::size_t commands = 0;
    const std::size_t list = all.out.find("Subcommands:\n");
    ASSERT_NE(list, std::string::npos);
    for (std::size_t at = all.out.find('\n', list) + 1; all.out.compare(at, 2, "  ") == 0;
         at = all.out.find('\n', at) + 1) {
        if (all.out[at + 2] == ' ') continue; // a description's second line
        const std::string name = all.out.substr(at + 2, all.out.find(' ', at + 2) - at - 2);
        const Result help = run({name, "--help"});
        EXPECT_EQ(help.exit_code, 0) << name;
        EXPECT_EQ(help.err, "") << name;
        EXPECT_NE(help.out.find("Examples:\n  jostle " + name), std::string::npos) << name;
        ++commands;
    }
    EXPECT_GE(commands, 1u);
}

TEST_F(Pairs, VersionIsTheHeaders)
{
    EXPECT_EQ(run({"--version"}).out, "jostle " + std::to_string(JOSTLE_VERSION_MAJOR) + "." +
                                          std::to_string(JOSTLE_VERSION_MINOR) + "." +
                                          std::to_string(JOSTLE_VERSION_PATCH) + "\n");
}

} // namespace
} // namespace tool_test
