// All parameters of a drive with a search; what is shown is read.

import { html, useEffect, useMemo, useState } from "../ui.js";
import { may } from "../session.js";
import { ask } from "../live.js";
import { t } from "../texts.js";
import { matching } from "../rows.js";
import { Editor } from "./editor.js";
import { held, read, readAll } from "./held.js";
import { range, shown } from "./value.js";

const AT_ONCE = 50;
const SETTLED_MS = 250;

export function List({ holder, described, onWritten }) {
  const [wanted, setWanted] = useState("");
  const [count, setCount] = useState(AT_ONCE);
  const [edited, setEdited] = useState("");
  const all = described.parameters;
  const found = useMemo(() => matching(all, wanted, words), [all, wanted]);
  const drawn = found.slice(0, count);
  useEffect(() => readWhatIsShown(holder, drawn), [holder, wanted, count]);
  return html`
    <section class="panel" aria-labelledby="list">
      <h2 id="list">${t("parameters.list")}</h2>
      <p class="search">
        <input type="search" aria-label=${t("parameters.search", { count: all.length })}
          placeholder=${t("parameters.search", { count: all.length })}
          onInput=${(event) => (setWanted(event.target.value), setCount(AT_ONCE))} />
        <small role="status">${t("integration.shown", { shown: drawn.length, count: found.length })}</small>
        <button onClick=${() => readAll(holder, drawn.filter(isReadable).map((one) => one.name))}>${t("parameters.read_again")}</button>
        ${described.can_save && may("engineer") && html`<${Save} holder=${holder} />`}
      </p>
      ${described.on_save_only && html`<p class="quiet">${t("parameters.on_save_only")}</p>`}
      <div class="scroll" tabindex="0" role="group" aria-label=${t("parameters.list")}>
        <table class="rows parameters">
          <thead><tr>${["name", "title", "value", "range", "change"].map((name) => html`<th scope="col">${t(`parameters.${name}`)}</th>`)}</tr></thead>
          <tbody>
            ${drawn.map((entry) => html`<${Row} key=${entry.name} holder=${holder} entry=${entry}
              isEdited=${edited === entry.name} onEdit=${() => setEdited(edited === entry.name ? "" : entry.name)}
              described=${described} onWritten=${onWritten} />`)}
          </tbody>
        </table>
      </div>
      ${found.length > drawn.length && html`<p><button onClick=${() => setCount(count + AT_ONCE)}>${t("parameters.more")}</button></p>`}
    </section>
  `;
}

const isReadable = (entry) => !entry.write_only;
const words = (entry) => `${entry.name} ${entry.title ?? ""} ${entry.object} ${entry.unit ?? ""} ${Object.values(entry.states ?? {}).join(" ")}`;

// As soon as nobody types any more; what was read once is not read again.
function readWhatIsShown(holder, entries) {
  let isOver = false;
  const timer = setTimeout(() => {
    const names = entries.filter((one) => isReadable(one) && held(holder, one.name).value === null).map((one) => one.name);
    readAll(holder, names, undefined, () => isOver);
  }, SETTLED_MS);
  return () => {
    isOver = true;
    clearTimeout(timer);
  };
}

function Row({ holder, entry, isEdited, onEdit, described, onWritten }) {
  const one = held(holder, entry.name).value;
  const isFixed = entry.read_only || entry.why_never;
  return html`
    <tr>
      <td><code>${entry.name}</code> <small>${entry.object}</small></td>
      <td>${entry.title}</td>
      <td class="value">${entry.write_only ? t("parameters.write_only") : !one ? "…" : one.failure
        ? html`<span class="quiet" title=${one.failure}>${t(one.isMissing ? "parameters.missing" : "parameters.unread")}</span>`
        : shown(entry, one.value)}</td>
      <td>${range(entry)}</td>
      <td>${isFixed
        ? html`<small title=${entry.why_never}>${t(entry.read_only ? "parameters.read_only" : "parameters.never")}</small>`
        : may("engineer")
          ? html`<button onClick=${onEdit} aria-expanded=${isEdited} aria-label=${t("parameters.change_one", { name: entry.name })}>${t("parameters.change")}</button>`
          : html`<small>${t("parameters.engineer")}</small>`}</td>
    </tr>
    ${isEdited && html`<tr><td colspan="5"><${Editor} holder=${holder} entry=${entry} described=${described}
      onWritten=${() => (read(holder, entry.name), onWritten())} /></td></tr>`}
  `;
}

function Save({ holder }) {
  const [said, setSaid] = useState("");
  const onClick = async () => {
    const outcome = await ask(holder, "save_parameters");
    setSaid(outcome.ok ? t("parameters.saved") : outcome.message || outcome.code);
  };
  return html`<button onClick=${onClick}>${t("parameters.save")}</button> <small role="status">${said}</small>`;
}
