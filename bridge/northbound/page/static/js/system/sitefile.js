// Site file as it lies on the box, without its secrets, and the findings of its check.

import { html } from "../ui.js";
import { many, t, worded } from "../texts.js";
import { Failure, useFetched } from "../fetched.js";
import { Icon } from "../icons.js";

export function SiteFile() {
  const told = useFetched("api/system/site");
  const file = told.value;
  return html`
    <section class="panel" aria-labelledby="sitefile"><h2 id="sitefile">${t("system.site_file")}</h2>
      <p class="search">${file && html`<code>${file.path}</code>`}
        <button onClick=${told.again} disabled=${told.isBusy}>${t(told.isBusy ? "system.checking" : "system.check")}</button>
        ${file && !told.failure && html`<strong role="status">${file.findings.length ? many("system.findings", file.findings.length) : t("system.no_findings")}</strong>`}</p>
      <${Failure} told=${told} />
      ${file?.changed && html`<p class="is-warning"><${Icon} name="warning" /> ${t("system.changed")}</p>`}
      ${file && html`<ul class="findings">${file.findings.map((one) => html`<li class=${one.severity === "error" ? "is-alarm" : "is-warning"}>
        <${Icon} name=${one.severity === "error" ? "alarm" : "warning"} /> <span>${worded(one.text, one.message)}</span></li>`)}</ul>
        <details><summary>${t("system.text")}</summary>
          <pre class="file" tabindex="0"><code>${lines(file.text, file.findings)}</code></pre></details>`}
    </section>
  `;
}

function lines(text, findings) {
  const marked = new Set(findings.map((one) => one.line));
  return text.split("\n").map((line, place) => html`<span class=${marked.has(place + 1) ? "marked" : ""}><i>${String(place + 1).padStart(4)}</i> ${line}${"\n"}</span>`);
}
