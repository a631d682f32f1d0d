// The parameters of one drive by the vendor's names: searched, read, changed, compared, backed up and restored.

import { html, useEffect, useState } from "../ui.js";
import { address } from "../route.js";
import { drives, nodes } from "../site.js";
import { t } from "../texts.js";
import { List } from "../parameters/list.js";
import { Sets } from "../parameters/sets.js";

export const parameters = { path: "parameters", topics: () => [], View };

/** Who has parameters: drives, and nodes that are none. */
function holders() {
  const others = nodes.value.filter((node) => !drives.value.some((drive) => drive.node === node.name));
  return [...drives.value, ...others].map((one) => one.name);
}

function View({ route }) {
  const named = route.slice(1).join("/");
  const all = holders();
  const holder = all.includes(named) ? named : all[0];
  return html`
    <h1>${t("page.parameters")}</h1>
    <p class="search">
      <label for="holder">${t("parameters.of")}</label>
      <select id="holder" value=${holder} onChange=${(event) => (location.hash = address("parameters", ...event.target.value.split("/")))}>
        ${all.map((name) => html`<option value=${name}>${name}</option>`)}
      </select>
    </p>
    ${holder && html`<${Holder} key=${holder} holder=${holder} others=${all.filter((name) => name !== holder)} />`}
  `;
}

function Holder({ holder, others }) {
  const [described, setDescribed] = useState(null);
  const [failure, setFailure] = useState("");
  const load = () =>
    describe(holder).then(setDescribed, (error) => setFailure(error.message));
  useEffect(() => void load(), [holder]);
  if (failure) return html`<p class="failure">${failure}</p>`;
  if (!described) return html`<p class="quiet">${t("frame.loading")}</p>`;
  return html`
    <${Sets} holder=${holder} described=${described} others=${others} />
    <${List} holder=${holder} described=${described} onWritten=${load} />
  `;
}

/** {mapping, cycles, can_save, on_save_only, parameters: [{name, title, object, type, unit, low, high, …}]} */
export async function describe(holder) {
  const answer = await fetch(`api/parameters/${holder}`);
  const told = await answer.json();
  if (!answer.ok) throw new Error(told.error);
  return told;
}
