// Outcome of a request in words.

import { t, worded } from "./texts.js";

/** The bridge's own sentence; where it has none, the text for its code. */
export function told(outcome) {
  return worded(outcome.text, outcome.message) || t(`outcome.${outcome.code}`);
}
