// SPDX-License-Identifier: MIT
#include <variant>

#include "c_api/handles.hpp"
#include "jostle/recorder.hpp"

namespace jostle::c_api {
namespace {

[[noreturn]] void throw_problem(const std::string& problem)
{
    throw Error(ErrorCode::file_error, problem);
}

struct RecorderContent final : Content
{
    RecorderContent(jostle_space space, const char* path, double frames_per_second, const char* description)
    {
        in_space(space, [&](auto of) {
            recorder.emplace<Recorder<decltype(of)::dim, typename decltype(of)::T>>(
                path, frames_per_second, description == nullptr ? "" : description);
        });
        on([](const auto& typed) {
            if (!typed.problem().empty()) throw_problem(typed.problem());
        });
    }
    template <class F>
    void on(F&& inside)
    {
        on_held(recorder, inside);
    }

    InSomeSpace<Recorder<2, float>, Recorder<3, float>, Recorder<2, double>, Recorder<3, double>> recorder;
};

} // namespace

template <>
struct Behind<jostle_recorder> : Kind<RecorderContent, 0x0b>
{
    static constexpr const char* name = "jostle_recorder";
};

} // namespace jostle::c_api

using namespace jostle;
using namespace jostle::c_api;

extern "C" {

jostle_status jostle_recorder_new(jostle_space space, const char* path, double frames_per_second,
                                  const char* description, jostle_recorder** out, jostle_error* error)
{
    return guarded(error, [&] {
        wanted(out, "out");
        wanted(path, "path");
        hand_out(out, std::make_unique<RecorderContent>(space, path, frames_per_second, description));
    });
}
jostle_status jostle_recorder_frame(jostle_recorder* recorder, const jostle_boxes* boxes, jostle_error* error)
{
    return guarded(error, [&] {
        open(recorder).on([&]<int Dim, Coordinate T>(Recorder<Dim, T>& typed) {
            if (!typed.frame(view<Dim, T>(boxes, "boxes"))) throw_problem(typed.problem());
        });
    });
}
jostle_status jostle_recorder_close(jostle_recorder* recorder, jostle_error* error)
{
    return guarded(error, [&] {
        open(recorder).on([](auto& typed) {
            if (!typed.close()) throw_problem(typed.problem());
        });
    });
}

} // extern "C"
