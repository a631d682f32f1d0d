// The state machine of the drive with its present state lit, and the steps that are possible from there
// (CiA 402 §7.2; NORD BU 2500 §6.5; the families name their states alike).

import { classes, html, useEffect, useRef } from "../ui.js";
import { t } from "../texts.js";
import { ownState } from "../drivestate.js";

const WIDTH = 132;
const HEIGHT = 40;
// Column and row of each state.
const PLACES = {
  not_ready: [0, 0],
  switch_on_inhibited: [1, 0],
  ready: [2, 0],
  switched_on: [3, 0],
  operation_enabled: [4, 0],
  fault: [1, 1],
  fault_reaction_active: [2, 1],
  quick_stop_active: [4, 1],
};
const STEPS = [
  ["not_ready", "switch_on_inhibited", "itself"],
  ["switch_on_inhibited", "ready", "start"],
  ["ready", "switched_on", "start"],
  ["ready", "operation_enabled", "start"],
  ["switched_on", "operation_enabled", "start"],
  ["operation_enabled", "switched_on", "stop"], // or to another state: the family says it
  ["operation_enabled", "quick_stop_active", "quick_stop"],
  ["quick_stop_active", "switch_on_inhibited", "itself"],
  ["fault_reaction_active", "fault", "itself"],
  ["fault", "switch_on_inhibited", "reset_fault"],
];

export function StateDiagram({ drive }) {
  const present = ownState(drive.name);
  const box = useRef(null);
  useEffect(() => reveal(box.current), [present]);
  const there = Object.keys(PLACES).filter((name) => drive.states.includes(name));
  const all = STEPS.map(([from, to, command]) => [from, command === "stop" ? drive.stops_in : to, command]);
  const steps = all.filter(([from, to]) => there.includes(from) && there.includes(to) && isDirect(from, to, there));
  return html`
    <section class=${classes("diagram", { unsure: !(present in PLACES) })} aria-labelledby="diagram">
      <h2 id="diagram">${t("drive.states")}</h2>
      <div class="scroll" ref=${box} tabindex="0" role="group" aria-label=${t("drive.states")}>
      <svg viewBox="0 0 720 140" role="img" aria-label=${t("drive.states.now", { state: t(`state.${present}`) })}>
        <defs>
          <marker id="tip" viewBox="0 0 8 8" refX="7" refY="4" markerWidth="9" markerHeight="9" markerUnits="userSpaceOnUse" orient="auto-start-reverse">
            <path d="M0 0l8 4-8 4z" />
          </marker>
        </defs>
        ${steps.map(([from, to]) => html`<path class=${classes("step", { possible: from === present })} d=${way(from, to)}
          marker-end="url(#tip)" />`)}
        ${there.map((name) => html`<${State} name=${name} isPresent=${name === present} />`)}
      </svg>
      </div>
      <${Possible} steps=${steps.filter(([from]) => from === present)} present=${present} />
    </section>
  `;
}

// On a phone the drawing is wider than its box. The page itself stays where it is.
function reveal(box) {
  const node = box.querySelector(".present")?.getBoundingClientRect();
  if (!node || box.scrollWidth <= box.clientWidth) return;
  const around = box.getBoundingClientRect();
  const left = box.scrollLeft + node.left + node.width / 2 - (around.left + around.width / 2);
  box.scrollTo({ left, behavior: matchMedia("(prefers-reduced-motion: reduce)").matches ? "instant" : "smooth" });
}

// Where a family has the state between two others, the way leads through it.
function isDirect(from, to, there) {
  const skips = from === "ready" && to === "operation_enabled";
  return !skips || !there.includes("switched_on");
}

function State({ name, isPresent }) {
  const [x, y] = corner(name);
  return html`
    <g class=${classes("node", `in-${name}`, { present: isPresent })}>
      <rect x=${x} y=${y} width=${WIDTH} height=${HEIGHT} rx="4" />
      <text x=${x + WIDTH / 2} y=${y + HEIGHT / 2 + 4}>${t(`state.${name}`)}</text>
    </g>
  `;
}

function corner(name) {
  const [column, row] = PLACES[name];
  return [2 + column * 146, 4 + row * 88];
}

function way(from, to) {
  const [x1, y1] = corner(from);
  const [x2, y2] = corner(to);
  if (y1 === y2) {
    const isForward = x2 > x1;
    const lane = y1 + HEIGHT * (isForward ? 0.35 : 0.7);
    const far = Math.abs(x2 - x1) > 150;
    if (far) return `M${x1 + WIDTH / 2} ${y1 + HEIGHT}C${x1} ${y1 + 75} ${x2 + WIDTH} ${y1 + 75} ${x2 + WIDTH / 2} ${y2 + HEIGHT}`;
    return isForward ? `M${x1 + WIDTH} ${lane}H${x2}` : `M${x1} ${lane}H${x2 + WIDTH}`;
  }
  const isDown = y2 > y1;
  const start = isDown ? y1 + HEIGHT : y1;
  const end = isDown ? y2 : y2 + HEIGHT;
  if (x1 === x2) return `M${x1 + WIDTH / 2} ${start}V${end}`;
  const middle = (start + end) / 2 + 6;
  return `M${x1 + WIDTH / 2} ${start}V${middle}H${x2 + WIDTH / 2 + 24}V${end}`;
}

function Possible({ steps, present }) {
  const commands = [...new Set(steps.map(([, , command]) => command))].filter((one) => one !== "itself");
  const waits = steps.some(([, , command]) => command === "itself");
  return html`
    <p class="possible">
      <span class="label">${t("drive.steps")}</span>${" "}
      ${commands.map((command) => t(`step.${command}`, { to: ends(steps, command) })).join(" · ")}
      ${waits && ` ${t("step.itself", { to: ends(steps, "itself") })}`}
      ${!steps.length && t(present in PLACES ? "step.none" : "step.unknown")}
    </p>
  `;
}

const ends = (steps, command) =>
  steps
    .filter(([, , one]) => one === command)
    .map(([, to]) => t(`state.${to}`))
    .join(", ");
