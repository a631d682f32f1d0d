// A long table with a search. Only the first rows found are drawn.

import { html, useMemo, useState } from "./ui.js";
import { t } from "./texts.js";
import { Failure, useFetched } from "./fetched.js";
import { Copy } from "./copy.js";

const DRAWN = 200;

/** The rows at `address`, a JSON list of objects; the column `copied` gets a button that copies it. */
export function Rows({ address, copied }) {
  const told = useFetched(address);
  const rows = told.value;
  const [wanted, setWanted] = useState("");
  const found = useMemo(() => matching(rows ?? [], wanted), [rows, wanted]);
  if (told.failure) return html`<${Failure} told=${told} />`;
  if (!rows) return html`<p class="quiet">${t("frame.loading")}</p>`;
  const columns = Object.keys(rows[0] ?? {});
  return html`
    <p class="search">
      <input type="search" aria-label=${t("integration.search", { count: rows.length })}
        placeholder=${t("integration.search", { count: rows.length })} onInput=${(event) => setWanted(event.target.value)} />
      <small role="status">${counted(Math.min(found.length, DRAWN), found.length, wanted)}</small>
    </p>
    <div class="scroll" tabindex="0" role="group" aria-label=${address}>
      <table class="rows">
        <thead><tr>${columns.map((name) => html`<th scope="col">${t(`column.${name}`)}</th>`)}</tr></thead>
        <tbody>
          ${found.slice(0, DRAWN).map((row) => html`<tr>${columns.map((name) => html`<td>
            ${name === copied ? html`<code>${row[name]}</code> <${Copy} text=${String(row[name])} />` : row[name]}</td>`)}</tr>`)}
        </tbody>
      </table>
    </div>
  `;
}

/** Number of rows found by `wanted`, in words. */
export function counted(shown, count, wanted) {
  return count || !wanted.trim() ? t("integration.shown", { shown, count }) : t("integration.no_match", { wanted: wanted.trim() });
}

/** The rows in which every word of `wanted` is somewhere in `text(row)`. */
export function matching(rows, wanted, text = (row) => Object.values(row).join(" ")) {
  const words = wanted.toLowerCase().split(/\s+/).filter(Boolean);
  if (!words.length) return rows;
  return rows.filter((row) => {
    const shown = text(row).toLowerCase();
    return words.every((word) => shown.includes(word));
  });
}
