import { type IntakeRequest, Taking } from "./intake.js";

// A worker that takes the frames of one mesh.
const scope = globalThis as unknown as Pick<Worker, "postMessage"> & {
  onmessage: (event: MessageEvent<IntakeRequest>) => void;
};
let taking: Taking | undefined;

scope.onmessage = ({ data }) => {
  if ("positions" in data) {
    taking = new Taking(data);
    return;
  }
  if ("pull" in data) {
    const pull = taking!.pull(data.pull);
    scope.postMessage({ pull }, [pull.buffer as ArrayBuffer]);
    return;
  }
  const intake = taking!.take(data.frame);
  const { positions, normals, distortion, boxes } = intake;
  scope.postMessage(
    intake,
    [positions, normals, distortion, boxes].map(({ buffer }) => buffer as ArrayBuffer),
  );
};
