// Asks before a page is left on which this tab moves a drive: who leaves it gives the drive back, and it stops.

import { signal } from "./ui.js";

/** What waits for the reader's answer: {go()}, or null. */
export const leaving = signal(null);
let isMoving = () => false;

/** From now on `test` says whether leaving would stop a drive; until the function that is returned is called. */
export function whileMoving(test) {
  isMoving = test;
  return () => {
    isMoving = () => false;
    leaving.value = null;
  };
}

/** Does `go` at once where that stops nothing, else when the reader has agreed. */
export function leaveBy(go) {
  if (!isMoving()) return void go();
  leaving.value = { go };
}

export function stay() {
  leaving.value = null;
}

export function leaveNow() {
  const { go } = leaving.value;
  leaving.value = null;
  go();
}
