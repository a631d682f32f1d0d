// How a request ended, in words.

import { t, translated } from "./texts.js";

/** The bridge's own sentence; where it has none, what its code means. */
export function told(outcome) {
  return translated(outcome.message) || t(`outcome.${outcome.code}`);
}
