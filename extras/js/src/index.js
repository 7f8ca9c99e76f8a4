// SPDX-License-Identifier: MIT
export { JostleError } from "./error.js";
export { readBoxes } from "./files.js";
export { load, support } from "./load.js";
export { rays } from "./queries.js";
export { poses } from "./shapes.js";
export { endReasons } from "./world.js";
