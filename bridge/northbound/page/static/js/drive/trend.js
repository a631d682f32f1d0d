// The course of chosen values: live, with zoom (drag), pause, a cursor and a CSV file.

import uPlot from "../../vendor/uplot.mjs";
import { effect, html, useEffect, useRef, useState } from "../ui.js";
import { follow } from "../live.js";
import { save } from "../download.js";
import { below, nature } from "../site.js";
import { language, t } from "../texts.js";
import { isDark } from "../theme.js";
import { History } from "./history.js";

const SPANS_S = [10, 60, 300];
const MOST = 6;
const DASHES = [[], [8, 3], [2, 3], [8, 3, 2, 3], [14, 4], [4, 6]];

export function Trend({ drive }) {
  const offered = trendable(drive.name);
  const [names, setNames] = useState(() => first(drive, offered));
  const [spanS, setSpan] = useState(60);
  const [isPaused, setPaused] = useState(false);
  const history = useRef(null);
  const state = useRef({});
  state.current = { spanS, isPaused };
  const box = useRef(null);
  useEffect(() => {
    const kept = (history.current = new History(names.length));
    let plot = null;
    let isDue = false;
    const draw = () => {
      isDue = false;
      if (!plot || state.current.isPaused) return;
      const until = kept.last;
      plot.setData(kept.columns(), false);
      plot.setScale("x", { min: until - state.current.spanS, max: until });
    };
    follow(names, (rows) => {
      for (const row of rows) kept.add(row);
      // In the frame after the one in which what came with it changes the texts: one at a time is in time.
      if (!isDue && !document.hidden) requestAnimationFrame(() => requestAnimationFrame(draw));
      isDue = true;
    });
    // Colours are read from the style sheet when the plot is made.
    const end = effect(() => {
      void [isDark.value, language.value];
      plot?.destroy();
      plot = new uPlot(options(names, box.current), kept.columns(), box.current);
    });
    const place = box.current;
    const sizes = new ResizeObserver(() => plot.setSize(sizeOf(place)));
    sizes.observe(place);
    const onVisible = () => (isDue = false);
    document.addEventListener("visibilitychange", onVisible);
    return () => {
      document.removeEventListener("visibilitychange", onVisible);
      sizes.disconnect();
      end();
      plot.destroy();
      follow([], () => {});
    };
  }, [names.join()]);
  const toggle = (name) => setNames(names.includes(name) ? names.filter((one) => one !== name) : [...names, name].slice(-MOST));
  return html`
    <section class="trend" aria-labelledby="trend">
      <header>
        <h2 id="trend">${t("trend.title")}</h2>
        <button aria-pressed=${isPaused} onClick=${() => setPaused(!isPaused)}>${t(isPaused ? "trend.resume" : "trend.pause")}</button>
        <label>${t("trend.span")}
          <select value=${spanS} onChange=${(event) => setSpan(Number(event.target.value))}>
            ${SPANS_S.map((one) => html`<option value=${one}>${one} s</option>`)}
          </select>
        </label>
        <button onClick=${() => keep(drive.name, names, history.current)}>${t("trend.csv")}</button>
        <small>${t("trend.hint")}</small>
      </header>
      <div class="plot" ref=${box}></div>
      <details>
        <summary>${t("trend.values", { count: names.length, most: MOST })}</summary>
        <ul class="choice">
          ${offered.map((name) => html`<li><label>
            <input type="checkbox" checked=${names.includes(name)} onChange=${() => toggle(name)} /> ${titleOf(name)}
          </label></li>`)}
        </ul>
      </details>
    </section>
  `;
}

function trendable(drive) {
  return below(drive).filter((name) => {
    const { type, states, bits } = nature(name);
    const group = name.split("/").at(-2);
    return type !== "string" && type !== "bool" && !states && !bits && ["actual", "command", "supervision"].includes(group);
  });
}

function first(drive, offered) {
  const wanted = [`command/${drive.main}`, `actual/${drive.main}`, "actual/current", "actual/torque"].map((leaf) => `${drive.name}/${leaf}`);
  const found = wanted.filter((name) => offered.includes(name));
  return found.length ? found : offered.slice(0, 2);
}

function titleOf(name) {
  const { unit } = nature(name);
  const [group, leaf] = name.split("/").slice(-2);
  return `${t(`group.${group}`)}: ${t(`point.${leaf}`)}${unit ? ` [${unit}]` : ""}`;
}

function options(names, box) {
  const units = [...new Set(names.map((name) => nature(name).unit ?? ""))];
  const axis = { stroke: colourOf("--text"), grid: { stroke: colourOf("--line"), width: 1 }, ticks: { stroke: colourOf("--line"), width: 1 } };
  const number = new Intl.NumberFormat(language.value, { maximumFractionDigits: 2 });
  return {
    ...sizeOf(box),
    cursor: { drag: { x: true, y: false } },
    series: [
      { label: t("trend.time"), value: (plot, at) => (at === null ? "–" : new Date(at * 1000).toLocaleTimeString(language.value, { hour12: false })) },
      ...names.map((name, index) => ({
        label: titleOf(name),
        scale: nature(name).unit ?? "",
        stroke: colourOf(`--series-${index}`),
        dash: DASHES[index],
        width: 1.75,
        points: { show: false },
        spanGaps: false,
        value: (plot, held) => (held === null || held === undefined ? "–" : number.format(held)),
      })),
    ],
    axes: [
      { ...axis, values: (plot, ticks) => ticks.map((at) => new Date(at * 1000).toLocaleTimeString(language.value, { hour12: false })) },
      ...units.slice(0, 3).map((unit, index) => ({ ...axis, scale: unit, label: unit, labelSize: 18, size: 54, side: index ? 1 : 3, grid: index ? { show: false } : axis.grid, values: (plot, ticks) => ticks.map((one) => number.format(one)) })),
    ],
  };
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

function keep(drive, names, history) {
  const head = ["time", ...names.map((name) => `${name}${nature(name).unit ? ` [${nature(name).unit}]` : ""}`)];
  const rows = history.rows().map(([s, ...held]) => [new Date(s * 1000).toISOString(), ...held.map((one) => one ?? "")].join(","));
  save(`${drive.replaceAll("/", "-")}.csv`, [head.map((one) => `"${one}"`).join(","), ...rows, ""].join("\r\n"), "text/csv");
}
