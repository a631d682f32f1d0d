// The plant: what is in trouble first, then each bus with its drives as tiles.

import { classes, html } from "../ui.js";
import { troubles } from "../live.js";
import { address } from "../route.js";
import { below, buses, drives, label, leafOf, nature, nodes } from "../site.js";
import { quality, value } from "../values.js";
import { number, quantity } from "../format.js";
import { maybe, t } from "../texts.js";
import { Icon } from "../icons.js";
import { Meter } from "../meter.js";
import { ownerName } from "../owner.js";
import { explanation, headline, lasting, nameOf, pageOfPlace, remedy, since } from "../trouble.js";
import { stateOf } from "../drivestate.js";

export const plant = { path: "plant", topics: () => ["plant"], View: Plant };

function Plant() {
  return html`
    <h1 class="hidden">${t("page.plant")}</h1>
    <${Attention} />
    ${buses.value.map((bus) => html`<${Bus} key=${bus.name} bus=${bus} />`)}
  `;
}

function Attention() {
  const all = troubles.value ?? [];
  if (!all.length) return null;
  return html`
    <section class="attention" aria-labelledby="attention">
      <h2 id="attention">${t("plant.attention")}</h2>
      <ol>
        ${all.map((one) => html`<${TroubleRow} key=${one.kind + one.place} trouble=${one} />`)}
      </ol>
    </section>
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
      </div>
      <p class="remedy"><span class="label">${t("plant.what_to_do")}</span> ${remedy(trouble)}</p>
    </li>
  `;
}

function Bus({ bus }) {
  const point = `bus/${bus.name}`;
  const state = label(`${point}/state`, value(`${point}/state`));
  return html`
    <section class="bus" aria-labelledby=${`bus-${bus.name}`}>
      <header>
        <h2 id=${`bus-${bus.name}`}><a href=${address("bus", bus.name)}>${bus.name}</a></h2>
        <span class=${classes("busstate", `is-${state}`)}>
          <${Icon} name=${{ ok: "ok", warning: "warning", passive: "warning" }[state] ?? "alarm"} /> ${t(`bus.${state}`)}
        </span>
        <span class="fact">${t("plant.load")} <${Meter} share=${(value(`${point}/load`) ?? 0) / 100} warn=${0.8} />
          ${quantity(value(`${point}/load`), "%")}</span>
        <span class="fact">${t("plant.errors")} ${number(value(`${point}/error_frames`))}</span>
      </header>
      <ul class="tiles">
        ${drives.value
          .filter((one) => one.bus === bus.name)
          .map((one) => html`<li key=${one.name}><${DriveTile} drive=${one} /></li>`)}
        ${nodes.value
          .filter((one) => one.bus === bus.name && !drives.value.some((drive) => drive.node === one.name))
          .map((one) => html`<li key=${one.name}><${NodeTile} node=${one} /></li>`)}
      </ul>
    </section>
  `;
}

function DriveTile({ drive }) {
  const state = stateOf(drive.name);
  return html`
    <a class=${classes("tile", `in-${state}`)} href=${address("drive", ...drive.name.split("/"))}>
      <span class="name">${drive.name}</span>
      <span class="state"><${Icon} name=${state} /> ${t(`state.${state}`)}</span>
      <${Speed} drive=${drive} />
      <${Control} drive=${drive} />
    </a>
  `;
}

function Speed({ drive }) {
  if (!drive.main) return null;
  const actual = `${drive.name}/actual/${drive.main}`;
  const command = `${drive.name}/command/${drive.main}`;
  const { unit, low, high } = nature(command);
  const most = Math.max(Math.abs(low ?? 0), Math.abs(high ?? 0)) || 1;
  const isGood = quality(actual) === "good";
  return html`
    <span class=${classes("speed", { old: !isGood })}>
      <span class="big">${isGood ? number(value(actual), unit) : "–"}</span> ${unit}
      <span class="setpoint">${t("plant.setpoint", { value: quantity(value(command), unit) })}</span>
      ${isGood
        ? html`<${Course} actual=${(value(actual) ?? 0) / most} setpoint=${(value(command) ?? 0) / most} />`
        : html`<span class="reason">${maybe(`quality.${quality(actual)}`)}</span>`}
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
      <path class="mark" d=${`M${x(setpoint)} 3l-3-3h6zM${x(setpoint)} 7l-3 3h6z`} />
    </svg>
  `;
}

function Control({ drive }) {
  const point = `${drive.name}/supervision`;
  const owner = value(`${point}/owner`);
  const timeout = value(`${point}/fieldbus_timeout_ms`) ?? 0;
  const state = label(`${point}/watchdog_state`, value(`${point}/watchdog_state`));
  const left = value(`${point}/watchdog_left_ms`) ?? 0;
  return html`
    <span class="control">
      <span class="label">${t("plant.owner")}</span> <span class="owner">${ownerName(owner)}</span>
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

// A node that is no drive, with what its inputs say and its outputs are.
function NodeTile({ node }) {
  const state = label(`${node.name}/node/state`, value(`${node.name}/node/state`));
  return html`
    <a class="tile" href=${address("bus", node.bus)}>
      <span class="name">${node.name}</span>
      <span class="state"><${Icon} name=${state === "operational" ? "ok" : "lost"} /> ${t(`node.${state}`)}</span>
      <span class="family">${node.family}</span>
      <span class="signals">${signals(node).map((name) => html`<span class=${classes({ old: quality(name) !== "good" })}>
        ${leafOf(name)} ${quality(name) === "good" ? shownSignal(name) : "–"}</span>`)}</span>
    </a>
  `;
}

const signals = (node) => [...below(`${node.name}/input`), ...below(`${node.name}/output`)];

function shownSignal(name) {
  const held = value(name);
  if (typeof held === "boolean") return t(held ? "signal.on" : "signal.off");
  const state = nature(name).states?.[held];
  return state ?? quantity(held, nature(name).unit);
}
