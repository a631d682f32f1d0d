// The setpoints of a drive in one form, which sends those that are filled in together: as one telegram.

import { html, useRef } from "../ui.js";
import { below, leafOf, nature } from "../site.js";
import { quality, reason } from "../values.js";
import { quantity } from "../format.js";
import { t } from "../texts.js";
import { good } from "../drivestate.js";
import { request } from "./ownership.js";

const WORDS = /^(control_word|setpoint_\d+)$/;

/** What may be set in numbers that mean something, the main setpoint first. */
function offered(drive) {
  const isOffered = (name) => {
    const { writable, type, unit, low, high } = nature(name);
    const isScaled = unit !== undefined || low !== undefined || high !== undefined;
    return writable && isScaled && type !== "bool" && type !== "string" && !WORDS.test(leafOf(name)) && quality(name) !== "disabled";
  };
  const isMain = (name) => leafOf(name) === drive.main;
  return below(`${drive.name}/command`).filter(isOffered).sort((one, other) => Number(isMain(other)) - Number(isMain(one)));
}

export function Setpoints({ drive, isHeld }) {
  const form = useRef();
  const names = offered(drive);
  if (!names.length) return null;
  const onSubmit = async (event) => {
    event.preventDefault();
    const values = filled(new FormData(form.current));
    if (!Object.keys(values).length) return form.current.querySelector("input").focus();
    const outcome = await request(drive.name, "write", { values });
    // What stands in a field is what the next sending sends.
    if (outcome.ok) form.current?.reset();
  };
  return html`
    <form class="setpoint" ref=${form} onSubmit=${onSubmit}>
      ${names.map((name) => html`<${Setpoint} key=${name} name=${name} isMain=${leafOf(name) === drive.main} isHeld=${isHeld} />`)}
      <button disabled=${!isHeld}>${t("drive.send")}</button>
    </form>
  `;
}

// {leaf: number} of the fields with a number in them.
function filled(fields) {
  const typed = [...fields].filter(([, text]) => String(text).trim() !== "").map(([leaf, text]) => [leaf, Number(text)]);
  return Object.fromEntries(typed.filter(([, number]) => Number.isFinite(number)));
}

function Setpoint({ name, isMain, isHeld }) {
  const { unit, low, high, type } = nature(name);
  const leaf = leafOf(name);
  const id = isMain ? "setpoint" : `setpoint-${leaf}`;
  const cannot = quality(name) === "config_error";
  return html`
    <p class="field">
      <label for=${id}>${t("drive.setpoint", { name: t(`point.${leaf}`) })}</label>
      <input id=${id} name=${leaf} type="number" step=${type === "float" ? "any" : 1} min=${low} max=${high} disabled=${!isHeld || cannot} />
      <span>${unit}</span>
      <small>${cannot ? reason(name) || t("quality.config_error") : t("drive.now", { value: quantity(good(name), unit) })}</small>
    </p>
  `;
}
