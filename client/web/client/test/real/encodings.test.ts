import { afterAll, beforeAll, describe, expect, test } from "vitest";
import {
  type Encoding,
  type Frame,
  type FrameOptions,
  joinSession,
  openSession,
  type Session,
} from "../../src/index.js";
import { Service } from "../support/service.js";
import { grid } from "../support/shapes.js";

/** The finished frame as a reader with these options gets it. */
async function read(service: Service, { name }: Session, options: FrameOptions): Promise<Frame> {
  const reader = await joinSession(name, { url: service.url, withNormals: true, ...options });
  for await (const frame of reader) {
    if (!frame.isFinal || frame.inputSeq === 0) continue;
    await reader.close();
    return frame;
  }
  throw new Error("no frame came");
}

/** A sheet of n by n, its right edge lifted and turned. */
async function bent(service: Service, n: number): Promise<Session> {
  const { mesh, handles } = grid(n);
  const session = await openSession(mesh, { url: service.url, settings: { p: 2 } });
  session.setHandles(handles);
  session.move("right", { axis: [0, 1, 0], angle: -1, center: [n, 0, 0], translation: [0, 0, n / 3] });
  await session.settle({ timeoutMs: 60_000 });
  return session;
}

describe("encodings", () => {
  let service: Service;
  let session: Session;
  beforeAll(async () => {
    service = await Service.start();
    session = await bent(service, 50);
  });
  afterAll(() => service.stop());

  const largest = (one: Float32Array, other: Float32Array, from = 0, stride = 1) => {
    let most = 0;
    for (let k = from; k < one.length; k += stride) most = Math.max(most, Math.abs(one[k]! - other[k]!));
    return most;
  };
  // Half a step, and what float32 rounds away of a coordinate below 64.
  const rounding = 64 * 2 ** -23;

  test.each(["quantized", "compressed"] satisfies Encoding[])("%s is off by at most half a step", async (encoding) => {
    const exact = await read(service, session, { encoding: "float32" });
    const frame = await read(service, session, { encoding });
    const { extent, distortionExtent } = frame.quantized!;
    for (let axis = 0; axis < 3; ++axis) {
      expect(largest(frame.positions, exact.positions, axis, 3)).toBeLessThanOrEqual(
        extent[axis]! / 65535 / 2 + rounding,
      );
    }
    expect(distortionExtent).toBeCloseTo(Math.max(...exact.distortion), 6);
    expect(largest(frame.distortion, exact.distortion)).toBeLessThanOrEqual(distortionExtent / 65535 / 2 + 1e-7);
    expect(largest(frame.normals, exact.normals)).toBeLessThanOrEqual(0.5 / 32767 + 1e-7);
  });

  test("float64 is what float32 was rounded from, at twice the bytes", async () => {
    const single = await read(service, session, { encoding: "float32" });
    const frame = await read(service, session, { encoding: "float64" });
    expect(single.doubles).toBeUndefined();
    for (const what of ["positions", "distortion", "normals"] as const) {
      expect(Float32Array.from(frame.doubles![what])).toEqual(single[what]);
      expect(frame[what]).toEqual(single[what]);
    }
    expect(frame.doubles!.positions.some((x) => x !== Math.fround(x))).toBe(true);
    expect(frame.wireBytes).toBe(2 * single.wireBytes);
  });

  test("compressed is the same as quantized, and smaller", async () => {
    const quantized = await read(service, session, { encoding: "quantized" });
    const compressed = await read(service, session, { encoding: "compressed" });
    expect(compressed.quantized).toEqual(quantized.quantized);
    expect(compressed.wireBytes).toBeLessThan(quantized.wireBytes);
    expect(quantized.wireBytes).toBe(16 * 2500);
  });
});

test("a solve in doubles brings back to the last bit what went out, what is held where it is and where it was put", async () => {
  const service = await Service.start();
  const { mesh, handles } = grid(20);
  // No coordinate of them is a float32.
  const vertices = Float64Array.from(mesh.vertices, (value, k) => value + 1e-4 * Math.PI * (k + 1));
  expect(vertices.some((value) => Math.fround(value) === value)).toBe(false);
  const put = Float64Array.from({ length: 3 * handles.right.vertices!.length }, (_, k) => 20 + Math.sqrt(k + 2));
  const session = await openSession({ ...mesh, vertices }, { url: service.url, settings: { p: 2 } });
  session.setHandles({ left: handles.left, right: { ...handles.right, motion: { targets: put } } });
  const { positions, distortion } = await session.solve({ scalar: "float64", deadlineMs: 20_000 });
  const at = (vertex: number) => [...positions.subarray(3 * vertex, 3 * vertex + 3)];
  for (const vertex of handles.left.vertices!)
    expect(at(vertex)).toEqual([...vertices.subarray(3 * vertex, 3 * vertex + 3)]);
  [...handles.right.vertices!].forEach((vertex, k) => expect(at(vertex)).toEqual([...put.subarray(3 * k, 3 * k + 3)]));
  expect(distortion).toBeInstanceOf(Float64Array);
  const rounded = await session.solve({ deadlineMs: 20_000 });
  expect(rounded.positions).toBeInstanceOf(Float32Array);
  expect(rounded.positions[0]).toBe(Math.fround(vertices[0]!));
  await session.close();
  await service.stop();
});

describe("a server with a limit of bytes a second", () => {
  const n = 30;
  let service: Service;
  beforeAll(async () => {
    // Less than ten frames a second of float32 with distortion, more than ten quantized.
    service = await Service.start({ serverFlags: ["--max-stream-rate", String(12 * n * n * 10)] });
  });
  afterAll(() => service.stop());

  test("lowers the precision to what the client takes", async () => {
    const session = await bent(service, n);
    expect((await read(service, session, { withNormals: false })).quantized).toBeDefined();
    expect((await read(service, session, { withNormals: false, lowestEncoding: "float32" })).quantized).toBeUndefined();
    await session.close();
  });

  test("lowers the frame rate, and still sends the last frame", async () => {
    const session = await bent(service, n);
    const reader = await joinSession(session.name, { url: service.url, lowestEncoding: "float32" });
    const start = performance.now();
    let [first, bytes, tick, last, isOver] = [0, 0, 0, 0, false];
    const dragging = setInterval(() => {
      last = session.move("right", { translation: [0, 0, ++tick % 20] });
      isOver = tick >= 150 && bytes > 5 * first; // some frames must come before the last one
      if (isOver) clearInterval(dragging);
    }, 10);
    for await (const frame of reader) {
      bytes += frame.wireBytes;
      first ||= frame.wireBytes;
      if (isOver && frame.isFinal && frame.inputSeq >= last) break;
    }
    const seconds = (performance.now() - start) / 1000;
    expect(bytes - first).toBeLessThanOrEqual(12 * n * n * 10 * seconds * 1.1);
    await reader.close();
    await session.close();
  });
});
