// A button that copies a text.

import { html, useState } from "./ui.js";
import { t } from "./texts.js";

const SHOWN_MS = 1500;

export function Copy({ text }) {
  const [isDone, setDone] = useState(false);
  const onClick = async () => {
    if (!(await copy(text))) return;
    setDone(true);
    setTimeout(() => setDone(false), SHOWN_MS);
  };
  return html`<button class="copy" onClick=${onClick}>
    <span aria-live="polite">${t(isDone ? "integration.copied" : "integration.copy")}</span> <span class="hidden">${text}</span></button>`;
}

// Browsers have a clipboard for pages by TLS or on loopback; elsewhere a field is selected and copied from.
async function copy(text) {
  if (navigator.clipboard) return navigator.clipboard.writeText(text).then(() => true, () => false);
  const field = document.createElement("textarea");
  field.value = text;
  document.body.append(field);
  field.select();
  const isDone = document.execCommand("copy");
  field.remove();
  return isDone;
}
