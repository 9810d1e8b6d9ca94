import "./style/index.css";
import { App } from "./app/app.js";
import { Files } from "./app/files.js";
import { Keeper } from "./app/keeper.js";
import { followSolving } from "./app/solving.js";
import { startShortcuts } from "./app/shortcuts.js";
import { exposeForTests } from "./app/testing.js";
import { canDraw } from "./stage/software.js";
import { noPictures } from "./ui/no_pictures.js";
import { wantsBack } from "./ui/wants_back.js";
import { dock } from "./ui/dock.js";
import { helpSheet } from "./ui/help.js";
import { legend } from "./ui/legend.js";
import { messages } from "./ui/messages.js";
import { sidePanel } from "./ui/sidepanel.js";
import { startTheme } from "./ui/theme.js";
import { toolOptions } from "./ui/toolbar.js";
import { topbar } from "./ui/topbar.js";
import { watchedHere, watchingPage } from "./ui/watching.js";

const root = document.querySelector("#app")!;
if (canDraw) await start();
else root.append(noPictures());

async function start(): Promise<void> {
  const watched = watchedHere();
  window.addEventListener("hashchange", () => {
    if (watchedHere() !== watched) location.reload();
  });
  const app = new App(watched !== null);
  if (watched !== null) {
    root.append(...watchingPage(app, watched));
    startTheme(app);
    exposeForTests(app);
    return;
  }
  const files = new Files(app);
  const help = helpSheet(app);
  const dropHere = document.createElement("div");
  dropHere.className = "drop-here";
  dropHere.textContent = "Drop a mesh, a project or a handle file";
  root.append(
    topbar(app, files, () => help.showModal()),
    app.stages,
    toolOptions(app),
    legend(app),
    dock(app),
    messages(app, () => startOver()),
    sidePanel(app),
    help,
    dropHere,
  );
  startTheme(app);
  followSolving(app);
  startShortcuts(app, files, help);
  exposeForTests(app);
  const keeper = new Keeper(app, wantsBack);
  // If nothing is kept, leaving the page by mistake loses the work.
  window.addEventListener("beforeunload", (event) => {
    if (app.history.canUndo && !keeper.isKeeping) event.preventDefault();
  });

  // ?shape=sheet&detail=fine&encoding=float32 for links to a state of the page.
  const asked = new URLSearchParams(location.search);
  const detail = asked.get("detail");
  const encoding = asked.get("encoding");
  const startOver = () =>
    app.startOver(asked.get("shape") ?? "creature", detail === "coarse" || detail === "fine" ? detail : "medium");
  if (encoding === "float32" || encoding === "quantized" || encoding === "compressed") app.view.set({ encoding });
  if (!(await keeper.restore())) startOver();
  keeper.start();
}
