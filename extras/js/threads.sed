# The glue of jostle-threads.wasm, as bundlers like it: the package makes the workers, and a worker names its module where it begins.
# And as users like it, who know that a search takes its time: it prints nothing.
s/if(!Module\["locateFile"\]){PThread\.unusedWorkers\.push(new Worker(new URL("jostle-threads\.worker\.js",import\.meta\.url)));return}//
s/^"use strict";var Module={};/import create from".\/jostle-threads.js";var Module={};/
s/(e\.data\.urlOrBlob?import(e\.data\.urlOrBlob):import("\.\/jostle-threads\.js"))\.then(function(exports){return exports\.default(Module)})/create(Module)/
s/warnOnce("Blocking on the main thread[^"]*")//
