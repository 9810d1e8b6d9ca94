import { defineConfig } from "vite";

// `npm run dev` serves the page, and a running deploy/up the rest.
const service = process.env["LPDEFORM_URL"] ?? "http://127.0.0.1:8080";

export default defineConfig({
  server: { proxy: { "/lpdeform.v1.DeformService": service } },
  worker: { format: "es" }, // its readers are loaded when they are needed
  build: { chunkSizeWarningLimit: 1200 }, // three.js is one
});
