// The nodes of a bus with the steps of their boot-up: where each is, or at which object it ended and what helps.

import { classes, html, useState } from "../ui.js";
import { may } from "../session.js";
import { ask } from "../live.js";
import { label, nodes } from "../site.js";
import { value } from "../values.js";
import { many, t } from "../texts.js";
import { Icon } from "../icons.js";

const STAGES = ["found", "identity", "configuration", "pdos", "supervision", "start"];
// Which stage the words of a step belong to (bridge/node/boot), the later ones first.
/** @type {[string, RegExp][]} */
const WORDS = [
  ["start", /^starting/],
  ["supervision", /^waiting for|own supervision|error control/],
  ["pdos", /process data mapping|what the words mean|where it listens/],
  ["configuration", /configuration|opening|emergency|communication/],
  ["identity", /identity|name and version|its errors/],
  ["found", /looking for/],
];
// At which stage a boot-up ends with an error status of CiA 302-2.
const ENDS = { B: "found", C: "identity", D: "identity", M: "identity", N: "identity", O: "identity", J: "configuration", E: "supervision", F: "supervision", K: "supervision" };
const SHAPES = { operational: "ok", booting: "unknown", stopped: "warning", disabled: "none" };

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
  const state = label(point("state"), value(point("state")));
  const status = value(point("boot_status")) ?? "";
  const error = /^([A-O]): ([^]*)$/.exec(status);
  return html`
    <li class=${classes("busnode", `is-${state}`)}>
      <h3>${node.name} <small>${t("plant.node", { id: node.id })} · ${node.family}</small></h3>
      <p class="nodestate"><${Icon} name=${SHAPES[state] ?? "lost"} /> ${t(`node.${state}`)}
        <small>${t("bus.nmt")}: ${label(point("nmt_state"), value(point("nmt_state"))).replaceAll("_", " ")}</small>
        ${value(point("software_version")) && html`<small>${t("bus.version")}: ${value(point("software_version"))}</small>`}</p>
      <ol class="stages" aria-label=${t("bus.boot")}>
        ${STAGES.map((stage, place) => html`<${Stage} stage=${stage} is=${standing(place, state, status, error)} />`)}
      </ol>
      ${error ? html`<p class="is-alarm"><strong>${error[1]}</strong> ${error[2]}</p>` : html`<${Found} status=${status} />`}
      ${value(point("device_errors")) && html`<p><span class="label">${t("bus.device_errors")}</span> ${value(point("device_errors"))}</p>`}
      ${may("engineer") && html`<${Commands} node=${node.name} />`}
    </li>
  `;
}

// The present step; or what was found and set, one line each.
function Found({ status }) {
  const [first, ...notes] = status.split("; ");
  if (!notes.length) return html`<p class="quiet">${first}</p>`;
  return html`<details><summary>${many("bus.notes", notes.length)}</summary>
    <ul class="notes">${notes.map((note) => html`<li>${note}</li>`)}</ul></details>`;
}

// "done", "now", "failed" or "open".
function standing(place, state, status, error) {
  if (error) {
    const failed = STAGES.indexOf(/1A0|160|180|140/.test(status) && error[1] === "J" ? "pdos" : (ENDS[error[1]] ?? "found"));
    return place < failed ? "done" : place === failed ? "failed" : "open";
  }
  if (state === "operational" || state === "stopped") return "done";
  if (state !== "booting") return "open";
  const now = STAGES.indexOf(WORDS.find(([, words]) => words.test(status))?.[0] ?? "found");
  return place < now ? "done" : place === now ? "now" : "open";
}

function Stage({ stage, is }) {
  return html`<li class=${`stage ${is}`}><${Icon} name=${{ done: "ok", now: "ready", failed: "alarm", open: "unknown" }[is]} />
    ${t(`boot.${stage}`)} <span class="hidden">${t(`boot.is.${is}`)}</span></li>`;
}

const COMMANDS = ["start_node", "stop_node", "enter_pre_operational", "reset_communication", "reset"];

function Commands({ node }) {
  const [said, setSaid] = useState("");
  const send = (action) => async () => {
    const outcome = await ask(node, action);
    setSaid(outcome.ok ? t("bus.sent") : outcome.message || outcome.code);
  };
  return html`
    <details><summary>${t("bus.commands")}</summary>
      <p class="buttons">${COMMANDS.map((action) => html`<button onClick=${send(action)}>${t(`nmt.${action}`)}</button>`)}
        <small role="status">${said}</small></p></details>
  `;
}
