#!/usr/bin/env bash
# package.sh BINDINGS BUILDS SCRATCH: builds the npm package, packs it, and installs the tarball where the tests lie.
set -euo pipefail
bindings=$1 builds=$2 scratch=$3
rm -rf "$scratch"
mkdir -p "$scratch/consumer"
"$bindings/build" "$scratch/jostle" "$builds"
cd "$scratch"
npm pack --silent ./jostle
tarball=$(ls jostle-*.tgz)
for file in {jostle,rbush,flatbush}.d.ts LICENSE README.md package.json src/{index,rbush,flatbush}.js \
    dist/jostle{,-bush,-2d,-3d,-pairs,-plain,-surfaces,-threads}.{js,wasm} dist/jostle-threads.worker.js; do
    tar -tzf "$tarball" "package/$file" >/dev/null # is in it
done
# The sizes that the package's own page tells, and those that the guide does, in kB.
grep -q '^| `load()` | [0-9]* kB | [0-9]* kB | [0-9]* kB |$' jostle/README.md
for module in dist/jostle{,-bush,-2d,-3d,-pairs,-plain,-surfaces,-threads}.wasm; do
    kilobytes=$(($(gzip -9c "jostle/$module" | wc -c) / 1000))
    told=$(sed -n "s/^| .$(basename $module). .* | \([0-9]*\) kB |$/\1/p" "$bindings/../../docs/guide/javascript.md")
    ((told > 0 && kilobytes <= told + told / 20 && kilobytes >= told - told / 20)) ||
        { echo "$module has $kilobytes kB gzipped, and the guide says ${told:-nothing}"; exit 1; }
done
# What threads.sed mends.
if grep -q 'import(' jostle/dist/jostle-threads.worker.js ||
    grep -qE 'new URL\("jostle-threads.worker|Blocking on the main thread' jostle/dist/jostle-threads.js; then
    echo "extras/js/threads.sed doesn't fit emscripten's glue"
    exit 1
fi
cd consumer
echo '{ "type": "module", "private": true }' >package.json
npm install --silent --offline --no-audit --no-fund "../$tarball"
# To compare with. Without npm's registry those tests are skipped; each is compared with its definition anyway.
timeout 60 npm install --silent --no-save --no-audit --no-fund rbush@4.0.1 flatbush@4.7.0 ||
    echo "rbush and flatbush can't be had from npm: tests do without"
cp "$bindings"/test/* .
