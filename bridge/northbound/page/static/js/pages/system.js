// The service itself: versions, who is connected, certificates, the site file with its check, events and log.

import { html } from "../ui.js";
import { events } from "../live.js";
import { may } from "../session.js";
import { clock, number, quantity } from "../format.js";
import { maybe, t, worded } from "../texts.js";
import { good } from "../drivestate.js";
import { Failure, useFetched } from "../fetched.js";
import { Icon } from "../icons.js";
import { Audit } from "../system/audit.js";
import { Certificates } from "../system/certificates.js";
import { SiteFile } from "../system/sitefile.js";

export const system = { path: "system", topics: () => ["plant"], View };

const REFRESH_MS = 5000;
const HEALTH = { worst_round_lateness_ms: "ms", worst_trip_lateness_ms: "ms", missed_deadlines: "", audit_lost: "", refused_writes: "" };

function View() {
  const answer = useFetched("api/system", REFRESH_MS);
  const told = answer.value;
  return html`
    <h1>${t("page.system")}</h1>
    <${Failure} told=${answer} />
    ${told && html`
      <${Unreadable} faults=${told.faults} />
      <div class="columns">
        <${Versions} versions=${told.versions} />
        <${Health} />
      </div>
      <${Clients} told=${told} />
      <${Certificates} certificates=${told.certificates} trustsAnybody=${told.trusts_anybody} again=${answer.again} />
    `}
    ${may("engineer") ? html`<${SiteFile} />` : html`<p class="quiet">${t("system.engineer")}</p>`}
    <${Events} />
    ${may("engineer") && html`<${Audit} />`}
  `;
}

function Versions({ versions }) {
  return html`
    <section class="panel" aria-labelledby="versions"><h2 id="versions">${t("system.versions")}</h2>
      <dl class="facts">${Object.entries(versions).map(([name, version]) => html`<dt>${name}</dt><dd>${version}</dd>`)}</dl>
    </section>
  `;
}

// Facts that could not be read; the rest of the page stands.
function Unreadable({ faults }) {
  return html`<ul class="findings">${faults.map((one) => html`<li class="is-warning"><${Icon} name="warning" />
    <span>${maybe(`system.${one.of}`) || one.of}: ${worded(one.text, one.message)}</span></li>`)}</ul>`;
}

function Health() {
  return html`
    <section class="panel" aria-labelledby="health"><h2 id="health">${t("system.health")}</h2>
      <dl class="facts">${Object.entries(HEALTH).map(([leaf, unit]) => html`
        <dt>${t(`system.${leaf}`)}</dt><dd>${unit ? quantity(good(`bridge/${leaf}`), unit) : number(good(`bridge/${leaf}`))}</dd>`)}</dl>
    </section>
  `;
}

function Clients({ told }) {
  return html`
    <section class="panel" aria-labelledby="clients"><h2 id="clients">${t("system.clients")}</h2>
      <dl class="counters">${Object.entries(told.clients).map(([protocol, count]) => html`
        <div><dt>${t(`protocol.${protocol}`)}</dt><dd>${number(count)} ${told.connections?.[protocol]?.length > 0 && html`<small>${told.connections[protocol].join(", ")}</small>`}</dd></div>`)}</dl>
      ${told.tabs && html`<div class="scroll" tabindex="0" role="group" aria-label=${t("system.tabs")}><table class="rows">
        <caption>${t("system.tabs")}</caption>
        <thead><tr>${["who", "role", "address", "since", "shows"].map((name) => html`<th scope="col">${t(`system.${name}`)}</th>`)}</tr></thead>
        <tbody>${told.tabs.map((tab) => html`<tr><td>${tab.who}</td><td>${t(`role.${tab.role}`)}</td><td>${tab.address}</td><td>${clock(tab.since)}</td><td>${tab.shows.join(", ")}</td></tr>`)}</tbody>
      </table></div>`}
    </section>
  `;
}

function Events() {
  const all = events.value;
  return html`
    <section class="panel" aria-labelledby="events"><h2 id="events">${t("system.events")}</h2>
      ${all.length === 0 && html`<p class="quiet">${t("system.no_events")}</p>`}
      ${all.length > 0 && html`<div class="scroll log" tabindex="0" role="group" aria-label=${t("system.events")}><table class="rows">
        <thead><tr>${["time", "source", "kind", "message"].map((name) => html`<th scope="col">${t(`system.${name}`)}</th>`)}</tr></thead>
        <tbody>${all.map((one) => html`<tr><td>${clock(one.time)}</td><td>${one.source}</td><td>${t(`event.${one.kind}`)}</td><td>${worded(one.text, one.message)}${one.cause && html` <small>${t("system.because", { cause: worded(one.cause_text, one.cause) })}</small>`}</td></tr>`)}</tbody>
      </table></div>`}
    </section>
  `;
}
