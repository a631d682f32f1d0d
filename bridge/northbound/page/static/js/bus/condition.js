// How the bus is: state, load and counters, and who is on it that should not be.

import { classes, html } from "../ui.js";
import { label, nature } from "../site.js";
import { value } from "../values.js";
import { number, quantity } from "../format.js";
import { t } from "../texts.js";
import { Icon } from "../icons.js";
import { Meter } from "../meter.js";

const COUNTERS = ["tx_errors", "rx_errors", "error_frames", "frames_lost", "frames_expired", "sync_window_misses"];
const STRANGERS = ["unexpected_nodes", "duplicate_ids", "last_intruder"];

export function Condition({ bus }) {
  const point = (leaf) => `bus/${bus.name}/${leaf}`;
  const state = label(point("state"), value(point("state")));
  const strangers = STRANGERS.filter((leaf) => value(point(leaf)));
  return html`
    <section class="panel" aria-labelledby="condition">
      <h2 id="condition">${t("bus.condition")}
        <span class=${classes("busstate", `is-${state}`)}>
          <${Icon} name=${{ ok: "ok", warning: "warning", passive: "warning" }[state] ?? "alarm"} /> ${t(`bus.${state}`)}</span></h2>
      <dl class="counters">
        <div><dt>${t("plant.load")}</dt><dd><${Meter} share=${(value(point("load")) ?? 0) / 100} warn=${0.8} /> ${quantity(value(point("load")), "%")}</dd></div>
        <div><dt>${t("bus.bitrate")}</dt><dd>${quantity(bus.bitrate / 1000, "kbit/s")}</dd></div>
        ${COUNTERS.map((leaf) => html`<div><dt>${t(`bus.${leaf}`)}</dt><dd>${number(value(point(leaf)))}</dd></div>`)}
      </dl>
      ${value(point("last_error")) && html`<p><span class="label">${t("bus.last_error")}</span> ${value(point("last_error"))}</p>`}
      ${value(point("second_master")) && html`<p class="is-alarm"><${Icon} name="alarm" /> ${t("trouble.second_master")}</p>`}
      ${strangers.map((leaf) => html`<p class="is-alarm"><${Icon} name="alarm" /> <span class="label">${t(`bus.${leaf}`)}</span> ${value(point(leaf))}</p>`)}
      ${!strangers.length && html`<p class="quiet">${t("bus.no_strangers")}</p>`}
      ${value(point("passive")) && html`<p>${nature(point("passive")).description}</p>`}
    </section>
  `;
}
