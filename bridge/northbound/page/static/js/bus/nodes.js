// The nodes of a bus with the steps of their boot-up: where each is, or at which object it ended and what helps.

import { classes, html, useState } from "../ui.js";
import { may } from "../session.js";
import { ask } from "../live.js";
import { nodes } from "../site.js";
import { many, t, translated } from "../texts.js";
import { good, goodLabel } from "../drivestate.js";
import { Icon, shapeOfNode } from "../icons.js";
import { told } from "../outcome.js";
import { words } from "../words.js";

const STAGES = ["found", "identity", "configuration", "pdos", "supervision", "start"];
// Which stage a step of the boot-up belongs to (bridge/node/boot). The steps come in the order of the stages: what is
// before the present one is done.
/** @type {[string, RegExp][]} */
const WORDS = [
  ["found", /^(looking for the node|reading where it listens)/],
  ["identity", /^reading (the identity|name and version|its errors)/],
  ["configuration", /^(resetting its communication|comparing the configuration|downloading the configuration|storing the configuration|reading the identifier of emergency messages|opening |setting error control)/],
  ["pdos", /process data mapping/],
  ["supervision", /^(reading the (drives'|node's) own supervision|reading what the words mean|waiting for )/],
  ["start", /^starting/],
];
// At which stage a boot-up ends with an error status of CiA 302-2.
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
  const status = good(point("boot_status")) ?? "";
  const error = /^([A-O]): ([^]*)$/.exec(status);
  return html`
    <li class=${classes("busnode", `is-${state}`)}>
      <h3>${node.name} <small>${t("plant.node", { id: node.id })} · ${node.family}</small></h3>
      <p class="nodestate"><${Icon} name=${shapeOfNode(state)} /> ${t(`node.${state}`)}
        <small>${t("bus.nmt")}: ${goodLabel(point("nmt_state")).replaceAll("_", " ")}</small>
        ${good(point("software_version")) && html`<small>${t("bus.version")}: ${good(point("software_version"))}</small>`}</p>
      <ol class="stages" aria-label=${t("bus.boot")}>
        ${STAGES.map((stage, place) => html`<${Stage} stage=${stage} is=${standing(place, state, status, error)} />`)}
      </ol>
      ${error ? html`<p class="is-alarm"><strong>${error[1]}</strong> ${translated(error[2])}</p>` : html`<${Found} status=${status} />`}
      ${good(point("device_errors")) && html`<p><span class="label">${t("bus.device_errors")}</span> ${words(point("device_errors"))}</p>`}
      ${may("engineer") && html`<${Commands} node=${node.name} />`}
    </li>
  `;
}

// The present step; or what was found and set, one line each.
function Found({ status }) {
  const [first, ...notes] = status.split("; ");
  if (!notes.length) return html`<p class="quiet">${translated(first)}</p>`;
  return html`<details><summary>${many("bus.notes", notes.length)}</summary>
    <ul class="notes">${notes.map((note) => html`<li>${translated(note)}</li>`)}</ul></details>`;
}

// "done", "now", "failed" or "open".
function standing(place, state, status, error) {
  if (error) return of(place, STAGES.indexOf(endOf(error[1], error[2])), "failed");
  if (state === "operational" || state === "stopped") return "done";
  if (state !== "booting") return "open";
  return of(place, STAGES.indexOf(stageOf(status)), "now");
}

const of = (place, present, is) => (place < present ? "done" : place === present ? is : "open");
const stageOf = (text) => WORDS.find(([, words]) => words.test(text))?.[0] ?? "found";

// The stage at which a boot-up ended: that of the step, where it is named; J tells of anything that was to be set.
function endOf(letter, detail) {
  const step = /^nothing was heard while (.*)/.exec(detail)?.[1];
  if (step) return stageOf(step);
  if (detail.startsWith("the node stays ")) return "start";
  return letter === "J" && isOfPdos(detail) ? "pdos" : (ENDS[letter] ?? "found");
}

// Whether the object that it names first is a parameter or a mapping of a PDO: 1400h … 1BFFh.
function isOfPdos(detail) {
  const object = /(?:^|[^0-9A-Za-z])([0-9A-F]{4})h(?![0-9A-Za-z])/.exec(detail)?.[1];
  return object !== undefined && object >= "1400" && object <= "1BFF";
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
