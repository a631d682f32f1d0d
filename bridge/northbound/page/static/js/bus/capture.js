// Some seconds of a bus as a file.

import { html, useState } from "../ui.js";
import { save } from "../download.js";
import { fetched } from "../fetched.js";
import { siteName } from "../session.js";
import { t } from "../texts.js";
import { Icon } from "../icons.js";
import { NumberField, numbersIn } from "../numberfield.js";

const ENDINGS = { candump: "log", asc: "asc" };
const LIMITS = { unit: "s", low: 1, high: 60, isWhole: true };
const ANSWERS_S = 15;

// The server keeps as many frames as it has room for.
const taken = async (answer) => ({ text: await answer.text(), isCut: answer.headers.has("x-cut") });

export function Capture({ bus }) {
  const [state, setState] = useState({});
  const onSubmit = async (event) => {
    event.preventDefault();
    const numbers = numbersIn(event.target);
    if (!numbers) return;
    const { seconds } = numbers;
    const format = event.target.elements.format.value;
    setState({ busy: t("capture.runs", { seconds }) });
    const address = `api/bus/${encodeURIComponent(bus.name)}/capture?seconds=${seconds}&format=${format}`;
    const { value, failure } = await fetched(address, { limitMs: (seconds + ANSWERS_S) * 1000, read: taken });
    if (failure) return setState({ failure });
    save(`${siteName.value}-${bus.name}${value.isCut ? "-cut" : ""}.${ENDINGS[format]}`, value.text);
    setState(value.isCut ? { failure: t("capture.cut") } : {});
  };
  return html`
    <section class="panel" aria-labelledby="capture">
      <h2 id="capture">${t("capture.title")}</h2>
      <form class="search" onSubmit=${onSubmit}>
        <label for="seconds">${t("capture.seconds")}</label>
        <${NumberField} id="seconds" name="seconds" says="number.lasts" limits=${LIMITS} initial=${10} isRequired=${true} />
        <label for="format">${t("capture.format")}</label>
        <select id="format" name="format"><option value="candump">candump -L (.log)</option><option value="asc">Vector ASC (.asc)</option></select>
        <button disabled=${state.busy}><${Icon} name="download" /> ${t("capture.start")}</button>
        <small role="status">${state.busy ?? ""}</small>
      </form>
      ${state.failure && html`<p class="failure" role="alert">${state.failure}</p>`}
    </section>
  `;
}
