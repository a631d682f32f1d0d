// The connection of this tab: what it shows arrives here, and what it asks goes out.
//
// The server sends {topic, state} once for each topic that is shown, {topic, changes} after that, {troubles},
// {trend: [[time, value, ...], ...]}, {heard}, {event} and {outcome}. Whatever came is drawn once a frame at most.

import { signal } from "./ui.js";
import { ended, session } from "./session.js";
import { lose, take } from "./values.js";

const RETRY_MS = [500, 1000, 2000, 4000];
const MOST_EVENTS = 200;
const UNREACHABLE = Object.freeze({ ok: false, code: "not_connected", message: "", forwarded: false });

export const isConnected = signal(false);
/** What is wrong, the worst first; null until the server has told. */
export const troubles = signal(null);
export const events = signal([]);
/** Who this tab is as a controller: what `owner` says of a drive that it has taken. */
export const self = signal("");

let socket = null;
let tries = 0;
let topics = [];
let trended = [];
let pending = null;
let onRows = (rows) => {};
let wish = null;
let onHeard = (message) => {};
const asked = new Map();
let lastNumber = 0;

/** Connects, and again whenever the connection is lost, until the session ends. */
export function connect() {
  const address = new URL("live", document.baseURI);
  address.protocol = address.protocol === "https:" ? "wss:" : "ws:";
  socket = new WebSocket(address);
  socket.onopen = onOpen;
  socket.onmessage = (message) => onMessage(JSON.parse(message.data));
  socket.onclose = onClose;
}

export function disconnect() {
  if (socket) socket.onclose = null;
  socket?.close();
  socket = null;
  onLost();
}

/** The topics that are shown from now on. */
export function show(wanted) {
  topics = wanted;
  send({ show: topics });
}

/** The points whose course is followed; `listener` gets rows of [time in ms, value, ...]. */
export function follow(names, listener) {
  trended = names;
  onRows = listener;
  send({ trend: names });
}

/** What is heard of a bus: {bus, view, kinds, nodes}, or null for nothing; `listener` gets the messages. */
export function hear(wanted, listener = (message) => {}) {
  wish = wanted;
  onHeard = listener;
  send({ hear: wanted });
}

/** One request.
 * @returns {Promise<{ok: boolean, code: string, message: string, forwarded: boolean, value?: any, abort_code?: number}>} */
export function ask(target, action, fields = {}) {
  const number = ++lastNumber;
  return new Promise((resolve) => {
    if (send({ ask: number, target, action, fields })) asked.set(number, resolve);
    else resolve(UNREACHABLE);
  });
}

/** Whoever hides a tab has let go of what it controls: nobody looks at it any more. */
export function leave() {
  send({ hidden: true });
}

function send(message) {
  if (socket?.readyState !== WebSocket.OPEN) return false;
  socket.send(JSON.stringify(message));
  return true;
}

function onOpen() {
  socket.send(session.value.token);
  tries = 0;
  isConnected.value = true;
  send({ show: topics });
  if (trended.length) send({ trend: trended });
  if (wish) send({ hear: wish });
}

function onClose(event) {
  onLost();
  if (event.code === 4401 || event.code === 4403) return ended();
  setTimeout(connect, RETRY_MS[Math.min(tries++, RETRY_MS.length - 1)]);
}

function onLost() {
  isConnected.value = false;
  pending = null;
  for (const resolve of asked.values()) resolve(UNREACHABLE);
  asked.clear();
  lose();
}

function onMessage(message) {
  if ("outcome" in message) {
    asked.get(message.outcome)?.(message);
    asked.delete(message.outcome);
  } else if ("you" in message) self.value = message.you;
  else if ("troubles" in message) troubles.value = message.troubles;
  else if ("trend" in message) onRows(message.trend);
  else if ("heard" in message) onHeard(message);
  else if ("event" in message) events.value = [message.event, ...events.value].slice(0, MOST_EVENTS);
  else keep(message.state ?? message.changes);
}

// A hidden tab gets no frames: what came meanwhile is kept as one set of readings, however long that takes.
function keep(readings) {
  if (pending) return void Object.assign(pending, readings);
  pending = readings;
  requestAnimationFrame(() => {
    if (pending) take(pending);
    pending = null;
  });
}
