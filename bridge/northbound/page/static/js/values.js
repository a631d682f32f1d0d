// Present readings of the points, a signal for each: a view is drawn again only when a point that it shows changes.

import { batch, signal } from "./ui.js";

const NOTHING = Object.freeze([null, "waiting", "", 0]);
const NONE = Object.freeze({});
const points = new Map();

/** The signal of a point: [value, quality, reason, time in ms since 1970], and {value, reason} with the texts, {code,
 * facts}, whose words these are, where they are the words of any. */
export function point(name) {
  let found = points.get(name);
  if (!found) points.set(name, (found = signal(NOTHING)));
  return found;
}

export const value = (name) => point(name).value[0];
export const quality = (name) => point(name).value[1];
export const reason = (name) => point(name).value[2];
export const time = (name) => point(name).value[3];
export const texts = (name) => point(name).value[4] ?? NONE;

/** Takes readings of the server: an object by the points' names. */
export function take(readings) {
  batch(() => {
    for (const name in readings) point(name).value = readings[name];
  });
}

/** Marks every value as not good: the connection is lost. */
export function lose() {
  batch(() => {
    for (const one of points.values()) one.value = [one.value[0], "dead", "", one.value[3]];
  });
}
