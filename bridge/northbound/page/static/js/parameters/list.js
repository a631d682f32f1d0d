// All parameters of a drive with a search; those shown are read.

import { html, useEffect, useMemo, useRef, useState } from "../ui.js";
import { may } from "../session.js";
import { ask, isConnected } from "../live.js";
import { inWords, language, t } from "../texts.js";
import { told } from "../outcome.js";
import { counted, matching } from "../rows.js";
import { Editor } from "./editor.js";
import { held, read, readAll } from "./held.js";
import { range, shown, statesOf, titleOf } from "./value.js";

const AT_ONCE = 50;
const SETTLED_MS = 250;

export function List({ holder, described, onWritten }) {
  const [wanted, setWanted] = useState("");
  const [count, setCount] = useState(AT_ONCE);
  const [edited, setEdited] = useState("");
  const all = described.parameters;
  const found = useMemo(() => matching(all, wanted, words), [all, wanted, language.value]);
  const drawn = found.slice(0, count);
  const isOver = useRef(false);
  useEffect(() => isConnected.value ? readWhatIsShown(holder, drawn) : undefined, [holder, wanted, count, isConnected.value]);
  useEffect(() => () => (isOver.current = true), []);
  const onReadAgain = () => readAll(holder, drawn.filter(isReadable).map((one) => one.name), undefined, () => isOver.current);
  return html`
    <section class="panel" aria-labelledby="list">
      <h2 id="list">${t("parameters.list")}</h2>
      <p class="search">
        <input type="search" aria-label=${t("parameters.search", { count: all.length })}
          placeholder=${t("parameters.search", { count: all.length })}
          onInput=${(event) => (setWanted(event.target.value), setCount(AT_ONCE))} />
        <small role="status">${counted(drawn.length, found.length, wanted)}</small>
        <button onClick=${onReadAgain} disabled=${!isConnected.value}>${t("parameters.read_again")}</button>
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
const words = (entry) => `${entry.name} ${titleOf(entry) ?? ""} ${entry.object} ${entry.unit ?? ""} ${Object.values(statesOf(entry) ?? {}).join(" ")}`;

// Once typing has stopped; a parameter that was read is not read again.
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
  return html`
    <tr>
      <td><code>${entry.name}</code> <small>${entry.object}</small></td>
      <td>${titleOf(entry)}</td>
      <td class="value"><${Held} holder=${holder} entry=${entry} /></td>
      <td>${range(entry)}</td>
      <td><${Change} entry=${entry} isEdited=${isEdited} onEdit=${onEdit} /></td>
    </tr>
    ${isEdited && html`<tr><td colspan="5"><${Editor} holder=${holder} entry=${entry} described=${described}
      onWritten=${() => (read(holder, entry.name), onWritten())} /></td></tr>`}
  `;
}

// The drive's value, or the reason why it is not known.
function Held({ holder, entry }) {
  const one = held(holder, entry.name).value;
  if (entry.write_only) return t("parameters.write_only");
  if (!one) return isConnected.value ? "…" : "–";
  if (!one.failure) return shown(entry, one.value);
  if (one.isMissing) return html`<span class="quiet">${t("parameters.missing")}</span>`;
  return html`<span class="quiet">${t("parameters.unread")} <small class="why">${one.failure}</small></span>`;
}

// Controls to change it, or the reason why it cannot be changed.
function Change({ entry, isEdited, onEdit }) {
  if (entry.read_only) return html`<small>${t("parameters.read_only")}</small>`;
  if (entry.why_never) return html`<small class="why">${t("parameters.never")}: ${inWords(entry.why_never)}</small>`;
  if (!may("engineer")) return html`<small>${t("parameters.engineer")}</small>`;
  return html`<button onClick=${onEdit} aria-expanded=${isEdited} aria-label=${t("parameters.change_one", { name: entry.name })}>${t("parameters.change")}</button>`;
}

function Save({ holder }) {
  const [said, setSaid] = useState({ text: "" });
  const onClick = async () => {
    setSaid({ text: t("parameters.writing"), isBusy: true });
    const outcome = await ask(holder, "save_parameters");
    setSaid({ text: outcome.ok ? t("parameters.saved") : t("outcome.refused", { what: t("parameters.save"), message: told(outcome) }) });
  };
  return html`<button onClick=${onClick} disabled=${said.isBusy}>${t("parameters.save")}</button> <small role="status">${said.text}</small>`;
}
