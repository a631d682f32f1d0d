// Certificates and how long they are valid; an administrator decides which OPC UA clients are trusted.

import { classes, html, useEffect, useRef, useState } from "../ui.js";
import { may, session } from "../session.js";
import { language, many, maybe, t, worded } from "../texts.js";
import { fetched } from "../fetched.js";
import { Icon } from "../icons.js";

const DAY_MS = 86_400_000;
const SOON_DAYS = 30;
/** What can be decided on a certificate, by the folder that holds it. */
const DECISIONS = { rejected: "trust", trusted: "reject" };
const COLUMNS = ["of", "subject", "valid_from", "until", "fingerprint"];

export function Certificates({ certificates, trustsAnybody, again }) {
  const [asked, setAsked] = useState(null);
  const [said, setSaid] = useState({ text: "" });
  const onAsk = (decision, one) => (setSaid({ text: "" }), setAsked({ decision, one }));
  const onDecided = (outcome) => (setAsked(null), setSaid(outcome), again());
  const isAdmin = may("admin");
  return html`
    <section class="panel" aria-labelledby="certificates"><h2 id="certificates">${t("system.certificates")}</h2>
      ${trustsAnybody && html`<p class="is-warning"><${Icon} name="warning" /> <span>${t("certificate.anybody")}</span></p>`}
      ${asked && html`<${Question} key=${asked.one.thumbprint} asked=${asked} onCancel=${() => setAsked(null)} onDecided=${onDecided} />`}
      <p role="status" class=${said.isFailure ? "failure" : "quiet"}>${said.text}</p>
      ${certificates.length === 0 && html`<p class="quiet">${t("system.no_certificates")}</p>`}
      ${certificates.length > 0 && html`<div class="scroll" tabindex="0" role="group" aria-label=${t("system.certificates")}><table class="rows">
        <thead><tr>${[...COLUMNS, ...(isAdmin ? ["decision"] : [])].map((name) => html`<th scope="col">${t(`system.${name}`)}</th>`)}</tr></thead>
        <tbody>${certificates.map((one) => html`<${Row} key=${`${one.of} ${one.fingerprint}`} one=${one} isAdmin=${isAdmin} onAsk=${onAsk} />`)}</tbody>
      </table></div>`}
    </section>
  `;
}

function Row({ one, isAdmin, onAsk }) {
  const decision = DECISIONS[one.of];
  const label = decision && t(`certificate.${decision}_one`, { subject: one.subject });
  return html`
    <tr>
      <td>${maybe(`certificate.${one.of}`) || one.of}</td>
      <td>${one.subject}${one.wrong && html`<${Wrong} one=${one} isAdmin=${isAdmin} />`}</td>
      <td class="until">${day(one.since)}</td><td><${Until} until=${one.until * 1000} /></td>
      <td class="fingerprint"><code>${one.fingerprint}</code><br /><small>SHA-1 <code>${one.thumbprint}</code></small></td>
      ${isAdmin && html`<td>${decision && html`<button aria-label=${label} onClick=${() => onAsk(decision, one)}>${t(`certificate.${decision}`)}</button>`}</td>`}
    </tr>
  `;
}

// Whoever may not decide here needs somebody who may write on the box, and the command.
function Wrong({ one, isAdmin }) {
  return html`<br /><strong class="is-warning">${worded(one.wrong.text, one.wrong.message)}</strong>
    ${one.of === "rejected" && !isAdmin && html`<br /><code>drivebridge certificates trust SITE ${one.thumbprint}</code>`}`;
}

// Rows move while strangers come: what is agreed to is one certificate by its name, and no place on the screen.
function Question({ asked, onCancel, onDecided }) {
  const { decision, one } = asked;
  const cancel = useRef(null);
  const [isBusy, setBusy] = useState(false);
  useEffect(() => cancel.current.focus(), []);
  const onAgreed = async () => {
    setBusy(true);
    const { failure } = await decide(decision, one.thumbprint);
    onDecided(failure
      ? { isFailure: true, text: t("outcome.refused", { what: one.subject, message: failure }) }
      : { text: t(`certificate.${decision}_done`, { subject: one.subject }) });
  };
  return html`
    <div class="leaving" role="alertdialog" aria-labelledby="question">
      <p id="question">${t(`certificate.${decision}_question`, { subject: one.subject })}</p>
      <p class="fingerprint">SHA-256 <code>${one.fingerprint}</code><br />SHA-1 <code>${one.thumbprint}</code></p>
      <p class="buttons"><button ref=${cancel} disabled=${isBusy} onClick=${onCancel}>${t("certificate.cancel")}</button>
        <button class="main" disabled=${isBusy} onClick=${onAgreed}>${t(`certificate.${decision}`)}</button></p>
    </div>
  `;
}

function decide(decision, thumbprint) {
  const headers = { "content-type": "application/json", "x-token": session.value?.token ?? "" };
  return fetched(`api/certificates/${decision}`, { method: "POST", headers, body: JSON.stringify({ thumbprint }) });
}

function day(seconds) {
  return new Date(seconds * 1000).toLocaleDateString(language.value, { dateStyle: "medium" });
}

function Until({ until }) {
  const days = Math.floor((until - Date.now()) / DAY_MS);
  const left = days < 0 ? t("system.expired") : many("system.days", days);
  return html`<span class="until">${day(until / 1000)}<br />
    <strong class=${classes({ "is-alarm": days < 0, "is-warning": days >= 0 && days < SOON_DAYS, plainly: days >= SOON_DAYS })}>${left}</strong></span>`;
}
