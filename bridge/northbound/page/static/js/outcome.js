// How a request ended, in words.

import { t, worded } from "./texts.js";

/** The bridge's own sentence; where it has none, what its code means. */
export function told(outcome) {
  return worded(outcome.text, outcome.message) || t(`outcome.${outcome.code}`);
}
