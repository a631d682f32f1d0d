// Latest entries of the audit log.

import { html, useMemo, useState } from "../ui.js";
import { clock } from "../format.js";
import { t, worded } from "../texts.js";
import { Failure, useFetched } from "../fetched.js";
import { matching } from "../rows.js";

const DRAWN = 100;

export function Audit() {
  const told = useFetched("api/system/audit");
  const entries = told.value;
  const [wanted, setWanted] = useState("");
  const found = useMemo(() => matching(entries ?? [], wanted, JSON.stringify), [entries, wanted]);
  if (!entries) return html`<${Failure} told=${told} />`;
  return html`
    <section class="panel" aria-labelledby="audit"><h2 id="audit">${t("system.audit")}</h2>
      <p class="search">
        <input type="search" aria-label=${t("integration.search", { count: entries.length })} placeholder=${t("integration.search", { count: entries.length })}
          onInput=${(event) => setWanted(event.target.value)} />
        <button onClick=${told.again} disabled=${told.isBusy}>${t("parameters.read_again")}</button>
      </p>
      <${Failure} told=${told} />
      <div class="scroll log" tabindex="0" role="group" aria-label=${t("system.audit")}><table class="rows">
        <thead><tr>${["time", "who", "target", "action", "result"].map((name) => html`<th scope="col">${t(`system.${name}`)}</th>`)}</tr></thead>
        <tbody>${found.slice(0, DRAWN).map((one) => html`<tr>
          <td>${clock(Date.parse(one.t))}</td><td>${one.source}:${one.user}</td><td>${one.target}</td>
          <td>${one.action}${one.new && html` <small>${Object.entries(one.new).map(([name, value]) => `${name} = ${value}`).join(", ")}</small>`}${one.count > 1 && html` <small>× ${one.count}</small>`}</td>
          <td>${one.code}${one.message && html` <small>${worded(one.text, one.message)}</small>`}</td></tr>`)}</tbody>
      </table></div>
    </section>
  `;
}
