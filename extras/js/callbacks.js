// SPDX-License-Identifier: MIT
// What the module imports from JavaScript (an emscripten library): the functions that src/core.js puts into
// Module.callbacks.
mergeInto(LibraryManager.library, {
  jostle_js_accept_pair: function (number, a, b) {
    return Module["callbacks"].acceptPair(number, a, b);
  },
  jostle_js_accept_scene_pair: function (number, scene, a, b) {
    return Module["callbacks"].acceptScenePair(number, scene, a, b);
  },
  jostle_js_take_pairs: function (number, pairs, count) {
    return Module["callbacks"].takePairs(number, pairs, count);
  },
  jostle_js_accept_answer: function (number, query, id) {
    return Module["callbacks"].acceptAnswer(number, query, id);
  },
  jostle_js_visit_answer: function (number, id, at, bound) {
    return Module["callbacks"].visitAnswer(number, id, at, bound);
  },
  jostle_js_accept_objects: function (number, a, b) {
    return Module["callbacks"].acceptObjects(number, a, b);
  },
});
