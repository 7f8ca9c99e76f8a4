// SPDX-License-Identifier: MIT
// Instead of the page's server, where there is no cpp-httplib.
#include "commands.hpp"
#include "page_server.hpp"

namespace jostle_tool {

struct PageServer::Http
{
};

PageServer::PageServer(const PageOptions&)
{
    throw UsageError(
        "this jostle was built without cpp-httplib, by which it would serve the page; ./run web, in "
        "Jostle's source, shows files that are dropped on it");
}
PageServer::~PageServer() = default;
std::string PageServer::show(const std::filesystem::path&)
{
    return {};
}
std::string PageServer::show(LiveFrames&)
{
    return {};
}
void PageServer::start() {}

} // namespace jostle_tool
