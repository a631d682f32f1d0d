// What drives hold, as far as this tab has asked: a signal for each parameter.

import { ask } from "../live.js";
import { signal } from "../ui.js";

/** The server lets a tab say fifty things a second. */
const PAUSE_MS = 25;
const MISSING = [0x06020000, 0x06090011];
const known = new Map();
/** @type {Promise<any>} */
let last = Promise.resolve();

/** The signal of a parameter: null before it was asked for, else {value}, or {failure, isMissing}. */
export function held(holder, name) {
  const key = `${holder} ${name}`;
  if (!known.has(key)) known.set(key, signal(null));
  return known.get(key);
}

/** Reads it anew. */
export async function read(holder, name) {
  const outcome = await inTurn(() => ask(holder, "read_parameter", { parameter: name }));
  held(holder, name).value = found(outcome);
  return held(holder, name).value;
}

/** Writes it; the outcome is {ok, code, message, value}. */
export async function write(holder, name, value) {
  const outcome = await inTurn(() => ask(holder, "write_parameter", { parameter: name, value }));
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

// One after the other: the node has one channel for them.
function inTurn(work) {
  const mine = last.then(work);
  last = mine.then(() => new Promise((resolve) => setTimeout(resolve, PAUSE_MS)));
  return mine;
}

function found(outcome) {
  if (outcome.ok) return { value: outcome.value };
  const isSilent = ["timed_out", "not_ready", "not_connected", "unknown_target"].includes(outcome.code);
  return { failure: outcome.message || outcome.code, isMissing: MISSING.includes(outcome.abort_code), isSilent };
}
