// What this tab controls. It renews its leases itself, and only while it is in the foreground: hidden, closed or cut
// off it falls silent as any controller may, and the drive stops in its published time.

import { effect, signal } from "../ui.js";
import { ask, isConnected, self } from "../live.js";
import { value } from "../values.js";

const LEASE_MS = 3000;
const LONGEST_PERIOD_MS = 750;
const timers = new Map();

/** The last thing that went wrong, by drive: {action, outcome}. */
export const refusals = signal({});

/** Whether this tab controls `drive`. */
export function isOurs(drive) {
  return self.value !== "" && value(`${drive}/supervision/owner`) === self.value;
}

export async function take(drive) {
  const outcome = await request(drive, "take_control", { ttl_ms: LEASE_MS });
  if (!outcome.ok) return outcome;
  stop(drive);
  // What takes longer than this to come back has not come back in time for the watchdog either.
  const timeout = value(`${drive}/supervision/fieldbus_timeout_ms`) || LEASE_MS;
  const period = Math.min(Math.min(timeout, LEASE_MS) / 4, LONGEST_PERIOD_MS);
  timers.set(drive, setInterval(() => renew(drive), period));
  renew(drive);
  return outcome;
}

export function giveBack(drive) {
  if (!timers.has(drive)) return;
  stop(drive);
  ask(drive, "release_control");
}

/** One request whose refusal is shown. */
export async function request(drive, action, fields = {}) {
  const outcome = await ask(drive, action, fields);
  refusals.value = { ...refusals.value, [drive]: outcome.ok && outcome.forwarded ? null : { action, outcome } };
  return outcome;
}

async function renew(drive) {
  if (document.hidden) return stop(drive);
  const outcome = await ask(drive, "keep_alive");
  if (outcome.code === "not_allowed" || outcome.code === "not_connected") stop(drive);
}

function stop(drive) {
  clearInterval(timers.get(drive));
  timers.delete(drive);
}

document.addEventListener("visibilitychange", () => {
  if (document.hidden) for (const drive of [...timers.keys()]) stop(drive);
});
effect(() => {
  if (!isConnected.value) for (const drive of [...timers.keys()]) stop(drive);
});
