// The WebSocket of this tab: opened again whenever it is lost, and taken as lost when nothing comes on it any more.

import { signal } from "./ui.js";
import { ended, session } from "./session.js";

const RETRY_MS = [500, 1000, 2000, 4000];
/** Longest silence, ms: the server sends something every second, a half-open link or a hung server does not. */
const SILENCE_MS = 3000;
const LOOK_MS = 500;
/** Longest wait for an answer, ms: longer than the bridge takes for the slowest. */
const ANSWER_MS = 15_000;
const SESSION_OVER = [4401, 4403];
const TOO_MANY = 4429;
const UNREACHABLE = Object.freeze({ ok: false, code: "not_connected", message: "", forwarded: false });
const UNANSWERED = Object.freeze({ ok: false, code: "timed_out", message: "", forwarded: false });

export const isConnected = signal(false);
/** True if the server has no room for this tab. */
export const isOneTooMany = signal(false);

let socket = null;
let tries = 0;
let retry = 0;
let watch = 0;
let heardAt = 0;
let lastNumber = 0;
const asked = new Map();
let listeners = { onReady() {}, onMessage(message) {}, onLost() {} };

/** Connects, and again whenever the connection is lost, until `disconnect` or the end of the session. */
export function connect(given) {
  listeners = given;
  open();
  watch = setInterval(look, LOOK_MS);
}

export function disconnect() {
  clearTimeout(retry);
  clearInterval(watch);
  drop();
}

/** Sends a message. Returns true if it could be sent. */
export function send(message) {
  if (socket?.readyState !== WebSocket.OPEN) return false;
  socket.send(JSON.stringify(message));
  return true;
}

/** One request.
 * @returns {Promise<{ok: boolean, code: string, message: string, forwarded: boolean, value?: any, abort_code?: number}>} */
export function ask(target, action, fields = {}) {
  const number = ++lastNumber;
  return new Promise((resolve) => {
    if (!send({ ask: number, target, action, fields })) return resolve(UNREACHABLE);
    const late = setTimeout(() => answer(number, UNANSWERED), ANSWER_MS);
    asked.set(number, { resolve, late });
  });
}

function open() {
  const address = new URL("live", document.baseURI);
  address.protocol = address.protocol === "https:" ? "wss:" : "ws:";
  const mine = (socket = new WebSocket(address));
  heardAt = performance.now();
  // Messages of an old socket do not count once another has been opened.
  const own = (act) => (event) => mine === socket && act(event);
  mine.onopen = own(onOpen);
  mine.onmessage = own(onMessage);
  mine.onclose = own(onClose);
}

function onOpen() {
  socket.send(session.value.token);
  heardAt = performance.now();
  listeners.onReady();
}

// Only an accepted tab gets messages: a refused one gets the reason with the closing code.
function onMessage(event) {
  tries = 0;
  isConnected.value = true;
  heardAt = performance.now();
  const message = JSON.parse(event.data);
  if ("outcome" in message) answer(message.outcome, message);
  else listeners.onMessage(message);
}

function onClose(event) {
  drop();
  if (SESSION_OVER.includes(event.code)) return void ended();
  isOneTooMany.value = event.code === TOO_MANY;
  retry = setTimeout(open, RETRY_MS[Math.min(tries++, RETRY_MS.length - 1)]);
}

function look() {
  if (socket && performance.now() - heardAt > SILENCE_MS) onClose({ code: 0 });
}

function drop() {
  socket?.close();
  socket = null;
  isConnected.value = false;
  for (const number of [...asked.keys()]) answer(number, UNREACHABLE);
  listeners.onLost();
}

function answer(number, outcome) {
  const waiting = asked.get(number);
  if (!waiting) return;
  clearTimeout(waiting.late);
  asked.delete(number);
  waiting.resolve(outcome);
}
