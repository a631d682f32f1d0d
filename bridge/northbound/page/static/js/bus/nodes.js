// Nodes of a bus with the steps of their boot-up: the present step of each, or the object at which it ended and a
// remedy.

import { classes, html, useState } from "../ui.js";
import { may } from "../session.js";
import { ask } from "../live.js";
import { nodes } from "../site.js";
import { inWords, many, t } from "../texts.js";
import { good, goodLabel } from "../drivestate.js";
import { Icon, shapeOfNode } from "../icons.js";
import { told } from "../outcome.js";
import { texts } from "../values.js";
import { words } from "../words.js";

const STAGES = ["found", "identity", "configuration", "pdos", "supervision", "start"];
// Stage of each step of the boot-up, by the code of its text (bridge/node/boot). The steps come in the order of the
// stages: those before the present one are done.
/** @type {Record<string, string[]>} */
const STEPS = {
  found: ["look", "listen"],
  identity: ["identity", "name", "errors"],
  configuration: ["reset", "compare", "download", "store", "emergency_id", "channel", "error_control"],
  pdos: ["pdos_of", "pdos"],
  supervision: ["own_supervision", "node_supervision", "words", "wait"],
  start: ["start"],
};
// Stage at which a boot-up ends with an error status of CiA 302-2.
const ENDS = { B: "found", C: "identity", D: "identity", M: "identity", N: "identity", O: "identity", J: "configuration", E: "supervision", F: "supervision", K: "supervision" };

export function Nodes({ bus }) {
  const own = nodes.value.filter((node) => node.bus === bus.name);
  return html`
    <section class="panel" aria-labelledby="nodes">
      <h2 id="nodes">${t("bus.nodes")}</h2>
      <ul class="nodes">${own.map((node) => html`<${Node} key=${node.name} node=${node} />`)}</ul>
    </section>
  `;
}

function Node({ node }) {
  const point = (leaf) => `${node.name}/node/${leaf}`;
  const state = goodLabel(point("state"));
  const status = good(point("boot_status")) === null ? undefined : texts(point("boot_status")).value;
  const error = failureOf(status);
  return html`
    <li class=${classes("busnode", `is-${state}`)}>
      <h3>${node.name} <small>${t("plant.node", { id: node.id })} · ${node.family}</small></h3>
      <p class="nodestate"><${Icon} name=${shapeOfNode(state)} /> ${t(`node.${state}`)}
        <small>${t("bus.nmt")}: ${goodLabel(point("nmt_state")).replaceAll("_", " ")}</small>
        ${good(point("software_version")) && html`<small>${t("bus.version")}: ${good(point("software_version"))}</small>`}</p>
      <ol class="stages" aria-label=${t("bus.boot")}>
        ${STAGES.map((stage, place) => html`<${Stage} stage=${stage} is=${standing(place, state, status, error)} />`)}
      </ol>
      ${error ? html`<p class="is-alarm"><strong>${error.letter}</strong> ${failing(status)}</p>` : html`<${Found} status=${status} name=${point("boot_status")} />`}
      ${good(point("device_errors")) && html`<p><span class="label">${t("bus.device_errors")}</span> ${words(point("device_errors"))}</p>`}
      ${may("engineer") && html`<${Commands} node=${node.name} />`}
    </li>
  `;
}

// Failure of a boot-up, {letter, what}; null where it did not fail. A drive that was left out is a failure, too.
function failureOf(status) {
  if (status?.code.startsWith("boot.failed")) return status.facts;
  const outcome = status?.code === "boot.noted" ? status.facts.outcome : status;
  return outcome?.code === "boot.left_out" ? { letter: "J", what: status } : null;
}

// What failed and what helps, without the letter.
function failing({ code, facts }) {
  if (code === "boot.noted") return [failing(facts.outcome), ...facts.notes.map((note) => inWords(note))].join("; ");
  if (code === "boot.left_out") return facts.drives.map((one) => inWords(one.facts.what)).join(", ");
  return [facts.what, facts.hint].filter(Boolean).map((part) => inWords(part)).join(": ");
}

// The present step; after the boot-up what was found and set, one line each.
function Found({ status, name }) {
  const notes = notesOf(status);
  if (!notes.length) return html`<p class="quiet">${words(name)}</p>`;
  return html`<details><summary>${many("bus.notes", notes.length)}</summary>
    <ul class="notes">${notes.map((note) => html`<li>${inWords(note)}</li>`)}</ul></details>`;
}

// Findings of the boot-up and since.
function notesOf(text) {
  return text?.code === "boot.noted" ? [...notesOf(text.facts.outcome), ...text.facts.notes] : [];
}

// State of a stage: "done", "now", "failed" or "open".
function standing(place, state, status, error) {
  if (error) return of(place, STAGES.indexOf(endOf(error.letter, error.what)), "failed");
  if (state === "operational" || state === "stopped") return "done";
  if (state !== "booting") return "open";
  return of(place, STAGES.indexOf(stageOf(status)), "now");
}

const of = (place, present, is) => (place < present ? "done" : place === present ? is : "open");
const bare = (step) => (step?.code === "boot_step.needed" ? step.facts.step : step);

function stageOf(step) {
  const name = bare(step)?.code.replace("boot_step.", "");
  return STAGES.find((stage) => STEPS[stage].includes(name)) ?? "found";
}

// The stage at which a boot-up ended: that of the step, where it is named; J tells of anything that was to be set.
function endOf(letter, what) {
  const ended = what.code === "boot.needed" ? what.facts.what : what;
  if (ended.code === "boot.nothing_heard") return stageOf(ended.facts.step);
  if (ended.code === "boot.stays") return "start";
  return letter === "J" && isOfPdos(ended) ? "pdos" : (ENDS[letter] ?? "found");
}

// True if the first object that the text names is a parameter or a mapping of a PDO: 1400h … 1BFFh.
function isOfPdos(what) {
  const object = objectOf(what)?.slice(0, 4) ?? "";
  return object >= "1400" && object <= "1BFF";
}

function objectOf(text) {
  if (typeof text.facts.object === "string") return text.facts.object;
  const inner = Object.values(text.facts).flat().filter((fact) => fact?.facts);
  return inner.map(objectOf).find((object) => object);
}

function Stage({ stage, is }) {
  return html`<li class=${`stage ${is}`}><${Icon} name=${{ done: "ok", now: "ready", failed: "alarm", open: "unknown" }[is]} /> ${t(`boot.${stage}`)} <span class="hidden">${t(`boot.is.${is}`)}</span></li>`;
}

const COMMANDS = ["start_node", "stop_node", "enter_pre_operational", "reset_communication", "reset"];

function Commands({ node }) {
  const [said, setSaid] = useState("");
  const send = (action) => async () => {
    const outcome = await ask(node, action);
    setSaid(outcome.ok ? t("bus.sent") : told(outcome));
  };
  return html`
    <details><summary>${t("bus.commands")}</summary>
      <p class="buttons">${COMMANDS.map((action) => html`<button onClick=${send(action)}>${t(`nmt.${action}`)}</button>`)}
        <small role="status">${said}</small></p></details>
  `;
}
