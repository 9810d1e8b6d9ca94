// @ts-expect-error: the package has no types
import { validateBytes } from "gltf-validator";

interface Issue {
  code: string;
  message: string;
  pointer: string;
  severity: number;
}

/** What the Khronos validator calls errors and warnings of a glTF file. */
export async function faultsOf(bytes: Uint8Array): Promise<string[]> {
  const report = (await validateBytes(bytes, { maxIssues: 100 })) as { issues: { messages: Issue[] } };
  const faults = report.issues.messages.filter(({ severity }) => severity <= 1);
  return faults.map(({ code, message, pointer }) => `${code} at ${pointer}: ${message}`);
}
