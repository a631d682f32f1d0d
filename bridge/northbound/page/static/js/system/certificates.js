// Certificates and how long they are valid.

import { classes, html } from "../ui.js";
import { language, many, maybe, t, worded } from "../texts.js";

const DAY_MS = 86_400_000;
const SOON_DAYS = 30;

export function Certificates({ certificates }) {
  return html`
    <section class="panel" aria-labelledby="certificates"><h2 id="certificates">${t("system.certificates")}</h2>
      ${certificates.length === 0 && html`<p class="quiet">${t("system.no_certificates")}</p>`}
      ${certificates.length > 0 && html`<div class="scroll" tabindex="0" role="group" aria-label=${t("system.certificates")}><table class="rows">
        <thead><tr>${["of", "subject", "until", "fingerprint"].map((name) => html`<th scope="col">${t(`system.${name}`)}</th>`)}</tr></thead>
        <tbody>${certificates.map((one) => html`<tr>
          <td>${maybe(`certificate.${one.of}`) || one.of}</td><td>${one.subject}${one.wrong && html`<${Refused} one=${one} />`}</td><td><${Until} until=${one.until * 1000} /></td><td class="fingerprint"><code>${one.fingerprint}</code></td></tr>`)}</tbody>
      </table></div>`}
    </section>
  `;
}

// Trusting is for whoever may write on the box: a session of the page is none of those.
function Refused({ one }) {
  return html`<br /><strong class="is-warning">${worded(one.wrong.text, one.wrong.message)}</strong><br /><code>drivebridge certificates trust SITE ${one.thumbprint}</code>`;
}

function Until({ until }) {
  const days = Math.floor((until - Date.now()) / DAY_MS);
  const left = days < 0 ? t("system.expired") : many("system.days", days);
  return html`<span class="until">${new Date(until).toLocaleDateString(language.value, { dateStyle: "medium" })}<br />
    <strong class=${classes({ "is-alarm": days < 0, "is-warning": days >= 0 && days < SOON_DAYS, plainly: days >= SOON_DAYS })}>${left}</strong></span>`;
}
