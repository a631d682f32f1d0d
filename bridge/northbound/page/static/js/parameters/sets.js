// Sets of parameters: backed up, compared with the factory, a file or another drive, and restored from what differs.

import { html, useRef, useState } from "../ui.js";
import { may, session } from "../session.js";
import { save } from "../download.js";
import { t } from "../texts.js";
import { held, identity, readAll } from "./held.js";
import { Differences } from "./differences.js";
import { same } from "./value.js";

export function Sets({ holder, described, others }) {
  const [state, setState] = useState({});
  const [source, setSource] = useState("factory");
  const file = useRef();
  const settings = described.parameters.filter((one) => one.setting);
  const busy = (text) => setState({ busy: text });
  const run = (work) => async () => {
    try {
      await work();
    } catch (error) {
      setState({ failure: error.message });
    }
  };
  const read = async (whose) => {
    const onRead = (count) => busy(t("parameters.reading", { name: whose, count, all: settings.length }));
    onRead(0);
    if (!(await readAll(whose, settings.map((one) => one.name), onRead)))
      throw new Error(t("parameters.silent", { name: whose }));
    return Object.fromEntries(settings.map((one) => [one.name, held(whose, one.name).value]));
  };
  const backUp = run(async () => {
    const found = await read(holder);
    const text = await backup(holder, found, await identity(holder));
    save(`${holder.replace("/", "-")}.toml`, text, "application/toml");
    setState({ done: t("parameters.backed_up", { count: Object.values(found).filter((one) => !one.failure).length }) });
  });
  const compare = run(async () => {
    const other = source.startsWith("drive ") && source.slice(6);
    const set = other
      ? { name: other, values: plain(await read(other)) }
      : await SOURCES[source]({ holder, settings, file: file.current?.files[0] });
    const found = await read(holder);
    const refusal = set.identity && (await whyAnother(holder, set.identity));
    setState({ result: { ...differences(described, found, set.values), refusal, source: set.name } });
  });
  return html`
    <section class="panel" aria-labelledby="sets">
      <h2 id="sets">${t("parameters.sets")}</h2>
      <p class="search">
        <button onClick=${backUp} disabled=${state.busy}>${t("parameters.back_up")}</button>
        <label for="source">${t("parameters.compare_with")}</label>
        <select id="source" value=${source} onChange=${(event) => setSource(event.target.value)}>
          <option value="factory">${t("parameters.source.factory")}</option>
          <option value="file">${t("parameters.source.file")}</option>
          ${others.map((name) => html`<option value=${`drive ${name}`}>${t("parameters.source.drive", { name })}</option>`)}
        </select>
        ${source === "file" && html`<input type="file" ref=${file} accept=".toml,.eds,.dcf,.xdd,.xdc" aria-label=${t("parameters.source.file")} />`}
        <button onClick=${compare} disabled=${state.busy}>${t("parameters.compare")}</button>
        <small role="status">${state.busy ?? state.done ?? ""}</small>
      </p>
      ${state.failure && html`<pre class="failure" role="alert">${state.failure}</pre>`}
      ${state.result && html`<${Differences} holder=${holder} result=${state.result} mayWrite=${may("engineer")} />`}
    </section>
  `;
}

// Where a set comes from: {name, values, identity}.
const SOURCES = {
  factory: async ({ settings }) => {
    const known = settings.filter((one) => "factory" in one);
    if (!known.length) throw new Error(t("parameters.no_factory"));
    return { name: t("parameters.source.factory"), values: Object.fromEntries(known.map((one) => [one.name, one.factory])) };
  },
  file: async ({ holder, file }) => {
    if (!file) throw new Error(t("parameters.no_file"));
    const told = await post(`api/set/${holder}?name=${encodeURIComponent(file.name)}`, file);
    return { ...(await told.json()), name: file.name };
  },
};

function differences(described, found, values) {
  const entries = new Map(described.parameters.map((one) => [one.name, one]));
  const rows = [];
  const missing = [];
  let count = 0;
  for (const [name, wanted] of Object.entries(values)) {
    const entry = entries.get(name) ?? { name };
    const held = found[name];
    if (!held || held.failure) missing.push(name);
    else if (same(entry, held.value, wanted)) count++;
    else rows.push({ entry, held: held.value, wanted });
  }
  return { rows, missing, same: count };
}

function plain(found) {
  return Object.fromEntries(Object.entries(found).filter(([, one]) => !one.failure).map(([name, one]) => [name, one.value]));
}

// Why a set is not of a drive of this kind; empty where it is.
async function whyAnother(holder, ofSet) {
  const own = await identity(holder);
  const name = ["vendor", "product"].find((one) => one in ofSet && ofSet[one] !== own[one]);
  return name ? t("parameters.another", { name: t(`parameters.${name}`) }) : "";
}

async function backup(holder, found, identity) {
  const failed = Object.entries(found).filter(([, one]) => one.failure);
  const set = {
    values: plain(found),
    missing: failed.filter(([, one]) => one.isMissing).map(([name]) => name),
    unreadable: Object.fromEntries(failed.filter(([, one]) => !one.isMissing).map(([name, one]) => [name, one.failure])),
    identity,
  };
  return (await post(`api/backup/${holder}`, JSON.stringify(set))).text();
}

async function post(path, body) {
  const answer = await fetch(path, { method: "POST", headers: { "x-token": session.value.token }, body });
  if (!answer.ok) throw new Error((await answer.json().catch(() => ({}))).error ?? String(answer.status));
  return answer;
}
