// One bus: its condition, its nodes and the boot-up of each, the layout of their PDOs, and the traffic.

import { html } from "../ui.js";
import { troubles } from "../live.js";
import { address } from "../route.js";
import { buses } from "../site.js";
import { t } from "../texts.js";
import { Failure, useFetched } from "../fetched.js";
import { Condition } from "../bus/condition.js";
import { Capture } from "../bus/capture.js";
import { placesOf } from "../bus/state.js";
import { Layout } from "../bus/layout.js";
import { Nodes } from "../bus/nodes.js";
import { Traffic } from "../bus/traffic.js";
import { TroubleRow } from "./plant.js";

export const bus = { path: "bus", topics, View };

const named = (route) => (route[1] ? buses.value.find((one) => one.name === route[1]) : buses.value[0]);

function topics(route) {
  return named(route) ? [`bus ${named(route).name}`] : [];
}

function View({ route }) {
  const one = named(route);
  if (!one && route[1]) return html`<p>${t("bus.not_there", { name: route[1] })} <a href=${address("plant")}>${t("page.plant")}</a></p>`;
  if (!one) return null;
  return html`
    <h1>${t("page.bus")} ${one.name}</h1>
    ${buses.value.length > 1 && html`<nav class="tabs" aria-label=${t("page.bus")}>
      ${buses.value.map((other) => html`<a href=${address("bus", other.name)} aria-current=${other === one ? "page" : undefined}>${other.name}</a>`)}
    </nav>`}
    <${Bus} key=${one.name} bus=${one} />
  `;
}

function Bus({ bus }) {
  const told = useFetched(`api/bus/${encodeURIComponent(bus.name)}`);
  const places = placesOf(bus);
  const own = (troubles.value ?? []).filter((one) => [one, ...(one.explains ?? [])].some((each) => places.includes(each.place)));
  return html`
    <${Condition} bus=${bus} />
    ${own.length > 0 && html`<section class="attention" aria-label=${t("plant.attention")}><ol>
      ${own.map((trouble) => html`<${TroubleRow} key=${trouble.kind + trouble.place + trouble.since} trouble=${trouble} />`)}
    </ol></section>`}
    <${Nodes} bus=${bus} />
    <${Traffic} bus=${bus} nodes=${told.value?.nodes ?? []} />
    <${Capture} bus=${bus} />
    <${Failure} told=${told} />
    ${told.value && html`<${Layout} nodes=${told.value.nodes} />`}
  `;
}
