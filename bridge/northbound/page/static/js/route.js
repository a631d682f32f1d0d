// Route of the page that is shown: `#/plant`, `#/drive/conveyor/fu1`.

import { leaveBy } from "./leaving.js";
import { computed, signal } from "./ui.js";

const place = signal(location.hash);
addEventListener("hashchange", () => {
  const [shown, wanted] = [place.value, location.hash];
  if (wanted === shown) return;
  leaveBy(() => {
    if (location.hash !== wanted) history.pushState(null, "", wanted);
    place.value = wanted;
  });
  // Until leaving is agreed to, the address stays that of the page shown.
  if (place.value === shown) history.replaceState(null, "", shown || location.pathname + location.search);
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
