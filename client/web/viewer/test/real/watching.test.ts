import { joinSession, type LpdeformError } from "lpdeform-client";
import { expect, it } from "vitest";
import type { Service } from "../../../client/test/support/service.js";
import { bar, withUser } from "./opened.js";
import { User } from "./user.js";

let user: User;
let service: Service;
withUser(bar, (one, started) => ([user, service] = [one, started]));

const close = async (watcher: User) => {
  expect(watcher.errors).toEqual([]);
  await watcher.close();
};

async function link(): Promise<string> {
  await user.page.getByRole("button", { name: "Save" }).click();
  await user.page.getByRole("menuitem", { name: "Link to watch live" }).click();
  const text = await user.page.getByLabel("Link", { exact: true }).inputValue();
  await user.page.getByRole("button", { name: "Close" }).click();
  return text;
}

const bend = async (x: number) => {
  const field = user.page.getByLabel("Moved along x");
  await field.fill(String(x));
  await field.press("Enter");
  await user.settled();
};

it("a link shows others the shape as it is and as it changes, and they change nothing", async () => {
  await bend(1);
  const watchers = await Promise.all([
    User.open(await link()),
    User.open(await link(), { width: 390, height: 844, colorScheme: "dark" }),
  ]);
  const [vertex] = await user.ask<number[]>("document().handles[1].vertices");
  const isAt = (watcher: User, x: number) =>
    watcher.until(`Math.abs((window.__lpdeform?.positions() ?? [])[${3 * vertex!}] - ${x}) < 1e-3`);
  const x = (await user.positions())[3 * vertex!]!;
  for (const watcher of watchers) await isAt(watcher, x);
  await bend(-1.5);
  for (const watcher of watchers) await isAt(watcher, x - 2.5);

  const [one, other] = watchers as [User, User];
  for (const [k, watcher] of watchers.entries()) {
    const place = await watcher.vertexOnPage(vertex!);
    await watcher.page.mouse.click(place.x, place.y);
    await watcher.drag(place, 40, 30);
    expect(await watcher.ask("document().handles")).toEqual([]);
    if (process.env["SHOT"]) await watcher.page.screenshot({ path: `${process.env["SHOT"]}-${k}.png` });
  }
  await user.settled();
  expect((await user.positions())[3 * vertex!]!).toBeCloseTo(x - 2.5, 3);
  for (const watcher of watchers) {
    expect(await watcher.page.locator(".rail, .options, .dock, .hint:visible").count()).toBe(0);
    expect(await watcher.page.locator(".legend").isVisible()).toBe(true);
  }
  await one.page.locator(".readout").waitFor({ state: "attached" });
  await close(other);

  // Opening something else ends what the link shows.
  await user.ask(`app.openShape("sheet", "coarse")`);
  await one.page.getByRole("alert").getByText("This session has ended").waitFor({ timeout: 60_000 });
  await close(one);
});

it("a page that is left for good takes its session with it", async () => {
  const leaving = await User.open(`${service.url}${bar}`);
  await leaving.settled();
  const name = await leaving.ask<string>("app.panes[0].live.sessionName");
  const { url } = service;
  const code = () =>
    joinSession(name, { url }).then(
      () => "there",
      (error: LpdeformError) => error.code,
    );
  expect(await code()).toBe("there");
  await leaving.page.goto("about:blank");
  await expect.poll(code).toBe("not_found");
  await leaving.close();
});

it("a link that is opened while the server is away shows the shape once it is back", async () => {
  const watched = await link();
  const watcher = await User.open("about:blank");
  const requests = "**/lpdeform.v1.*/**";
  await watcher.page.route(requests, (route) => route.abort());
  await watcher.page.goto(watched);
  await watcher.page.getByRole("alert").getByText("The server is away").waitFor();
  await watcher.page.unroute(requests);
  await watcher.until("window.__lpdeform?.status() === 'live' && window.__lpdeform.positions().length > 0");
  await close(watcher);
});

it("a link that is cut off, or of a session that is not there, says so, also if it is opened in the page of another", async () => {
  const watcher = await User.open(`${service.url}/#watch=12ab`);
  await watcher.page.getByRole("alert").getByText("This link is not whole").waitFor();
  await watcher.page.goto(`${service.url}/#watch=${"0".repeat(32)}`);
  await watcher.page.getByRole("alert").getByText("This session has ended").waitFor();
  await close(watcher);
});
