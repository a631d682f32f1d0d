// Sentences of the bridge in the reader's language: a phrase book from its English.
//
// A phrase is a pair of sentences with slots: {name} holds one word as it is, {name#} a number, {name…} words as they
// are, and {NAME} words that are looked up in turn. Texts that are joined by "; ", ": " or ". ", or end with something
// in brackets, are looked up part by part; a list with commas only where every part of it has a phrase. What has no
// phrase stays English.

import { signal } from "../ui.js";

const KEPT = 500;
const LONGEST = 4000;
const DEEPEST = 8;
const AGAIN_MS = 10000;

const SLOT = /\{(\w+)([#…]?)\}/g;
const HOLDS = { "": "(\\S+)", "#": "(-?\\d[\\w.+-]*|[\\dA-F]+h)", "…": "((?:(?!: )[^])+?)" };
const WORDS = /[a-z]{3}/;
const JOINED = /[:;] /;
const books = signal({});
const loading = new Set();

/** `text` of the bridge in `language`. Until the phrases are loaded it is English; it is drawn again then. */
export function said(text, language) {
  if (language === "en" || typeof text !== "string" || !text) return text;
  const book = books.value[language];
  if (book) return book(text);
  load(language);
  return text;
}

async function load(language) {
  if (loading.has(language)) return;
  loading.add(language);
  try {
    const answer = await fetch(new URL(`said-${language}.json`, import.meta.url));
    const book = bookOf(await answer.json());
    books.value = { ...books.value, [language]: book };
  } catch {
    setTimeout(() => loading.delete(language), AGAIN_MS);
  }
}

/** A function that looks up texts among `phrases`, a list of [English, other]; it keeps its latest answers. */
export function bookOf(phrases) {
  const whole = new Map(phrases.filter(([english]) => !english.includes("{")));
  /** @type {{match: RegExp, names: string[], other: string}[]} */
  let slotted = null;
  const kept = new Map();

  function ofText(text, depth) {
    if (depth > DEEPEST) return text;
    const [head, inner] = aside(text);
    if (JOINED.test(inner)) return `${ofText(head, depth)} (${ofText(inner, depth + 1)})`;
    return text.split("; ").map((part) => ofPart(part, depth)).join("; ");
  }

  function ofPart(part, depth) {
    const phrase = ofPhrase(part, depth);
    if (phrase !== null) return phrase;
    const list = part.split(", ");
    if (list.length > 1) {
      const others = list.map((one) => ofItem(one, depth));
      if (!others.includes(null)) return others.join(", ");
    }
    const colon = part.indexOf(": ");
    if (colon >= 0) return `${ofPart(part.slice(0, colon), depth)}: ${ofPart(part.slice(colon + 2), depth)}`;
    const stop = part.indexOf(". ");
    if (stop >= 0) return `${ofPart(part.slice(0, stop), depth)}. ${ofPart(part.slice(stop + 2), depth)}`;
    const [head, inner] = aside(part);
    return inner ? `${ofPart(head, depth)} (${ofText(inner, depth + 1)})` : part;
  }

  function ofItem(one, depth) {
    const phrase = ofPhrase(one, depth);
    if (phrase !== null || !WORDS.test(one)) return phrase ?? one;
    const [head, inner] = aside(one);
    const first = inner && ofPhrase(head, depth);
    return first ? `${first} (${ofText(inner, depth + 1)})` : null;
  }

  function ofPhrase(part, depth) {
    const exact = whole.get(part);
    if (exact !== undefined) return exact;
    for (const { match, names, other } of slotted) {
      const found = match.exec(part);
      if (!found) continue;
      const held = Object.fromEntries(names.map((name, place) => [name, found[place + 1]]));
      return other.replace(SLOT, (_, name) => (isLookedUp(name) ? ofText(held[name], depth + 1) : held[name]));
    }
    return null;
  }

  return (text) => {
    if (text.length > LONGEST) return text;
    slotted ??= phrases.filter(([english]) => english.includes("{")).map(compiled);
    const other = kept.get(text) ?? ofText(text, 0);
    kept.delete(text);
    kept.set(text, other);
    if (kept.size > KEPT) kept.delete(kept.keys().next().value);
    return other;
  };
}

// Text before the brackets at the end of a text, and in them.
function aside(text) {
  if (!text.endsWith(")")) return [text, ""];
  let open = 0;
  for (let at = text.length - 1; at > 0; at--) {
    if (text[at] === ")") open++;
    else if (text[at] === "(" && --open === 0)
      return text[at - 1] === " " ? [text.slice(0, at - 1), text.slice(at + 1, -1)] : [text, ""];
  }
  return [text, ""];
}

const isLookedUp = (name) => name === name.toUpperCase();

function compiled([english, other]) {
  const names = [];
  const source = english.replace(/[.*+?^$()|[\]\\]/g, "\\$&").replace(SLOT, (_, name, kind) => {
    names.push(name);
    return HOLDS[isLookedUp(name) ? "…" : kind];
  });
  return { match: new RegExp(`^${source}$`), names, other };
}
