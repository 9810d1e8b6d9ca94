import * as three from "three";
import { STLExporter } from "three/examples/jsm/exporters/STLExporter.js";
import type { WrittenMesh } from "lpdeform-client/mesh/mesh";

/** Binary, in float32, as STL is. */
export function writeStl({ positions, faces }: WrittenMesh): Uint8Array<ArrayBuffer> {
  const geometry = new three.BufferGeometry();
  geometry.setAttribute("position", new three.BufferAttribute(positions, 3));
  geometry.setIndex(new three.BufferAttribute(faces, 1));
  const { buffer } = new STLExporter().parse(new three.Mesh(geometry), { binary: true });
  return new Uint8Array(buffer as ArrayBuffer);
}
