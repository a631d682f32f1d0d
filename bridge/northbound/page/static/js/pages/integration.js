// Page for programmers: how each server is reached, and all that it serves.

import { html } from "../ui.js";
import { address } from "../route.js";
import { t } from "../texts.js";
import { Copy } from "../copy.js";
import { Failure, useFetched } from "../fetched.js";
import { Rows } from "../rows.js";

export const integration = { path: "integration", topics: () => [], View };

const PROTOCOLS = ["modbus", "opcua", "zenoh"];
const KEYS = { modbus: "reference", opcua: "node_id", zenoh: "key" };

function View({ route }) {
  const shown = PROTOCOLS.includes(route[1]) ? route[1] : PROTOCOLS[0];
  const told = useFetched("api/integration");
  const servers = told.value;
  return html`
    <h1>${t("page.integration")}</h1>
    <nav class="tabs" aria-label=${t("integration.protocols")}>
      ${PROTOCOLS.map((name) => html`<a href=${address("integration", name)} aria-current=${name === shown ? "page" : undefined}>
        ${t(`integration.${name}`)}</a>`)}
    </nav>
    <${Failure} told=${told} />
    ${servers && (servers[shown] ? html`<${Server} key=${shown} name=${shown} facts=${servers[shown]} exports=${servers.exports} />`
      : html`<p>${t("integration.not_served", { name: shown })}</p>`)}
  `;
}

function Server({ name, facts, exports }) {
  const files = exports.filter((file) => file.startsWith(`${name}.`) || file.endsWith(".dbc"));
  return html`
    <dl class="facts"><${FACTS[name]} facts=${facts} /></dl>
    <p class="downloads"><span class="label">${t("integration.downloads")}</span>
      ${files.map((file) => html`<a href=${`api/export/${encodeURIComponent(file)}`} download>${file}</a>`)}</p>
    <${Rows} address=${`api/export/${name}.json`} copied=${KEYS[name]} />
  `;
}

const FACTS = {
  modbus: ({ facts }) => html`
    <${Fact} name="address"><${Command} text=${reached(facts.listen)} /><//>
    <${Fact} name="word_order">${facts.word_order}<//>
    <${Fact} name="example"><${Command} text=${`mbpoll -m tcp -p ${portOf(facts.listen)} -a 1 -t 3 -r 1 -c 4 -1 ${hostOf(reached(facts.listen))}`} /><//>
  `,
  opcua: ({ facts }) => html`
    <${Fact} name="address"><${Command} text=${reached(facts.url)} /><//>
    <${Fact} name="security">${t(facts.no_security ? "integration.open" : "integration.encrypted")}<//>
    <${Fact} name="who">${t("integration.users", { count: facts.users, anonymous: facts.anonymous })}<//>
  `,
  zenoh: ({ facts }) => html`
    <${Fact} name="address">${facts.listen.map((one) => html`<div><${Command} text=${reached(one)} /></div>`)}<//>
    <${Fact} name="prefix"><${Command} text=${facts.prefix} /><//>
  `,
};

const Fact = ({ name, children }) => html`<dt>${t(`integration.${name}`)}</dt><dd>${children}</dd>`;
const Command = ({ text }) => html`<code>${text}</code> <${Copy} text=${text} />`;
const portOf = (listen) => listen.slice(listen.lastIndexOf(":") + 1);
// Host as commands take it: an IPv6 address without its brackets.
const hostOf = (listen) => listen.slice(0, listen.lastIndexOf(":")).replace(/^\[(.*)\]$/, "$1");

// A server that listens at every address is reached at that of this page.
const reached = (listen) => listen.replace(/(^|\/)(0\.0\.0\.0|\[::\])(?=:|$)/, `$1${location.hostname}`);
