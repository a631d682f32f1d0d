// Which page is shown: `#/plant`, `#/drive/conveyor/fu1`.

import { computed, signal } from "./ui.js";

const place = signal(location.hash);
addEventListener("hashchange", () => {
  place.value = location.hash;
});

/** The parts of the address: `["drive", "conveyor", "fu1"]`. */
export const route = computed(() => {
  const parts = place.value.replace(/^#\/?/, "").split("/").filter(Boolean).map(decoded);
  return parts.length ? parts : ["plant"];
});

export function address(...parts) {
  return `#/${parts.map(encodeURIComponent).join("/")}`;
}

function decoded(part) {
  try {
    return decodeURIComponent(part);
  } catch {
    return part;
  }
}
