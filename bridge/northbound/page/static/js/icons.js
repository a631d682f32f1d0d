// States as shapes: each can be told from the others without its colour. Drawn in a square of 16.

import { html } from "./ui.js";

const SHAPES = {
  // of drives
  operation_enabled: html`<path class="fill" d="M4 2.5v11l9-5.5z" />`,
  switched_on: html`<circle cx="8" cy="8" r="5.5" /><path class="fill" d="M8 2.5a5.5 5.5 0 0 1 0 11z" />`,
  ready: html`<circle cx="8" cy="8" r="5.5" />`,
  switch_on_inhibited: html`<circle cx="8" cy="8" r="5.5" /><path d="M4.2 11.8l7.6-7.6" />`,
  not_ready: html`<circle cx="8" cy="8" r="5.5" stroke-dasharray="2 2" />`,
  quick_stop_active: html`<rect class="fill" x="3.5" y="3.5" width="9" height="9" />`,
  fault: html`<path class="fill" d="M8 1l7 7-7 7-7-7z" /><path class="on" d="M8 4.5v4.2M8 10.6v1" />`,
  fault_reaction_active: html`<path d="M8 1l7 7-7 7-7-7z" /><path d="M8 4.5v4.2M8 10.6v1" />`,
  tripped: html`<path class="fill" d="M5 1h6l4 4v6l-4 4H5l-4-4V5z" /><path class="on" d="M8 4v4.5l2.5 2" />`,
  lost: html`<path d="M3 3l10 10M13 3L3 13" />`,
  unknown: html`<circle cx="8" cy="8" r="5.5" stroke-dasharray="1 2.4" />`,
  disabled: html`<rect x="3" y="3" width="10" height="10" stroke-dasharray="2 2" />`,
  booting: html`<path d="M13.5 8A5.5 5.5 0 1 1 8 2.5" /><path class="fill" d="M8 0l4 2.5L8 5z" />`,
  // of the plant
  ok: html`<circle cx="8" cy="8" r="6" /><path d="M5 8.2l2.2 2.2L11 6" />`,
  danger: html`<path class="fill" d="M8 1l7 13.5H1z" /><path class="on" d="M8 5.5v4.5M8 11.8v1" />`,
  alarm: html`<path class="fill" d="M8 1l7 7-7 7-7-7z" /><path class="on" d="M8 4.5v4.2M8 10.6v1" />`,
  warning: html`<path d="M8 1.5l6.6 12.4H1.4z" /><path d="M8 6v4M8 11.4v1" />`,
  none: html`<circle cx="8" cy="8" r="6" />`,
  // of the page
  download: html`<path d="M8 2v8M4.5 7L8 10.5 11.5 7M3 13.5h10" />`,
  light: html`<circle cx="8" cy="8" r="3" /><path d="M8 1v2M8 13v2M1 8h2M13 8h2M3 3l1.4 1.4M11.6 11.6L13 13M3 13l1.4-1.4M11.6 4.4L13 3" />`,
  dark: html`<path d="M13 9.5A5.5 5.5 0 0 1 6.5 3a5.5 5.5 0 1 0 6.5 6.5z" />`,
  system: html`<circle cx="8" cy="8" r="5.5" /><path class="fill" d="M8 2.5a5.5 5.5 0 0 1 0 11z" />`,
};

const OF_NODES = { operational: "ok", booting: "booting", stopped: "warning", disabled: "disabled", config_error: "alarm", unknown: "unknown" };
const OF_BUSES = { ok: "ok", warning: "warning", passive: "warning", unknown: "unknown" };

/** The shape for the state of a node, and of a bus. */
export const shapeOfNode = (state) => OF_NODES[state] ?? "lost";
export const shapeOfBus = (state) => OF_BUSES[state] ?? "alarm";

/** A shape without a text: beside it stands the word for it. */
export function Icon({ name }) {
  return html`<svg class="icon" viewBox="0 0 16 16" aria-hidden="true">${SHAPES[name] ?? SHAPES.unknown}</svg>`;
}
