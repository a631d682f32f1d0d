// What this tab controls. It renews its leases itself, and only while it is in sight: hidden, closed or cut off it
// falls silent as any controller may, and the drive stops in its published time.

import { effect, signal, untracked } from "../ui.js";
import { ask, isConnected, self } from "../live.js";
import { value } from "../values.js";

const LEASE_MS = 3000;
const LONGEST_PERIOD_MS = 750;
/** A browser's timers, and what a tab may send in a second, are too coarse for less. */
const SHORTEST_TIMEOUT_MS = 200;
/** The drives that this tab means to control. */
const wanted = new Set();
const timers = new Map();
/** Drives whose latest renewal has no answer yet. */
const underway = new Set();

/** The last thing that went wrong, by drive: {action, outcome}; "hidden" and "cut_off" are what became of this tab itself,
 * at `outcome.at`. */
export const refusals = signal({});

/** Whether this tab controls `drive`. */
export function isOurs(drive) {
  return isConnected.value && self.value !== "" && value(`${drive}/supervision/owner`) === self.value;
}

export async function take(drive) {
  // What takes longer than this to come back has not come back in time for the watchdog either.
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

/** What was refused is forgotten: it is about what was asked before. */
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

// Who was in the way is not there any more: what was refused then might be granted now. The owner may be told later
// than the refusal.
function forget(drive, refused) {
  if (refused?.outcome.code !== "not_allowed" || refused.action === "keep_alive") return;
  const owner = value(`${drive}/supervision/owner`);
  refused.owner ||= owner;
  if (refused.owner !== owner) refuse(drive, "", null);
}

// One at a time: what waits in a slow connection must not go on renewing when the tab has gone.
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

/** Whether it had been renewed until now. */
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
