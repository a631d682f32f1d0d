// What drives hold, as far as this tab has asked: a signal for each parameter.

import { ask, isConnected } from "../live.js";
import { session } from "../session.js";
import { batch, effect, signal } from "../ui.js";
import { told } from "../outcome.js";

/** The server lets a tab say fifty things a second. */
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

/** What was read of `holder`, or of all, is not known any more. */
export function forget(holder = "") {
  batch(() => {
    for (const [key, one] of known) if (!holder || key.startsWith(`${holder} `)) one.value = null;
  });
}

// Whoever was cut off does not know what others have changed meanwhile, nor does whoever has just come.
effect(() => {
  void [isConnected.value, session.value?.token];
  forget();
});

/** Reads it anew. */
export async function read(holder, name) {
  const outcome = await inTurn(holder, () => ask(holder, "read_parameter", { parameter: name }));
  const one = found(outcome);
  held(holder, name).value = one;
  return one;
}

/** Writes it; the outcome is {ok, code, message, value}. */
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

/** What a node says that it is: {vendor, product, revision, serial}, as far as it does. */
export async function identity(holder) {
  const told = {};
  for (const [place, name] of ["vendor", "product", "revision", "serial"].entries()) {
    const { value } = await read(holder, `1018:0${place + 1}`);
    if (typeof value === "number") told[name] = value;
  }
  return told;
}

// One after the other at each node, which has one channel for them; what is asked of another waits for none of it.
function inTurn(holder, work) {
  const [node] = holder.split("/");
  const mine = (queues.get(node) ?? Promise.resolve()).then(pause).then(work);
  queues.set(node, mine.catch(() => {}));
  return mine;
}

// Until the server takes the next.
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
