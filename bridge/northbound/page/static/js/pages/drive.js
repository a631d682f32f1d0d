// One drive: its state and values, its controls, and who watches whom.

import { classes, html } from "../ui.js";
import { troubles } from "../live.js";
import { address } from "../route.js";
import { drives, has, nature } from "../site.js";
import { quality } from "../values.js";
import { number } from "../format.js";
import { t } from "../texts.js";
import { Icon } from "../icons.js";
import { good, stateKey, stateOf } from "../drivestate.js";
import { Bits } from "../drive/bits.js";
import { Chain } from "../drive/chain.js";
import { Controls } from "../drive/controls.js";
import { Faults } from "../drive/faults.js";
import { StateDiagram } from "../drive/states.js";
import { Trend } from "../drive/trend.js";
import { TroubleRow } from "./plant.js";

export const drive = { path: "drive", topics, View };

const nameIn = (route) => route.slice(1).join("/");

function topics(route) {
  const one = drives.value.find((found) => found.name === nameIn(route));
  return one ? [`drive ${one.name}`, `node ${one.node}`] : [];
}

function View({ route }) {
  const one = drives.value.find((found) => found.name === nameIn(route));
  if (!one) return html`<p>${t("drive.not_there", { name: nameIn(route) })} <a href=${address("plant")}>${t("page.plant")}</a></p>`;
  return html`<${Drive} key=${one.name} drive=${one} />`;
}

function Drive({ drive }) {
  const state = stateOf(drive.name);
  const own = (troubles.value ?? []).filter((one) => [drive.name, drive.node, `bus/${drive.bus}`].includes(one.place));
  return html`
    <header class=${classes("drivehead", `in-${state}`)}>
      <h1>${drive.name}</h1>
      <span class="state"><${Icon} name=${state} /> ${t(stateKey(state, drive))}</span>
      <span class="fact">${drive.family}</span>
      <a href=${address("parameters", ...drive.name.split("/"))}>${t("page.parameters")}</a>
      <a href=${address("bus", drive.bus)}>${t("page.bus")} ${drive.bus}</a>
      <${Actuals} drive=${drive} />
      <span class="hidden" role="status">${drive.name}: ${t(stateKey(state, drive))}</span>
    </header>
    ${own.length > 0 && html`<section class="attention" aria-label=${t("plant.attention")}><ol>
      ${own.map((trouble) => html`<${TroubleRow} key=${trouble.kind + trouble.place + trouble.since} trouble=${trouble} />`)}
    </ol></section>`}
    <div class="columns">
      <${Controls} drive=${drive} />
      <${Chain} drive=${drive} />
    </div>
    <${Faults} drive=${drive} />
    <${StateDiagram} drive=${drive} />
    <${Trend} drive=${drive} />
    <${Bits} drive=${drive} />
  `;
}

function Actuals({ drive }) {
  const shown = [drive.main, "current", "torque"].filter((leaf, index, all) => leaf && all.indexOf(leaf) === index);
  return html`
    <dl class="actuals">
      ${shown
        .map((leaf) => `${drive.name}/actual/${leaf}`)
        .filter((name) => has(name) && quality(name) !== "disabled")
        .map((name) => html`
          <div><dt>${t(`point.${name.split("/").at(-1)}`)}</dt>
            <dd>${number(good(name), nature(name).unit)} <small>${nature(name).unit}</small></dd></div>
        `)}
    </dl>
  `;
}
