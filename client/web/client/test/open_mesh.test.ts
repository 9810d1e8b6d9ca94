import { afterEach, beforeAll, beforeEach, expect, test, vi } from "vitest";
import { LpdeformError } from "../src/errors.js";
import { FileFault } from "../src/mesh/fault.js";
import type { Mesh } from "../src/mesh/mesh.js";
import { OpenMesh, readMesh } from "../src/mesh/open_mesh.js";
import type { Answer, Question } from "../src/mesh/open_mesh.js";
import { logicalLines } from "../src/mesh/obj_lines.js";
import { parseMesh } from "../src/mesh/read.js";

type Message = { data: Question | Answer };

/** The program of the worker, in this thread. Messages are copied as between threads. */
class WorkerHere {
  static newest: WorkerHere;
  static program: (message: Message) => void;
  onmessage: ((message: Message) => void) | undefined;
  onerror: (() => void) | undefined;
  /** It does not answer any more. */
  hangs = false;
  constructor() {
    WorkerHere.newest = this;
  }
  postMessage(question: Question, transfer: Transferable[]): void {
    const data = structuredClone(question, { transfer });
    if (!this.hangs) WorkerHere.program({ data });
  }
  terminate(): void {}
}

beforeAll(async () => {
  vi.stubGlobal("onmessage", undefined);
  await import("../src/mesh/mesh_worker.js");
  WorkerHere.program = (globalThis as unknown as { onmessage: (message: Message) => void }).onmessage;
});

beforeEach(() => {
  vi.stubGlobal("Worker", WorkerHere);
  vi.stubGlobal("postMessage", (answer: Answer, transfer: Transferable[]) =>
    WorkerHere.newest.onmessage!({ data: structuredClone(answer, { transfer }) }),
  );
});

afterEach(() => {
  vi.unstubAllGlobals();
});

const side = 100;

/** A flat sheet that is large enough for a worker. */
function sheet(): Mesh {
  const positions = new Float32Array(3 * side * side);
  const faces: number[] = [];
  for (let v = 0; v < side * side; ++v) {
    positions[3 * v] = v % side;
    positions[3 * v + 1] = Math.floor(v / side);
    if (v % side < side - 1 && v + side < side * side) faces.push(v, v + 1, v + side, v + 1, v + side + 1, v + side);
  }
  return { name: "sheet", positions, faces: Uint32Array.from(faces) };
}

function unreadable() {
  const part = { firstVertex: 0, vertexCount: side * side, vertices: Uint8Array.of(1, 2), normals: new Uint8Array() };
  const quantization = { origin: [0, 0, 0], step: 1, distortionMax: 1 } as never;
  return { vertexCount: side * side, isCompressed: true, quantization, parts: [part] };
}

test("an error of the worker keeps its code and reason", async () => {
  const opened = await OpenMesh.from({ mesh: sheet() });
  expect(opened.isInWorker).toBe(true);
  const failed = await opened.unpack(unreadable()).catch((error: unknown) => error);
  expect(failed).toBeInstanceOf(LpdeformError);
  expect(failed).toMatchObject({ code: "data_loss", reason: "FRAME_PARTS" });
  expect(await opened.shade(surface(opened))).toHaveProperty("positions");
});

test("what nobody should have thrown in the worker is an LpdeformError, too, and a wrong file a FileFault", async () => {
  const opened = await OpenMesh.from({ mesh: sheet() });
  const broken = opened.shade({ positions: undefined as never, distortion: new Float32Array() });
  await expect(broken).rejects.toMatchObject({ name: "LpdeformError", code: "internal", reason: "EXCEPTION" });
  const long = new File(["v 1 2\n", "#".repeat(300_000)], "wrong.obj");
  await expect(readMesh(long)).rejects.toThrow(
    new FileFault("wrong.obj, line 1, vertex 1: a vertex has no three finite coordinates."),
  );
});

const surface = ({ mesh }: OpenMesh) => ({ positions: mesh.positions, distortion: new Float32Array() });

test("the page goes on with a mesh whose worker has ended, and answers what was asked of it", async () => {
  const opened = await OpenMesh.from({ mesh: sheet() });
  const before = await opened.shade(surface(opened));
  WorkerHere.newest.hangs = true;
  const [shaded, rewelded] = [opened.shade(surface(opened)), opened.reweld({ tolerance: 0, isOn: true })];
  const gone = opened.unpack(unreadable()); // its memory went to the worker
  WorkerHere.newest.onerror!();
  await expect(gone).rejects.toMatchObject({ code: "unavailable" }); // a session asks for its frames again
  expect(await shaded).toEqual(before);
  expect((await rewelded).welding.tolerance).toBe(0);
  expect(opened.isInWorker).toBe(false);
  expect(opened.derived.welding.tolerance).toBe(0);
  await expect(opened.unpack(unreadable())).rejects.toMatchObject({ reason: "FRAME_PARTS" }); // in the page
  expect((await opened.store()).blob.size).toBeGreaterThan(200_000);
  opened.close();
  await expect(opened.shade(surface(opened))).rejects.toMatchObject({ code: "unavailable" });
});

test("a worker that ends before it has opened the mesh is replaced", async () => {
  class Ending extends WorkerHere {
    override postMessage(): void {
      setTimeout(() => this.onerror!());
    }
  }
  vi.stubGlobal("Worker", Ending);
  const opened = await OpenMesh.from({ mesh: sheet() });
  expect(opened.isInWorker).toBe(false);
  expect(opened.derived.seams).toBeUndefined();
});

test.each([
  [NaN, "WELD_TOLERANCE"],
  [-1e-9, "WELD_TOLERANCE"],
  [Infinity, "WELD_TOLERANCE"],
  [1.1e-3, "WELD_TOLERANCE"],
  ["1e-4", "WELD_TOLERANCE"],
  [undefined, "WELD_TOLERANCE"],
])("a tolerance of %s is refused", async (tolerance, reason) => {
  const welding = { tolerance, isOn: true } as never;
  const limit = "0 <= tolerance <= 0.001";
  const refusal = { code: "invalid_argument", reason, element: "weld tolerance", limit };
  await expect(OpenMesh.from({ mesh: sheet() }, welding)).rejects.toMatchObject(refusal);
  const opened = await OpenMesh.from({ mesh: sheet() });
  await expect(opened.reweld(welding)).rejects.toMatchObject(refusal);
  expect(opened.derived.welding).toEqual({ tolerance: 1e-6, isOn: true });
});

test("the ends of the range of tolerances are taken", async () => {
  const opened = await OpenMesh.from({ mesh: sheet() }, { tolerance: 0, isOn: true });
  expect((await opened.reweld({ tolerance: 1e-3, isOn: true })).seams).toBeUndefined();
});

test("unknown keys of options are refused by name", async () => {
  const file = new File(["v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3"], "a.obj");
  const unknown = (element: string) => ({ reason: "UNKNOWN_KEY", element });
  await expect(readMesh(file, { besides: [] } as never)).rejects.toMatchObject(unknown("options"));
  const welding = { tolerance: 1e-6, isOn: true, isWelded: true };
  await expect(readMesh(file, { welding })).rejects.toMatchObject(unknown("welding"));
  await expect(readMesh(file, { welding: { tolerance: 1e-6 } as never })).rejects.toMatchObject({
    reason: "ARRAY_TYPE",
    element: "isOn of welding",
  });
});

test("a message about an unknown file names what the library reads", () => {
  expect(() => parseMesh("a.fbx", new Uint8Array())).toThrow(
    "a.fbx is not a mesh that can be read: GLB, glTF, OFF, OBJ, PLY and STL can.",
  );
});

test("a line that is continued 200,000 times is read in a moment, and a face of as many corners", () => {
  const count = 200_000;
  const words = Array.from({ length: count }, (_, k) => `${(k % 3) + 1}`);
  const text = `v 0 0 0\nv 1 0 0\nv 0 1 0\nf ${words.join(" \\\n")}`;
  const began = performance.now();
  const lines = [...logicalLines(text)];
  expect(lines.map(({ number }) => number)).toEqual([1, 2, 3, count + 3]);
  expect(lines[3]!.words.length).toBe(count + 1);
  expect(lines[3]!.text).toBe(text.slice(text.indexOf("f")));
  expect(parseMesh("a.obj", new TextEncoder().encode(text)).faces.length).toBe(3 * (count - 2));
  expect(performance.now() - began).toBeLessThan(5000); // with the square of their number it takes minutes
});
