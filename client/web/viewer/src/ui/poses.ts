import type { App } from "../app/app.js";
import { Player } from "../app/player.js";
import type { KeyPose } from "../model/document.js";
import { atPose } from "../model/key_poses.js";
import { button } from "./controls.js";
import { el, setText } from "./dom.js";

/** The poses that were kept, in their order: to go to, and to play. */
export function posesPanel(app: App): HTMLElement {
  const player = new Player(app);
  const list = el("ul", { className: "poses" });
  const none = el("p", { className: "quiet" }, "Keep a pose, move the handles, keep another: then play them.");
  const keep = el("button", {
    type: "button",
    className: "plain",
    textContent: "Keep this pose",
    title: "Where all handles are, and p (K)",
  });
  const play = el("button", { type: "button", className: "plain", title: "From the first to the last; Escape reverts it" });
  keep.addEventListener("click", () => app.keepPose());
  play.addEventListener("click", () => (player.facts.now.isPlaying ? player.stop() : player.play()));
  app.facts.watch(
    ({ document }) => [document.keyPoses],
    ([poses = []]) => {
      const isFocused = list.contains(document.activeElement);
      list.replaceChildren(...poses.map((pose) => row(app, pose)));
      if (isFocused) keep.focus();
      none.hidden = poses.length > 1;
      play.disabled = poses.length < 2;
    },
  );
  player.facts.watchAll(({ isPlaying }) => setText(play, isPlaying ? "Stop" : "Play"));
  return el("div", {}, none, list, el("div", { className: "pose-actions" }, keep, play));
}

function row(app: App, pose: KeyPose): HTMLElement {
  const { name } = pose;
  const others = () => (app.document.keyPoses ?? []).filter((one) => one.name !== name);
  const go = el("button", { type: "button", className: "plain", textContent: name, title: `Go to ${name}` });
  go.addEventListener("click", () => app.change(atPose(app.document, pose), true));
  const remove = button("trash", `Delete ${name}`, () => app.change({ ...app.document, keyPoses: others() }));
  return el("li", {}, go, remove);
}
