// Control word and status word, bit by bit.

import { classes, html } from "../ui.js";
import { has, nature } from "../site.js";
import { word } from "../format.js";
import { maybe, t } from "../texts.js";
import { good } from "../drivestate.js";

export function Bits({ drive }) {
  const sent = `${drive.name}/supervision/sent_control_word`;
  const own = `${drive.name}/status/drive_status_word`;
  return html`
    <section class="words" aria-label=${t("drive.words")}>
      <${Word} title=${t("drive.control_word")} point=${sent} bits=${bitsOf(`${drive.name}/command/control_word`, sent)} />
      <${Word} title=${t("drive.status_word")} point=${own} bits=${bitsOf(`${drive.name}/status/status_word`, own)} />
    </section>
  `;
}

const bitsOf = (...points) => points.map((name) => nature(name).bits).find(Boolean) ?? [];

function Word({ title, point, bits }) {
  if (!has(point)) return null;
  const present = good(point);
  return html`
    <table class="bits">
      <caption>${title} <code>${word(present)}</code></caption>
      <thead><tr>${["bit", "name", "value"].map((name) => html`<th scope="col">${t(`bits.${name}`)}</th>`)}</tr></thead>
      <tbody>
        ${bits.map((name, bit) => {
          if (!name) return null;
          const isSet = present !== null && Boolean(present & (1 << bit));
          return html`
            <tr class=${classes({ set: isSet })}>
              <td class="bit">${bit}</td>
              <th scope="row">${maybe(`bit.${name}`) || name.replaceAll("_", " ")}</th>
              <td class="is">${present === null ? "–" : isSet ? "1" : "0"}</td>
            </tr>
          `;
        })}
      </tbody>
    </table>
  `;
}
