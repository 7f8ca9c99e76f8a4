// SPDX-License-Identifier: MIT
// A thread of the module's under node: makes a worker thread look like a browser's worker.
import { parentPort } from "node:worker_threads";

globalThis.self = globalThis;
globalThis.postMessage = (message) => parentPort.postMessage(message);
await import("../dist/jostle-threads.worker.js");
parentPort.on("message", (data) => globalThis.onmessage({ data })); // what came before is kept until now
