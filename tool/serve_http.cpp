// SPDX-License-Identifier: MIT
// The page's server, by cpp-httplib.
#include <algorithm>
#include <charconv>
#include <chrono>
#include <fstream>
#include <string_view>
#include <system_error>
#include <thread>

#include <httplib.h>

#include "commands.hpp"
#include "installed.hpp"
#include "page_server.hpp"

namespace jostle_tool {

namespace {

constexpr const char* host = "127.0.0.1";

std::filesystem::path page_folder(const std::filesystem::path& given)
{
    const auto is_page = [](const std::filesystem::path& folder) {
        std::error_code unknown;
        return std::filesystem::exists(folder / "index.html", unknown);
    };
    if (!given.empty()) {
        if (!is_page(given))
            throw UsageError("--page: " + given.string() +
                             " has no index.html; give the folder that ./run web --build DIR wrote");
        return given;
    }
    for (const std::filesystem::path& folder : {installed("page"), std::filesystem::path(JOSTLE_PAGE)})
        if (!folder.empty() && is_page(folder)) return folder;
    throw UsageError(
        "the page isn't built; extras/web/build, in Jostle's source, builds it (it installs emscripten "
        "and npm), or give the folder of one with --page");
}

/// A path as part of an address.
std::string encoded(std::string_view path)
{
    std::string text;
    for (const char c : path) {
        const bool plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
                           std::string_view("-._~/").find(c) != std::string_view::npos;
        constexpr const char* digits = "0123456789ABCDEF";
        if (plain)
            text += c;
        else
            text += {'%', digits[static_cast<unsigned char>(c) >> 4], digits[c & 15]};
    }
    return text;
}

void send_file(const std::filesystem::path& path, httplib::Response& response)
{
    const auto file = std::make_shared<std::ifstream>(path, std::ios::binary);
    std::error_code failed;
    const std::uintmax_t size = std::filesystem::file_size(path, failed);
    if (!*file || failed) {
        response.status = 404; // it was there when the command began
        return;
    }
    response.set_content_provider(
        size, "application/octet-stream", [file](std::size_t from, std::size_t left, httplib::DataSink& to) {
            char bytes[1 << 16];
            file->clear();
            file->seekg(static_cast<std::streamoff>(from));
            file->read(bytes, static_cast<std::streamsize>(std::min(left, sizeof bytes)));
            return file->gcount() > 0 && to.write(bytes, static_cast<std::size_t>(file->gcount()));
        });
}

void send_frame(LiveFrames& frames, const httplib::Request& request, httplib::Response& response)
{
    LiveFrames::Answer answer;
    if (request.has_param("after")) {
        const std::string text = request.get_param_value("after");
        std::uint64_t seen;
        const auto read = std::from_chars(text.data(), text.data() + text.size(), seen);
        if (read.ec != std::errc() || read.ptr != text.data() + text.size()) {
            response.status = 400;
            return;
        }
        answer = frames.newer_than(seen);
    } else {
        answer = frames.newest();
    }
    response.set_header("Jostle-Frame", std::to_string(answer.frame));
    response.set_header("Jostle-Title", frames.title());
    if (answer.ended) response.set_header("Jostle-Ended", "1");
    if (answer.npy.empty())
        response.status = 204;
    else
        response.set_content(std::move(answer.npy), "application/octet-stream");
}

} // namespace

struct PageServer::Http
{
    httplib::Server server;
    std::string address;
    std::thread thread;
};

PageServer::PageServer(const PageOptions& options) : http_(std::make_unique<Http>())
{
    const std::filesystem::path folder = page_folder(options.page);
    httplib::Server& server = http_->server;
    server.set_mount_point("/", folder.string());
    server.set_file_extension_and_mimetype_mapping("wasm", "application/wasm");
    server.set_default_headers({// Threads: browsers share memory only in pages that are isolated.
                                {"Cross-Origin-Opener-Policy", "same-origin"},
                                {"Cross-Origin-Embedder-Policy", "require-corp"},
                                {"Cross-Origin-Resource-Policy", "same-origin"},
                                {"X-Content-Type-Options", "nosniff"},
                                {"Cache-Control", "no-cache"}});
    // A page of somebody else's may have its own name lead here, and would then read what is served.
    server.set_pre_routing_handler([](const httplib::Request& request, httplib::Response& response) {
        const std::string asked = request.get_header_value("Host");
        const std::string name = asked.substr(0, asked.find(':'));
        if (name == host || name == "localhost") return httplib::Server::HandlerResponse::Unhandled;
        response.status = 403;
        return httplib::Server::HandlerResponse::Handled;
    });
    // Each open connection of a browser takes a thread, and so does each wait for a frame.
    server.new_task_queue = [] { return new httplib::ThreadPool(32); };
    server.set_keep_alive_max_count(10'000);
    server.set_keep_alive_timeout(1); // which ending has to wait for
    server.set_tcp_nodelay(true);
    server.set_socket_options([](socket_t socket) { // not SO_REUSEPORT: two programs would share the port
        const int yes = 1;
        setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
    });
    int port = static_cast<int>(options.port);
    if (port == 0)
        port = server.bind_to_any_port(host);
    else if (!server.bind_to_port(host, port))
        port = -1;
    if (port < 0)
        throw UsageError(options.port == 0
                             ? std::string("no port of 127.0.0.1 can be served")
                             : "--port: " + std::to_string(options.port) +
                                   " can't be used, probably because another program has it; give another");
    http_->address = std::string("http://") + host + ":" + std::to_string(port) + "/";
}

PageServer::~PageServer()
{
    http_->server.stop();
    if (http_->thread.joinable()) http_->thread.join();
}

std::string PageServer::show(const std::filesystem::path& file)
{
    const std::string path = "data/" + file.filename().string();
    http_->server.Get(R"(/data/[\s\S]+)",
                      [file, path](const httplib::Request& request, httplib::Response& response) {
                          if (request.path == "/" + path)
                              send_file(file, response);
                          else
                              response.status = 404;
                      });
    return http_->address + "#file=" + encoded(path);
}

std::string PageServer::show(LiveFrames& frames)
{
    http_->server.Get("/live", [&frames](const httplib::Request& request, httplib::Response& response) {
        send_frame(frames, request, response);
    });
    return http_->address + "#live=live";
}

void PageServer::start()
{
    http_->thread = std::thread([this] { http_->server.listen_after_bind(); });
    while (!http_->server.is_running()) // before that it can't be stopped
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
}

} // namespace jostle_tool
