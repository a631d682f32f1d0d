// The setpoints of a drive in one form, which sends those that are filled in together: as one telegram.

import { html, useState } from "../ui.js";
import { below, leafOf, nature } from "../site.js";
import { quality } from "../values.js";
import { quantity, range } from "../format.js";
import { NumberField, numbersIn } from "../numberfield.js";
import { t } from "../texts.js";
import { good } from "../drivestate.js";
import { limitsOf } from "./limits.js";
import { request } from "./ownership.js";
import { why } from "../words.js";

const WORDS = /^(control_word|setpoint_\d+)$/;

/** Setpoints with a unit, the main setpoint first. */
function offered(drive) {
  const isOffered = (name) => {
    const { writable, type, unit, low, high } = nature(name);
    const isScaled = unit !== undefined || low !== undefined || high !== undefined;
    return writable && isScaled && type !== "bool" && type !== "string" && !WORDS.test(leafOf(name)) && quality(name) !== "disabled";
  };
  const isMain = (name) => leafOf(name) === drive.main;
  return below(`${drive.name}/command`).filter(isOffered).sort((one, other) => Number(isMain(other)) - Number(isMain(one)));
}

/** `form` is a reference, so that a start can send what is typed. */
export function Setpoints({ drive, isHeld, form }) {
  const [said, setSaid] = useState("");
  const names = offered(drive);
  if (!names.length) return null;
  const onSubmit = async (event) => {
    event.preventDefault();
    const values = numbersIn(form.current);
    if (!values || Object.keys(values).length) return values && send(drive.name, form.current, values);
    setSaid(t("drive.nothing_to_send"));
    form.current.querySelector("input:enabled")?.focus();
  };
  return html`
    <form class="setpoint" ref=${form} onSubmit=${onSubmit} onInput=${() => setSaid("")}>
      ${names.map((name) => html`<${Setpoint} key=${name} drive=${drive} name=${name} isMain=${leafOf(name) === drive.main} isHeld=${isHeld} />`)}
      <button disabled=${!isHeld}>${t("drive.send")}</button>
      <small role="status">${said}</small>
    </form>
  `;
}

/** Sends the setpoints typed in `form`, if any. Returns true where none was refused. */
export async function sendTyped(drive, form) {
  if (!form) return true;
  const values = numbersIn(form);
  if (!values) return false;
  return Object.keys(values).length ? send(drive, form, values) : true;
}

async function send(drive, form, values) {
  const outcome = await request(drive, "write", { values });
  // The next telegram carries what stands in the fields.
  if (outcome.ok) form.reset();
  return outcome.ok;
}

function Setpoint({ drive, name, isMain, isHeld }) {
  const { unit, type } = nature(name);
  const { low, high } = limitsOf(drive, name);
  const leaf = leafOf(name);
  const id = isMain ? "setpoint" : `setpoint-${leaf}`;
  const cannot = quality(name) === "config_error";
  return html`
    <p class="field">
      <label for=${id}>${t("drive.setpoint", { name: t(`point.${leaf}`) })}</label>
      <${NumberField} id=${id} name=${leaf} says="number.sends" limits=${{ unit, low, high, isWhole: type !== "float" }} isDisabled=${!isHeld || cannot} />
      <small>${range(low, high, unit)}<br />${cannot ? why(name) || t("quality.config_error") : t("drive.sent", { value: quantity(good(name), unit) })}</small>
    </p>
  `;
}
