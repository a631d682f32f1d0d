// Plot of a trend: it follows the newest values, unless it is paused or zoomed.

import uPlot from "../../vendor/uplot.mjs";
import { effect } from "../ui.js";
import { inOwnFrame } from "../frames.js";
import { follow, now } from "../live.js";
import { nature } from "../site.js";
import { language, t } from "../texts.js";
import { isDark } from "../theme.js";
import { History } from "./history.js";

const DASHES = [[], [8, 3], [2, 3], [8, 3, 2, 3], [14, 4], [4, 6]];
/** @type {any} A class; a type checker cannot tell from its script. */
const Plot = uPlot;

export class Course {
  /** Follows the points `names` in the element `box`; `onZoom` gets true while it is zoomed. */
  constructor(box, names, onZoom) {
    this._history = new History(names.length);
    this._frozen = null;
    this._state = { spanS: 60, isPaused: false, isZoomed: false };
    this._isDue = false;
    // At once: the zoom would be lost when another row came first.
    const zoom = (isZoomed) => {
      this._state = { ...this._state, isZoomed };
      onZoom(isZoomed);
    };
    follow(names, (rows) => this._take(rows), () => this._take([[now(), ...names.map(() => null)]]));
    // Colours are read from the style sheet when the plot is made.
    this._end = effect(() => {
      void [isDark.value, language.value];
      this._plot?.destroy();
      this._plot = new Plot(options(names, box, zoom), this.shown.columns(), box);
      describe(box.querySelector("canvas"), names);
      this._draw();
    });
    this._sizes = new ResizeObserver(() => this._plot.setSize(sizeOf(box)));
    this._sizes.observe(box);
  }

  close() {
    follow([]);
    this._sizes.disconnect();
    this._end();
    this._plot.destroy();
  }

  /** Draws the newest `spanS` seconds; paused or zoomed, the part shown stays. */
  show(state) {
    this._state = state;
    this._frozen = state.isPaused ? (this._frozen ?? this._history.copy()) : null;
    this._draw();
  }

  /** The History that is drawn. */
  get shown() {
    return this._frozen ?? this._history;
  }

  _take(rows) {
    for (const row of rows) this._history.add(row);
    if (this._isDue || this._frozen) return;
    this._isDue = true;
    inOwnFrame(() => {
      this._isDue = false;
      this._draw();
    });
  }

  _draw() {
    if (!this._plot) return;
    this._plot.setData(this.shown.columns(), false);
    if (this._state.isZoomed) return;
    const until = this.shown.last;
    this._plot.setScale("x", { min: until - this._state.spanS, max: until });
  }
}

/** The name of a value with its unit. */
export function titleOf(name) {
  const { unit } = nature(name);
  const [group, leaf] = name.split("/").slice(-2);
  return `${t(`group.${group}`)}: ${t(`point.${leaf}`)}${unit ? ` [${unit}]` : ""}`;
}

// The canvas has no text for a screen reader; the values stand in the legend below it.
function describe(picture, names) {
  picture.setAttribute("role", "img");
  picture.setAttribute("aria-label", t("trend.picture", { names: names.map(titleOf).join(", ") }));
}

function options(names, box, onZoom) {
  const units = [...new Set(names.map((name) => nature(name).unit ?? ""))];
  const axis = { stroke: colourOf("--text"), grid: { stroke: colourOf("--line"), width: 1 }, ticks: { stroke: colourOf("--line"), width: 1 } };
  const number = new Intl.NumberFormat(language.value, { maximumFractionDigits: 2 });
  return {
    ...sizeOf(box),
    legend: { markers: { width: 0, fill: (_, index) => pattern(colourOf(`--series-${index - 1}`), DASHES[index - 1]) } },
    cursor: { drag: { x: true, y: false }, bind: { dblclick: () => () => onZoom(false) } },
    hooks: { setSelect: [(plot) => plot.select.width > 0 && onZoom(true)] },
    series: [
      { label: t("trend.time"), value: (plot, at) => (at === null ? "–" : timeOf(at, (plot.scales.x.max - plot.scales.x.min) / 10)) },
      ...names.map((name, index) => ({
        label: titleOf(name),
        scale: nature(name).unit ?? "",
        stroke: colourOf(`--series-${index}`),
        dash: DASHES[index],
        width: 1.75,
        points: { show: false },
        spanGaps: false,
        value: (_, held) => (held === null || held === undefined ? "–" : number.format(held)),
      })),
    ],
    axes: [
      { ...axis, space: 85, values: (_, ticks, __, ___, step) => ticks.map((at) => timeOf(at, step)) },
      ...units.slice(0, 3).map((unit, index) => ({ ...axis, scale: unit, label: unit, labelSize: 18, size: 54, side: index ? 1 : 3, grid: index ? { show: false } : axis.grid, values: (_, ticks) => ticks.map((one) => number.format(one)) })),
    ],
  };
}

// The time of day of `at`, in s; with as many decimals as times need that are `step` s apart.
function timeOf(at, step) {
  const decimals = [1, 0.1, 0.01].filter((one) => step < one).length;
  return new Date(at * 1000).toLocaleTimeString(language.value, {
    hour: "2-digit", minute: "2-digit", second: "2-digit", hourCycle: "h23",
    ...(decimals && { fractionalSecondDigits: /** @type {1 | 2 | 3} */ (decimals) }),
  });
}

// The dashes of a line as a background, for those who cannot tell the colours apart.
function pattern(colour, dash) {
  let at = 0;
  const parts = dash.map((length, index) => `${index % 2 ? "transparent" : colour} ${at}px ${(at += length)}px`);
  return parts.length ? `repeating-linear-gradient(90deg, ${parts.join(", ")})` : colour;
}

// A colour of the style sheet as it is at present: a canvas does not know custom properties.
function colourOf(name) {
  const probe = document.createElement("span");
  probe.style.color = `var(${name})`;
  document.body.append(probe);
  const colour = getComputedStyle(probe).color;
  probe.remove();
  return colour;
}

function sizeOf(box) {
  return { width: Math.max(200, box.clientWidth), height: 260 };
}
