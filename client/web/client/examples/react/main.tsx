// React with react-three-fiber: a cylinder whose upper end a slider turns, as state of React.
//
//   npx vite examples/react        and the page http://localhost:5173/?url=http://localhost:8080
import { Canvas, useFrame } from "@react-three/fiber";
import { openSession, type Session } from "lpdeform-client";
import { useEffect, useMemo, useState } from "react";
import { createRoot } from "react-dom/client";
import { type BufferAttribute, CylinderGeometry } from "three";

const url = new URLSearchParams(location.search).get("url") ?? "http://localhost:8080";

/** A session for this geometry while the component is there. Undefined until it is open. */
function useSession(geometry: CylinderGeometry): Session | undefined {
  const [session, setSession] = useState<Session>();
  useEffect(() => {
    const leaving = new AbortController();
    const heights = (geometry.attributes["position"] as BufferAttribute).array.filter((_, k) => k % 3 === 1);
    const where = (isIn: (height: number) => boolean) => [...heights.keys()].filter((vertex) => isIn(heights[vertex]!));
    const opening = openSession(
      {
        vertices: Float32Array.from(geometry.attributes["position"]!.array),
        faces: Uint32Array.from(geometry.index!.array),
        normals: Float32Array.from(geometry.attributes["normal"]!.array),
      },
      { url, weld: "byPosition", withNormals: true, signal: leaving.signal },
    );
    opening.then(
      (opened) => {
        opened.setHandles({ base: { vertices: where((y) => y < -1.4) }, tip: { vertices: where((y) => y > 1.4) } });
        if (!leaving.signal.aborted) setSession(opened);
      },
      (error: unknown) => leaving.signal.aborted || console.error(error),
    );
    return () => {
      leaving.abort();
      setSession(undefined);
      opening.then(
        (opened) => opened.close(),
        () => undefined,
      );
    };
  }, [geometry]);
  return session;
}

function Bending({ angle }: { angle: number }) {
  const geometry = useMemo(() => new CylinderGeometry(0.3, 0.3, 3, 32, 40), []);
  const session = useSession(geometry);
  useEffect(() => {
    session?.move("tip", { axis: [0, 0, 1], angle, center: [0, 0, 0] });
  }, [session, angle]);
  useFrame(() => {
    const frame = session?.poll();
    if (!frame) return;
    const { position, normal } = geometry.attributes as { position: BufferAttribute; normal: BufferAttribute };
    position.copyArray(frame.positions).needsUpdate = true;
    normal.copyArray(frame.normals).needsUpdate = true;
    geometry.computeBoundingSphere();
  });
  return (
    <mesh geometry={geometry}>
      <meshStandardMaterial color="steelblue" />
    </mesh>
  );
}

function App() {
  const [degrees, setDegrees] = useState(0);
  return (
    <>
      <label>
        Bend{" "}
        <input
          type="range"
          min={-90}
          max={90}
          value={degrees}
          onChange={({ target }) => setDegrees(target.valueAsNumber)}
        />
      </label>
      <Canvas camera={{ position: [0, 0, 6], fov: 45 }}>
        <color attach="background" args={["white"]} />
        <hemisphereLight args={["white", "gray", 3]} />
        <Bending angle={(degrees * Math.PI) / 180} />
      </Canvas>
    </>
  );
}

createRoot(document.getElementById("root")!).render(<App />);
