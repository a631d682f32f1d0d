// Requests to the server: each gives a value or a failure, never neither.

import { html, useEffect, useRef, useState } from "./ui.js";
import { maybe, onceWorded, t } from "./texts.js";

const LIMIT_MS = 30_000;

/** Result of one request: {value}, or {failure} in words. `read` makes the value of the answer.
 * @param {string} address
 * @param {{method?: string, headers?: any, body?: any, limitMs?: number, read?: (answer: Response) => Promise<any>}} options
 * @returns {Promise<{value?: any, failure?: string}>} */
export async function fetched(address, { limitMs = LIMIT_MS, read = (answer) => answer.json(), ...options } = {}) {
  try {
    const answer = await fetch(address, { ...options, signal: AbortSignal.timeout(limitMs) });
    return answer.ok ? { value: await read(answer) } : { failure: await reasonOf(answer) };
  } catch (error) {
    return { failure: error.name === "TimeoutError" ? t("fetched.late", { s: limitMs / 1000 }) : t("login.unreachable") };
  }
}

async function reasonOf(answer) {
  const { error, text } = await answer.json().catch(() => ({}));
  return maybe(`refusal.${error}`) || (await onceWorded(text, error)) || t("fetched.status", { status: answer.status });
}

/** {value, failure, isBusy, again} for the resource at `address`; requested again by `again`, and every `everyMs`. When a
 * new request fails, the old value stays beside the failure. */
export function useFetched(address, everyMs = 0) {
  const [state, setState] = useState({ isBusy: true });
  const turn = useRef(0);
  const load = async () => {
    const mine = ++turn.current;
    setState((before) => ({ ...before, isBusy: true }));
    const told = await fetched(address);
    if (mine === turn.current) setState((before) => ({ value: before.value, ...told, isBusy: false }));
  };
  useEffect(() => {
    setState({ isBusy: true });
    load();
    const timer = everyMs && setInterval(() => document.hidden || load(), everyMs);
    return () => {
      turn.current++;
      clearInterval(timer);
    };
  }, [address, everyMs]);
  return { ...state, again: load };
}

/** The failure with a button that tries once more; nothing while all is well. */
export function Failure({ told }) {
  if (!told.failure) return null;
  const key = told.value === undefined ? "fetched.failed" : "fetched.old";
  return html`
    <p class="failure"><span role="alert">${t(key, { why: told.failure })}</span>
      <button onClick=${told.again} disabled=${told.isBusy}>${t("fetched.again")}</button></p>
  `;
}
