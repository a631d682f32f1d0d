// Drawing tools of every module: Preact, its hooks, signals, and htm as the notation.

import { h, render } from "../vendor/preact.mjs";
import htm from "../vendor/htm.mjs";

export const html = htm.bind(h);
export { render };
export { useEffect, useMemo, useRef, useState } from "../vendor/hooks.mjs";
export { batch, computed, effect, signal, untracked, useComputed, useSignal } from "../vendor/signals.mjs";

/** Class names whose value is true: `classes("tile", { late: true })` is "tile late". */
export function classes(...given) {
  return given
    .flatMap((one) => (typeof one === "object" && one ? Object.keys(one).filter((name) => one[name]) : one || []))
    .join(" ");
}
