import { defineConfig, type Plugin } from "vite";

// Threads need shared memory, which browsers give only to pages that are isolated from other origins.
const isolated = {
  "Cross-Origin-Opener-Policy": "same-origin",
  "Cross-Origin-Embedder-Policy": "require-corp",
};

/** Modules of the package that weren't built (extras/web/build): a browser that needs one asks in vain. */
const unbuilt: Plugin = {
  name: "unbuilt",
  enforce: "pre",
  async resolveId(name, importer) {
    if (!/\/dist\/jostle[-\w]*\.js$/.test(name)) return undefined;
    return (await this.resolve(name, importer, { skipSelf: true })) ?? { id: name, external: true };
  },
};

export default defineConfig({
  plugins: [unbuilt],
  base: "./", // so that the folder works wherever it is put
  build: { target: "es2022", assetsInlineLimit: 0, chunkSizeWarningLimit: 1000, reportCompressedSize: false },
  worker: { format: "es", plugins: () => [unbuilt] },
  server: { host: "127.0.0.1", headers: isolated },
  preview: { host: "127.0.0.1", headers: isolated },
});
