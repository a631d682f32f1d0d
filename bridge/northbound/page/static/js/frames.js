// Schedule of drawing: one job a frame, each at the frame's beginning.
//
// A browser that is idle begins a frame as soon as one is asked for. Where that is shortly before the screen is due,
// the frame comes late. So while values come it is kept from being idle, by frames in which nothing is drawn.

const AWAKE_MS = 300;
const jobs = [];
let awakeUntil = 0;
let isAwake = false;

/** Calls `job` in a frame of its own, in the order in which they were given. */
export function inOwnFrame(job) {
  jobs.push(job);
  awakeUntil = performance.now() + AWAKE_MS;
  if (isAwake) return;
  isAwake = true;
  requestAnimationFrame(() => requestAnimationFrame(onFrame));
}

function onFrame() {
  const job = jobs.shift();
  isAwake = jobs.length > 0 || performance.now() < awakeUntil;
  if (isAwake) requestAnimationFrame(onFrame);
  job?.();
}
