// State of a bus in one word: as bad as the worst on it, and "in order" only where nothing is wrong.

import { classes, html } from "../ui.js";
import { drives, nodes } from "../site.js";
import { t } from "../texts.js";
import { goodLabel } from "../drivestate.js";
import { headline, nameOf, worstAt } from "../trouble.js";
import { Icon, shapeOfBus } from "../icons.js";

export function BusState({ bus }) {
  const state = goodLabel(`bus/${bus.name}/state`);
  const worst = worstAt(placesOf(bus));
  if (!worst || state === "unknown") {
    return html`<span class=${classes("busstate", `is-${state}`)}><${Icon} name=${shapeOfBus(state)} /> ${t(`bus.${state}`)}</span>`;
  }
  const where = worst.place === `bus/${bus.name}` ? "" : `${nameOf(worst.place)}: `;
  return html`<span class=${classes("busstate", `is-${worst.rank}`)}><${Icon} name=${worst.rank} /> ${where}${headline(worst)}</span>`;
}

/** Places of the bus, its nodes and their drives. */
export const placesOf = (bus) => [
  `bus/${bus.name}`,
  ...nodes.value.filter((one) => one.bus === bus.name).map((one) => one.name),
  ...drives.value.filter((one) => one.bus === bus.name).map((one) => one.name),
];
