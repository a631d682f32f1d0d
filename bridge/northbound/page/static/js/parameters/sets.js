// Parameter sets: back-up, comparison with the factory settings, a file or another drive, and restoring differences.

import { html, useEffect, useRef, useState } from "../ui.js";
import { may, session } from "../session.js";
import { save } from "../download.js";
import { fetched } from "../fetched.js";
import { t } from "../texts.js";
import { held, identity, readAll } from "./held.js";
import { Differences } from "./differences.js";
import { same } from "./value.js";

/** Address of the server's data on a drive or node. */
export const placeOf = (what, holder) => `api/${what}/${holder.split("/").map(encodeURIComponent).join("/")}`;

export function Sets({ holder, described, others }) {
  const [state, setState] = useState({});
  const file = useRef();
  const turn = useRef({ isOver: true });
  const settings = described.parameters.filter((one) => one.setting);
  const names = settings.map((one) => one.name);
  const hasFactory = settings.some((one) => "factory" in one);
  const [source, setSource] = useState(hasFactory ? "factory" : "file");
  const end = () => (turn.current.isOver = true);
  useEffect(() => end, []);
  // A run that was stopped, or left, reports nothing more.
  const run = (work) => async () => {
    const mine = (turn.current = { isOver: false });
    const say = (one) => mine.isOver || setState(one);
    await work(mine, say).then(say, (error) => say({ failure: error.message }));
  };
  const onStop = () => {
    end();
    setState({ done: t("parameters.stopped") });
  };
  const read = async (whose, mine, say) => {
    const onRead = (count) => say({ begun: t("parameters.reads", { name: whose }), busy: t("parameters.reading", { name: whose, count, all: names.length }) });
    onRead(0);
    if (!(await readAll(whose, names, onRead, () => mine.isOver))) throw new Error(t("parameters.silent", { name: whose }));
    return Object.fromEntries(names.map((name) => [name, held(whose, name).value]));
  };
  const backUp = run(async (mine, say) => {
    const found = await read(holder, mine, say);
    const text = await backup(holder, found, await identity(holder));
    if (!mine.isOver) save(`${holder.replace("/", "-")}.toml`, text, "application/toml");
    return { done: t("parameters.backed_up", { count: Object.values(found).filter((one) => !one.failure).length }) };
  });
  const compare = run(async (mine, say) => {
    say({ begun: t("frame.loading"), busy: t("frame.loading") });
    const other = source.startsWith("drive ") && source.slice(6);
    const set = other
      ? { name: other, values: plain(await read(other, mine, say)), identity: await identity(other), mapping: await mappingOf(other) }
      : await SOURCES[source]({ holder, settings, file: file.current?.files[0] });
    const found = await read(holder, mine, say);
    const refusal = await whyAnother(holder, described, set);
    return { done: t("parameters.compared"), result: { ...differences(described, found, set.values), refusal, source: set.name } };
  });
  return html`
    <section class="panel" aria-labelledby="sets">
      <h2 id="sets">${t("parameters.sets")}</h2>
      <p class="search">
        <button onClick=${backUp} disabled=${state.busy}>${t("parameters.back_up")}</button>
        <label for="source">${t("parameters.compare_with")}</label>
        <select id="source" value=${source} disabled=${state.busy} onChange=${(event) => setSource(event.target.value)}>
          <option value="factory" disabled=${!hasFactory}>${t(hasFactory ? "parameters.source.factory" : "parameters.source.none")}</option>
          <option value="file">${t("parameters.source.file")}</option>
          ${others.map((name) => html`<option value=${`drive ${name}`}>${t("parameters.source.drive", { name })}</option>`)}
        </select>
        ${source === "file" && html`<input type="file" ref=${file} accept=".toml,.eds,.dcf,.xdd,.xdc" aria-label=${t("parameters.source.file")} />`}
        <button onClick=${compare} disabled=${state.busy}>${t("parameters.compare")}</button>
        ${state.busy && html`<button onClick=${onStop}>${t("parameters.stop")}</button>`}
        <small>${state.busy ?? state.done ?? ""}</small>
        <span class="hidden" role="status">${state.begun ?? state.done ?? ""}</span>
      </p>
      ${!hasFactory && source === "file" && html`<p class="quiet">${t("parameters.no_factory")}</p>`}
      ${state.failure && html`<pre class="failure" role="alert">${state.failure}</pre>`}
      ${state.result && html`<${Differences} holder=${holder} result=${state.result} mayWrite=${may("engineer")} />`}
    </section>
  `;
}

// Source of a set: {name, values, identity}.
const SOURCES = {
  factory: async ({ settings }) => {
    const known = settings.filter((one) => "factory" in one);
    return { name: t("parameters.source.factory"), values: Object.fromEntries(known.map((one) => [one.name, one.factory])) };
  },
  file: async ({ holder, file }) => {
    if (!file) throw new Error(t("parameters.no_file"));
    const told = await post(`${placeOf("set", holder)}?name=${encodeURIComponent(file.name)}`, file, (answer) => answer.json());
    return { ...told, name: file.name };
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

// Reason why a set is not for a drive of this kind; empty where it is.
async function whyAnother(holder, described, { name, mapping, identity: ofSet }) {
  if (mapping && mapping !== described.mapping) return t("parameters.another", { source: name, name: t("parameters.mapping") });
  if (!ofSet) return "";
  const own = await identity(holder);
  const found = ["vendor", "product"].find((one) => one in ofSet && ofSet[one] !== own[one]);
  return found ? t("parameters.another", { source: name, name: t(`parameters.${found}`) }) : "";
}

async function mappingOf(holder) {
  const { value, failure } = await fetched(placeOf("parameters", holder));
  if (failure) throw new Error(failure);
  return value.mapping;
}

async function backup(holder, found, identity) {
  const failed = Object.entries(found).filter(([, one]) => one.failure);
  const set = {
    values: plain(found),
    missing: failed.filter(([, one]) => one.isMissing).map(([name]) => name),
    unreadable: Object.fromEntries(failed.filter(([, one]) => !one.isMissing).map(([name, one]) => [name, one.failure])),
    identity,
  };
  return post(placeOf("backup", holder), JSON.stringify(set), (answer) => answer.text());
}

async function post(address, body, read) {
  const { value, failure } = await fetched(address, { method: "POST", headers: { "x-token": session.value?.token ?? "" }, body, read });
  if (failure) throw new Error(failure);
  return value;
}
