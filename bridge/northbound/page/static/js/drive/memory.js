// Fault memory of a drive: parameters of its family, and the error list 1003h of its node (CiA 301 §7.5.2.4). Read on
// request only.

import { html, useState } from "../ui.js";
import { below, nature } from "../site.js";
import { exact, word } from "../format.js";
import { faultIn, t } from "../texts.js";
import { ask } from "../live.js";
import { told } from "../outcome.js";

const MOST = 16;

export function Memory({ drive }) {
  const [read, setRead] = useState({ rows: [] });
  const onRead = async () => {
    setRead({ rows: [], isBusy: true });
    setRead(await remembered(drive));
  };
  return html`
    <p class="search"><button onClick=${onRead} disabled=${read.isBusy}>${t("faults.read")}</button>
      <span role="status">${read.isBusy ? t("frame.loading") : read.said}</span></p>
    ${read.rows.length > 0 && html`<dl class="facts">${read.rows.map(([name, text]) => html`<dt>${name}</dt><dd>${text}</dd>`)}</dl>`}
  `;
}

// {rows: [[name, text], …], said}; `said` is the reason why there are no rows, or no more.
async function remembered(drive) {
  let rows = [];
  let isEmpty = false;
  const ofDrive = (parameter) => ask(drive.name, "read_parameter", { parameter });
  for (const { name, title } of parametersOf(drive.name)) {
    const outcome = await ofDrive(name);
    if (!outcome.ok) return { rows, said: told(outcome) };
    rows.push([`${name} ${title}`, exact(outcome.value, 1)]);
    isEmpty = outcome.value === 0 && (isEmpty || rows.length === 1);
  }
  if (isEmpty) rows = [];
  const count = await ofDrive("1003:00");
  // Not every device has the list: one that refuses the read has none.
  if (!count.ok && !count.abort_code) return { rows, said: told(count) };
  for (let place = 1; place <= Math.min(count.value ?? 0, MOST); place++) {
    const sub = place.toString(16).toUpperCase().padStart(2, "0");
    const { ok, value } = await ofDrive(`1003:${sub}`);
    if (ok) rows.push([`1003h:${sub}`, inWords(drive, value)]);
  }
  return { rows, said: rows.length ? "" : t(isEmpty ? "faults.empty" : "faults.keeps_none") };
}

// The error code, and beside it 16 bits of the maker's.
function inWords(drive, value) {
  const code = word(value & 0xffff);
  return [code, faultIn(drive.mapping, code).text, `(${word(value >>> 16)})`].filter(Boolean).join(" ");
}

// A point of a parameter is described by the parameter's name and title: "P701[1] last fault".
function parametersOf(drive) {
  return below(`${drive}/parameter`)
    .map((point) => /^(\S+) (last fault( but \d+)?)$/.exec(nature(point).description ?? ""))
    .filter(Boolean)
    .map(([, name, title]) => ({ name, title }));
}
