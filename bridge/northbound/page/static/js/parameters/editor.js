// Editor of one parameter, within its range, with the wear of the EEPROM that a write causes.

import { html, useState } from "../ui.js";
import { number } from "../format.js";
import { NumberField, numbersIn } from "../numberfield.js";
import { t, worded } from "../texts.js";
import { told } from "../outcome.js";
import { held, write } from "./held.js";
import { chosen, isChosen, isText, limitsOf, range, shown, statesOf } from "./value.js";

export function Editor({ holder, entry, described, onWritten }) {
  const [said, setSaid] = useState({ text: "" });
  const one = held(holder, entry.name).value;
  const onSubmit = async (event) => {
    event.preventDefault();
    if (said.isBusy) return; // a write costs the EEPROM one of its cycles
    const numbers = numbersIn(event.target);
    if (!numbers) return;
    const value = numbers.value ?? chosen(entry, event.target.elements.value.value);
    setSaid({ text: t("parameters.writing"), isBusy: true });
    const outcome = await write(holder, entry.name, value);
    setSaid(outcome.ok
      ? { text: worded(outcome.text, outcome.message) || t("parameters.written", { value: shown(entry, outcome.value) }) }
      : { isFailure: true, text: t("outcome.refused", { what: entry.name, message: told(outcome) }) });
    if (outcome.ok) onWritten();
  };
  return html`
    <form class="editor" onSubmit=${onSubmit}>
      <label for="value">${t("parameters.new_value", { name: entry.name })}</label>
      <${Field} entry=${entry} value=${one?.value} isBusy=${said.isBusy} /> ${entry.unit}
      <button class="main" disabled=${said.isBusy}>${t("parameters.write")}</button>
      <small>${range(entry)}</small>
      ${entry.states && !isChosen(entry) && html`<small>${Object.keys(entry.states).map((code) => shown(entry, Number(code))).join(", ")}</small>`}
      ${entry.factory !== undefined && html`<small>${t("parameters.factory_is", { value: shown(entry, entry.factory) })}</small>`}
      <small>${wear(entry, described)}</small>
      ${entry.protected && html`<p class="quiet">${t(`parameters.protected.${entry.protected}`)}</p>`}
      <p role="status" class=${said.isFailure ? "failure" : ""}>${said.text}</p>
    </form>
  `;
}

function Field({ entry, value, isBusy }) {
  if (isChosen(entry)) {
    const choices = statesOf(entry) ?? { true: "true", false: "false" };
    const isKnown = String(value) in choices;
    return html`<select id="value" name="value" required disabled=${isBusy}>
      ${!isKnown && html`<option value="" selected>${t("parameters.choose")}</option>`}
      ${Object.entries(choices).map(([code, text]) => html`
        <option value=${code} selected=${String(value) === code}>${entry.states ? `${code} (${text})` : text}</option>`)}</select>`;
  }
  if (isText(entry)) return html`<input id="value" name="value" required disabled=${isBusy} type="text" defaultValue=${value ?? ""} />`;
  return html`<${NumberField} id="value" name="value" says="number.writes" limits=${limitsOf(entry)} initial=${value} isRequired=${true} isDisabled=${isBusy} />`;
}

// Wear that a write causes.
function wear(entry, described) {
  if (entry.command) return t("parameters.wear.command");
  if (entry.volatile) return t("parameters.wear.volatile");
  if (!described.cycles) return t("parameters.wear.unknown");
  if (described.on_save_only) return t("parameters.wear.on_save");
  return t("parameters.wear", { writes: number(entry.writes ?? 0), cycles: number(described.cycles) });
}
