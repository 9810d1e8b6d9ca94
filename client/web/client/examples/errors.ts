// What goes wrong, and how it is said: by a stable reason, the element and the limit.
//
//   node examples/errors.ts http://localhost:8080
import { joinSession, LpdeformError, openSession } from "lpdeform-client";

const url = process.argv[2]!;
const triangle = { vertices: [0, 0, 0, 1, 0, 0, 0, 1, 0], faces: [0, 1, 2] };

// A mesh that cannot be deformed.
try {
  await openSession({ ...triangle, faces: [0, 1, 7] }, { url });
} catch (error) {
  if (!(error instanceof LpdeformError)) throw error;
  console.log(`${error.reason} ${error.element}: ${error.limit}`);
}

// An update that the server refuses; the session goes on.
const session = await openSession(triangle, { url });
const problem = new Promise<LpdeformError>((resolve) => session.on("problem", resolve));
session.setHandle("tip", { vertices: [9] });
console.log(`${(await problem).reason} ${(await problem).element}`);

// A reader sees the frames and changes nothing.
const reader = await joinSession(session.name, { url });
try {
  reader.remove("tip");
} catch (error) {
  if (error instanceof LpdeformError) console.log(error.reason);
}
await reader.close();

// After it was closed.
await session.close();
try {
  session.move("tip", "fixed");
} catch (error) {
  if (error instanceof LpdeformError) console.log(error.reason);
}
