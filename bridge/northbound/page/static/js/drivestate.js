// The state in which people see a drive: its own, unless the bridge has stopped it or does not hear it.

import { label } from "./site.js";
import { quality, value } from "./values.js";

export function stateOf(drive) {
  const state = `${drive}/status/state`;
  const kind = quality(state);
  if (kind === "lost" || kind === "dead") return "lost";
  if (label(`${drive}/supervision/watchdog_state`, value(`${drive}/supervision/watchdog_state`)) === "tripped") return "tripped";
  return value(state) === null ? "unknown" : label(state, value(state));
}
