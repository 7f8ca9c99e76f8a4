// SPDX-License-Identifier: MIT
// jostle pairs on bad input: the exact line, exit status 2, and nothing written.
#include <algorithm>
#include <chrono>
#include <csignal>
#include <thread>

#include "run_tool.hpp"
#include "tool/scenes/recording.hpp"

namespace tool_test {
namespace {

class Errors : public ToolTest
{
  protected:
    /// `jostle arguments...` fails with this one line, writes nothing to stdout and leaves the folder as it
    /// is.
    void expect_error(const std::vector<std::string>& arguments, const std::string& message,
                      const std::string& input = "")
    {
        std::string command = "jostle";
        for (const std::string& argument : arguments)
            command += " " + argument;
        SCOPED_TRACE(command);
        const std::vector<std::string> before = files();
        const Result result = run(arguments, input);
        EXPECT_EQ(result.err, "jostle: " + message + "\n");
        EXPECT_EQ(result.exit_code, 2);
        EXPECT_EQ(result.out, "");
        EXPECT_EQ(files(), before);
    }

    void expect_file_error(const std::string& name, const std::string& bytes, const std::string& message)
    {
        write(name, bytes);
        expect_error({"pairs", name}, message);
        expect_error({"pairs", name, "--stats"}, message);
        expect_error({"pairs", name, "-o", "out.csv"}, message);
        expect_error({"pairs", name, "--engine", "brute", "--threads", "7"}, message);
    }
};

constexpr const char* header_advice =
    "the first line may name the columns: lo_x,lo_y[,lo_z],hi_x,hi_y[,hi_z], or xmin,..., or "
    "x,y[,z],w,h[,d], "
    "and maybe id, in any order; without names there are 4 or 6 columns in the first of these orders";

TEST_F(Errors, CsvHeader)
{
    const std::string advice = header_advice;
    expect_file_error("b.csv", "", "b.csv:1:1: the file is empty; " + advice);
    expect_file_error("b.csv", "\n \n", "b.csv:2:1: the file is empty; " + advice);
    expect_file_error("b.csv", std::string("\xff\xfel\0o\0", 6),
                      "b.csv:1:1: the file is UTF-16 text; save it as UTF-8");
    expect_file_error("b.csv", "0,0,1\n", "b.csv:1:1: there is no line with names, and 3 columns; " + advice);
    expect_file_error("b.csv", "0,0,one,1\n", "b.csv:1:1: column \"0\" is not known; " + advice);
    expect_file_error("b.csv", "0,0,1,1\n0,0,1\n",
                      "b.csv:2:4: the row has 3 fields and the first 4; give each column one value");
    expect_file_error("b.csv", "x,y,xmin,w,h\n", "b.csv:1:3: column xmin is there twice; remove one");
    expect_file_error("b.csv", "x,y,w,h,max_x\n", "b.csv:1:5: columns max_x and w say the same; remove one");
    expect_file_error("b.csv", "x,y,w\n", "b.csv:1:4: column hi_y is missing; " + advice);
    expect_file_error("b.csv", "w,h,maxx,maxy\n", "b.csv:1:5: column lo_x is missing; " + advice);
    expect_file_error("b.csv", "lo_x,lo_y,hi_x,hi_y,mass\n",
                      "b.csv:1:5: column \"mass\" is not known; " + advice);
    expect_file_error("b.csv", "lo_x;lo_y;hi_x;hi_y\n",
                      "b.csv:1:1: column \"lo_x;lo_y;hi_x;hi_y\" is not known; " + advice);
    expect_file_error("b.csv", "\n\nlo_x,lo_x,hi_x,hi_y\n",
                      "b.csv:3:2: column lo_x is there twice; remove one");
    expect_file_error("b.csv", "lo_x,lo_y,hi_x\n", "b.csv:1:4: column hi_y is missing; " + advice);
    // One z column alone doesn't quietly make 2D boxes.
    expect_file_error("b.csv", "lo_x,lo_y,lo_z,hi_x,hi_y\n", "b.csv:1:6: column hi_z is missing; " + advice);
    expect_file_error("b.csv", std::string("lo_x,\0\n\"\x01,\x7f\"", 13),
                      "b.csv:1:2: column \"\\x00\" is not known; " + advice);
}

TEST_F(Errors, CsvRows)
{
    const std::string header = "lo_x,lo_y,hi_x,hi_y\n0,0,1,1\n";
    const std::string advice = ", which is not a number; write one like -12.5, 1e-3 or inf";
    expect_file_error("b.csv", header + "0,abc,1,1\n", "b.csv:3:2: lo_y is \"abc\"" + advice);
    expect_file_error("b.csv", header + "0,0,1,1.5x\n", "b.csv:3:4: hi_y is \"1.5x\"" + advice);
    expect_file_error("b.csv", header + "0,0,+-1,1\n", "b.csv:3:3: hi_x is \"+-1\"" + advice);
    expect_file_error("b.csv", header + "0,0,0x10,1\n", "b.csv:3:3: hi_x is \"0x10\"" + advice);
    expect_file_error("b.csv", header + "0,0,1 000,1\n", "b.csv:3:3: hi_x is \"1 000\"" + advice);
    expect_file_error("b.csv", header + "0,0," + std::string(50, 'y') + ",1\n",
                      "b.csv:3:3: hi_x is \"" + std::string(40, 'y') + "...\"" + advice);
    expect_file_error("b.csv", header + "0,0,\x1b[31m,1\n", "b.csv:3:3: hi_x is \"\\x1b[31m\"" + advice);
    expect_file_error("b.csv", header + "\n\r\n0,,1,1\n", "b.csv:5:2: lo_y is empty; write a number");
    expect_file_error("b.csv", header + ",,,\n", "b.csv:3:1: lo_x is empty; write a number");
    expect_file_error(
        "b.csv", header + "0,0,1e400,1\n",
        "b.csv:3:3: hi_x is \"1e400\", which is more than a double can hold; write inf if it is meant to "
        "be unbounded");
    expect_file_error("b.csv", header + "0,0,1\n",
                      "b.csv:3:4: the row has 3 fields and the header 4; give each column one value");
    expect_file_error("b.csv", header + "0,0,1,1,\n",
                      "b.csv:3:5: the row has 5 fields and the header 4; give each column one value");
    expect_file_error("b.csv", header + "0,0,1,\"1\n2,2,3,3\n",
                      "b.csv:3:4: the quote is never closed; add the missing \"");
    expect_file_error("b.csv", header + "0,0,\"1\"2,1\n",
                      "b.csv:3:3: text follows a closing quote; put a comma there, or double the quote");
    expect_file_error("b.csv", header + "0,0,1," + std::string(2000000, '1') + "\n",
                      "b.csv:3:4: the row is longer than a megabyte; is this a CSV file?");
    // Row numbers go on counting through fields of several lines.
    expect_file_error("b.csv", "id,lo_x,lo_y,hi_x,hi_y\n\"a\nb\",0,0,1,1\nc,0,0,x,1\n",
                      "b.csv:4:4: hi_x is \"x\"" + advice);
    expect_error({"pairs", "-"}, "stdin:3:1: lo_x is \"x\"" + advice, header + "x,0,1,1\n");
}

TEST_F(Errors, CsvBoxes)
{
    const std::string header = "lo_x,lo_y,lo_z,hi_x,hi_y,hi_z\n0,0,0,1,1,1\n\n";
    expect_file_error("b.csv", header + "0,0,nan,1,1,1\n",
                      "b.csv:4:3: lo_z is NaN; every bound must be a number (inf is allowed)");
    expect_file_error("b.csv", header + "0,0,0,1,-NaN,1\n",
                      "b.csv:4:5: hi_y is NaN; every bound must be a number (inf is allowed)");
    expect_file_error("b.csv", header + "0,5.50,0,1,3,1\n",
                      "b.csv:4:2: lo_y = 5.50 is greater than hi_y = 3; swap them or drop the box");
    expect_file_error("b.csv", "2,0,1,1\n",
                      "b.csv:1:1: lo_x = 2 is greater than hi_x = 1; swap them or drop the box");
    expect_file_error("b.csv", "x,y,w,h\n0,0,1,-1\n",
                      "b.csv:2:4: h = -1 is below 0; a box begins at y and has this size");
    for (const std::string row : {"1e308,0,1e308,1", "-inf,0,inf,1"})
        expect_file_error(
            "b.csv", "x,y,w,h\n" + row + "\n",
            "b.csv:2:3: x + w is no number that a double can hold; write the upper bound as hi_x");
}

TEST_F(Errors, CsvIds)
{
    const std::string header = "id,lo_x,lo_y,hi_x,hi_y\na,0,0,1,1\n";
    expect_file_error("b.csv", header + " ,0,0,1,1\n",
                      "b.csv:3:1: id is empty; name the box, or leave the column out");
    expect_file_error(
        "b.csv", header + "b,0,0,1,1\na,0,0,1,1\n",
        "b.csv:4:1: id \"a\" already names box 0 (the first is 0); make them differ, or leave the column "
        "out");
    write("b.csv", header + "\"\xff\",0,0,1,1\n");
    expect_error(
        {"pairs", "b.csv", "-o", "out.npy"},
        "out.npy: id \"a\" isn't a whole number up to 4294967295, as .npy needs; write .csv or .jsonl");
    expect_error({"pairs", "b.csv", "-o", "out.jsonl"},
                 "out.jsonl: id \"\\xff\" isn't UTF-8, as JSON needs; write .csv");
    write("b.csv", "id,lo_x,lo_y,hi_x,hi_y\n4294967295,0,0,1,1\n4294967296,0,0,1,1\n");
    expect_error(
        {"pairs", "b.csv", "-o", "out.npy"},
        "out.npy: id \"4294967296\" isn't a whole number up to 4294967295, as .npy needs; write .csv or "
        ".jsonl");
    write("b.csv", "id,lo_x,lo_y,hi_x,hi_y\n7,0,0,1,1\n007,0,0,1,1\n"); // which would both be 7
    expect_error(
        {"pairs", "b.csv", "-o", "out.npy"},
        "out.npy: id \"007\" isn't a whole number up to 4294967295, as .npy needs; write .csv or .jsonl");
    write("b.csv", "id,lo_x,lo_y,hi_x,hi_y\n7,0,0,1,1\n8x,0,0,1,1\n");
    expect_error(
        {"pairs", "b.csv", "-o", "out.npy"},
        "out.npy: id \"8x\" isn't a whole number up to 4294967295, as .npy needs; write .csv or .jsonl");
}

TEST_F(Errors, Npy)
{
    const std::vector<float> two_boxes{0, 0, 1, 1, 1, 1, 2, 2};
    const std::string good = npy(two_boxes, "<f4", false, "(2, 4)");
    const std::string cut = "b.npy: ends inside the NPY header; save the array again with numpy.save";
    const std::string damaged = "b.npy: the NPY header is damaged; save the array again with numpy.save";
    expect_file_error("b.npy", "", cut);
    expect_file_error("b.npy", good.substr(0, 9), cut);
    expect_file_error("b.npy", good.substr(0, 60), cut);
    expect_file_error("b.npy", npy(two_boxes, "<f4", false, "(2, 4)", 2).substr(0, 11), cut);
    expect_file_error("b.npy", "lo_x,lo_y,hi_x,hi_y\n0,0,1,1\n",
                      "b.npy: doesn't start as an NPY file does; save it with numpy.save");
    expect_file_error("b.npy", std::string(good).replace(6, 1, "\x09"),
                      "b.npy: is NPY version 9; versions 1, 2 and 3 are known");
    expect_file_error("b.npy", npy(two_boxes, "<f4", false, "(2, 4"), damaged);
    expect_file_error("b.npy", npy(two_boxes, "<f4", false, "(2, -4)"), damaged);
    expect_file_error("b.npy", npy(two_boxes, "<f4", false, "(2, 4), 'shape': (2, 4)"), damaged);
    expect_file_error("b.npy", npy(two_boxes, "<f4", false, "(2, 4), 'more': 1"), damaged);
    expect_file_error("b.npy", npy(two_boxes, "<f4", false, "(99999999999999999999, 4)"), damaged);
    const std::string sizes = "; n boxes in d dimensions (2 or 3) are (n, 2, d) or (n, 2 * d), lo before hi";
    for (const std::string shape : {"(8,)", "()", "(2, 5)", "(2, 2, 4)", "(2, 1, 4)", "(1, 2, 2, 2)"})
        expect_file_error("b.npy", npy(two_boxes, "<f4", false, shape), "b.npy: has shape " + shape + sizes);
    for (const std::string type : {"<i4", "<f2", "|b1", "<c8", "<U4", ""})
        expect_file_error("b.npy", npy(two_boxes, type, false, "(2, 4)"),
                          "b.npy: has numbers of type \"" + type +
                              "\"; convert them with .astype('float32') or .astype('float64')");
    expect_file_error(
        "b.npy", std::string(good).erase(100, 9).replace(20, 5, "[('x', '<f4')]"),
        "b.npy: is an array of records; save plain float32 or float64 numbers, of shape (n, 4) or (n, "
        "6)");
    expect_file_error(
        "b.npy", good.substr(0, good.size() - 1),
        "b.npy: shape (2, 4) of <f4 needs 32 bytes and the file has 31; it is cut off, save it again");
    expect_file_error(
        "b.npy", good + "x",
        "b.npy: shape (2, 4) of <f4 needs 32 bytes and the file has 33; save one array per file");
    // A size that no memory holds is told from the file's size, not tried.
    expect_file_error(
        "b.npy", npy(two_boxes, "<f8", false, "(4294967295, 2, 3)"),
        "b.npy: shape (4294967295, 2, 3) of <f8 needs 206158430160 bytes and the file has 32; it is cut "
        "off, save it again");
    expect_file_error("b.npy", npy(two_boxes, "<f4", false, "(4294967296, 4)"),
                      "b.npy: has more boxes than 32 bits can number; split it");
}

TEST_F(Errors, NpyBoxes)
{
    // Row and column are the array's own indices.
    const float nan = std::numeric_limits<float>::quiet_NaN();
    const std::string number = " is NaN; every bound must be a number (infinite is allowed)";
    expect_file_error("b.npy", npy(std::vector<float>{0, 0, 1, 1, 0, nan, 1, 1}, "<f4", false, "(2, 4)"),
                      "b.npy:1:1: box 1: lo.y" + number);
    expect_file_error("b.npy", npy(std::vector<float>{0, 0, 1, 1, 0, 0, 1, nan}, "<f4", false, "(2, 4)"),
                      "b.npy:1:3: box 1: hi.y" + number);
    expect_file_error(
        "b.npy", npy(std::vector<double>{0, 0, 0, 1, 1, 1, 4, 5, 6.5, 5, 5, 6}, "<f8", false, "(2, 2, 3)"),
        "b.npy:1:2: box 1: lo.z = 6.5 is greater than hi.z = 6; swap them or drop the box");
}

TEST_F(Errors, Meshes)
{
    expect_file_error("m.obj", "v 0 0 0\nv 1 0 0\nl 1 2\n",
                      "m.obj: has no triangles; give a mesh with faces");
    write("m.stl", "solid s\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\n");
    const Result cut = run({"pairs", "m.stl"});
    EXPECT_EQ(cut.exit_code, 2);
    EXPECT_EQ(cut.err.substr(0, 15), "jostle: m.stl: ");
    expect_file_error("m.ply",
                      "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
                      "property float z\nelement face 2\nproperty list uchar int vertex_indices\nend_header\n"
                      "0 0 0\n1 0 0\nnan 1 0\n0 1 0\n3 0 1 3\n3 0 2 3\n",
                      "m.ply: triangle 1 has a corner that isn't finite; fix or drop the triangle");
    // By its number among those of all parts: a node that is scaled twice, by more than floats hold.
    expect_file_error("m.gltf",
                      R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0,1]}],
"nodes":[{"mesh":0},{"scale":[1e30,1e30,1e30],"children":[2]},{"mesh":0,"scale":[1e30,1e30,1e30]}],
"meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],
"accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]}],
"bufferViews":[{"buffer":0,"byteLength":36}],
"buffers":[{"byteLength":36,"uri":"data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}]})",
                      "m.gltf: triangle 1 has a corner that isn't finite; fix or drop the triangle");
}

TEST_F(Errors, Recordings)
{
    jostle_scenes::RecordingWriter<3, float> writer(folder / "r.jrec", 10, 60, "");
    for (std::uint64_t frame = 0; frame < 3; ++frame)
        writer.add_frame(lattice_boxes<3, float>(frame, 10));
    writer.finish();
    expect_error({"pairs", "r.jrec", "--frame", "3"},
                 "r.jrec: has frames 0 to 2 and no frame 3; choose one of them with --frame");
    const std::string bytes = read("r.jrec");
    write("cut.jrec", bytes.substr(0, bytes.size() - 1));
    const Result result = run({"pairs", "cut.jrec", "--frame", "2", "-o", "out.csv"});
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_EQ(result.err.substr(0, 16), "jostle: cut.jrec");
    EXPECT_EQ(files(), (std::vector<std::string>{"cut.jrec", "r.jrec"}));
}

TEST_F(Errors, Input)
{
    expect_error({"pairs", "gone.csv"},
                 "gone.csv: No such file or directory; check the name and its permissions");
    expect_error({"pairs", "gone.npy"},
                 "gone.npy: No such file or directory; check the name and its permissions");
    expect_error({"pairs", "gone.obj"},
                 "gone.obj: No such file or directory; check the name and its permissions");
    expect_error({"pairs", "gone.jrec"},
                 "gone.jrec: No such file or directory; check the name and its permissions");
    expect_error({"pairs", "gone"}, "gone: No such file or directory; check the name and its permissions");
    expect_error({"pairs", "."}, ".: is a directory; name a file");
    const std::string readable = "; give a .csv, .npy or .jrec file, or a mesh (.obj, .stl, .ply, .glb, ...)";
    write("b.txt", "");
    expect_error({"pairs", "b.txt"}, "b.txt: can't read .txt files" + readable);
    write("b", "");
    expect_error({"pairs", "b"}, "b: the name has no extension" + readable);
    write("b.csv", "lo_x,lo_y,hi_x,hi_y\n0,0,1,1\n0,0,1,1\n");
    expect_error({"pairs", "b.csv", "--parts"},
                 "b.csv: --parts is for meshes only; leave it out for this file");
    expect_error({"pairs", "b.csv", "--frame", "0"},
                 "b.csv: --frame is for recordings (.jrec) only; leave it out for this file");
}

TEST_F(Errors, Options)
{
    write("b.csv", "lo_x,lo_y,hi_x,hi_y\n0,0,1,1\n0,0,1,1\n");
    const std::string see = "; see jostle pairs --help";
    expect_error({"pairs"}, "FILE is required" + see);
    expect_error({"pairs", "b.csv", "c.csv"}, "The following argument was not expected: c.csv" + see);
    expect_error(
        {"pairs", "b.csv", "--fast"},
        "The following argument was not expected: --fast; choose from --help, --output, --stats, --engine, "
        "--threads, --parts, --frame" +
            see);
    expect_error(
        {"pairs", "b.csv", "--stat"},
        "The following argument was not expected: --stat; did you mean --stats? See jostle pairs --help");
    expect_error(
        {"pairs", "b.csv", "--frmae=1"},
        "The following argument was not expected: --frmae=1; did you mean --frame? See jostle pairs --help");
    expect_error({"pairs", "b.csv", "--engine", "slow"},
                 "--engine: slow is not known; choose default, chapter or brute" + see);
    expect_error({"pairs", "b.csv", "--threads", "0"},
                 "--threads: 0 is not a whole number from 1 to 1024" + see);
    expect_error({"pairs", "b.csv", "--threads", "1025"},
                 "--threads: 1025 is not a whole number from 1 to 1024" + see);
    for (const std::string bad : {"many", "2.5", "-1", "99999999999999999999", "1e99", "1,00", "k"}) {
        expect_error({"pairs", "b.csv", "--threads", bad},
                     "--threads: " + bad + " is not a whole number from 1 to 1024" + see);
        expect_error({"pairs", "b.csv", "--frame", bad},
                     "--frame: " + bad + " is not a whole number from 0 to 4294967295" + see);
    }
    expect_error({"pairs", ""}, "argument 2 () is empty; give it a value, or leave it out");
    expect_error({"bench", "--json=", "uniform"},
                 "argument 2 (--json=) is empty; give it a value, or leave it out");
    EXPECT_EQ(run({}).exit_code, 2);
    EXPECT_TRUE(run({}).err.starts_with("jostle: say what to do; choose from pairs"));
    EXPECT_TRUE(run({"cherries"}).err.starts_with("jostle: cherries is not a command; choose from pairs"));
    expect_error({"pears"}, "pears is not a command; did you mean pairs? See jostle --help");
    expect_error({"bnech", "uniform"}, "bnech is not a command; did you mean bench? See jostle --help");
    expect_error({"--versoin"}, "--versoin is not a command; did you mean --version? See jostle --help");
    expect_error({"help", "pears"}, "pears is not a command; did you mean pairs? See jostle --help");
    expect_error({"bench", "unifrom"}, "there is no scene 'unifrom'; did you mean uniform?");
    expect_error({"bench", "wrold"}, "there is no scene 'wrold'; did you mean world?");
    expect_error({"bench", "-n", "100,,200"},
                 "-n:  is not a whole number from 1 to 10000000; see jostle bench --help");
    expect_error({"bench", "-n", "100,000,20"},
                 "-n: 000 is not a whole number from 1 to 10000000; see jostle bench --help");
}

TEST_F(Errors, HelpMayBeAskedForAsACommand)
{
    for (const auto& [asked, same] :
         std::vector<std::pair<std::vector<std::string>, std::vector<std::string>>>{
             {{"help"}, {"--help"}}, {{"help", "bench", "world"}, {"bench", "world", "--help"}}}) {
        const Result result = run(asked);
        EXPECT_EQ(result.exit_code, 0) << result.err;
        EXPECT_EQ(result.out, run(same).out);
    }
}

TEST_F(Errors, Output)
{
    write("b.csv", "lo_x,lo_y,hi_x,hi_y\n0,0,1,1\n0,0,1,1\n");
    const std::string names = "; choose a name that ends in .csv, .npy or .jsonl";
    expect_error({"pairs", "b.csv", "-o", "out.txt"}, "out.txt: can't write .txt files" + names);
    expect_error({"pairs", "b.csv", "-o", "out"}, "out: the name has no extension" + names);
    expect_error({"pairs", "b.csv", "--stats", "-o", "-"},
                 "--stats and -o - would both write to stdout; give -o a file, or leave one of them out");
    expect_error({"pairs", "b.csv", "-o", "./b.csv"},
                 "./b.csv: is the input itself; choose another name for the output");
    expect_error({"pairs", "b.csv", "-o", "gone/out.csv"},
                 "gone/out.csv: No such file or directory; choose another place");
    std::filesystem::create_directory(folder / "dir.csv");
    expect_error({"pairs", "b.csv", "-o", "dir.csv"}, "dir.csv: Is a directory; choose another place");
    expect_error({"pairs", "b.csv", "-o", "b.csv/out.csv"},
                 "b.csv/out.csv: Not a directory; choose another place");
    // A device is written as it is, not replaced by a file.
    std::filesystem::create_symlink("/dev/full", folder / "full.csv");
    expect_error({"pairs", "b.csv", "-o", "full.csv"},
                 "full.csv: No space left on device; make room, or write elsewhere");
    EXPECT_TRUE(std::filesystem::is_character_file("/dev/full"));
    for (const char* const arguments :
         {"bench uniform -n 10 --frames 1", "simulate -n 5 --frames 1", "--help"})
        EXPECT_EQ(
            std::system((std::string("'" JOSTLE_TOOL_PATH "' ") + arguments + " >/dev/full 2>&1").c_str()),
            2 << 8)
            << arguments;
}

class BigOutput : public Errors
{
  protected:
    BigOutput()
    {
        std::string boxes = "lo_x,lo_y,hi_x,hi_y\n";
        for (int i = 0; i < 3000; ++i)
            boxes += "0,0,1,1\n";
        write("b.csv", boxes); // 4.5 million pairs, some 43 MB
    }
};

TEST_F(BigOutput, AFullDiskLeavesWhatWasThere)
{
    write("out.csv", "precious");
    for (const std::string out : {"out.csv", "new.csv"}) {
        const Result result = wait(start({"pairs", "b.csv", "-o", out}, "", 5000000));
        EXPECT_EQ(result.exit_code, 2);
        EXPECT_EQ(result.err, "jostle: " + out + ": File too large; make room, or write elsewhere\n");
    }
    EXPECT_EQ(read("out.csv"), "precious");
    EXPECT_EQ(files(), (std::vector<std::string>{"b.csv", "out.csv"}));
}

TEST_F(BigOutput, AnInterruptLeavesWhatWasThere)
{
    write("out.csv", "precious");
    bool interrupted = false;
    for (int attempt = 0; attempt < 20 && !interrupted; ++attempt) {
        const Running running = start({"pairs", "b.csv", "-o", "out.csv"});
        while (files().size() == 2 && kill(running.pid, 0) == 0 && read("out.csv") == "precious")
            std::this_thread::sleep_for(std::chrono::milliseconds(1));
        kill(running.pid, SIGTERM); // in the midst of writing, unless it was faster
        const Result result = wait(running);
        EXPECT_EQ(files(), (std::vector<std::string>{"b.csv", "out.csv"}));
        interrupted = result.exit_code == 1000 + SIGTERM;
        if (interrupted) {
            EXPECT_EQ(read("out.csv"), "precious");
        }
        write("out.csv", "precious");
    }
    EXPECT_TRUE(interrupted);
}

} // namespace
} // namespace tool_test
