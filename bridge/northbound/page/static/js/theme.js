// Light, dark, or as the system has it.

import { computed, effect, signal } from "./ui.js";
import { kept } from "./store.js";

export const theme = kept("theme", ["system", "light", "dark"]);

effect(() => {
  document.documentElement.dataset.theme = theme.value;
});

const media = matchMedia("(prefers-color-scheme: dark)");
const isSystemDark = signal(media.matches);
media.addEventListener("change", () => (isSystemDark.value = media.matches));

/** Signal for drawings whose colours were read once from the style sheet. */
export const isDark = computed(() => (theme.value === "system" ? isSystemDark.value : theme.value === "dark"));
