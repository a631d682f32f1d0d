// The plant: troubles first, then each bus with its drives as tiles.

import { classes, html } from "../ui.js";
import { isConnected, recent, troubles } from "../live.js";
import { address } from "../route.js";
import { below, buses, drives, leafOf, nature, nodes } from "../site.js";
import { quality } from "../values.js";
import { clock, number, quantity } from "../format.js";
import { many, maybe, t } from "../texts.js";
import { BusState } from "../bus/state.js";
import { Icon, shapeOfNode } from "../icons.js";
import { Meter } from "../meter.js";
import { ownerOf } from "../owner.js";
import { explained, explanation, faultText, headline, lasting, nameOf, pageOfPlace, rankAt, remedy, since } from "../trouble.js";
import { good, goodLabel, stateKey, stateOf } from "../drivestate.js";

export const plant = { path: "plant", topics: () => ["plant"], View: Plant };

function Plant() {
  return html`
    <h1 class="hidden">${t("page.plant")}</h1>
    <${Attention} />
    <${Over} />
    ${buses.value.map((bus) => html`<${Bus} key=${bus.name} bus=${bus} />`)}
  `;
}

function Attention() {
  const all = troubles.value ?? [];
  if (!all.length) return null;
  return html`
    <section class=${classes("attention", { old: !isConnected.value })} aria-labelledby="attention">
      <h2 id="attention">${t("plant.attention")}</h2>
      <ol>
        ${all.map((one) => html`<${TroubleRow} key=${one.kind + one.place + one.since} trouble=${one} />`)}
      </ol>
    </section>
  `;
}

// Troubles that come and go stay listed for a while.
function Over() {
  const all = recent.value;
  if (!all.length) return null;
  return html`
    <details class="recent"><summary>${many("plant.over", all.length)}</summary>
      <ul>
        ${all.map((one) => html`<li key=${one.kind + one.place}>
          <a href=${pageOfPlace(one.place)}>${nameOf(one.place)}</a> ${headline(one)},
          ${" "}${many("plant.times", one.times, { time: clock(one.until) })}</li>`)}
      </ul>
    </details>
  `;
}

export function TroubleRow({ trouble }) {
  return html`
    <li class=${classes("trouble", `is-${trouble.rank}`)}>
      <${Icon} name=${trouble.rank} />
      <div class="what">
        <a href=${pageOfPlace(trouble.place)}>${nameOf(trouble.place)}</a> <strong>${headline(trouble)}</strong>
        <span class="when">${since(trouble)} (${lasting(trouble)})</span>
        <p>${explanation(trouble)}</p>
        ${trouble.explains && html`<${Explained} cause=${trouble} />`}
      </div>
      <p class="remedy"><span class="label">${t("plant.what_to_do")}</span> ${remedy(trouble)}</p>
    </li>
  `;
}

// Consequences of a cause stay visible below it.
function Explained({ cause }) {
  return html`
    <details class="explains" open=${Boolean(cause.until)}><summary>${explained(cause)}</summary>
      <ul>
        ${cause.explains.map((one) => html`<li key=${one.kind + one.place}>
          <a href=${pageOfPlace(one.place)}>${nameOf(one.place)}</a> ${headline(one)}, ${since(one)}</li>`)}
      </ul>
    </details>
  `;
}

function Bus({ bus }) {
  return html`
    <section class="bus" aria-labelledby=${`bus-${bus.name}`}>
      <${BusHead} bus=${bus} />
      <ul class="tiles">
        ${tilesOf(bus).map(({ drive, node }) => html`<li key=${(drive ?? node).name}>
          ${drive ? html`<${DriveTile} drive=${drive} />` : html`<${NodeTile} node=${node} />`}</li>`)}
      </ul>
    </section>
  `;
}

// Drives in trouble first, the worst before; all others keep their place.
function tilesOf(bus) {
  const ofDrives = drives.value.filter((one) => one.bus === bus.name).map((drive) => ({ drive, rank: rankAt([drive.name, drive.node]) }));
  const ofNodes = nodes.value
    .filter((one) => one.bus === bus.name && !drives.value.some((drive) => drive.node === one.name))
    .map((node) => ({ node, rank: rankAt([node.name]) }));
  return [...ofDrives, ...ofNodes].sort((one, other) => one.rank - other.rank);
}

function BusHead({ bus }) {
  const point = `bus/${bus.name}`;
  const load = good(`${point}/load`);
  return html`
    <header>
      <h2 id=${`bus-${bus.name}`}><a href=${address("bus", bus.name)}>${bus.name}</a></h2>
      <${BusState} bus=${bus} />
      <span class="fact">${t("plant.load")} <${Meter} share=${(load ?? 0) / 100} warn=${0.8} /> ${quantity(load, "%")}</span>
      <span class="fact">${t("plant.errors")} ${number(good(`${point}/error_frames`))}</span>
    </header>
  `;
}

// Only the name is the link, so that a screen reader does not read out changing values; the style sheet stretches it
// over the tile.
function DriveTile({ drive }) {
  const state = stateOf(drive.name);
  const hasFault = state === "fault" || state === "fault_reaction_active";
  return html`
    <div class=${classes("tile", `in-${state}`)}>
      <a class="name" href=${address("drive", ...drive.name.split("/"))}>${drive.name}</a>
      <span class="state"><${Icon} name=${state} /> ${t(stateKey(state, drive))}</span>
      ${hasFault && html`<span class="fault">${faultText(drive.name) || good(`${drive.name}/status/fault_text`)}</span>`}
      <${Speed} drive=${drive} />
      <${Control} drive=${drive} />
    </div>
  `;
}

function Speed({ drive }) {
  if (!drive.main) return null;
  const actual = `${drive.name}/actual/${drive.main}`;
  const command = `${drive.name}/command/${drive.main}`;
  const { unit, low, high } = nature(command);
  const most = Math.max(Math.abs(low ?? 0), Math.abs(high ?? 0));
  const [is, wanted] = [good(actual), good(command)];
  return html`
    <span class=${classes("speed", { old: is === null })}>
      <span class="big">${number(is, unit)}</span> ${unit}
      ${is === null && html`<span class="reason">${maybe(`quality.${quality(actual)}`)}</span>`}
      <span class="setpoint">${t("plant.setpoint", { value: quantity(wanted, unit) })}</span>
      ${is !== null && most > 0 && html`<${Course} actual=${is / most} setpoint=${wanted === null ? null : wanted / most} />`}
    </span>
  `;
}

// A bar from the middle for the actual value, with a mark for the setpoint: both −1 … 1.
function Course({ actual, setpoint }) {
  const x = (share) => 60 + 58 * Math.max(-1, Math.min(1, share));
  const from = Math.min(x(0), x(actual));
  return html`
    <svg class="course" viewBox="0 0 120 10" preserveAspectRatio="none" aria-hidden="true">
      <rect class="track" x="0" y="3" width="120" height="4" />
      <rect class="fill" x=${from} y="3" width=${Math.abs(x(actual) - x(0))} height="4" />
      <rect class="middle" x="59.5" y="1" width="1" height="8" />
      ${setpoint !== null && html`<path class="mark" d=${`M${x(setpoint)} 3l-3-3h6zM${x(setpoint)} 7l-3 3h6z`} />`}
    </svg>
  `;
}

function Control({ drive }) {
  const point = `${drive.name}/supervision`;
  const timeout = good(`${point}/fieldbus_timeout_ms`);
  const state = goodLabel(`${point}/watchdog_state`);
  const left = good(`${point}/watchdog_left_ms`) ?? 0;
  return html`
    <span class="control">
      <span class="label">${t("plant.owner")}</span> <span class="owner">${ownerOf(drive.name)}</span>
    </span>
    <span class="margin">
      <span class="label">${t("plant.margin")}</span>
      ${state === "running" && timeout
        ? html`<${Meter} share=${left / timeout} low=${0.25} />
            <span class="hidden">${t("plant.margin.left", { left: number(left), timeout: number(timeout) })}</span>
            <span aria-hidden="true">${quantity(left, "ms")}</span>`
        : t(`watchdog.${state}`)}
    </span>
  `;
}

// A node that is no drive, with the values of its inputs and outputs.
function NodeTile({ node }) {
  const state = goodLabel(`${node.name}/node/state`);
  return html`
    <div class=${classes("tile", `of-${state}`)}>
      <a class="name" href=${address("bus", node.bus)}>${node.name}</a>
      <span class="state"><${Icon} name=${shapeOfNode(state)} /> ${t(`node.${state}`)}</span>
      <span class="family">${node.family}</span>
      <span class="signals">${signals(node).map((name) => html`<span class=${classes({ old: quality(name) !== "good" })}>
        ${leafOf(name)} ${shownSignal(name)}</span>`)}</span>
    </div>
  `;
}

const signals = (node) => [...below(`${node.name}/input`), ...below(`${node.name}/output`)];

function shownSignal(name) {
  const held = good(name);
  if (held === null) return "–";
  if (typeof held === "boolean") return t(held ? "signal.on" : "signal.off");
  const state = nature(name).states?.[held];
  return state ?? quantity(held, nature(name).unit);
}
