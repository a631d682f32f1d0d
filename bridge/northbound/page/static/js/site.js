// What the site has: its buses, nodes and drives, and the nature of its points.

import { computed } from "./ui.js";
import { described } from "./session.js";

export const drives = computed(() => described.value?.drives ?? []);
export const nodes = computed(() => described.value?.nodes ?? []);
export const buses = computed(() => described.value?.buses ?? []);

/** The nature of the point called `name`: {type, unit, low, high, writable, states, bits}; {} where there is none. */
export function nature(name) {
  return described.value?.points[name] ?? {};
}

export function has(name) {
  return described.value !== null && name in described.value.points;
}

/** The label of a state's code, such as "operation_enabled". */
export function label(name, code) {
  return nature(name).states?.[code] ?? "unknown";
}

/** The names of the points below `place`, such as "conveyor/fu1/actual". */
export function below(place) {
  return Object.keys(described.value?.points ?? {}).filter((name) => name.startsWith(`${place}/`));
}

export const leafOf = (name) => name.slice(name.lastIndexOf("/") + 1);
