import { describe, expect, it } from "vitest";
import { FileFault } from "lpdeform-client/mesh/fault";
import { newGlb } from "../src/io/write_glb.js";
import { type GltfDocument, type Part, readGltfDocument, writeGlb } from "lpdeform-client/mesh/gltf_document";
import { rewriteGlb } from "../src/io/gltf_rewrite.js";
import { readBlocks } from "lpdeform-client/mesh/gltf_blocks";
import { parseMesh } from "lpdeform-client/mesh/read";
import type { Mesh } from "lpdeform-client/mesh/mesh";
import { seamsOf } from "lpdeform-client/mesh/seams";
import { guessYUp } from "lpdeform-client/mesh/up";
import { faultsOf } from "./gltf_validator.js";
import { columns, makeGlb, rows } from "./made_glb.js";

const glb = makeGlb();
const perNode = (rows + 1) * (columns + 1);
const documentOf = (bytes: Uint8Array): GltfDocument => readGltfDocument("a.glb", bytes, new Map());
const meshOf = (bytes: Uint8Array) => parseMesh("a.glb", bytes) as Mesh & { gltf: Uint8Array };
/** The file with its JSON changed. */
function with_(change: (json: any) => void, bytes = glb): Uint8Array {
  const document = documentOf(bytes.slice());
  change(document.json);
  return writeGlb(document);
}
/** All vertices turned by 0.5 about the z axis and lifted. */
const turned = ({ positions }: Mesh) =>
  Float64Array.from(positions, (_, k) => {
    const [x, y, z] = [...positions.subarray(k - (k % 3), k - (k % 3) + 3)] as [number, number, number];
    return [Math.cos(0.5) * x - Math.sin(0.5) * y, Math.sin(0.5) * x + Math.cos(0.5) * y, z + 1][k % 3]!;
  });
const withoutBounds = (json: Part) =>
  JSON.parse(JSON.stringify(json, (key, value: unknown) => (key === "min" || key === "max" ? undefined : value))) as Part;

describe("a GLB file", () => {
  it("is valid as the tests make it", async () => {
    expect(await faultsOf(glb)).toEqual([]);
    expect(await faultsOf(makeGlb(true))).toEqual([]);
  });

  it("is read where its nodes draw it, with y up, in one piece, and what it has beside is named", () => {
    const mesh = meshOf(glb);
    expect(mesh.positions.length).toBe(9 * perNode);
    expect([...mesh.positions.subarray(0, 3)]).toEqual([1, 0, 0]);
    expect([...mesh.positions.subarray(3 * perNode, 3 * perNode + 3)]).toEqual([4, 0, 0]);
    expect([...mesh.positions.subarray(6 * perNode, 6 * perNode + 3)]).toEqual([-4.5, 0, 0]);
    expect(seamsOf(mesh, 1e-6)!.copyCount).toBe(3 * (rows + 1));
    expect(guessYUp(mesh)).toBe(true);
    expect(mesh.beside).toEqual(
      expect.arrayContaining(["materials", "textures", "skins", "animations", "morph targets", "normals"]),
    );
    const [a, b, c] = mesh.faces.subarray(mesh.faces.length / 3); // of the mirrored node, turned
    expect([a, b, c]).toEqual([perNode, perNode + 1, perNode + columns + 1]);
  });

  it("comes back to the last bit where nothing has moved", () => {
    const mesh = meshOf(glb);
    expect(rewriteGlb(mesh, mesh.exact ?? mesh.positions)).toEqual(glb);
  });

  it("keeps chunks that are unknown here, behind its own", async () => {
    const own = Uint8Array.of(4, 0, 0, 0, ...new TextEncoder().encode("ACME"), 1, 2, 3, 4);
    for (const tail of [own, Uint8Array.of(...own, ...own)]) {
      const file = writeGlb({ ...documentOf(makeGlb(true)), chunks: tail });
      expect((await faultsOf(file)).filter((fault) => !fault.startsWith("GLB_UNKNOWN_CHUNK_TYPE"))).toEqual([]);
      const mesh = meshOf(file);
      expect(rewriteGlb(mesh, mesh.positions)).toEqual(file);
      expect(rewriteGlb(mesh, turned(mesh)).slice(-tail.length)).toEqual(tail);
    }
    const cut = writeGlb({ ...documentOf(makeGlb(true)), chunks: Uint8Array.of(9, 0, 0, 0, 1, 2) });
    expect(rewriteGlb(meshOf(cut), meshOf(cut).positions)).toEqual(makeGlb(true)); // no chunk that is whole
  });

  it("of one node comes back with other positions, and everything else to the last bit", async () => {
    const bare = makeGlb(true);
    const one = meshOf(bare);
    const moved = rewriteGlb(one, turned(one));
    expect(withoutBounds(documentOf(moved).json)).toEqual(withoutBounds(documentOf(bare).json));
    const changed = 12 * perNode;
    expect(documentOf(moved).buffer.subarray(changed)).toEqual(documentOf(bare).buffer.subarray(changed));
    expect(meshOf(moved).positions).toEqual(Float32Array.from(turned(one)));
    expect(await faultsOf(moved)).toEqual([]);
  });

  it("whose nodes share a mesh and accessors is deformed node by node, and stays valid", async () => {
    const mesh = meshOf(glb);
    const positions = turned(mesh);
    const out = rewriteGlb(mesh, positions);
    expect(await faultsOf(out)).toEqual([]);
    const again = meshOf(out);
    again.positions.forEach((value, k) => expect(value).toBeCloseTo(positions[k]!, 5));
    const { json, buffer } = documentOf(out) as { json: any; buffer: Uint8Array };
    for (const key of ["materials", "textures", "images", "skins", "animations", "extensions", "extras", "extensionsUsed"]) {
      expect(json[key]).toEqual(documentOf(glb).json[key]);
    }
    const bytesIn = (accessor: number) => {
      const { byteOffset, byteLength } = json.bufferViews[json.accessors[accessor].bufferView];
      return new Float32Array(buffer.slice(byteOffset, byteOffset + byteLength).buffer);
    };
    const { NORMAL, TANGENT } = json.meshes[json.nodes[0].mesh].primitives[0].attributes;
    const [normals, tangents] = [bytesIn(NORMAL), bytesIn(TANGENT)];
    const wanted = [Math.cos(0.5), Math.sin(0.5), 0]; // of vertex 0: its normal was x, and its tangent z
    wanted.forEach((value, axis) => expect(normals[axis]).toBeCloseTo(value, 5));
    [0, 0, 1, -1].forEach((value, axis) => expect(tangents[axis]).toBeCloseTo(value, 5));
    const seam = [0, 1, 2].map((axis) => normals[3 * columns + axis]);
    expect(seam).toEqual([...normals.subarray(0, 3)]);
  });

  it("may be split into files that are opened together", () => {
    const { json, buffer } = documentOf(glb);
    const text = (uri: string) =>
      new TextEncoder().encode(JSON.stringify({ ...json, buffers: [{ byteLength: buffer.length, uri }] }));
    const beside = new Map([["my data.bin", buffer]]);
    expect(parseMesh("a.gltf", text("my%20data.bin"), beside).positions).toEqual(meshOf(glb).positions);
    expect(() => parseMesh("a.gltf", text("other.bin"), beside)).toThrow(
      "Buffer 0 of a.gltf is not in the file; open it together",
    );
    const data = `data:application/octet-stream;base64,${Buffer.from(buffer).toString("base64")}`;
    expect(parseMesh("a.gltf", text(data)).gltf).toEqual(glb);
  });

  it.each<[string, (json: any) => void]>([
    [
      "Primitive 0 of mesh 0 (“sheet”) is compressed by KHR_draco",
      (json) => (json.meshes[0].primitives[0].extensions = { KHR_draco_mesh_compression: {} }),
    ],
    ["BufferView 1 is compressed by EXT_meshopt", (json) => (json.bufferViews[1].extensions = { EXT_meshopt_compression: {} })],
    ["The extension “ACME_secret” is required", (json) => (json.extensionsRequired = ["ACME_secret"])],
    [
      "The extension “KHR_draco_mesh_compression” is required",
      (json) => (json.extensionsRequired = ["KHR_texture_basisu", "KHR_draco_mesh_compression"]),
    ],
    ["The extension “EXT_meshopt_compression” is required", (json) => (json.extensionsRequired = ["EXT_meshopt_compression"])],
    ["The extension “” is required", (json) => (json.extensionsRequired = [""])],
    [`The extension “${"x".repeat(60)}...” is required`, (json) => (json.extensionsRequired = ["x".repeat(5000)])],
    [
      `BufferView 1 (“${"x".repeat(59)}...”) is`,
      (json) => {
        json.bufferViews[1] = {
          ...json.bufferViews[1],
          name: `${"x".repeat(59)}😀`,
          extensions: { EXT_meshopt_compression: {} },
        };
      },
    ],
    ["The extension “ACME_draco” is required", (json) => (json.extensionsRequired = ["ACME_draco"])],
    [
      "Primitive 0 of mesh 0 (“sheet”) is compressed by KHR_draco",
      (json) => {
        json.extensionsRequired = ["KHR_draco_mesh_compression"];
        json.meshes[0].primitives[0].extensions = { KHR_draco_mesh_compression: {} };
      },
    ],
    ["“extensionsRequired” is no list", (json) => (json.extensionsRequired = "KHR_draco_mesh_compression")],
    ["“extensionsRequired” is no list", (json) => (json.extensionsRequired = {})],
    ["“extensionsRequired” has an item that is no text", (json) => (json.extensionsRequired = [null])],
    [
      "Node 0 (“tube”) draws by EXT_mesh_gpu_instancing",
      (json) => (json.nodes[0].extensions = { EXT_mesh_gpu_instancing: {} }),
    ],
    [
      "The scene has no triangles that could be deformed, only what node 0 (“tube”) draws, which its scale flattens",
      (json) => json.nodes.forEach((node: any) => (node.scale = [1, 0, 1])),
    ],
    ["Accessor 0 reaches beyond", (json) => (json.accessors[0].byteOffset = 4)],
    ["Accessor 0 has 1000000000 elements", (json) => (json.accessors[0].count = 1e9)],
    ["Accessor 0 names none of", (json) => delete json.accessors[0].bufferView],
    [
      "“sparse” of accessor 0 has 9999 values",
      (json) => (json.accessors[0].sparse = { count: 9999, indices: { componentType: 5121 } }),
    ],
    [
      "The scene has no triangles that could be deformed, only points and lines",
      (json) => json.meshes.forEach((mesh: any) => (mesh.primitives[0].mode = 1)),
    ],
    ["Primitive 0 of mesh 0 (“sheet”) has a “mode” that", (json) => (json.meshes[0].primitives[0].mode = "4")],
    ["Node 0 (“tube”) is reached twice", (json) => (json.nodes[0].children = [0])],
    ["Node 0 (“tube”) names none of the 2 meshes", (json) => (json.nodes[0].mesh = 7)],
    ["a.glb is no glTF of version 2", (json) => (json.asset.version = "1.0")],
  ])("is refused with a sentence that begins: %s", (words, change) => {
    expect(() => parseMesh("a.glb", with_(change))).toThrow(FileFault);
    expect(() => parseMesh("a.glb", with_(change))).toThrow(words);
  });

  it("says once which points, lines and flattened nodes stay as they are, and keeps them", () => {
    const other = with_((json) => {
      const { primitives } = json.meshes[0]; // two nodes draw it
      primitives.push({ ...primitives[0], mode: 0 }, { ...primitives[0], mode: 1 }, { attributes: {} });
      json.nodes.push({ mesh: 1, name: "flat", scale: [1, 0, 1] });
      json.scenes[0].nodes.push(json.nodes.length - 1);
    });
    const mesh = meshOf(other);
    expect(mesh.notices).toEqual([
      "The points of primitive 1 of mesh 0 (“sheet”) stay as they are.",
      "The lines of primitive 2 of mesh 0 (“sheet”) stay as they are.",
      "There are no positions in primitive 3 of mesh 0 (“sheet”): it stays as it is.",
      "What node 4 (“flat”) draws is flattened by its scale, and stays as it is.",
    ]);
    expect(mesh.faces).toEqual(meshOf(glb).faces);
    expect(meshOf(glb).notices).toBeUndefined();
    const { json } = documentOf(rewriteGlb(mesh, turned(mesh))) as { json: any };
    expect(json.meshes[0].primitives.map(({ mode }: any) => mode)).toEqual([undefined, 0, 1, undefined]);
  });

  it("may have a node of very many children, and a mesh of very many primitives", () => {
    const count = 200_000;
    const children = with_((json) => {
      const first = json.nodes.length;
      for (let k = 0; k < count; ++k) json.nodes.push({});
      json.nodes[0].children = [...(json.nodes[0].children ?? []), ...Array.from({ length: count }, (_, k) => first + k)];
    }, makeGlb(true));
    expect(meshOf(children).faces).toEqual(meshOf(makeGlb(true)).faces);
    const primitives = with_((json) => {
      const own = { ...json.accessors[json.meshes[0].primitives[0].attributes.POSITION], count: 3 };
      const first = json.accessors.length;
      for (let k = 0; k < count; ++k) json.accessors.push(own);
      json.meshes[0].primitives = Array.from({ length: count }, (_, k) => ({ attributes: { POSITION: first + k } }));
    }, makeGlb(true));
    expect(readBlocks(documentOf(primitives)).blocks.length).toBe(count);
  });

  it("says which corners make no triangle", () => {
    const plain = meshOf(makeGlb(true));
    const other = with_((json) => {
      const { primitives } = json.meshes[0];
      const shorter = (mode: number, count: number) => {
        const indices = json.accessors.push({ ...json.accessors[primitives[0].indices], count }) - 1;
        primitives.push({ ...primitives[0], mode, indices });
      };
      shorter(4, 5);
      shorter(5, 2);
      shorter(6, 1);
      shorter(5, 3);
    }, makeGlb(true));
    expect(meshOf(other).faces.length / 3).toBe(plain.faces.length / 3 + 2);
    expect(meshOf(other).notices).toEqual([
      "Corners at the end of primitive 1 of mesh 0 make no triangle: 2 of 5.",
      "Corners at the end of primitive 2 of mesh 0 make no triangle: 2 of 2.",
      "Corners at the end of primitive 3 of mesh 0 make no triangle: 1 of 1.",
    ]);
  });

  it("whose chunk of JSON is longer than the file is refused by the chunk", () => {
    const bytes = glb.slice();
    new DataView(bytes.buffer).setUint32(12, 0xffffffff, true);
    expect(() => parseMesh("a.glb", bytes)).toThrow("a.glb ends within its chunk JSON.");
  });

  it("that breaks off or is damaged is refused or read, and nothing else", () => {
    let seed = 1;
    const below = (count: number) => (seed = (seed * 48271) % 2147483647) % count;
    const source = makeGlb(true);
    for (let round = 0; round < 400; ++round) {
      const damaged = round % 4 === 0 ? source.slice(0, below(source.length)) : source.slice();
      for (let k = 0; k <= round % 3; ++k) damaged[20 + below(900)] = 0x20 + below(0x60);
      try {
        const mesh = parseMesh("a.glb", damaged) as Mesh & { gltf: Uint8Array };
        expect(meshOf(rewriteGlb(mesh, turned(mesh))).faces).toEqual(mesh.faces);
      } catch (error) {
        expect(error).toBeInstanceOf(FileFault);
      }
    }
  });
});

describe("a mesh from elsewhere", () => {
  it("becomes a valid GLB of its own", async () => {
    const { positions, faces } = meshOf(glb);
    const written = newGlb({ positions, faces });
    expect(await faultsOf(written)).toEqual([]);
    expect(meshOf(written).positions).toEqual(positions);
    expect(meshOf(written).faces).toEqual(faces);
  });
});
