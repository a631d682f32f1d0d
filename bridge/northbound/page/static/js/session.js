// Who uses this tab, and what the site has.

import { signal } from "./ui.js";

/** `undefined` until the server has told; null where a login is needed; else {user, role, token}. */
export const session = signal(undefined);
/** What the site has, as /api/site tells it: {site, version, points, drives, …}. */
export const described = signal(null);
export const siteName = signal("");

const ROLES = ["observer", "operator", "engineer"];

/** Whether this tab's user has at least this role. */
export function may(role) {
  return Boolean(session.value) && ROLES.indexOf(session.value.role) >= ROLES.indexOf(role);
}

/** Ask the server who we are, and what there is to show. */
export async function begin() {
  const answer = await fetch("api/session");
  const told = await answer.json();
  if (told.site) siteName.value = told.site;
  await become(told.token ? told : null);
}

/** {} where it worked, else {error, pause_s}. */
export async function login(user, password) {
  const answer = await post("api/login", { user, password });
  const told = await answer.json();
  if (!answer.ok) return told;
  await become(told);
  return {};
}

export async function logout() {
  await post("api/logout", {});
  session.value = null;
  await begin();
}

/** The session has ended on the server. */
export function ended() {
  session.value = null;
}

async function become(told) {
  if (told) {
    const answer = await fetch("api/site");
    if (!answer.ok) return void (session.value = null);
    described.value = await answer.json();
    siteName.value = described.value.site;
  }
  session.value = told;
}

function post(path, body) {
  const headers = { "content-type": "application/json", "x-token": session.value?.token ?? "" };
  return fetch(path, { method: "POST", headers, body: JSON.stringify(body) });
}
