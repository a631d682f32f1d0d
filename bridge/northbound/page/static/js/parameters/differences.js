// Differences between a drive and a set, to be written to the drive.

import { html, useEffect, useRef, useState } from "../ui.js";
import { many, t } from "../texts.js";
import { told } from "../outcome.js";
import { write } from "./held.js";
import { shown, titleOf } from "./value.js";

export function Differences({ holder, result, mayWrite }) {
  const [progress, setProgress] = useState({ written: 0 });
  const [left, setLeft] = useState(() => new Set(result.rows.map((row) => row.entry.name)));
  const chosen = result.rows.filter((row) => left.has(row.entry.name));
  const isOver = useRef(false);
  useEffect(() => () => (isOver.current = true), []);
  const onWrite = async () => {
    isOver.current = false;
    setProgress({ written: 0, isBusy: true });
    setProgress(await writeAll(holder, chosen, (written) => setProgress({ written, isBusy: true }), () => isOver.current));
  };
  const toggle = (name) => {
    const next = new Set(left);
    if (!next.delete(name)) next.add(name);
    setLeft(next);
  };
  return html`
    <p role="status"><strong>${many("parameters.differ", result.rows.length, { source: result.source })}</strong>${" "}
      ${many("parameters.same", result.same)} ${result.missing.length > 0 && many("parameters.not_there", result.missing.length)}</p>
    ${result.refusal && html`<p class="failure">${result.refusal}</p>`}
    ${result.rows.length > 0 && html`
      <div class="scroll" tabindex="0" role="group" aria-label=${t("parameters.compare")}>
        <table class="rows differences">
          <thead><tr><th scope="col"><span class="hidden">${t("parameters.write")}</span></th>
            ${["name", "title", "in_drive", "in_set"].map((name) => html`<th scope="col">${t(`parameters.${name}`)}</th>`)}</tr></thead>
          <tbody>${result.rows.map(({ entry, held, wanted }) => html`<tr>
            <td><input type="checkbox" checked=${left.has(entry.name)} disabled=${progress.isBusy} onChange=${() => toggle(entry.name)} aria-label=${entry.name} /></td>
            <td><code>${entry.name}</code></td><td>${titleOf(entry)}</td><td>${shown(entry, held)}</td><td>${shown(entry, wanted)}</td></tr>`)}
          </tbody>
        </table>
      </div>
      ${mayWrite && !result.refusal && html`<p class="search">
        <button class="main" onClick=${onWrite} disabled=${progress.isBusy || progress.isDone || !chosen.length}>${many("parameters.restore", chosen.length)}</button>
        ${progress.isBusy && html`<button onClick=${() => (isOver.current = true)}>${t("parameters.stop")}</button>
          <span>${t("parameters.restoring", { written: progress.written, count: chosen.length })}</span>`}
        <span role="status">${progress.isDone ? many("parameters.restored", progress.written) : progress.isBusy ? t("parameters.writing") : ""}</span></p>`}
      ${progress.failure && html`<p class="failure" role="alert">${progress.failure}</p>`}`}
  `;
}

// Writes one after the other, to the end, the first refusal, or until `isOver()`. Returns the message to show.
async function writeAll(holder, chosen, onWritten, isOver) {
  let written = 0;
  for (const { entry, wanted } of chosen) {
    if (isOver()) return { written, failure: t("parameters.write_stopped", { name: entry.name, written, count: chosen.length }) };
    const outcome = await write(holder, entry.name, wanted);
    if (!outcome.ok) return { written, failure: t("parameters.ended", { name: entry.name, message: told(outcome), written, count: chosen.length }) };
    onWritten(++written);
  }
  return { written, isDone: true };
}
