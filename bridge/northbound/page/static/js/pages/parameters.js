// The parameters of one drive by the vendor's names: searched, read, changed, compared, backed up and restored.

import { html, useEffect } from "../ui.js";
import { address } from "../route.js";
import { drives, nodes } from "../site.js";
import { t } from "../texts.js";
import { Failure, useFetched } from "../fetched.js";
import { forget } from "../parameters/held.js";
import { List } from "../parameters/list.js";
import { placeOf, Sets } from "../parameters/sets.js";

export const parameters = { path: "parameters", topics: () => [], View };

/** Holders of parameters: drives by the kind of their mapping, and nodes that are none by their family. */
function holders() {
  const others = nodes.value.filter((node) => !drives.value.some((drive) => drive.node === node.name));
  const ofDrives = drives.value.map(({ name, mapping }) => ({ name, kind: mapping }));
  return [...ofDrives, ...others.map(({ name, family }) => ({ name, kind: `node ${family}` }))];
}

function View({ route }) {
  const named = route.slice(1).join("/");
  const all = holders();
  const holder = all.find((one) => one.name === named) ?? all[0];
  return html`
    <h1>${t("page.parameters")}</h1>
    <p class="search">
      <label for="holder">${t("parameters.of")}</label>
      <select id="holder" value=${holder?.name} onChange=${(event) => (location.hash = address("parameters", ...event.target.value.split("/")))}>
        ${all.map(({ name }) => html`<option value=${name}>${name}</option>`)}
      </select>
    </p>
    ${holder && html`<${Holder} key=${holder.name} holder=${holder.name}
      others=${all.filter((one) => one !== holder && one.kind === holder.kind).map((one) => one.name)} />`}
  `;
}

// `described` is {mapping, cycles, can_save, on_save_only, parameters: [{name, title, object, type, unit, low, high, …}]}.
function Holder({ holder, others }) {
  const told = useFetched(placeOf("parameters", holder));
  const described = told.value;
  useEffect(() => forget(holder), [holder]);
  return html`
    <${Failure} told=${told} />
    ${!described && !told.failure && html`<p class="quiet">${t("frame.loading")}</p>`}
    ${described && html`
      <${Sets} holder=${holder} described=${described} others=${others} />
      <${List} holder=${holder} described=${described} onWritten=${told.again} />`}
  `;
}
