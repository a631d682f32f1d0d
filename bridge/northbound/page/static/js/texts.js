// Texts in the reader's language.

import { computed, effect, signal } from "./ui.js";
import { kept } from "./store.js";
import { en } from "./texts/en.js";
import { de } from "./texts/de.js";
import { isKnown, rendered } from "./texts/text.js";

const TEXTS = { en, de };
const browsers = navigator.language.toLowerCase().startsWith("de") ? ["de", "en"] : ["en", "de"];

export const language = kept("language", browsers);
const texts = computed(() => TEXTS[language.value]);

effect(() => {
  document.documentElement.lang = language.value;
});

/** Text called `key`, with `{name}` replaced by the entry of `filled`. A word of the bridge that has no text here is
 * shown as it is. */
export function t(key, filled = {}) {
  const text = texts.value[key] ?? en[key];
  if (text === undefined) return key.slice(key.indexOf(".") + 1).replaceAll("_", " ");
  return fill(text, filled);
}

/** Like `t`, but empty where there is no such text. */
export function maybe(key, filled = {}) {
  return fill(texts.value[key] ?? "", filled);
}

function fill(text, filled) {
  return text.replace(/\{(\w+)\}/g, (whole, name) => filled[name] ?? whole);
}

const faults = signal({});

/** {text, cause, remedy} of a family's fault in the reader's language, or {} where they stay as they are. */
export function faultIn(family, number) {
  if (language.value === "en" || !family || !number) return {};
  load(language.value, "faults", faults);
  return faults.value[language.value]?.[family]?.[number] ?? {};
}

const templates = signal({});

/** A sentence of the bridge in the reader's language: `english` is made of `text`, {code, facts}, or is somebody else's
 * words, which have no other language. */
export function worded(text, english) {
  if (language.value === "en" || !text) return english;
  const known = templates.value[language.value];
  if (known) return isKnown(text, known) ? rendered(text, known) : english;
  load(language.value, "texts", templates);
  return english;
}

/** Words for a part of a sentence of the bridge, {code, facts} or words already, of which there is no English. */
export function inWords(text) {
  if (typeof text === "string") return text;
  const known = templates.value[language.value];
  if (known) return isKnown(text, known) ? rendered(text, known) : text.code;
  load(language.value, "texts", templates);
  return "";
}

/** Like `worded`, for what is shown once: it waits for the templates. */
export async function onceWorded(text, english) {
  if (language.value !== "en" && text) await load(language.value, "texts", templates);
  return worded(text, english);
}

const loading = new Map();

function load(wanted, what, into) {
  const address = `api/${what}/${wanted}`;
  if (!loading.has(address)) loading.set(address, loaded(address, wanted, into));
  return loading.get(address);
}

async function loaded(address, wanted, into) {
  try {
    const answer = await fetch(address);
    if (answer.ok) into.value = { ...into.value, [wanted]: await answer.json() };
    else loading.delete(address);
  } catch {
    setTimeout(() => loading.delete(address), 10000);
  }
}

/** The text for a number of things: `key.one` or `key.other`. */
export function many(key, count, filled = {}) {
  return t(`${key}.${count === 1 ? "one" : "other"}`, { count, ...filled });
}
