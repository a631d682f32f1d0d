// The pages there are. A page is {path, topics(route), View}; its text is "page.<path>". The plant is there from the
// beginning, any other is loaded when it is opened first.

import { signal } from "./ui.js";
import { plant } from "./pages/plant.js";

const OTHERS = {
  drive: () => import("./pages/drive.js"),
  parameters: () => import("./pages/parameters.js"),
  bus: () => import("./pages/bus.js"),
  integration: () => import("./pages/integration.js"),
  system: () => import("./pages/system.js"),
};
const RETRY_MS = 2000;

/** Pages in the menu; the page of a drive is opened from the plant. */
export const menu = ["plant", "parameters", "bus", "integration", "system"];

const loaded = signal({ plant });
const loading = new Set();

/** The page of a route. */
export function pathOf(route) {
  return Object.hasOwn(OTHERS, route[0]) ? route[0] : "plant";
}

/** The page called `path`; null until it is loaded. */
export function pageOf(path) {
  if (!loaded.value[path]) load(path);
  return loaded.value[path] ?? null;
}

async function load(path) {
  if (loading.has(path)) return;
  loading.add(path);
  try {
    const module = await OTHERS[path]();
    loaded.value = { ...loaded.value, [path]: module[path] };
  } catch {
    setTimeout(() => load(path), RETRY_MS); // the bridge is being started again
  }
  loading.delete(path);
}
