// User of this tab, and the description of the site.

import { signal } from "./ui.js";

/** Session: `undefined` until the server has answered; null where a login is needed; else {user, role, token, has_users}. */
export const session = signal(undefined);
/** Description of the site, from /api/site: {site, buses, nodes, drives, places, natures}. */
export const described = signal(null);
export const siteName = signal("");
/** True if the site lets people read without a login. */
export const hasVisitors = signal(false);

const RETRY_MS = 1000;
const ROLES = ["observer", "operator", "engineer", "admin"];

/** True if this tab's user has at least this role. */
export function may(role) {
  return Boolean(session.value) && ROLES.indexOf(session.value.role) >= ROLES.indexOf(role);
}

/** Asks the server for the session and the site; again and again while it does not answer. */
export async function begin() {
  const answer = await fetch("api/session").catch(() => null);
  const told = await answer?.json().catch(() => null);
  if (!told) return void setTimeout(begin, RETRY_MS); // it is being started again
  if (told.site) siteName.value = told.site;
  hasVisitors.value = answer.ok ? hasVisitors.value || !told.user : false;
  await become(told.token ? told : null);
}

/** Logs in. {} where it worked, else {error, pause_s}. */
export async function login(user, password) {
  const answer = await post("api/login", { user, password });
  const told = await answer.json();
  if (!answer.ok) return told;
  await become(told);
  return {};
}

export async function logout() {
  await post("api/logout", {}).catch(() => null); // a server that is gone has no session of ours either
  session.value = null;
  await begin();
}

/** The session has ended on the server: a visitor gets another, all others log in again. */
export function ended() {
  session.value = null;
  begin();
}

async function become(told) {
  if (told) {
    const answer = await fetch("api/site").catch(() => null);
    const site = answer?.ok ? await answer.json() : null;
    if (!site) return void setTimeout(begin, RETRY_MS);
    described.value = site;
    siteName.value = site.site;
  }
  session.value = told;
}

function post(path, body) {
  const headers = { "content-type": "application/json", "x-token": session.value?.token ?? "" };
  return fetch(path, { method: "POST", headers, body: JSON.stringify(body) });
}
