// Supervision chain: who watches whom, the time left, and the reaction to each silence. A value that is not good counts
// as unknown: its arrow is dashed, and no time left is shown.

import { html } from "../ui.js";
import { isConnected, troubles } from "../live.js";
import { has } from "../site.js";
import { quality } from "../values.js";
import { quantity } from "../format.js";
import { inWords, t } from "../texts.js";
import { good, goodLabel, ownState } from "../drivestate.js";
import { ownerOf } from "../owner.js";
import { Meter } from "../meter.js";
import { why } from "../words.js";

const NEVER_MS = 0xffffffff;

export function Chain({ drive }) {
  return html`
    <section class="chain" aria-labelledby="chain">
      <h2 id="chain">${t("chain.title")}</h2>
      <ol>
        <${OfController} drive=${drive} />
        <${OfBridge} drive=${drive} />
        <${OfDrive} drive=${drive} />
      </ol>
    </section>
  `;
}

function OfController({ drive }) {
  const point = (leaf) => `${drive.name}/supervision/${leaf}`;
  const watchdog = goodLabel(point("watchdog_state"));
  const timeout = good(point("fieldbus_timeout_ms"));
  return html`
    <li class="link">
      <div class="end"><strong>${t("chain.controller")}</strong> ${ownerOf(drive.name)}</div>
      <${Arrow} text=${t("chain.telegrams")} is=${{ tripped: "broken", unknown: "unsure" }[watchdog]}>
        <${Margin} time=${watchdog === "running" ? good(point("watchdog_left_ms")) : null} of=${timeout} text=${t(`watchdog.${watchdog}`)} />
      <//>
      <p class="break"><${ControllerBreak} drive=${drive} timeout=${timeout} worst=${point("worst_case_stop_ms")} /></p>
    </li>
  `;
}

function ControllerBreak({ drive, timeout, worst }) {
  if (timeout === null) return t("chain.unknown");
  if (!timeout) return t("chain.controller.unwatched");
  const filled = { timeout: quantity(timeout, "ms"), reaction: inWords(drive.reaction) };
  if (drive.on_expiry === "hold") return html`<strong class="is-alarm">${t(holdKey(drive), filled)}</strong>`;
  return html`${t("chain.controller.silent", filled)}${" "}<${Worst} name=${worst} />`;
}

// A hold does not outlive the one who holds: the end of its lease stops the drive.
const holdKey = (drive) => (drive.control === "lease" ? "chain.controller.hold_lease" : "chain.controller.hold");

function OfBridge({ drive }) {
  const isDown = (troubles.value ?? []).some((one) => one.place === `bus/${drive.bus}` && ["bus_down", "bus_off"].includes(one.kind));
  return html`
    <li class="link">
      <div class="end"><strong>${t("chain.bridge")}</strong> drivebridge</div>
      <${Arrow} text=${t("chain.frames")} is=${!isConnected.value ? "unsure" : isDown ? "broken" : ""} />
      <p class="break"><${BridgeBreak} name=${`${drive.name}/supervision/worst_case_bridge_ms`} /></p>
    </li>
  `;
}

function OfDrive({ drive }) {
  const point = (leaf) => `${drive.name}/supervision/${leaf}`;
  const downtimeS = good(point("telegram_downtime_s"));
  const state = ownState(drive.name);
  return html`
    <li class="link">
      <div class="end"><strong>${t("chain.drive")}</strong> ${drive.name} <small>${drive.family}</small></div>
      <${Arrow} text=${t("chain.answers")} isBack is=${{ lost: "broken", unknown: "unsure", disabled: "unsure" }[state]}>
        ${has(point("pdo_age_ms")) && html`<${Answers} age=${good(point("pdo_age_ms"))} downtimeMs=${downtimeS === null ? null : downtimeS * 1000} isHeard=${state !== "lost"} />`}
      <//>
      <p class="break">${downtimeS === null ? t("chain.unknown")
        : downtimeS > 0 ? t("chain.drive.silent", { time: quantity(downtimeS * 1000, "ms") }) : t("chain.drive.unwatched")}</p>
    </li>
  `;
}

// Age of the last message, and the longest time for the next.
function Answers({ age, downtimeMs, isHeard }) {
  if (age === null || downtimeMs === null) return html`<span class="quiet">${t("unknown")}</span>`;
  if (age === NEVER_MS) return html`<span class="quiet">${t("chain.unheard")}</span>`;
  if (!isHeard) return html`<span class="quiet">${t("state.lost")}</span>`;
  return html`<${Margin} time=${downtimeMs > 0 ? Math.max(0, downtimeMs - age) : null} of=${downtimeMs} text=${t("chain.unwatched")} />`;
}

function Arrow({ text, is = "", isBack, children }) {
  return html`
    <div class=${`arrow ${is}`}>
      <span class="way">${text}</span>
      <svg viewBox="0 0 100 12" preserveAspectRatio="none" aria-hidden="true">
        <path d=${isBack ? "M100 6H6M12 1L4 6l8 5" : "M0 6h94M88 1l8 5-8 5"} />
      </svg>
      ${children}
    </div>
  `;
}

// Share of the time that is left before the reaction.
function Margin({ time, of, text }) {
  if (time === null || time === undefined || !of) return html`<span class="quiet">${text}</span>`;
  return html`<span class="left"><${Meter} share=${time / of} low=${0.25} /> ${t("chain.left", { left: quantity(time, "ms"), of: quantity(of, "ms") })}</span>`;
}

// The drive's own supervision is read from it: it may be that it would run on.
function BridgeBreak({ name }) {
  if (!isConnected.value) return t("chain.unknown");
  if (quality(name) === "config_error") return html`<strong class="is-alarm">${t("chain.bridge.doubt", { why: why(name) })}</strong>`;
  return html`${t("chain.bridge.silent")}${" "}<${Worst} name=${name} />`;
}

// A published worst case, or the reason why there is none.
function Worst({ name }) {
  if (!has(name)) return null;
  const time = good(name);
  if (time === null) return html`<strong class="is-alarm">${t("chain.not_known", { why: why(name) || t("unknown") })}</strong>`;
  if (!time) return html`<strong class="is-alarm">${t("chain.never")}</strong>`;
  return html`<strong>${t("chain.within", { time: quantity(time, "ms") })}</strong>`;
}
