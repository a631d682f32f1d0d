// Where the keyboard and a screen reader are, in a page whose parts are exchanged.

/** To the page's own part. The address stays as it is: it says which page is shown. */
export function toMain(event) {
  event?.preventDefault();
  document.getElementById("main")?.focus();
}

let isFirst = true;

/** Another page is shown: it begins at its top, and whoever came by a link is there with the keyboard, too. */
export function onRoute() {
  if (isFirst) return void (isFirst = false);
  scrollTo(0, 0);
  const focused = document.activeElement;
  if (!focused || focused === document.body || focused.closest("a")) document.getElementById("main")?.focus({ preventScroll: true });
}
