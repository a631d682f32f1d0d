// Numbers and times as people read them.

import { language, t } from "./texts.js";

const DECIMALS = { Hz: 1, A: 1, V: 0, "%": 0, ms: 0, s: 1, rpm: 0, "1/min": 0, rev: 3, "°C": 0, Nm: 1, kW: 2 };
const formats = new Map();

function format(decimals) {
  const key = `${language.value} ${decimals}`;
  if (!formats.has(key)) {
    const digits = { minimumFractionDigits: decimals, maximumFractionDigits: decimals };
    formats.set(key, new Intl.NumberFormat(language.value, digits));
  }
  return formats.get(key);
}

/** A number without its unit; with as many decimals as are usual for that unit. */
export function number(value, unit = "") {
  if (typeof value !== "number") return value === null || value === undefined ? "–" : String(value);
  const decimals = DECIMALS[unit] ?? (Number.isInteger(value) ? 0 : Math.abs(value) < 10 ? 2 : 1);
  const shown = format(decimals).format(value);
  return /^-0([.,]0*)?$/.test(shown) ? shown.slice(1) : shown;
}

/** A number as it is, with all of its decimals, at least `least`; without groups, which may be read as decimals. */
export function exact(value, least = 0) {
  if (typeof value !== "number") return value === null || value === undefined ? "–" : String(value);
  const [digits, exponent] = String(shortest(value)).split("e");
  const decimals = Math.max(least, (digits.split(".")[1] ?? "").length);
  const shown = exponent ? { maximumSignificantDigits: 15 } : { minimumFractionDigits: decimals, maximumFractionDigits: decimals };
  return new Intl.NumberFormat(language.value, { ...shown, useGrouping: false }).format(shortest(value));
}

/** The shortest number that is the same in the drive, which may keep it in 32 bits: 0.1 and not 0.10000000149. */
export function shortest(value) {
  if (Number.isInteger(value)) return value;
  if (Math.fround(value) !== value) return Number(value.toPrecision(12));
  const found = [6, 7, 8, 9].map((digits) => Number(value.toPrecision(digits))).find((one) => Math.fround(one) === value);
  return found ?? value;
}

/** A number with its unit, kept on one line. */
export function quantity(value, unit = "") {
  const shown = number(value, unit);
  return unit && shown !== "–" ? `${shown}\u202f${unit}` : shown;
}

/** A number with all of its digits and its unit: "25.0 Hz", "2.125 Hz". */
export function inFull(value, unit = "") {
  const shown = exact(value, DECIMALS[unit] ?? 0);
  return unit ? `${shown}\u202f${unit}` : shown;
}

/** The permitted range with its unit: "-100 … 99.9 Hz"; the unit alone where nothing is limited. */
export function range(low, high, unit = "") {
  const has = (one) => typeof one === "number";
  const [least, most] = [has(low) && limit(low, unit, Math.ceil), has(high) && limit(high, unit, Math.floor)];
  if (has(low) && has(high)) return `${least} … ${most} ${unit}`.trimEnd();
  if (has(low) || has(high)) return `${has(low) ? `≥ ${least}` : `≤ ${most}`} ${unit}`.trimEnd();
  return unit;
}

// A limit comes from the bits of a word, such as 199.994: its decimals are meaningless. They are rounded off towards
// the inside, so that every value shown as allowed is allowed.
function limit(value, unit, inwards) {
  for (let decimals = DECIMALS[unit] ?? 2; decimals < 9; decimals++) {
    const step = 10 ** decimals;
    const shown = Number(value.toFixed(decimals));
    const inside = shown === value ? value : Number((inwards(value * step) / step).toFixed(decimals));
    if (Math.abs(inside - value) <= Math.abs(value) / 100) return exact(inside);
  }
  return exact(value);
}

/** A time span in its largest units: 8 s, 3 min 20 s, 2 h 5 min. */
export function span(ms) {
  const s = Math.max(0, Math.round(ms / 1000));
  if (s < 60) return t("span.s", { s });
  if (s < 3600) return t("span.min", { min: Math.floor(s / 60), s: s % 60 });
  if (s < 86400) return t("span.h", { h: Math.floor(s / 3600), min: Math.floor((s % 3600) / 60) });
  return t("span.d", { d: Math.floor(s / 86400), h: Math.floor((s % 86400) / 3600) });
}

/** Time of day of an epoch time in ms; with the date where it is not today's. */
export function clock(ms) {
  const time = new Date(ms);
  const isToday = time.toDateString() === new Date().toDateString();
  return time.toLocaleString(language.value, { ...(isToday ? {} : { dateStyle: "short" }), timeStyle: "medium", hourCycle: "h23" });
}

export function word(value) {
  return typeof value === "number" ? `${value.toString(16).toUpperCase().padStart(4, "0")}h` : "–";
}
