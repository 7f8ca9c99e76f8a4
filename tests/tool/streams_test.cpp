// SPDX-License-Identifier: MIT
// jostle pairs on pipes, on other things that are read once, and without its standard streams.
#include "run_tool.hpp"
#include "tool/scenes/recording.hpp"

namespace tool_test {
namespace {

class Streams : public ToolTest
{
  protected:
    Streams() { write("b.csv", "lo_x,lo_y,hi_x,hi_y\n0,0,1,1\n1,1,2,2\n8,8,9,9\n"); }

    void expect_pairs(const std::string& script, const std::string& pairs = "a,b\n0,1\n")
    {
        SCOPED_TRACE(script);
        const Result result = shell(script);
        EXPECT_EQ(result.exit_code, 0);
        EXPECT_EQ(result.err, "");
        EXPECT_EQ(result.out, pairs);
    }
    void expect_error(const std::string& script, const std::string& message)
    {
        SCOPED_TRACE(script);
        const Result result = shell(script);
        EXPECT_EQ(result.exit_code, 2);
        EXPECT_EQ(result.err, "jostle: " + message + "\n");
        EXPECT_EQ(result.out, "");
    }
    /// The bytes come through a named pipe, in two pieces.
    static std::string piped(const std::string& from, const std::string& to, std::size_t first = 90)
    {
        return "mkfifo " + to + "; { head -c " + std::to_string(first) + " " + from +
               "; sleep 0.1; tail -c +" + std::to_string(first + 1) + " " + from + "; } > " + to +
               " & jostle pairs " + to + "; e=$?; rm " + to + "; exit $e";
    }
};

TEST_F(Streams, CsvComesFromAnyPipe)
{
    expect_pairs("cat b.csv | jostle pairs -");
    expect_pairs("cat b.csv | jostle pairs /dev/stdin");
    expect_pairs("jostle pairs /dev/stdin < b.csv");
    expect_pairs("jostle pairs <(cat b.csv)");
    expect_pairs("mkfifo plain; cat b.csv > plain & jostle pairs plain");
    expect_pairs(piped("b.csv", "f.csv"));
    expect_error(
        "jostle pairs /dev/null",
        "/dev/null:1:1: the file is empty; the first line may name the columns: lo_x,lo_y[,lo_z],hi_x,"
        "hi_y[,hi_z], or xmin,..., or x,y[,z],w,h[,d], and maybe id, in any order; without names there "
        "are 4 or 6 columns in the first of these orders");
}

TEST_F(Streams, ArraysComeFromPipesOfTheirName)
{
    const auto boxes = lattice_boxes<3, float>(1, 30'000); // 720 kB: more than a pipe holds
    for (const bool fortran : {false, true}) {
        write("b.npy", npy(npy_values(boxes, fortran, true), "<f4", fortran, "(30000, 2, 3)"));
        const Result whole = run({"pairs", "b.npy", "--stats"});
        const Result result = shell("mkfifo f.npy; cat b.npy > f.npy & jostle pairs f.npy --stats; rm f.npy");
        EXPECT_EQ(result.err, "");
        EXPECT_EQ(result.out.substr(0, result.out.find("\"ms\"")),
                  whole.out.substr(0, whole.out.find("\"ms\"")));
    }
    const std::vector<float> two{0, 0, 1, 1, 1, 1, 2, 2};
    const std::string good = npy(two, "<f4", false, "(2, 4)");
    write("g.npy", good);
    expect_pairs(piped("g.npy", "f.npy"));
    write("g.npy", good.substr(0, good.size() - 1));
    expect_error(
        piped("g.npy", "f.npy"),
        "f.npy: shape (2, 4) of <f4 needs 32 bytes and the file has 31; it is cut off, save it again");
    write("g.npy", good + "xyz");
    expect_error(piped("g.npy", "f.npy"),
                 "f.npy: shape (2, 4) of <f4 needs 32 bytes and the file has 33; save one array per file");
    expect_error(piped("g.npy", "f.npy", good.size()), // too much, but not at once
                 "f.npy: shape (2, 4) of <f4 needs 32 bytes and the file has 33; save one array per file");
    write("g.npy", good.substr(0, 100));
    expect_error(piped("g.npy", "f.npy"),
                 "f.npy: ends inside the NPY header; save the array again with numpy.save");
    // What a pipe claims isn't believed either.
    write("g.npy", npy(two, "<f8", false, "(4294967295, 2, 3)"));
    const Result claims = shell(piped("g.npy", "f.npy"));
    EXPECT_EQ(claims.err,
              "jostle: f.npy: shape (4294967295, 2, 3) of <f8 needs 206158430160 bytes and the file "
              "has 32; it is cut off, save it again\n");
    EXPECT_LT(claims.peak_kb, 100'000);
}

TEST_F(Streams, RecordingsComeFromPipesOfTheirName)
{
    jostle_scenes::RecordingWriter<2, double> writer(folder / "r.jrec", 3, 60, "");
    writer.add_frame(std::vector<jostle::Aabb2d>{{{0, 0}, {1, 1}}, {{1, 1}, {2, 2}}, {{8, 8}, {9, 9}}});
    writer.finish();
    expect_pairs(piped("r.jrec", "f.jrec"));
}

TEST_F(Streams, MeshesDontComeFromPipes)
{
    write("m.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    expect_error("mkfifo f.obj; cat m.obj > f.obj & jostle pairs f.obj",
                 "f.obj: is no regular file, and a mesh is read more than once; save it to a file");
}

// Else the first files that are opened would get the streams' numbers: the output's own would be 1.
TEST_F(Streams, ClosedStandardStreamsAreNotMistakenForFiles)
{
    expect_pairs("jostle pairs b.csv -o out.csv >&- && cat out.csv");
    expect_pairs("jostle pairs b.csv -o out.csv <&- >&- 2>&- && cat out.csv");
    expect_pairs("jostle pairs b.csv <&-");
    expect_pairs("jostle pairs b.csv 2>&-");
    expect_error("jostle pairs b.csv >&-", "stdout: Bad file descriptor; choose another place");
    expect_error("jostle pairs b.csv --stats >&-", "stdout: Bad file descriptor; choose another place");
    expect_error("jostle pairs - <&-", "stdin: Bad file descriptor while reading; check the file");
    // The table can't be written, which is said; the rows are all there.
    expect_error("jostle bench uniform -n 10 --frames 1 --json rows.json >&-",
                 "stdout: can't be written; make room, or write elsewhere");
    EXPECT_TRUE(read("rows.json").ends_with("}\n]\n"));
    EXPECT_EQ(shell("jostle pairs gone.csv 2>&-").exit_code, 2);
    EXPECT_EQ(files(), (std::vector<std::string>{"b.csv", "out.csv", "rows.json"}));
}

} // namespace
} // namespace tool_test
