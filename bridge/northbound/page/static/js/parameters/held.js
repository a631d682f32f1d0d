// Parameter values that this tab has read from drives: a signal for each.

import { ask, isConnected } from "../live.js";
import { session } from "../session.js";
import { batch, effect, signal } from "../ui.js";
import { told } from "../outcome.js";

/** Pause between two requests, ms: the server takes fifty messages a second from a tab. */
const PAUSE_MS = 25;
const MISSING = [0x06020000, 0x06090011];
const known = new Map();
/** @type {Map<string, Promise<any>>} */
const queues = new Map();
let free = 0;

/** The signal of a parameter: null before it was asked for, else {value}, or {failure, isMissing}. */
export function held(holder, name) {
  const key = `${holder} ${name}`;
  if (!known.has(key)) known.set(key, signal(null));
  return known.get(key);
}

/** Forgets the values read from `holder`, or all values. */
export function forget(holder = "") {
  batch(() => {
    for (const [key, one] of known) if (!holder || key.startsWith(`${holder} `)) one.value = null;
  });
}

// Without a connection, changes by others are missed.
effect(() => {
  void [isConnected.value, session.value?.token];
  forget();
});

/** Reads a parameter again. */
export async function read(holder, name) {
  const outcome = await inTurn(holder, () => ask(holder, "read_parameter", { parameter: name }));
  const one = found(outcome);
  held(holder, name).value = one;
  return one;
}

/** Writes a parameter; the outcome is {ok, code, message, value}. */
export async function write(holder, name, value) {
  const outcome = await inTurn(holder, () => ask(holder, "write_parameter", { parameter: name, value }));
  if (outcome.ok) held(holder, name).value = { value: outcome.value };
  return outcome;
}

/** Reads all of `names`, until `isOver()`; `onRead` is called with the number that has been read. */
export async function readAll(holder, names, onRead = (count) => {}, isOver = () => false) {
  let count = 0;
  for (const name of names) {
    if (isOver()) return false;
    const one = await read(holder, name);
    if (one.isSilent) return false;
    onRead(++count);
  }
  return true;
}

/** Identity object of a node, {vendor, product, revision, serial}, as far as it can be read. */
export async function identity(holder) {
  const told = {};
  for (const [place, name] of ["vendor", "product", "revision", "serial"].entries()) {
    const { value } = await read(holder, `1018:0${place + 1}`);
    if (typeof value === "number") told[name] = value;
  }
  return told;
}

// One request at a time for each node, which has one SDO channel; other nodes do not wait.
function inTurn(holder, work) {
  const [node] = holder.split("/");
  const mine = (queues.get(node) ?? Promise.resolve()).then(pause).then(work);
  queues.set(node, mine.catch(() => {}));
  return mine;
}

// Waits until the server takes the next message.
function pause() {
  const now = Date.now();
  free = Math.max(now, free + PAUSE_MS);
  return new Promise((resolve) => setTimeout(resolve, free - now));
}

function found(outcome) {
  if (outcome.ok) return { value: outcome.value };
  const isSilent = ["timed_out", "not_ready", "not_connected", "unknown_target"].includes(outcome.code);
  return { failure: told(outcome), isMissing: MISSING.includes(outcome.abort_code), isSilent };
}
