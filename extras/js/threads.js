// Before the glue of jostle-threads.wasm (an emscripten --pre-js): the package makes the workers, in browsers
// and in node.
var Worker = function () {
  return Module["makeWorker"]();
};
