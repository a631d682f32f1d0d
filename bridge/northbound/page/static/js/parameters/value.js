// Values of parameters as people read and type them: as they are in the drive, in the reader's number format.

import { exact, range as rangeOf } from "../format.js";
import { language } from "../texts.js";

const BARE = ["string", "bytes"];

/** The title in the reader's language. */
export const titleOf = (entry) => (language.value === "de" && entry.german) || entry.title;

/** The texts of its values in the reader's language; undefined where it has none. */
export const statesOf = (entry) => (language.value === "de" && entry.german_states) || entry.states;

/** A value in words: "1.03 s", "1 (automatic)". */
export function shown(entry, value) {
  if (value === null || value === undefined) return "–";
  if (typeof value !== "number") return String(value);
  const state = statesOf(entry)?.[value];
  if (state) return `${value} (${state})`;
  return entry.unit ? `${exact(value)}\u202f${entry.unit}` : exact(value);
}

/** The range in words: "0 … 320 s"; empty where there is none. */
export function range(entry) {
  if (entry.low === undefined && entry.high === undefined) return "";
  return rangeOf(entry.low, entry.high, entry.unit);
}

const hasRange = ({ low, high }) => low !== undefined && high !== undefined;

/** True if the value is chosen from a list: not one that has a range, and texts for some of it alone. */
export const isChosen = (entry) => (Boolean(entry.states) && !hasRange(entry)) || entry.type === "bool";
export const isText = (entry) => BARE.includes(entry.type);

/** Limits of a number typed for the parameter. */
export function limitsOf({ unit, low, high, whole }) {
  return { unit, low, high, isWhole: whole };
}

/** The chosen or typed value as it is sent. */
export function chosen(entry, code) {
  if (entry.type === "bool") return code === "true";
  return isText(entry) ? code : Number(code);
}

/** True if two values are the same; a state may be given by its text. */
export function same(entry, one, other) {
  const [a, b] = [coded(entry, one), coded(entry, other)];
  if (typeof a === "number" && typeof b === "number") return Math.abs(a - b) <= 1e-9 * Math.max(1, Math.abs(a));
  return typeof a === "string" && typeof b === "string" ? a.trimEnd() === b.trimEnd() : a === b;
}

function coded(entry, value) {
  if (typeof value !== "string" || !entry.states) return value;
  const found = Object.entries(entry.states).find(([, text]) => text.toLowerCase() === value.trim().toLowerCase());
  return found ? Number(found[0]) : value;
}
