import type { LpdeformError } from "lpdeform-client";
import type { Handle } from "../model/document.js";
import { nothing, ofVertices, type PointedOut } from "../model/pointed.js";

/** The state of the connection, in words for users. */
export interface Status {
  kind: "idle" | "opening" | "live" | "away" | "full" | "draining" | "refused";
  title: string;
  text: string;
  /** The element that the server named: "vertex 17", "face 3". */
  element: string;
  /** Nothing is tried any more until the user wants it. */
  canTryAgain?: boolean;
}

const kept = "Your work is kept here";

export function statusOf(error: LpdeformError): Status {
  const { code, reason, message, element } = error;
  if (reason === "DRAINING") {
    return say("draining", "The server is shutting down", `${kept} and goes on as soon as a server is back.`);
  }
  if (code === "resource_exhausted") {
    const what = message.replace(/; try again after the time given\.?$/, "");
    return say("full", "The server is full", `${sentence(what)} Trying again by itself; ${kept.toLowerCase()}.`);
  }
  if (["unavailable", "unknown", "deadline_exceeded", "internal", "cancelled", "data_loss"].includes(code)) {
    return say("away", "The server is away", `${kept}. Reconnecting by itself…`);
  }
  if (isSessionOver(reason)) return say("away", "The server has removed this session", `${kept}. Starting again…`);
  if (code === "unauthenticated" || code === "permission_denied") {
    return say("refused", "The server does not let you in", `${sentence(message)} ${kept}.`);
  }
  if (code === "unimplemented") {
    return say("refused", "The server does not know this request", `It may be older than this page. ${kept}.`);
  }
  return { ...say("refused", "The server refuses this mesh", sentence(message)), element };
}

/** The connection stands, but the server or its proxy has stopped. */
export const notAnswering: Status = {
  kind: "away",
  title: "The server does not answer",
  text: `${kept} and goes on as soon as it answers.`,
  element: "",
};

/** The status when nothing is tried again until the user starts again. */
export function statusAtEnd(error: LpdeformError): Status {
  if (error.reason === "EXCEPTION") return say("away", "This page failed with a frame", `${kept}. Starting again…`);
  if (error.reason !== "FRAME_PARTS" && error.reason !== "FRAME_VERTICES") return statusOf(error);
  const advice = "Page and server may be of different versions: reload the page.";
  return say("refused", "The server's frames do not fit this mesh", `${advice} ${kept}.`);
}

/** The page has failed with the frames of session after session. */
export function failingHere({ message }: LpdeformError): Status {
  return { ...say("refused", "This page fails with every frame", sentence(message)), canTryAgain: true };
}

function isSessionOver(reason: string): boolean {
  return reason.startsWith("SESSION_") && reason !== "SESSIONS_FULL";
}

export function say(kind: Status["kind"], title: string, text = ""): Status {
  return { kind, title, text, element: "" };
}

/** Whether the same may succeed later. */
export function isPassing({ kind }: Status): boolean {
  return kind === "away" || kind === "full" || kind === "draining";
}

/** Formats numbers with many digits; numbers of elements stay as they are. */
const amounts = /(?<=≤\u00a0)\d{5,}|\b\d{5,}(?= (?:vertices|faces|bytes))/g;

export function sentence(text: string): string {
  const trimmed = text.trim();
  if (trimmed === "") return "";
  const plain = trimmed.replaceAll(" <= ", "\u00a0≤\u00a0").replace(amounts, (digits) => Number(digits).toLocaleString("en"));
  return plain[0]!.toUpperCase() + plain.slice(1) + (/[.!?…]$/.test(plain) ? "" : ".");
}

/**
 * The elements that a server names: "vertex 17", "face 3", "edge 4-5", "vertices 1 and 2", "handle \"tip\"" of `handles`. Empty
 * if it names none: "component 2".
 */
export function elementsIn(element: string, handles: readonly Pick<Handle, "name" | "vertices">[] = []): PointedOut {
  const [, name] = /^handle "(.*)"/.exec(element) ?? [];
  if (name !== undefined) return ofVertices(handles.find((handle) => handle.name === name)?.vertices ?? []);
  if (/^component/i.test(element)) return nothing;
  const numbers = (element.match(/\d+/g) ?? []).map(Number);
  if (/face|triangle/i.test(element)) return { ...nothing, faces: numbers };
  return /edge/i.test(element) ? { ...nothing, edges: numbers } : ofVertices(numbers);
}
