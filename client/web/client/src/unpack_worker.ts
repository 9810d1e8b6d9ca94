import { type UnpackAnswer, unpackLoaded, type UnpackRequest } from "./unpack.js";

// The worker of Unpacker.
const scope = globalThis as unknown as {
  postMessage(answer: UnpackAnswer, transfer: ArrayBufferLike[]): void;
  onmessage: (event: MessageEvent<UnpackRequest>) => void;
};
let before = Promise.resolve();

scope.onmessage = ({ data }) => (before = before.then(() => answer(data)));

async function answer({ id, packed }: UnpackRequest): Promise<void> {
  try {
    const unpacked = await unpackLoaded(packed);
    const { quantized, positions, distortion, normals } = unpacked;
    const arrays = [quantized.vertices, quantized.normals, positions, distortion, normals];
    scope.postMessage(
      { id, unpacked },
      arrays.map(({ buffer }) => buffer),
    );
  } catch (thrown) {
    scope.postMessage({ id, fault: (thrown as Error).message }, []);
  }
}
