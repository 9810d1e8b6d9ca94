/** What was remembered in this browser; nothing where it forbids that. */
export function remembered(key: string): string | undefined {
  try {
    return localStorage.getItem(key) ?? undefined;
  } catch {
    return undefined;
  }
}

export function forget(key: string): void {
  try {
    localStorage.removeItem(key);
  } catch {
    // nothing was remembered
  }
}

/** For the next visit, where the browser lets a page do that. */
export function remember(key: string, value: string): void {
  try {
    localStorage.setItem(key, value);
  } catch {
    // forbidden, or full: the next visit begins as the first
  }
}
