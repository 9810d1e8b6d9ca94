import { join } from "node:path";
import { afterAll, afterEach, beforeAll, beforeEach, expect } from "vitest";
import { Service } from "../../../client/test/support/service.js";
import { User } from "./user.js";

// What each file of tests begins and ends with: a server, and somebody before the page, who must have met no error.

export const bar = "/?shape=bar&detail=coarse";

/** A server with the page, for the whole file. */
export function withService(taken: (service: Service) => void): void {
  let service: Service | undefined;
  beforeAll(async () => {
    service = await Service.start({ files: join(import.meta.dirname, "../../dist") });
    taken(service);
  });
  afterAll(() => service?.stop());
}

type Options = Parameters<typeof User.open>[1];

/** One user for the whole file, at this path, whose first shape has settled. */
export function withUser(path: string, taken: (user: User, service: Service) => void, options?: Options): void {
  let service: Service;
  let user: User | undefined;
  withService((started) => (service = started));
  beforeAll(async () => {
    user = await opened(service, path, options);
    taken(user, service);
  });
  afterAll(() => closed(user));
}

/** A new one for each test. */
export function withNewUsers(path: string, taken: (user: User, service: Service) => void, options?: Options): void {
  let service: Service;
  let user: User | undefined;
  withService((started) => (service = started));
  beforeEach(async () => {
    user = undefined;
    user = await opened(service, path, options);
    taken(user, service);
  });
  afterEach(() => closed(user));
}

async function opened(service: Service, path: string, options?: Options): Promise<User> {
  const user = await User.open(service.url + path, options);
  await user.settled();
  return user;
}

async function closed(user: User | undefined): Promise<void> {
  if (!user) return;
  await user.close();
  expect(user.errors).toEqual([]);
}
