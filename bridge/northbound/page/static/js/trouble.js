// Troubles in words. The server finds them; here they get their texts.

import { computed, effect, signal } from "./ui.js";
import { hasBeen, now as boxNow, troubles, waiting } from "./live.js";
import { address } from "./route.js";
import { clock, span } from "./format.js";
import { drives, nodes } from "./site.js";
import { ownerName } from "./owner.js";
import { faultIn, inWords as wordsOf, many, maybe, t, worded } from "./texts.js";

const TICK_MS = 10_000;
const now = signal(boxNow());

// The duration runs while there is a trouble; without one nothing has to be drawn.
effect(() => {
  if (!troubles.value?.length) return;
  now.value = boxNow();
  const ticking = setInterval(() => (now.value = boxNow()), TICK_MS);
  return () => clearInterval(ticking);
});

/** The rank of the worst of `all`; "none" where there is none, "unknown" before the server has sent them. */
export function worst(all) {
  if (all === null) return "unknown";
  return all[0]?.rank ?? "none";
}

/** Condition of the plant in one sentence. */
export function sentence(all) {
  if (all === null) return t("frame.loading");
  if (!all.length) return waiting.value ? many("plant.waiting", waiting.value) : many("plant.fine", drives.value.length);
  const first = `${nameOf(all[0].place)}: ${headline(all[0])}, ${since(all[0])}`;
  const others = all.length - 1;
  return others ? `${first}. ${many("plant.others", others)}` : `${first}.`;
}

/** Headline of a trouble: "drive fault E010/10.3". */
export function headline(trouble) {
  return t(`trouble.${trouble.kind}`, said(trouble));
}

/** The present fault of a drive in the reader's language, with its number; empty where it has none of its own. */
export function faultText(drive) {
  const found = everything.value.find((one) => one.kind === "drive_fault" && one.place === drive);
  return found ? inWords(driveAt(drive), found.facts.number, found.texts?.text, found.facts.text) : "";
}

/** A fault in the reader's language with its number, as its maker writes it: "E003/3.0 overcurrent". `text` is what the
 * bridge says of it, and `english` the words of that. */
export function inWords(drive, number, text, english) {
  const own = faultIn(drive?.mapping, number).text;
  return own ? `${number} ${capital(own)}` : worded(text, english);
}

const RANKS = ["danger", "alarm", "warning"];

/** All troubles, causes and those that they explain. */
const everything = computed(() => (troubles.value ?? []).flatMap((one) => [one, ...(one.explains ?? [])]));

/** Worst rank at one of `places`: 0 is the worst, 3 nothing. */
export function rankAt(places) {
  const ranks = everything.value.filter((one) => places.includes(one.place)).map((one) => RANKS.indexOf(one.rank));
  return Math.min(RANKS.length, ...ranks);
}

/** Worst trouble at one of `places`, or its cause there: null where nothing is wrong. */
export function worstAt(places) {
  const found = (troubles.value ?? []).filter((one) => [one, ...(one.explains ?? [])].some((each) => places.includes(each.place)));
  return found[0] ?? null;
}

/** Meaning and cause of a trouble; empty where the headline says it all. */
export function explanation(trouble) {
  return maybe(`trouble.${trouble.kind}.why${variant(trouble)}`, withDefaults(trouble));
}

// Additions for some troubles: a fault without a cause, and a watchdog that stops nothing.
function variant(trouble) {
  if (trouble.kind === "drive_fault") return said(trouble).cause ? "_and_cause" : "";
  if (trouble.kind !== "controller_silent") return "";
  const reaction = driveAt(trouble.place)?.on_expiry;
  if (reaction === "hold") return trouble.facts.owner ? "_hold" : "_hold_over";
  return reaction === "silence" ? "_silence" : "";
}

/** Remedy of a trouble. */
export function remedy(trouble) {
  if (trouble.until) return t("trouble.left.remedy");
  return said(trouble).remedy || maybe(`trouble.${trouble.kind}.remedy${whose(trouble)}`, withDefaults(trouble));
}

// A controller that is a tab of this page cannot be looked after as a PLC is.
function whose({ kind, facts }) {
  if (kind !== "controller_silent" || !facts.owner) return "";
  if (hasBeen(facts.owner)) return "_self";
  return /^local:.*#/.test(facts.owner) ? "_tab" : "";
}

export function since(trouble) {
  if (trouble.until) return t("since.until", { time: clock(trouble.since), until: clock(trouble.until) });
  return t(trouble.or_longer ? "since.longer" : "since", { time: clock(trouble.since) });
}

export function lasting(trouble) {
  return span(now.value - trouble.since);
}

/** Number of troubles that it explains, or has left behind. */
export function explained(trouble) {
  return many(trouble.until ? "plant.left" : "plant.explains", trouble.explains.length);
}

/** Name of the place for people. */
export function nameOf(place) {
  if (place === "bridge") return t("place.bridge");
  return place.replace(/^bus\//, "");
}

const driveAt = (place) => drives.value.find((one) => one.name === place);

// The facts in the reader's language, as far as the drive's family has its faults in it.
function said(trouble) {
  const { number, value } = trouble.facts;
  const own = faultIn(driveAt(trouble.place)?.mapping, number);
  const facts = { ...trouble.facts, ...own };
  if (value) facts.value = t(`point.${value}`);
  if (facts.text) facts.text = capital(own.text ?? withoutNumber(trouble));
  return facts;
}

// The headline has the number already.
function withoutNumber({ facts, texts }) {
  return texts?.text?.code === "fault.numbered" ? wordsOf(texts.text.facts.text) : worded(texts?.text, facts.text);
}

const capital = (words) => words.charAt(0).toUpperCase() + words.slice(1);

/** The address of the page that shows the place. */
export function pageOfPlace(place) {
  if (driveAt(place)) return address("drive", ...place.split("/"));
  if (place === "bridge") return address("system");
  const bus = place.startsWith("bus/") ? place.slice(4) : nodes.value.find((one) => one.name === place)?.bus;
  return bus ? address("bus", bus) : address("plant");
}

function withDefaults(trouble) {
  const facts = { ...said(trouble) };
  // A controller that has lost its lease controls nothing any more.
  if ("owner" in facts) facts.owner = facts.owner ? ownerName(facts.owner) : t("owner.gone");
  for (const name of ["why", "how", "who", "fronts"]) if (name in facts) facts[name] = worded(trouble.texts?.[name], facts[name]) || t("unknown");
  return facts;
}
