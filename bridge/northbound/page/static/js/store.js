// Choices of this browser. Without storage they last as long as the tab.

import { effect, signal } from "./ui.js";

/** A signal that is kept under `key`: one of `allowed`, the first of them to begin with. */
export function kept(key, allowed) {
  const found = read(key);
  const one = signal(allowed.includes(found) ? found : allowed[0]);
  effect(() => write(key, one.value));
  return one;
}

function read(key) {
  try {
    return localStorage.getItem(`drivebridge.${key}`);
  } catch {
    return null;
  }
}

function write(key, value) {
  try {
    localStorage.setItem(`drivebridge.${key}`, value);
  } catch {
    // Storage is off or full: the choice lasts as long as the tab.
  }
}
