// Drives that this tab controls. It renews its leases itself, and only while it is visible: hidden, closed or cut off
// it falls silent like any controller, and the drive stops in its published time.

import { effect, signal, untracked } from "../ui.js";
import { ask, isConnected, self } from "../live.js";
import { value } from "../values.js";

const LEASE_MS = 3000;
const LONGEST_PERIOD_MS = 750;
/** Least watchdog time, ms: browser timers, and the limit of a tab's messages, are too coarse for less. */
const SHORTEST_TIMEOUT_MS = 200;
/** The drives that this tab means to control. */
const wanted = new Set();
const timers = new Map();
/** Drives whose latest renewal has no answer yet. */
const underway = new Set();

/** The last failure by drive: {action, outcome}; the actions "hidden" and "cut_off" are of this tab itself, at
 * `outcome.at`. */
export const refusals = signal({});

/** True if this tab controls `drive`. */
export function isOurs(drive) {
  return isConnected.value && self.value !== "" && value(`${drive}/supervision/owner`) === self.value;
}

export async function take(drive) {
  // An answer that takes longer than this comes too late for the watchdog, too.
  const timeout = value(`${drive}/supervision/fieldbus_timeout_ms`) || LEASE_MS;
  if (timeout < SHORTEST_TIMEOUT_MS) return refuse(drive, "take_control", { code: "too_short", message: "" });
  wanted.add(drive);
  const outcome = await request(drive, "take_control", { ttl_ms: LEASE_MS });
  if (!outcome.ok) return wanted.delete(drive);
  if (!wanted.has(drive)) return ask(drive, "release_control"); // its page was left meanwhile
  stop(drive);
  timers.set(drive, setInterval(() => renew(drive), Math.min(timeout / 4, LONGEST_PERIOD_MS)));
  renew(drive);
}

/** Forgets earlier refusals: they are about earlier requests. */
export function giveBack(drive) {
  wanted.delete(drive);
  refuse(drive, "", null);
  if (stop(drive)) ask(drive, "release_control");
}

/** One request whose refusal is shown. */
export async function request(drive, action, fields = {}) {
  const outcome = await ask(drive, action, fields);
  refuse(drive, action, outcome.ok && outcome.forwarded ? null : outcome);
  return outcome;
}

function refuse(drive, action, outcome) {
  refusals.value = { ...refusals.value, [drive]: outcome && { action, outcome } };
}

// The former owner is gone: a request refused then may be granted now. The new owner may arrive later than the refusal.
function forget(drive, refused) {
  if (refused?.outcome.code !== "not_allowed" || refused.action === "keep_alive") return;
  const owner = value(`${drive}/supervision/owner`);
  refused.owner ||= owner;
  if (refused.owner !== owner) refuse(drive, "", null);
}

// One renewal at a time: those waiting in a slow connection must not outlive the tab.
async function renew(drive) {
  if (document.hidden) return stop(drive);
  if (underway.has(drive)) return;
  underway.add(drive);
  const outcome = await ask(drive, "keep_alive");
  underway.delete(drive);
  if (!["not_allowed", "not_connected", "timed_out"].includes(outcome.code) || !stop(drive)) return;
  wanted.delete(drive);
  if (outcome.code === "not_allowed") return refuse(drive, "keep_alive", outcome);
  refuse(drive, "cut_off", { at: Date.now() });
}

/** Stops renewing the lease. Returns true if it was being renewed. */
function stop(drive) {
  clearInterval(timers.get(drive));
  return timers.delete(drive);
}

function stopAll() {
  wanted.clear();
  for (const drive of [...timers.keys()]) stop(drive);
}

function letGo(why) {
  const ours = [...timers.keys()];
  stopAll();
  for (const drive of ours) refuse(drive, why, { at: Date.now() });
}

document.addEventListener("visibilitychange", () => document.hidden && letGo("hidden"));
effect(() => {
  for (const drive in refusals.value) forget(drive, refusals.value[drive]);
});
effect(() => {
  if (!isConnected.value) untracked(() => letGo("cut_off"));
});
