// SPDX-License-Identifier: MIT
// Files made to do harm: they get a short message, and neither memory, nor time, nor another file's bytes.
#include <algorithm>
#include <chrono>
#include <csignal>
#include <fstream>
#include <sstream>
#include <thread>

#include "run_tool.hpp"

namespace tool_test {
namespace {

class HostileFiles : public ToolTest
{
  protected:
    /// Refuses the file, in one short line that says this.
    void expect_refused(const std::string& name, const std::string& part, long most_kb = 200'000)
    {
        SCOPED_TRACE(name);
        const Result result = run({"pairs", name, "--stats"});
        EXPECT_EQ(result.exit_code, 2);
        EXPECT_EQ(result.out, "");
        EXPECT_TRUE(result.err.starts_with("jostle: " + name)) << result.err;
        EXPECT_NE(result.err.find(part), std::string::npos) << result.err;
        EXPECT_LT(result.err.size(), 500u);
        EXPECT_EQ(std::count_if(result.err.begin(), result.err.end(),
                                [](char c) { return static_cast<unsigned char>(c) < 0x20; }),
                  1)
            << result.err;
        EXPECT_LT(result.peak_kb, most_kb);
    }
};

template <class Number>
void append(std::string& bytes, Number number)
{
    bytes.append(reinterpret_cast<const char*>(&number),
                 sizeof number); // the tests run on little-endian machines
}

/// A recording's header for that many objects, as if one frame followed.
std::string recording_header(std::uint32_t objects)
{
    std::string bytes("JOSTLRE\x01", 8);
    append(bytes, std::uint32_t{3});
    append(bytes, std::uint32_t{4});
    append(bytes, objects);
    append(bytes, std::uint32_t{0});
    append(bytes, std::uint64_t{1});
    append(bytes, 60.0);
    std::uint64_t hash = 0xcbf29ce484222325u;
    for (const char c : bytes)
        hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3u;
    append(bytes, hash);
    return bytes;
}

TEST_F(HostileFiles, ARecordingsClaimsAreNotBelieved)
{
    // A reader that believes them touches a gigabyte, which a machine bears and this test notices.
    for (const std::uint32_t objects : {30'000'000u, 40'000'000u}) {
        // A frame of zstd's that claims all their bytes and holds a block of one byte 131072 times.
        std::string frame("\x28\xb5\x2f\xfd\xc0\x60", 6); // window of 4 MB
        append(frame, 4 + std::uint64_t{24} * objects);
        frame += std::string("\x02\x00\x10\x00", 4);
        std::string file = recording_header(objects);
        append(file, static_cast<std::uint32_t>(frame.size()));
        write("claims.jrec", file + frame);
        expect_refused("claims.jrec", "was altered in frame 1 of 1; copy or record it again", 60'000);
        // Hundreds of megabytes of packed bytes, and the file ends.
        file = recording_header(objects);
        append(file, std::uint32_t{700'000'000});
        write("short.jrec", file + frame);
        expect_refused("short.jrec", "is truncated: it ends inside frame 1 of 1", 60'000);
    }
}

TEST_F(HostileFiles, AnArraysHeaderIsNotBelieved)
{
    std::string file("\x93NUMPY\x02\x00\xff\xff\xff\xff", 12);
    write("header.npy", file);
    expect_refused("header.npy", "the NPY header is longer than a megabyte", 60'000);
    // Shape and type are quoted in part.
    std::string shape = "(1";
    for (int i = 0; i < 10'000; ++i)
        shape += ", 1";
    write("shape.npy", npy(std::vector<float>(4), "<f4", false, shape + ")", 2));
    expect_refused("shape.npy", "has shape (1, 1, 1");
    write("type.npy", npy(std::vector<float>(4), std::string(9000, '\x1b'), false, "(1, 4)"));
    expect_refused("type.npy", "has numbers of type \"\\x1b\\x1b");
}

TEST_F(HostileFiles, ATextsFieldsAreQuotedInPart)
{
    const std::string header = "lo_x,lo_y,hi_x,hi_y\n";
    write("huge.csv", header + "1." + std::string(900'000, '0') + ",0,0,1\n");
    expect_refused("huge.csv",
                   "huge.csv:2:1: lo_x = 1.00000000000000000000000000000000000000... is greater than "
                   "hi_x = 0; swap them or drop the box");
    write("hi.csv", header + "1,0,-1." + std::string(900'000, '0') + ",1\n");
    expect_refused("hi.csv", "is greater than hi_x = -1.0000");
    write("more.csv", header + "0,0," + std::string(900'000, '9') + ",1\n");
    expect_refused("more.csv", "which is more than a double can hold");
    write("id.csv", "id," + header + std::string(500'000, 'x') + ",0,0,1,1\n" + std::string(500'000, 'x') +
                        ",0,0,1,1\n");
    expect_refused("id.csv", "already names box 0");
    write("name.csv", std::string(900'000, 'n') + "," + header);
    expect_refused("name.csv", "is not known");
    write("commas.csv", header + std::string(30'000'000, ','));
    expect_refused("commas.csv", "the row is longer than a megabyte", 60'000);
    write("\x1b[2J\n.csv", "");
    const Result name = run({"pairs", "\x1b[2J\n.csv"});
    EXPECT_TRUE(name.err.starts_with("jostle: \\x1b[2J\\x0a.csv:1:1: ")) << name.err;
    const Result argument = run({"pairs", std::string(100'000, 'a')});
    EXPECT_EQ(argument.exit_code, 2);
    EXPECT_LT(argument.err.size(), 3000u);
    EXPECT_TRUE(argument.err.ends_with("File name too long; check the name and its permissions\n"));
}

/// A mesh whose nodes lead to 2^levels triangles.
std::string doubling_nodes(int levels)
{
    std::string nodes;
    for (int i = 0; i < levels; ++i)
        nodes += "{\"children\":[" + std::to_string(i + 1) + "," + std::to_string(i + 1) + "]},";
    return R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[)" + nodes +
           R"({"mesh":0}],"meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],
"accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]}],
"bufferViews":[{"buffer":0,"byteLength":36}],
"buffers":[{"byteLength":36,"uri":"data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}]})";
}

TEST_F(HostileFiles, AMeshsMemoryIsBoundByItsSize)
{
    const std::string memory =
        "needs more memory than a valid mesh of its size; check it, or export it again";
    write("nodes.gltf", doubling_nodes(40));
    expect_refused("nodes.gltf", memory, 700'000);
    std::string glb = "glTF"; // version 2, 22 bytes, of which 2 GB are JSON
    append(glb, std::uint32_t{2});
    append(glb, std::uint32_t{22});
    append(glb, std::uint32_t{0x7ffffff0});
    glb += "JSON{}";
    write("lie.glb", glb);
    expect_refused("lie.glb", "", 700'000);
    // What fits is read.
    write("some.gltf", doubling_nodes(10));
    EXPECT_EQ(run({"pairs", "some.gltf", "--stats"}).out.substr(0, 31),
              "{\"objects\":1024,\"pairs\":523776,");
    // Triangles that each of many nodes repeats: their boxes would take 24 GB.
    std::string nodes = "0";
    for (int i = 1; i < 100'000; ++i)
        nodes += ",0";
    std::string faces;
    for (int i = 0; i < 10'000; ++i)
        faces += "AAABAAIA"; // 0, 1, 2 as three shorts
    write(
        "repeated.gltf",
        R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[)" + nodes +
            R"(]}],"nodes":[{"mesh":0}],"meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1}]}],
"accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]},
{"bufferView":1,"componentType":5123,"count":30000,"type":"SCALAR"}],
"bufferViews":[{"buffer":0,"byteLength":36},{"buffer":1,"byteLength":60000}],
"buffers":[{"byteLength":36,"uri":"data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"},
{"byteLength":60000,"uri":"data:application/octet-stream;base64,)" +
            faces + "\"}]}");
    expect_refused("repeated.gltf", memory, 1'500'000);
}

class MeshFolders : public HostileFiles
{
  protected:
    MeshFolders()
    {
        std::string triangle; // (0,0,0) (1,0,0) (0,1,0)
        for (const float x : {0.0f, 0.0f, 0.0f, 1.0f, 0.0f, 0.0f, 0.0f, 1.0f, 0.0f})
            append(triangle, x);
        std::filesystem::create_directories(folder / "models/parts");
        write("secret.bin", triangle);
        write("models/triangle.bin", triangle);
        write("models/parts/triangle.bin", triangle);
        write("models/..bin", triangle);
        std::filesystem::create_symlink("../secret.bin", folder / "models/out.bin");
        std::filesystem::create_symlink("..", folder / "models/up");
        std::filesystem::create_symlink("parts/triangle.bin", folder / "models/in.bin");
        std::filesystem::create_symlink("models", folder / "link");
    }
    /// A triangle whose corners lie in a file of this name.
    void write_gltf(const std::string& name, const std::string& uri)
    {
        write(name, R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],
"meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],
"accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]}],
"bufferViews":[{"buffer":0,"byteLength":36}],"buffers":[{"byteLength":36,"uri":")" +
                        uri + "\"}]}");
    }
};

TEST_F(MeshFolders, AMeshHasItsFilesFromItsFolder)
{
    for (const std::string uri : {"triangle.bin", "./triangle.bin", "parts/triangle.bin",
                                  "parts/../triangle.bin", "in.bin", "..bin"}) {
        write_gltf("models/m.gltf", uri);
        for (const std::string& mesh :
             {std::string("models/m.gltf"), std::string("link/m.gltf"), (folder / "models/m.gltf").string(),
              std::string("./models/../models/m.gltf")}) {
            const Result result = run({"pairs", mesh, "--stats"});
            EXPECT_TRUE(result.out.starts_with("{\"objects\":1,"))
                << uri << " of " << mesh << ": " << result.err;
        }
        EXPECT_TRUE(shell("cd models; jostle pairs m.gltf --stats").out.starts_with("{\"objects\":1,"))
            << uri;
    }
}

TEST_F(MeshFolders, AMeshHasNoFilesFromElsewhere)
{
    for (const std::string& uri :
         {std::string("../secret.bin"), std::string("out.bin"), std::string("up/secret.bin"),
          std::string("parts/../../secret.bin"), (folder / "secret.bin").string(),
          std::string("../models/../secret.bin")}) {
        write_gltf("models/m.gltf", uri);
        const Result result = run({"pairs", "models/m.gltf"});
        EXPECT_EQ(result.exit_code, 2) << uri;
        EXPECT_EQ(result.out, "") << uri;
        EXPECT_TRUE(result.err.starts_with("jostle: models/m.gltf: ")) << uri << ": " << result.err;
        if (!uri.starts_with("/")) { // which the importer puts into the folder
            EXPECT_NE(
                result.err.find("is outside of its folder; put all that belongs to the mesh into one folder"),
                std::string::npos)
                << uri << ": " << result.err;
        }
        EXPECT_LT(result.err.size(), 500u);
    }
    // A pipe is not waited for.
    write_gltf("models/m.gltf", "f.bin");
    EXPECT_EQ(shell("mkfifo models/f.bin; jostle pairs models/m.gltf").exit_code, 2);
}

struct ProcessState
{
    char state = 'X'; // R, S, ..., Z for one that is dead and not yet waited for, X for none
    pid_t parent = 0;
};

ProcessState state_of(const std::string& process)
{
    std::ifstream file("/proc/" + process + "/stat");
    std::string text;
    std::getline(file, text);
    ProcessState result;
    const std::size_t after_name = text.rfind(") ");
    if (after_name != std::string::npos)
        std::istringstream(text.substr(after_name + 2)) >> result.state >> result.parent;
    return result;
}

/// The one process that this one has begotten; "" if there is none yet.
std::string child_of(pid_t parent)
{
    for (const auto& entry : std::filesystem::directory_iterator("/proc")) {
        const std::string name = entry.path().filename().string();
        if (name.find_first_not_of("0123456789") == std::string::npos && state_of(name).parent == parent)
            return name;
    }
    return "";
}

/// A line of what limits a process; "" if there is none.
std::string limit_of(const std::string& process, const std::string& name)
{
    std::ifstream file("/proc/" + process + "/limits");
    std::string line;
    while (std::getline(file, line))
        if (line.starts_with(name)) return line;
    return "";
}

/// Waits until it happens, however busy the machine is.
template <class Condition>
bool comes_true(const Condition& condition)
{
    const auto end = std::chrono::steady_clock::now() + std::chrono::minutes(2);
    while (!condition()) {
        if (std::chrono::steady_clock::now() > end) return false;
        std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
    return true;
}

TEST_F(HostileFiles, AnImporterDiesWithItsParent)
{
    const auto gone = [](const std::string& process) {
        const char state = state_of(process).state;
        return state == 'Z' || state == 'X';
    };
    // Text that takes the importer a while. On a busy machine it may be done before it is seen.
    Running running{};
    std::string importer;
    bool caught = false;
    for (int triangles = 200'000; !caught && triangles < 10'000'000; triangles *= 2) {
        {
            std::ofstream file(folder / "long.obj");
            for (int i = 0; i < triangles; ++i)
                file << "v " << i << " 0 0\nv " << i << " 1 0\nv " << i << " 0 1\nf -1 -2 -3\n";
        }
        running = start({"pairs", "long.obj", "--stats"});
        const std::string parent = std::to_string(running.pid);
        ASSERT_TRUE(comes_true([&] {
            importer = child_of(running.pid);
            return !importer.empty() || gone(parent);
        }));
        // It has tied itself to its parent before it bounds its memory.
        const std::string unbound = limit_of(parent, "Max data size");
        ASSERT_TRUE(comes_true([&] {
            return gone(parent) || gone(importer) || limit_of(importer, "Max data size") != unbound;
        }));
        if (!importer.empty()) kill(static_cast<pid_t>(std::stol(importer)), SIGSTOP);
        caught =
            comes_true([&] { return state_of(importer).state == 'T' || gone(importer); }) && !gone(importer);
        if (!caught) wait(running);
    }
    ASSERT_TRUE(caught);
    kill(running.pid, SIGKILL);
    wait(running);
    EXPECT_TRUE(comes_true([&] { return gone(importer); }));
    if (!gone(importer)) kill(static_cast<pid_t>(std::stol(importer)), SIGKILL);
}

} // namespace
} // namespace tool_test
