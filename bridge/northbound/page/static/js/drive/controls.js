// Setpoints and commands for the owner of the drive; every user who may command at all may stop it.

import { html, useEffect, useRef } from "../ui.js";
import { leaveNow, leaving, stay, whileMoving } from "../leaving.js";
import { may } from "../session.js";
import { t, worded } from "../texts.js";
import { clock } from "../format.js";
import { told } from "../outcome.js";
import { ownState } from "../drivestate.js";
import { ownerOf } from "../owner.js";
import { sendTyped, Setpoints } from "./setpoints.js";
import { giveBack, isOurs, refusals, request, take } from "./ownership.js";

/** Nothing would be stopped: it stands, or is not heard, and then it is not enabled again without a new start. */
const NOT_STOPPED = ["not_ready", "switch_on_inhibited", "ready", "switched_on", "fault", "disabled", "lost"];

export function Controls({ drive }) {
  const name = drive.name;
  const isHeld = isOurs(name);
  const form = useRef(null);
  useEffect(() => () => giveBack(name), [name]);
  useEffect(() => whileMoving(() => isOurs(name) && !NOT_STOPPED.includes(ownState(name))), [name]);
  const takes = drive.control === "lease";
  return html`
    <section class="controls" aria-labelledby="controls">
      <h2 id="controls">${t("drive.control")}</h2>
      <p class="ownership">
        <span class="label">${t("plant.owner")}</span> <strong>${ownerOf(name)}</strong>
        ${may("operator") && takes && !isHeld && html`<button onClick=${() => take(name)}>${t("drive.take")}</button>`}
        ${isHeld && html`<button onClick=${() => giveBack(name)}>${t("drive.give_back")}</button>`}
      </p>
      ${!may("operator") && html`<p class="quiet">${t("drive.observer")}</p>`}
      ${may("operator") && !takes && html`<p class="quiet">${t("drive.fixed", { control: t(`control.${drive.control}`) })}</p>`}
      ${may("operator") && !isHeld && html`<p class="quiet"><${Stopping} drive=${drive} takes=${takes} /></p>`}
      ${isHeld && html`<p class="quiet">${t("drive.foreground")}</p>`}
      ${may("operator") && takes && html`<${Setpoints} drive=${drive} isHeld=${isHeld} form=${form} />`}
      ${may("operator") && html`<${Buttons} drive=${drive} isHeld=${isHeld} form=${form} />`}
      ${leaving.value && html`<${Leaving} drive=${name} />`}
      <${Refusal} drive=${name} />
    </section>
  `;
}

// It is no modal dialog: the buttons that stop the drive stay where they are, and its lease is renewed meanwhile.
function Leaving({ drive }) {
  const first = useRef(null);
  useEffect(() => first.current.focus(), []);
  return html`
    <div class="leaving" role="alertdialog" aria-labelledby="leaving">
      <p id="leaving">${t("drive.leaving", { name: drive })}</p>
      <p class="buttons"><button ref=${first} class="main" onClick=${stay}>${t("drive.stay")}</button>
        <button class="stop" onClick=${leaveNow}>${t("drive.leave")}</button></p>
    </div>
  `;
}

// True if this tab may stop a drive that is not its own.
function Stopping({ drive, takes }) {
  if (!drive.stop_by_anyone) return t("drive.stop_by_owner");
  return takes ? null : t("drive.stop_only");
}

function Buttons({ drive, isHeld, form }) {
  const does = (action) => () => request(drive.name, action);
  // A user who has typed a setpoint expects the start to use it.
  const starts = (direction) => async () => (await sendTyped(drive.name, form.current)) && request(drive.name, "start", { direction });
  const mayStop = isHeld || drive.stop_by_anyone;
  return html`
    <div class="buttons">
      <button class="main" disabled=${!isHeld} onClick=${starts(1)}>${t("action.start")}</button>
      <button disabled=${!isHeld} onClick=${starts(-1)}>${t("action.start_reverse")}</button>
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
  if (action === "hidden") return t("drive.was_hidden", { time: clock(outcome.at) });
  if (action === "cut_off") return t("drive.was_cut_off", { time: clock(outcome.at) });
  if (action === "keep_alive") return t("outcome.lost", { message: told(outcome) });
  const what = t(`action.${action}`);
  if (outcome.ok) return t("outcome.not_forwarded", { what, message: worded(outcome.text, outcome.message) });
  return t("outcome.refused", { what, message: told(outcome) });
}
