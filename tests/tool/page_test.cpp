// SPDX-License-Identifier: MIT
// jostle replay and jostle simulate --watch, asked over HTTP as the page asks them. The page itself, in a
// browser, is for extras/web/tests/.
#include <atomic>
#include <chrono>
#include <csignal>
#include <map>
#include <thread>

#include <httplib.h>
#include <nlohmann/json.hpp>

#include "run_tool.hpp"
#include "tool/scenes/recording.hpp"

namespace tool_test {
namespace {

using jostle::Aabb3f;

class Page : public ToolTest
{
  protected:
    Page()
    {
        std::filesystem::create_directories(folder / "page" / "assets");
        write("page/index.html", "<!doctype html><title>a page</title>");
        write("page/assets/engine.wasm", std::string("\0asm", 4));
        write("page/assets/main.js", "export {};");
        write("b.csv", "lo_x,lo_y,hi_x,hi_y\n0,0,1,1\n1,1,2,2\n8,8,9,9\n");
    }
    ~Page() override
    {
        if (running_.pid > 0) {
            kill(running_.pid, SIGKILL);
            ToolTest::wait(running_);
        }
    }

    /// Starts the command and waits until it has told its address.
    void serve(std::vector<std::string> arguments)
    {
        arguments.insert(arguments.end(), {"--page", "page"});
        running_ = start(arguments);
        await_address();
    }
    void await_address()
    {
        for (int tries = 0; tries < 2000; ++tries) {
            for (const int stream : {running_.out, running_.err}) {
                char bytes[4096];
                const ssize_t got = pread(stream, bytes, sizeof bytes, 0);
                const std::string said(bytes, static_cast<std::size_t>(std::max<ssize_t>(got, 0)));
                const std::size_t from = said.find("http://"), to = said.find('\n', from);
                if (from == std::string::npos || to == std::string::npos) continue;
                address_ = said.substr(from, to - from);
                const std::size_t slash = address_.find('/', 7);
                client_ = std::make_unique<httplib::Client>(address_.substr(0, slash));
                opened_ = address_.substr(slash);
                return;
            }
            std::this_thread::sleep_for(std::chrono::milliseconds(5));
        }
        FAIL() << "it told no address";
    }
    Result end(int signal)
    {
        kill(running_.pid, signal);
        const Result result = ToolTest::wait(running_);
        running_.pid = -1;
        return result;
    }
    httplib::Response get(const std::string& path, const httplib::Headers& headers = {})
    {
        const httplib::Result result = client_->Get(path, headers);
        if (!result) {
            ADD_FAILURE() << path << ": " << httplib::to_string(result.error());
            return {};
        }
        return result.value();
    }

    std::string address_, opened_; // opened_: what stands behind the host's name
    std::unique_ptr<httplib::Client> client_;
    Running running_{-1, -1, -1, -1};
};

TEST_F(Page, ReplayServesThePageAndTheFileUntilInterrupted)
{
    for (const int signal : {SIGINT, SIGTERM}) {
        serve({"replay", JOSTLE_DATA_DIR "/tumble.jrec"});
        EXPECT_EQ(opened_, "/#file=data/tumble.jrec");
        const std::map<std::string, std::pair<std::string, std::string>> expected = {
            {"/", {"text/html", read("page/index.html")}},
            {"/index.html", {"text/html", read("page/index.html")}},
            {"/assets/engine.wasm", {"application/wasm", read("page/assets/engine.wasm")}},
            {"/assets/main.js", {"text/javascript", read("page/assets/main.js")}},
            {"/data/tumble.jrec", {"application/octet-stream", read_file(JOSTLE_DATA_DIR "/tumble.jrec")}}};
        for (const auto& [path, what] : expected) {
            SCOPED_TRACE(path);
            const httplib::Response response = get(path);
            EXPECT_EQ(response.status, 200);
            EXPECT_EQ(response.get_header_value("Content-Type"), what.first);
            EXPECT_TRUE(response.body == what.second);
            // Without these the page has one thread.
            EXPECT_EQ(response.get_header_value("Cross-Origin-Opener-Policy"), "same-origin");
            EXPECT_EQ(response.get_header_value("Cross-Origin-Embedder-Policy"), "require-corp");
        }
        const Result result = end(signal);
        EXPECT_EQ(result.exit_code, 0);
        EXPECT_EQ(result.err, "");
        EXPECT_NE(result.out.find("tumble.jrec: 1,500 boxes, 220 frames\nSee it at " + address_ + "\n"),
                  std::string::npos)
            << result.out;
    }
}

TEST_F(Page, ReplayServesNothingElseAndToNobodyElse)
{
    write("secret.csv", "of somebody's");
    serve({"replay", "b.csv"});
    for (const char* path : {"/data/secret.csv", "/data/../b.csv", "/data/", "/data", "/../secret.csv",
                             "/live", "/%2e%2e/secret.csv", "/data/b.csv/", "/b.csv"})
        EXPECT_EQ(get(path).status, 404) << path;
    for (const char* host : {"example.org", "example.org:80", "127.0.0.1.example.org"})
        EXPECT_EQ(get("/data/b.csv", {{"Host", host}}).status, 403) << host;
    EXPECT_EQ(get("/data/b.csv", {{"Host", "localhost:9000"}}).status, 200); // through a tunnel
    EXPECT_EQ(end(SIGINT).exit_code, 0);
}

TEST_F(Page, ReplayServesFilesOfAnyName)
{
    const std::string name = "a b%20c#d?\xc3\xa9&=+.csv";
    write(name, read("b.csv"));
    serve({"replay", name});
    const std::string encoded = "a%20b%2520c%23d%3F%C3%A9%26%3D%2B.csv";
    EXPECT_EQ(opened_, "/#file=data/" + encoded);
    EXPECT_EQ(get("/data/" + encoded).body, read("b.csv"));
    write(name, "it changed");
    EXPECT_EQ(get("/data/" + encoded).body, "it changed");
    std::filesystem::remove(folder / name);
    EXPECT_EQ(get("/data/" + encoded).status, 404);
    EXPECT_EQ(end(SIGINT).exit_code, 0);
}

TEST_F(Page, ReplayRefusesWhatThePageCouldNotShow)
{
    write("bad.csv", "lo_x,lo_y,hi_x,hi_y\n0,0,1,1\n3,0,2,1\n");
    write("mesh.stl", "solid");
    const auto said = [&](const std::vector<std::string>& arguments) {
        const Result result = run(arguments);
        EXPECT_EQ(result.exit_code, 2);
        EXPECT_EQ(result.out, "");
        return result.err;
    };
    EXPECT_EQ(said({"replay", "bad.csv", "--page", "page"}), run({"pairs", "bad.csv"}).err);
    EXPECT_EQ(said({"replay", "none.jrec", "--page", "page"}), run({"pairs", "none.jrec"}).err);
    EXPECT_EQ(said({"replay", "mesh.stl"}),
              "jostle: mesh.stl: the page can't show .stl files; give .jrec, .csv, .npy, .obj or .glb\n");
    EXPECT_EQ(said({"replay", "mesh"}),
              "jostle: mesh: the name has no extension; give .jrec, .csv, .npy, .obj or .glb\n");
    EXPECT_EQ(
        said({"replay", "b.csv", "--page", "nowhere"}),
        "jostle: --page: nowhere has no index.html; give the folder that ./run web --build DIR wrote\n");
    EXPECT_EQ(said({"replay", "b.csv", "--port", "65536"}),
              "jostle: --port: 65536 is not a whole number from 1 to 65535; see jostle replay --help\n");
    EXPECT_EQ(said({"simulate", "--port", "8000"}),
              "jostle: --port and --page are for --watch; add that, or leave them out\n");

    serve({"replay", "b.csv"});
    const std::string port = address_.substr(17, address_.find('/', 17) - 17);
    EXPECT_EQ(said({"replay", "b.csv", "--page", "page", "--port", port}),
              "jostle: --port: " + port +
                  " can't be used, probably because another program has it; give another\n");
    EXPECT_EQ(end(SIGINT).exit_code, 0);
    serve({"replay", "b.csv", "--port", port}); // at once
    EXPECT_EQ(address_.substr(17, port.size()), port);
    EXPECT_EQ(end(SIGINT).exit_code, 0);
}

TEST_F(Page, ReplayWithoutAPageSaysWhatBuildsIt)
{
    // Where no page was built beside it, and none was installed.
    std::filesystem::create_directories(folder / "bin");
    std::filesystem::copy_file(JOSTLE_TOOL_PATH, folder / "bin" / "jostle");
    const std::string program = (folder / "bin" / "jostle").string();
    const auto with_page_at = [&](const char* page) {
        std::filesystem::create_directories(folder / "share" / "jostle");
        if (page != nullptr) std::filesystem::rename(folder / page, folder / "share" / "jostle" / "page");
        running_ = start({"replay", "b.csv"}, "", RLIM_INFINITY, 60, program.c_str());
    };
    if (!std::filesystem::exists(JOSTLE_PAGE "/index.html")) {
        with_page_at(nullptr);
        const Result result = wait(running_);
        EXPECT_EQ(result.exit_code, 2);
        EXPECT_EQ(
            result.err,
            "jostle: the page isn't built; extras/web/build, in Jostle's source, builds it (it installs "
            "emscripten and npm), or give the folder of one with --page\n");
    }
    with_page_at("page"); // as installed
    await_address();
    EXPECT_EQ(get("/").body, "<!doctype html><title>a page</title>");
    EXPECT_EQ(end(SIGINT).exit_code, 0);
}

/// The boxes of a frame, as NumPy writes them.
std::string bytes_of(const std::vector<Aabb3f>& boxes)
{
    std::vector<float> numbers;
    for (const Aabb3f& box : boxes) {
        numbers.insert(numbers.end(), box.lo.begin(), box.lo.end());
        numbers.insert(numbers.end(), box.hi.begin(), box.hi.end());
    }
    return npy(numbers, "<f4", false, "(" + std::to_string(boxes.size()) + ", 2, 3)");
}

TEST_F(Page, WatchedFramesAreTheSimulations)
{
    const std::vector<std::string> simulate = {"simulate", "--scene", "mixed", "-n", "300", "--frames", "40"};
    std::vector<std::string> alone = simulate;
    alone.insert(alone.end(), {"--record", "alone.jrec", "--json", "alone.json"});
    ASSERT_EQ(run(alone).exit_code, 0);
    std::vector<std::vector<Aabb3f>> frames;
    jostle_scenes::RecordingReader reader(folder / "alone.jrec");
    for (std::vector<Aabb3f> boxes; reader.next(boxes);)
        frames.push_back(boxes);
    ASSERT_EQ(frames.size(), 41u);

    std::vector<std::string> watched = simulate;
    watched.insert(watched.end(), {"--watch", "--record", "watched.jrec", "--json", "watched.json"});
    serve(watched);
    EXPECT_EQ(opened_, "/#live=live");
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
    httplib::Response response = get("/live");
    EXPECT_EQ(response.get_header_value("Jostle-Frame"), "0"); // it waited for somebody to look
    EXPECT_EQ(response.get_header_value("Jostle-Title"), "jostle simulate --scene mixed -n 300 --seed 1");
    std::uint64_t seen = 0, several = 0;
    for (;;) {
        EXPECT_TRUE(response.body == bytes_of(frames.at(seen))) << seen;
        if (seen == 40) break;
        response = get("/live?after=" + std::to_string(seen));
        ASSERT_EQ(response.status, 200);
        const std::uint64_t frame = std::stoull(response.get_header_value("Jostle-Frame"));
        ASSERT_GT(frame, seen);
        seen = frame;
        ++several;
    }
    EXPECT_GT(several, 5u);
    do {
        response = get("/live?after=40");
        ASSERT_EQ(response.status, 204);
    } while (!response.has_header("Jostle-Ended"));
    for (const char* bad : {"x", "-1", "1x", ""})
        EXPECT_EQ(get(std::string("/live?after=") + bad).status, 400) << bad;
    EXPECT_EQ(end(SIGINT).exit_code, 0);

    EXPECT_EQ(read("watched.jrec"), read("alone.jrec"));
    const auto result = nlohmann::json::parse(read("watched.json"));
    EXPECT_EQ(result["hash"], nlohmann::json::parse(read("alone.json"))["hash"]);
}

TEST_F(Page, WatchedUntilInterruptedEndsAfterAWholeFrame)
{
    serve({"simulate", "-n", "200", "--watch", "--record", "some.jrec", "--json", "some.json"});
    std::uint64_t seen = 0;
    get("/live");
    while (seen < 20)
        seen = std::stoull(get("/live?after=" + std::to_string(seen)).get_header_value("Jostle-Frame"));
    // Somebody waits for a frame when it ends.
    std::thread waiting([&] { client_->Get("/live?after=1000000"); });
    EXPECT_EQ(end(SIGINT).exit_code, 0);
    waiting.join();
    const auto result = nlohmann::json::parse(read("some.json"));
    const std::uint64_t simulated = result["frames"];
    EXPECT_GE(simulated, 20u);
    EXPECT_EQ(jostle_scenes::RecordingReader(folder / "some.jrec").info().frames, simulated + 1);
    const Result again = run({"simulate", "-n", "200", "--frames", std::to_string(simulated), "--json", "-",
                              "--record", "r.jrec"});
    EXPECT_EQ(nlohmann::json::parse(again.out)["hash"], result["hash"]);
    EXPECT_EQ(read("r.jrec"), read("some.jrec"));
}

TEST_F(Page, WatchedByNobodyIsEndedAllTheSame)
{
    serve({"simulate", "-n", "200", "--watch"});
    const Result result = end(SIGTERM);
    EXPECT_EQ(result.exit_code, 0);
    EXPECT_NE(result.err.find("It begins when the page is open."), std::string::npos);
}

} // namespace
} // namespace tool_test
