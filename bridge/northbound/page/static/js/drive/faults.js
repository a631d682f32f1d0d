// Faults of a drive: the present one with its cause and remedy, former ones, and its node's emergency messages.

import { html } from "../ui.js";
import { has, label } from "../site.js";
import { number } from "../format.js";
import { faultIn, t } from "../texts.js";
import { good, goodLabel } from "../drivestate.js";
import { inWords } from "../trouble.js";
import { texts } from "../values.js";
import { Memory } from "./memory.js";

export function Faults({ drive }) {
  const status = (leaf) => good(`${drive.name}/status/${leaf}`);
  const text = status("fault_text");
  const { cause, remedy } = reasons(drive);
  return html`
    <section class="faults" aria-labelledby="faults">
      <h2 id="faults">${t("faults.title")}</h2>
      <dl class="facts">
        <dt>${t("faults.present")}</dt>
        <dd>${text ? html`<strong class="is-alarm">${inWords(drive, status("fault_number"), texts(`${drive.name}/status/fault_text`).value, text)}</strong>` : text === null ? "–" : t("faults.none")}</dd>
        ${text && cause && html`<dt>${t("faults.cause")}</dt><dd>${cause}</dd>`}
        ${text && remedy && html`<dt>${t("plant.what_to_do")}</dt><dd>${remedy}</dd>`}
        <${Before} drive=${drive} />
      </dl>
      <${Memory} drive=${drive} />
      <${Emergencies} node=${drive.node} />
    </section>
  `;
}

// After a trip of the bridge's watchdog the fault shown is the bridge's: the maker's text for that number does not
// apply.
function reasons(drive) {
  if (goodLabel(`${drive.name}/supervision/watchdog_state`) === "tripped") return { cause: t("faults.by_bridge"), remedy: "" };
  const status = (leaf) => good(`${drive.name}/status/${leaf}`);
  const own = faultIn(drive.mapping, status("fault_number"));
  return { cause: own.cause || status("fault_cause"), remedy: own.remedy || status("fault_remedy") };
}

const BEFORE = {
  last_fault_text: lastFault,
  trips: (count) => number(count),
  last_stop: (code, drive) => t(`stop.${label(`${drive.name}/supervision/last_stop`, code)}`),
};

function lastFault(english, drive) {
  const text = texts(`${drive.name}/supervision/last_fault_text`).value;
  return english ? inWords(drive, text?.facts.number, text, english) : t("faults.none");
}

function Before({ drive }) {
  const point = (leaf) => `${drive.name}/supervision/${leaf}`;
  const shown = (leaf) => (good(point(leaf)) === null ? "–" : BEFORE[leaf](good(point(leaf)), drive));
  return Object.keys(BEFORE)
    .filter((leaf) => has(point(leaf)))
    .map((leaf) => html`<dt>${t(`faults.${leaf}`)}</dt><dd>${shown(leaf)}</dd>`);
}

function Emergencies({ node }) {
  const history = good(`${node}/node/emcy_history`);
  if (history === null) return null;
  const all = JSON.parse(history || "[]");
  return html`
    <h3>${t("faults.emergencies", { node })}</h3>
    ${all.length === 0 && html`<p class="quiet">${t("faults.no_emergencies")}</p>`}
    ${all.length > 0 && html`<div class="scroll" tabindex="0" role="group" aria-label=${t("faults.emergencies", { node })}><table class="rows">
      <thead><tr>${["code", "register", "vendor", "text"].map((name) => html`<th scope="col">${t(`emcy.${name}`)}</th>`)}</tr></thead>
      <tbody>${all.map((one) => html`<tr><td><code>${one.code}</code></td><td><code>${one.register}</code></td><td><code>${one.vendor}</code></td><td>${one.text}</td></tr>`)}</tbody>
    </table></div>`}
  `;
}
