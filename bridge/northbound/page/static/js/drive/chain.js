// The supervision chain: who watches whom, how much time is left, and what happens when one of them falls silent.

import { classes, html } from "../ui.js";
import { has, label } from "../site.js";
import { quality, reason, value } from "../values.js";
import { quantity } from "../format.js";
import { t } from "../texts.js";
import { ownerName } from "../owner.js";
import { Meter } from "../meter.js";

export function Chain({ drive }) {
  const point = (leaf) => `${drive.name}/supervision/${leaf}`;
  const timeout = value(point("fieldbus_timeout_ms"));
  const left = value(point("watchdog_left_ms"));
  const watchdog = label(point("watchdog_state"), value(point("watchdog_state")));
  const downtimeMs = (value(point("telegram_downtime_s")) ?? 0) * 1000;
  const age = value(point("pdo_age_ms"));
  return html`
    <section class="chain" aria-labelledby="chain">
      <h2 id="chain">${t("chain.title")}</h2>
      <ol>
        <li class="link">
          <div class="end"><strong>${t("chain.controller")}</strong> ${ownerName(value(point("owner")))}</div>
          <${Arrow} text=${t("chain.telegrams")} isBroken=${watchdog === "tripped"}>
            <${Margin} time=${watchdog === "running" ? left : null} of=${timeout} text=${t(`watchdog.${watchdog}`)} />
          <//>
          <p class="break">
            ${timeout
              ? html`${t("chain.controller.silent", { timeout: quantity(timeout, "ms"), reaction: t(`reaction.${drive.on_expiry}`) })}${" "}
                  <${Worst} name=${point("worst_case_stop_ms")} />`
              : t("chain.controller.unwatched")}
          </p>
        </li>
        <li class="link">
          <div class="end"><strong>${t("chain.bridge")}</strong> drivebridge</div>
          <${Arrow} text=${t("chain.frames")} isBroken=${false} />
          <p class="break"><${BridgeBreak} name=${point("worst_case_bridge_ms")} /></p>
        </li>
        <li class="link">
          <div class="end"><strong>${t("chain.drive")}</strong> ${drive.name} <small>${drive.family}</small></div>
          <${Arrow} text=${t("chain.answers")} isBack isBroken=${["lost", "dead"].includes(quality(`${drive.name}/status/state`))}>
            ${has(point("pdo_age_ms")) &&
            html`<${Margin} time=${age === null || age > 0xfffffff0 ? null : Math.max(0, downtimeMs - age)} of=${downtimeMs}
              text=${t("chain.unheard")} />`}
          <//>
          <p class="break">${downtimeMs > 0 ? t("chain.drive.silent", { time: quantity(downtimeMs, "ms") }) : t("chain.drive.unwatched")}</p>
        </li>
      </ol>
    </section>
  `;
}

function Arrow({ text, isBroken, isBack, children }) {
  return html`
    <div class=${classes("arrow", { broken: isBroken })}>
      <span class="way">${text}</span>
      <svg viewBox="0 0 100 12" preserveAspectRatio="none" aria-hidden="true">
        <path d=${isBack ? "M100 6H6M12 1L4 6l8 5" : "M0 6h94M88 1l8 5-8 5"} />
      </svg>
      ${children}
    </div>
  `;
}

// How much of the time is left before somebody reacts.
function Margin({ time, of, text }) {
  if (time === null || time === undefined || !of) return html`<span class="quiet">${text}</span>`;
  return html`<span class="left"><${Meter} share=${time / of} low=${0.25} /> ${t("chain.left", { left: quantity(time, "ms"), of: quantity(of, "ms") })}</span>`;
}

// What the drive does by itself is read from it: it may be that it would run on.
function BridgeBreak({ name }) {
  if (quality(name) === "config_error") return html`<strong class="is-alarm">${t("chain.bridge.doubt", { why: reason(name) })}</strong>`;
  return html`${t("chain.bridge.silent")}${" "}<${Worst} name=${name} />`;
}

// A published worst case, or why there is none.
function Worst({ name }) {
  if (!has(name)) return null;
  const time = value(name);
  if (quality(name) !== "good") return html`<strong class="is-alarm">${t("chain.not_known", { why: reason(name) || t("unknown") })}</strong>`;
  if (!time) return html`<strong class="is-alarm">${t("chain.never")}</strong>`;
  return html`<strong>${t("chain.within", { time: quantity(time, "ms") })}</strong>`;
}
