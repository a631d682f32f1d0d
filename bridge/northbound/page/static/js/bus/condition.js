// Condition of the bus: state, load and counters, and foreign nodes and masters on it.

import { html } from "../ui.js";
import { isConnected } from "../live.js";
import { number, quantity } from "../format.js";
import { t } from "../texts.js";
import { good } from "../drivestate.js";
import { words } from "../words.js";
import { BusState } from "./state.js";
import { Icon } from "../icons.js";
import { Meter } from "../meter.js";

const COUNTERS = ["tx_errors", "rx_errors", "error_frames", "frames_lost", "frames_expired", "sync_window_misses"];
const STRANGERS = ["unexpected_nodes", "duplicate_ids", "last_intruder"];

export function Condition({ bus }) {
  const point = (leaf) => `bus/${bus.name}/${leaf}`;
  const load = good(point("load"));
  return html`
    <section class="panel" aria-labelledby="condition">
      <h2 id="condition">${t("bus.condition")}
        <${BusState} bus=${bus} /></h2>
      <dl class="counters">
        <div><dt>${t("plant.load")}</dt><dd><${Meter} share=${(load ?? 0) / 100} warn=${0.8} /> ${quantity(load, "%")}</dd></div>
        <div><dt>${t("bus.bitrate")}</dt><dd>${quantity(bus.bitrate / 1000, "kbit/s")}</dd></div>
        ${COUNTERS.map((leaf) => html`<div><dt>${t(`bus.${leaf}`)}</dt><dd>${number(good(point(leaf)))}</dd></div>`)}
      </dl>
      ${good(point("last_error")) && html`<p><span class="label">${t("bus.last_error")}</span> ${words(point("last_error"))}</p>`}
      ${good(point("second_master")) && html`<p class="is-alarm"><${Icon} name="alarm" /> ${t("trouble.second_master")}</p>`}
      <${Strangers} point=${point} />
      ${good(point("passive")) && html`<p>${t("bus.gives_way")}</p>`}
    </section>
  `;
}

// An absence of foreign nodes is known only while the bus is watched.
function Strangers({ point }) {
  const found = STRANGERS.filter((leaf) => good(point(leaf)));
  const isKnown = isConnected.value && STRANGERS.every((leaf) => good(point(leaf)) !== null);
  if (!found.length) return isKnown ? html`<p class="quiet">${t("bus.no_strangers")}</p>` : null;
  return found.map((leaf) => html`<p class="is-alarm"><${Icon} name="alarm" /> <span class="label">${t(`bus.${leaf}`)}</span> ${words(point(leaf))}</p>`);
}
