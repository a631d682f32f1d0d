// Question before a page is left on which this tab moves a drive: leaving gives the drive back, and it stops.

import { signal } from "./ui.js";

/** Step that waits for the reader's answer: {go()}, or null. */
export const leaving = signal(null);
let isMoving = () => false;

/** Registers `test`, true while leaving would stop a drive. The function returned withdraws it. */
export function whileMoving(test) {
  isMoving = test;
  return () => {
    isMoving = () => false;
    leaving.value = null;
  };
}

/** Calls `go` at once where that stops nothing, else when the reader has agreed. */
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
