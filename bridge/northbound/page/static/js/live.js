// Messages of the server to this tab.
//
// The server sends {topic, state} once for each topic that is shown and {topic, changes} after that, {troubles,
// waiting, recent}, {events} once and each {event} after that, {trend: [[time, value, ...], ...], number}, {heard}, and each
// second {now}. All of it is drawn once a frame at most.

import { batch, signal } from "./ui.js";
import * as connection from "./connection.js";
import { inOwnFrame } from "./frames.js";
import { lose, take } from "./values.js";

const MOST_EVENTS = 200;

export { ask, isConnected } from "./connection.js";
/** Troubles, the worst first; null until the server has sent them. */
export const troubles = signal(null);
/** Troubles that are over, the latest first, with `until` and `times`. */
export const recent = signal([]);
/** Number of drives that are not ready yet though nothing is wrong. */
export const waiting = signal(0);
/** Events, the newest first. */
export const events = signal([]);
/** Identity of this tab as a controller: the `owner` of a drive that it has taken. */
export const self = signal("");

/** Identities of this tab since it was opened: another one after each loss of its connection. */
const selves = new Set();

export const hasBeen = (owner) => selves.has(owner);

let topics = [];
let trend = { names: [], number: 0, onRows: (rows) => {}, onLost: () => {} };
let wish = null;
let onHeard = (message) => {};
let pending = null;
let aheadMs = 0;

export function connect() {
  connection.connect({ onReady, onMessage, onLost });
}

export const disconnect = connection.disconnect;

/** Time on the box, in ms since 1970: all times of the server are by its clock. */
export function now() {
  return Date.now() + aheadMs;
}

/** Sets the topics that are shown from now on. */
export function show(wanted) {
  topics = wanted;
  connection.send({ show: topics });
}

/** Sets the points whose trend is drawn; `onRows` gets rows of [time in ms, value, ...], `onLost` is called where the
 * course breaks off. */
export function follow(names, onRows = (rows) => {}, onLost = () => {}) {
  trend = { names, number: trend.number + 1, onRows, onLost };
  sendTrend();
}

/** Sets the filter for a bus's traffic: {bus, view, kinds, nodes}, or null for none; `listener` gets the messages. */
export function hear(wanted, listener = (message) => {}) {
  wish = wanted;
  onHeard = listener;
  connection.send({ hear: wanted });
}

/** A hidden tab gives up control of its drives: nobody looks at it any more. */
export function leave() {
  connection.send({ hidden: true });
}

function sendTrend() {
  connection.send({ trend: trend.names, number: trend.number });
}

function onReady() {
  connection.send({ show: topics });
  if (trend.names.length) sendTrend();
  if (wish) connection.send({ hear: wish });
}

function onLost() {
  pending = null;
  trend.onLost();
  lose();
}

function onMessage(message) {
  if ("you" in message) selves.add((self.value = message.you));
  else if ("now" in message) aheadMs = message.now - Date.now();
  else if ("troubles" in message) {
    batch(() => {
      troubles.value = message.troubles;
      waiting.value = message.waiting;
      recent.value = message.recent;
    });
  } else if ("trend" in message) {
    if (message.number === trend.number) trend.onRows(message.trend); // else of a choice before
  } else if ("heard" in message) onHeard(message);
  else if ("events" in message) events.value = message.events.reverse();
  else if ("event" in message) events.value = [message.event, ...events.value].slice(0, MOST_EVENTS);
  else keep(message.state ?? message.changes);
}

// A hidden tab gets no frames: the readings that come meanwhile are kept as one set, however long it is hidden.
function keep(readings) {
  if (pending) return void Object.assign(pending, readings);
  pending = readings;
  // Beside a trend each frame has to be in time (frames.js). An idle browser begins one for us, and it may take longer.
  const soon = trend.names.length ? inOwnFrame : requestAnimationFrame;
  soon(draw);
}

function draw() {
  if (pending) take(pending);
  pending = null;
}
