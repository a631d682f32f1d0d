// Focus of keyboard and screen reader in a page whose parts are exchanged.

/** Moves the focus to the page's own part. The address stays: it is the route of the page. */
export function toMain(event) {
  event?.preventDefault();
  document.getElementById("main")?.focus();
}

let isFirst = true;

/** Scrolls to the top of a newly shown page; the focus goes there, too, where a link was followed. */
export function onRoute() {
  if (isFirst) return void (isFirst = false);
  scrollTo(0, 0);
  const focused = document.activeElement;
  if (!focused || focused === document.body || focused.closest("a")) document.getElementById("main")?.focus({ preventScroll: true });
}
