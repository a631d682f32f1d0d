// Description of the site: its buses, nodes and drives, and the nature of its points.

import { computed } from "./ui.js";
import { described } from "./session.js";

export const drives = computed(() => described.value?.drives ?? []);
export const nodes = computed(() => described.value?.nodes ?? []);
export const buses = computed(() => described.value?.buses ?? []);

const NONE = Object.freeze({});

/** The nature of the point called `name`: {type, unit, low, high, writable, states, bits}; {} where there is none. */
export function nature(name) {
  const place = placeOf(name);
  return naturesOf(place)?.[name.slice(place.length + 1)] ?? NONE;
}

export function has(name) {
  return nature(name) !== NONE;
}

/** The label of a state's code, such as "operation_enabled". */
export function label(name, code) {
  return nature(name).states?.[code] ?? "unknown";
}

/** The names of the points below `group`, such as "conveyor/fu1/actual". */
export function below(group) {
  const place = placeOf(group);
  return Object.keys(naturesOf(place) ?? NONE)
    .map((leaf) => `${place}/${leaf}`)
    .filter((name) => name.startsWith(`${group}/`));
}

export const leafOf = (name) => name.slice(name.lastIndexOf("/") + 1);

// A drive, a bus, a node or the bridge: many of them have the same points.
function placeOf(name) {
  const parts = name.split("/", 2);
  const longer = parts.join("/");
  return Object.hasOwn(described.value?.places ?? NONE, longer) ? longer : parts[0];
}

function naturesOf(place) {
  const kind = described.value?.places[place];
  return kind === undefined ? undefined : described.value.natures[kind];
}
