// SPDX-License-Identifier: MIT
export { JostleError } from "./error.js";
export { readBoxes } from "./files.js";
export { findPairs, load } from "./load.js";
export { rays } from "./queries.js";
export { poses } from "./shapes.js";
export { support } from "./start.js";
export { endReasons } from "./world.js";
