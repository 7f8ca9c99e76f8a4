# WebAssembly, by Debian's emscripten; programs run under node.
#   cmake -B build/wasm --toolchain cmake/toolchains/wasm.cmake -DJOSTLE_TBB=OFF ...
include(/usr/share/emscripten/cmake/Modules/Platform/Emscripten.cmake)
# Debian keeps the parser that emscripten links with where node doesn't look by itself.
set_property(GLOBAL PROPERTY RULE_LAUNCH_LINK "env NODE_PATH=/usr/share/nodejs")
# emscripten's loader calls fetch on a file's name where node has fetch, that is from 18 on.
set(CMAKE_CROSSCOMPILING_EMULATOR node --no-experimental-fetch)
