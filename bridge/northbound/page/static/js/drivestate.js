// State of a drive as the page shows it, and its values as far as they are good.

import { isConnected } from "./live.js";
import { label } from "./site.js";
import { quality, value } from "./values.js";

/** The value of a point while it is good, else null: an old value may not hold any more. */
export const good = (name) => (quality(name) === "good" ? value(name) : null);

/** The label of a state while it is good, else "unknown". */
export function goodLabel(name) {
  const code = good(name);
  return code === null ? "unknown" : label(name, code);
}

/** The state that the drive itself reports; "lost" where it is not heard. */
export function ownState(drive) {
  const state = `${drive}/status/state`;
  const kind = quality(state);
  // Without a connection it is this page that hears nothing, and not the bridge.
  if (isConnected.value && (kind === "lost" || kind === "dead")) return "lost";
  return kind === "disabled" ? "disabled" : goodLabel(state);
}

/** The drive's own state, unless its watchdog has tripped. */
export function stateOf(drive) {
  const own = ownState(drive);
  const isTripped = goodLabel(`${drive}/supervision/watchdog_state`) === "tripped";
  return isTripped && own !== "lost" ? "tripped" : own;
}

/** The key of the text for such a state: a watchdog that leaves the drive as it is stops nothing. */
export function stateKey(state, drive) {
  return state === "tripped" && drive.on_expiry === "hold" ? "state.tripped_hold" : `state.${state}`;
}
