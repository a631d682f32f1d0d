// PDOs drawn as bytes, with the meaning of their bits.

import { html } from "../ui.js";
import { t } from "../texts.js";

const BIT = 10;
const HIGH = 44;

export function Layout({ nodes }) {
  return html`
    <section class="panel" aria-labelledby="layout">
      <h2 id="layout">${t("layout.title")}</h2>
      <p class="quiet">${t("layout.as_in_mapping")}</p>
      ${nodes.map((node) => html`<details key=${node.name} open=${nodes.length < 3}>
        <summary>${node.name} <small>${t("plant.node", { id: node.id })}, ${node.pdos.length} PDO</small></summary>
        ${node.pdos.map((pdo) => html`<${Pdo} key=${pdo.label} pdo=${pdo} />`)}
      </details>`)}
    </section>
  `;
}

function Pdo({ pdo }) {
  const bits = pdo.bytes * 8;
  const said = pdo.parts.map((part) => `${part.name}: ${t("layout.bits", { first: part.from, last: part.from + part.bits - 1 })}`).join("; ");
  return html`
    <figure class="pdo">
      <figcaption><strong>${pdo.label}</strong> <code>${pdo.cob_id}h</code></figcaption>
      <div class="scroll" tabindex="0" role="group" aria-label=${pdo.label}>
        <svg viewBox=${`0 0 ${64 * BIT} ${HIGH + 14}`} role="img" aria-label=${said}>
          ${Array.from({ length: pdo.bytes }, (_, byte) => html`<g class="byte">
            <rect x=${byte * 8 * BIT} y="0" width=${8 * BIT} height=${HIGH} />
            <text x=${byte * 8 * BIT + 4 * BIT} y=${HIGH + 11}>${t("layout.byte", { byte })}</text></g>`)}
          ${pdo.parts.filter((part) => part.from < bits).map((part) => html`<g class="part">
            <rect x=${part.from * BIT + 1} y="1" width=${part.bits * BIT - 2} height=${HIGH - 2} />
            <text x=${(part.from + part.bits / 2) * BIT} y=${part.carries ? 17 : 26}>${cut(part.name, part.bits)}</text>
            ${part.carries && html`<text class="carried" x=${(part.from + part.bits / 2) * BIT} y="34">${cut(part.carries.join(", "), part.bits)}</text>`}</g>`)}
        </svg>
      </div>
    </figure>
  `;
}

// The text as far as there is room for it.
function cut(text, bits) {
  const most = Math.max(1, Math.floor((bits * BIT) / 6.4));
  return text.length > most ? `${text.slice(0, most - 1)}…` : text;
}
