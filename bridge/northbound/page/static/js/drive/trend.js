// Trend of chosen values: live, with zoom (drag), pause, a cursor and a CSV file.

import { html, useEffect, useRef, useState } from "../ui.js";
import { save } from "../download.js";
import { clock } from "../format.js";
import { now } from "../live.js";
import { siteName } from "../session.js";
import { below, nature } from "../site.js";
import { t } from "../texts.js";
import { Course, titleOf } from "./course.js";

const SPANS_S = [10, 60, 300];
const MOST = 6;

export function Trend({ drive }) {
  const offered = trendable(drive.name);
  const [names, setNames] = useState(() => first(drive, offered));
  const [spanS, setSpan] = useState(60);
  const [pausedAt, setPausedAt] = useState(0);
  const isPaused = pausedAt > 0;
  const [isZoomed, setZoomed] = useState(false);
  const course = useRef(null);
  const box = useRef(null);
  useEffect(() => {
    const mine = (course.current = new Course(box.current, names, setZoomed));
    return () => mine.close();
  }, [names.join()]);
  useEffect(() => course.current.show({ spanS, isPaused, isZoomed }), [names.join(), spanS, isPaused, isZoomed]);
  const toLive = () => {
    setPausedAt(0);
    setZoomed(false);
  };
  const toggle = (name) => {
    setNames(names.includes(name) ? names.filter((one) => one !== name) : [...names, name].slice(-MOST));
    setZoomed(false);
  };
  return html`
    <section class="trend" aria-labelledby="trend">
      <header>
        <h2 id="trend">${t("trend.title")}</h2>
        <button aria-pressed=${isPaused} onClick=${() => setPausedAt(isPaused ? 0 : now())}>${t("trend.pause")}</button>
        ${isPaused && html`<strong>${t("trend.paused", { time: clock(pausedAt) })}</strong>`}
        ${isZoomed && html`<button onClick=${toLive}>${t("trend.to_live")}</button>`}
        <label>${t("trend.span")}
          <select value=${spanS} onChange=${(event) => setSpan(Number(event.target.value))}>
            ${SPANS_S.map((one) => html`<option value=${one}>${one} s</option>`)}
          </select>
        </label>
        <button onClick=${() => keep(drive.name, names, course.current.shown)}>${t("trend.csv")}</button>
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

function keep(drive, names, history) {
  const head = ["time", ...names.map((name) => `${name}${nature(name).unit ? ` [${nature(name).unit}]` : ""}`)];
  const rows = history.rows().map(([s, ...held]) => [new Date(s * 1000).toISOString(), ...held.map(rounded)].join(","));
  save(fileName(drive), [head.map((one) => `"${one}"`).join(","), ...rows, ""].join("\r\n"), "text/csv");
}

// File name with the time: several files stay apart and sort by time.
function fileName(drive) {
  const time = new Date(now()).toLocaleString("sv").replaceAll(":", "");
  return `${siteName.value}-${drive}-${time}.csv`.replace(/[^\p{L}\p{N}._-]+/gu, "-");
}

// Six digits are more than any drive measures; the integer part keeps all of its own.
function rounded(value) {
  if (typeof value !== "number") return value ?? "";
  const whole = String(Math.trunc(Math.abs(value))).length;
  return Number.isInteger(value) ? value : Number(value.toPrecision(Math.max(6, whole)));
}
