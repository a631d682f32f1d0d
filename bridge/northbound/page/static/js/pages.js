// The pages there are, in the order of the menu. A page is {path, topics(route), View}; its text is "page.<path>".

import { plant } from "./pages/plant.js";
import { drive } from "./pages/drive.js";
import { integration } from "./pages/integration.js";

export const pages = [plant, drive, integration];
/** What the menu shows; the page of a drive is opened from the plant. */
export const menu = pages.filter((page) => page.inMenu !== false);

export function pageOf(route) {
  return pages.find((page) => page.path === route[0]) ?? plant;
}
