// Pictures of every state of the page, to be looked at: npm run pictures, into build/viewer-pictures.
import { mkdirSync } from "node:fs";
import { join } from "node:path";
import { afterAll, beforeAll, it } from "vitest";
import { openSession } from "../../../client/src/index.js";
import { Service } from "../../../client/test/support/service.js";
import { ringObj } from "../support/ring.js";
import { sizes } from "../support/sizes.js";
import { User } from "../real/user.js";

const out = join(import.meta.dirname, "../../../../../build/viewer-pictures");
const only = new RegExp(process.env["ONLY"] ?? "");
const files = join(import.meta.dirname, "../../dist");
const desktop = { width: 1440, height: 900 };
const upright = { width: 820, height: 1180, hasTouch: true };
const across = { width: 1180, height: 820, hasTouch: true };

let service: Service;

beforeAll(async () => {
  mkdirSync(out, { recursive: true });
  service = await Service.start({ files });
});

afterAll(() => service.stop());

interface State {
  name: string;
  query?: string;
  size?: { width: number; height: number; hasTouch?: boolean };
  isLight?: boolean;
  /** Of a server of its own. */
  serverFlags?: string[];
  /** Before the page is opened. */
  prepare?: (service: Service) => Promise<unknown>;
  /** What the page comes to by itself; a shape that can be dragged where left out. */
  shows?: string;
  act?: (user: User, service: Service) => Promise<unknown>;
}

/** Drags the k-th vertex of the handle. */
async function pull(user: User, handle: string, dx: number, dy: number, k = 0, pane = 0): Promise<void> {
  const vertex = await user.ask<number>(`document().handles.find(({ name }) => name === "${handle}").vertices[${k}]`);
  await user.drag(await user.vertexOnPage(vertex, pane), dx, dy);
  await user.settled(pane);
}

async function stroke(user: User, points: readonly (readonly [number, number])[]): Promise<void> {
  const { mouse } = user.page;
  await mouse.move(...points[0]!);
  await mouse.down();
  for (const point of points) await mouse.move(...point);
}

const raiseHead = (user: User) => pull(user, "Head", -110, -60, 40);
const p = (user: User, value: string, row = 0) =>
  user.page.locator(".p-row").nth(row).getByRole("button", { name: value, exact: true }).click();
const keys = async (user: User, ...all: string[]) => {
  for (const key of all) await user.page.keyboard.press(key);
};
const place = (user: User, x: number, y: number, z: number) =>
  user.vertexNear([x, y, z]).then((vertex) => user.vertexOnPage(vertex));

const banner = (user: User, words: string) => user.page.locator(".banner", { hasText: words }).waitFor();

async function openWithDefects(user: User): Promise<void> {
  const content =
    "OFF\n7 6 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 1 1\n5 5 5\n0.5 0 0\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 0 3 2\n3 1 2 4\n3 0 6 1\n";
  await user.openFiles({ name: "odd.off", content });
  const warning = user.page.locator('[data-warning="non_manifold_edges"]');
  await warning.waitFor({ state: "attached" });
  if (!(await warning.isVisible())) await user.page.getByRole("button", { name: "Side panel" }).click();
  await warning.click();
}

const states: readonly State[] = [
  { name: "open-dark" },
  { name: "open-light", isLight: true },
  { name: "dragged-dark", act: raiseHead },
  { name: "dragged-light", isLight: true, act: raiseHead },
  {
    name: "split",
    query: "?shape=bar",
    act: async (user) => {
      await keys(user, "s");
      await user.settled(1);
      await p(user, "1");
      await pull(user, "Top", 150, 130);
      await user.settled(1);
      await keys(user, "Escape");
      await user.page.waitForTimeout(2500);
    },
  },
  {
    name: "sheet-ghost-wireframe",
    query: "?shape=sheet",
    isLight: true,
    act: async (user) => {
      await p(user, "1");
      await pull(user, "Top", -90, 220);
      await keys(user, "w", "g");
    },
  },
  { name: "block", query: "?shape=block", act: (user) => pull(user, "Right", -60, -110) },
  {
    name: "brush",
    act: async (user) => {
      await keys(user, "2");
      const { x, y } = await place(user, 0, -0.15, 0.48);
      await stroke(
        user,
        Array.from({ length: 14 }, (_, k) => [x - 90 + 12 * k, y] as const),
      );
    },
  },
  {
    name: "lasso",
    isLight: true,
    act: async (user) => {
      await keys(user, "3");
      const { x, y } = await place(user, -0.86, 0, 0.5);
      await stroke(
        user,
        Array.from({ length: 40 }, (_, k) => [x + 70 * Math.cos(k / 6.3), y + 60 * Math.sin(k / 6.3)] as const),
      );
    },
  },
  {
    name: "p-brush",
    act: async (user) => {
      await raiseHead(user);
      await keys(user, "5");
      const { x, y } = await place(user, 0.3, -0.1, 0.6);
      await stroke(
        user,
        Array.from({ length: 14 }, (_, k) => [x - 30 + 5 * k, y + 40 - 10 * k] as const),
      );
      await user.page.mouse.up();
      await user.settled();
      await user.page.mouse.move(700, 200);
    },
  },
  {
    name: "rings-and-soft",
    act: async (user) => (await keys(user, "r"), await user.page.getByLabel("How it is held").selectOption("soft")),
  },
  {
    name: "automatic",
    act: async (user) => (
      await raiseHead(user),
      await keys(user, "a"),
      await user.settled(),
      await user.page.waitForTimeout(2500)
    ),
  },
  { name: "normals", act: async (user) => (await raiseHead(user), await keys(user, "c", "c", "c")) },
  {
    name: "cross",
    isLight: true,
    act: async (user) => {
      await user.page.locator("canvas.stage").focus();
      await keys(user, "Tab", "Shift+Tab", "Enter", "ArrowUp", "ArrowUp");
    },
  },
  { name: "save-menu", isLight: true, act: (user) => user.page.getByRole("button", { name: "Save" }).click() },
  { name: "upright", size: upright, act: (user) => pull(user, "Head", -90, -60, 40) },
  {
    name: "upright-panel",
    size: upright,
    isLight: true,
    act: async (user) => (
      await pull(user, "Head", -90, -60, 40),
      await user.page.getByRole("button", { name: "Side panel" }).click()
    ),
  },
  {
    name: "upright-split",
    size: upright,
    act: async (user) => (await keys(user, "s"), await user.settled(1), await pull(user, "Head", -40, -50, 40)),
  },
  { name: "across", size: across, query: "?shape=bar", act: (user) => pull(user, "Top", 110, 60) },
  {
    name: "upright-split-panel",
    size: upright,
    isLight: true,
    act: async (user) => (
      await keys(user, "s"),
      await user.settled(1),
      await pull(user, "Head", -40, -50, 40),
      await user.page.getByRole("button", { name: "Side panel" }).click()
    ),
  },
  {
    name: "restored",
    act: async (user) => {
      await raiseHead(user);
      await user.page.waitForTimeout(700);
      await user.page.reload();
      await user.settled();
    },
  },
  {
    name: "points",
    query: "?shape=bar",
    act: async (user) => {
      const points: object[] = [];
      for (const height of [3, 3.5, 4]) {
        const vertex = await user.vertexNear([0.5, 0, height]);
        const face = Math.floor((await user.ask<number>(`app.mesh.faces.indexOf(${vertex})`)) / 3);
        points.push({ face, barycentric: [0.3, 0.3, 0.4] });
      }
      const base = await user.ask<number[]>("document().handles[0].vertices");
      const handles = [
        { name: "Base", vertices: base },
        { name: "Pins", points, translate: [0.8, 0, 0] },
      ];
      await user.openFiles({ name: "pins.json", content: JSON.stringify({ handles }) });
      await user.settled();
    },
  },
];

const openSection = (user: User, name: string) => user.page.locator("summary", { hasText: name }).click();

/** What an artist has at hand. */
const tools: readonly State[] = [
  {
    name: "poses",
    act: async (user) => {
      await openSection(user, "Poses");
      await user.page.getByRole("button", { name: "Keep this pose", exact: true }).click();
      await raiseHead(user);
      await user.page.getByRole("button", { name: "Keep this pose", exact: true }).click();
      await user.page.getByRole("button", { name: "Pose 2", exact: true }).waitFor();
    },
  },
  {
    name: "blend",
    query: "?shape=bar",
    act: async (user) => {
      await pull(user, "Top", 150, 130);
      await user.page.getByText("All shapes are ready.").waitFor({ timeout: 60_000 });
    },
  },
  {
    name: "symmetric-p-brush",
    isLight: true,
    act: async (user) => {
      await keys(user, "5");
      await user.page.getByLabel("Symmetry").selectOption("x");
      const { x, y } = await place(user, 0.3, -0.1, 0.6);
      await stroke(
        user,
        Array.from({ length: 14 }, (_, k) => [x - 30 + 5 * k, y + 40 - 10 * k] as const),
      );
    },
  },
  {
    name: "viridis",
    act: async (user) => (await raiseHead(user), await user.page.getByLabel("Palette").selectOption("viridis")),
  },
  {
    name: "from-the-left",
    isLight: true,
    act: async (user) => (await raiseHead(user), await user.page.getByRole("button", { name: "Left", exact: true }).click()),
  },
  {
    name: "link-to-watch",
    act: async (user) => {
      await raiseHead(user);
      await user.page.getByRole("button", { name: "Save" }).click();
      await user.page.getByRole("menuitem", { name: "Link to watch live" }).click();
    },
  },
];

/** Every size of the test of the layout. */
const bySize: readonly State[] = sizes.map(([width, height]) => ({
  name: `size-${width}x${height}`,
  query: "?shape=bar",
  size: { width, height, hasTouch: Math.min(width, height) < 700 },
  act: (user) => pull(user, "Top", 0.1 * width, 0.05 * height),
}));

/** What stands between somebody and their work. */
const troubles: readonly State[] = [
  {
    name: "away",
    serverFlags: [],
    act: async (user, own) => {
      await raiseHead(user);
      await own.killServer();
      await banner(user, "The server is away");
    },
  },
  {
    name: "draining",
    serverFlags: [],
    act: async (user, own) => {
      await raiseHead(user);
      await user.page.route("**/StreamSessions", () => undefined); // no other answer comes: it stays as it is then
      await own.stopServer();
      await banner(user, "The server is shutting down");
    },
  },
  {
    name: "full",
    serverFlags: ["--max-sessions", "1"],
    prepare: ({ url }) => openSession({ vertices: [0, 0, 0, 1, 0, 0, 0, 1, 0], faces: [0, 1, 2] }, { url }),
    shows: ".banner:has-text('The server is full')",
  },
  {
    name: "refused",
    serverFlags: ["--max-vertices", "500"],
    shows: ".banner:has-text('The server refuses this mesh')",
  },
  {
    name: "change-refused",
    serverFlags: ["--max-handles", "3"],
    act: async (user) => {
      const { x, y } = await place(user, 0, -0.15, 0.48);
      await user.page.mouse.click(x, y);
      await banner(user, "The server cannot take this change");
    },
  },
  {
    name: "export-without-server",
    serverFlags: [],
    act: async (user, own) => {
      await raiseHead(user);
      await own.killServer();
      await banner(user, "The server is away");
      await user.save("Mesh as OFF");
      await user.page.locator(".notice.bad").waitFor();
    },
  },
  {
    name: "show-again",
    act: async (user) => {
      await raiseHead(user);
      await user.page.waitForTimeout(700);
      await user.page.reload();
      await user.settled();
      await user.page.evaluate("localStorage.setItem('lpdeform-restoring-' + sessionStorage.getItem('lpdeform-work'), 'yes')");
      await user.page.reload();
      await user.page.getByRole("dialog", { name: "Your work" }).waitFor();
    },
  },
  {
    name: "made-room",
    act: async (user) => {
      await raiseHead(user);
      await user.page.getByLabel("Shape").selectOption("sheet");
      await user.settled();
    },
  },
  {
    name: "opened",
    act: async (user) => {
      await user.openFiles({ name: "a ring of a model.obj", content: ringObj(60, 30) });
      await user.page.locator(".notice", { hasText: "a ring of a model.obj" }).waitFor();
    },
  },
  { name: "help", act: (user) => user.page.getByRole("button", { name: "Help and shortcuts (?)" }).click() },
  { name: "warnings", act: openWithDefects },
];
const narrow = { width: 420, height: 860, hasTouch: true };
const low = { width: 740, height: 360, hasTouch: true };
const atBothSizes = troubles.flatMap((state) => [
  { ...state, isLight: state.name.length % 2 === 0 },
  { ...state, name: `upright-${state.name}`, size: upright, isLight: state.name.length % 2 === 1 },
]);

/** A window or a telephone that is narrower still. */
const inLittleRoom = troubles
  .filter(({ name }) => ["away", "made-room", "opened", "help"].includes(name))
  .flatMap((state) => [
    { ...state, name: `narrow-${state.name}`, size: narrow },
    { ...state, name: `low-${state.name}`, size: low },
  ]);

it.each([...states, ...tools, ...bySize, ...atBothSizes, ...inLittleRoom].filter(({ name }) => only.test(name)))(
  "$name",
  async ({ name, query = "", size = desktop, isLight = false, serverFlags, prepare, shows, act }: State) => {
    const served = serverFlags ? await Service.start({ files, serverFlags }) : service;
    await prepare?.(served);
    const user = await User.open(`${served.url}/${query}`, { ...size, colorScheme: isLight ? "light" : "dark" });
    try {
      if (shows) await user.page.locator(shows).waitFor();
      else await user.settled();
      await act?.(user, served);
      // The picture at rest, and plots; there is none before there is a surface.
      await user.until(
        `window.__lpdeform.app.panes.every(({ stage }) => !stage.surface || stage.canvas.width >= Math.min(2 * stage.canvas.clientWidth, 3840))`,
      );
      await user.page.waitForTimeout(1200);
      await user.page.screenshot({ path: join(out, `${name}.png`) });
    } finally {
      await user.close();
      if (served !== service) await served.stop();
    }
  },
);
