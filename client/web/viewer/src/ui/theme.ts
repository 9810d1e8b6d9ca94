import type { App } from "../app/app.js";
import { remember, remembered } from "../io/remember.js";

const key = "lpdeform-theme";

/** The user's last choice, otherwise the system's setting. */
export function startTheme(app: App): void {
  const isSystemDark = matchMedia("(prefers-color-scheme: dark)");
  const chosen = remembered(key);
  app.view.set({ isDark: chosen ? chosen === "dark" : isSystemDark.matches, isPanelOpen: innerWidth > 900 });
  isSystemDark.addEventListener("change", () => {
    if (!remembered(key)) app.view.set({ isDark: isSystemDark.matches });
  });
  // The picture shows its focus to users of the keyboard.
  window.addEventListener("keydown", ({ key }) => key === "Tab" && document.body.classList.add("by-keyboard"));
  window.addEventListener("pointerdown", () => document.body.classList.remove("by-keyboard"));
  app.view.watchAll(({ isDark }, before) => {
    document.documentElement.dataset["theme"] = isDark ? "dark" : "light";
    if (isDark !== before.isDark) remember(key, isDark ? "dark" : "light");
  });
}
