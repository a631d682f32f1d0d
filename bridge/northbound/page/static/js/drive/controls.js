// Setpoints and commands, for who controls the drive; stopping is everybody's who may command at all.

import { html, useEffect, useRef } from "../ui.js";
import { may } from "../session.js";
import { nature } from "../site.js";
import { value } from "../values.js";
import { quantity } from "../format.js";
import { t } from "../texts.js";
import { ownerName } from "../owner.js";
import { giveBack, isOurs, refusals, request, take } from "./ownership.js";

export function Controls({ drive }) {
  const name = drive.name;
  const isHeld = isOurs(name);
  useEffect(() => () => giveBack(name), [name]);
  const takes = drive.control === "lease";
  return html`
    <section class="controls" aria-labelledby="controls">
      <h2 id="controls">${t("drive.control")}</h2>
      <p class="ownership">
        <span class="label">${t("plant.owner")}</span> <strong>${ownerName(value(`${name}/supervision/owner`))}</strong>
        ${may("operator") && takes && !isHeld && html`<button onClick=${() => take(name)}>${t("drive.take")}</button>`}
        ${isHeld && html`<button onClick=${() => giveBack(name)}>${t("drive.give_back")}</button>`}
      </p>
      ${!may("operator") && html`<p class="quiet">${t("drive.observer")}</p>`}
      ${may("operator") && !takes && html`<p class="quiet">${t("drive.fixed", { control: t(`control.${drive.control}`) })}</p>`}
      ${isHeld && html`<p class="quiet">${t("drive.foreground")}</p>`}
      ${may("operator") && takes && html`<${Setpoint} drive=${drive} isHeld=${isHeld} />`}
      ${may("operator") && html`<${Buttons} drive=${drive} isHeld=${isHeld} />`}
      <${Refusal} drive=${name} />
    </section>
  `;
}

function Setpoint({ drive, isHeld }) {
  const field = useRef();
  if (!drive.main) return null;
  const point = `${drive.name}/command/${drive.main}`;
  const { unit, low, high } = nature(point);
  const onSubmit = (event) => {
    event.preventDefault();
    request(drive.name, "write", { values: { [drive.main]: Number(field.current.value) } });
  };
  return html`
    <form class="setpoint" onSubmit=${onSubmit}>
      <label for="setpoint">${t("drive.setpoint", { name: t(`point.${drive.main}`) })}</label>
      <input id="setpoint" ref=${field} type="number" step="any" min=${low} max=${high} required disabled=${!isHeld}
        placeholder=${value(point) ?? ""} /> ${unit}
      <button disabled=${!isHeld}>${t("drive.send")}</button>
      <small>${t("drive.now", { value: quantity(value(point), unit) })}</small>
    </form>
  `;
}

function Buttons({ drive, isHeld }) {
  const does = (action, fields) => () => request(drive.name, action, fields);
  const mayStop = isHeld || drive.stop_by_anyone;
  return html`
    <div class="buttons">
      <button class="main" disabled=${!isHeld} onClick=${does("start", { direction: 1 })}>${t("action.start")}</button>
      <button disabled=${!isHeld} onClick=${does("start", { direction: -1 })}>${t("action.start_reverse")}</button>
      <button class="stop" disabled=${!mayStop} onClick=${does("stop")}>${t("action.stop")}</button>
      <button class="stop" disabled=${!mayStop} onClick=${does("quick_stop")}>${t("action.quick_stop")}</button>
      <button disabled=${!mayStop} onClick=${does("disable_voltage")}>${t("action.disable_voltage")}</button>
      <button disabled=${!isHeld} onClick=${does("reset_fault")}>${t("action.reset_fault")}</button>
    </div>
  `;
}

function Refusal({ drive }) {
  const refused = refusals.value[drive];
  return html`<p class="failure" role="alert">${refused ? text(refused) : ""}</p>`;
}

function text({ action, outcome }) {
  const what = t(`action.${action}`);
  if (outcome.ok) return t("outcome.not_forwarded", { what, message: outcome.message });
  return t("outcome.refused", { what, message: outcome.message || t(`outcome.${outcome.code}`) });
}
