// A field for a number, read by the page itself in the page's language (numbers.js), and never by the browser in its own.
// It says in words what will be sent; an ambiguous number is refused, and one in the other language's notation is shown
// in this page's before it is sent.

import { html, useEffect, useRef, useState } from "./ui.js";
import { exact, inFull, range } from "./format.js";
import { readNumber } from "./numbers.js";
import { language, t } from "./texts.js";

/** Readers of the fields on the page, {read(), confirm()} by the field's element. */
const fields = new WeakMap();

/** `says` is the key of the text for what will be done with the number; `limits` are {unit, low, high, isWhole}, and
 * `initial` is a number. */
export function NumberField({ id, name, limits, says, initial = undefined, isRequired = false, isDisabled = false }) {
  const input = useRef(null);
  const beginning = typeof initial === "number" ? exact(initial) : "";
  const [text, setText] = useState(beginning);
  const [note, setNote] = useState("");
  const found = understood(text, limits);
  const follow = () => {
    setText(input.current.value);
    setNote("");
    input.current.setCustomValidity(understood(input.current.value, limits).failure ?? "");
  };
  // The drive's value may be read later than the field appears; a field without input then shows it.
  useEffect(follow, [beginning]);
  useEffect(() => {
    const { form } = input.current;
    const onReset = () => setTimeout(() => input.current && follow());
    form.addEventListener("reset", onReset);
    return () => form.removeEventListener("reset", onReset);
  }, []);
  useEffect(() => {
    input.current.setCustomValidity(found.failure ?? "");
    fields.set(input.current, {
      read: () => understood(input.current.value, limits),
      confirm: (one) => {
        const before = input.current.value.trim();
        input.current.value = exact(one.value);
        follow();
        setNote(t("number.confirm", { text: before, value: inFull(one.value, limits.unit) }));
      },
    });
  });
  return html`
    <input ref=${input} id=${id} name=${name} type="text" inputmode="decimal" autocomplete="off" spellcheck=${false} defaultValue=${beginning}
      onInput=${follow} required=${isRequired} disabled=${isDisabled} aria-invalid=${found.failure ? "true" : undefined} aria-describedby="${id}-echo" />
    <output id="${id}-echo" for=${id} class=${found.failure ? "echo failure" : "echo"}>${note || said(found, text, says, limits)}</output>
  `;
}

/** Numbers in `form` by the names of their fields, without empty ones. Null where nothing is to be sent: one was refused,
 * or is shown in this page's notation first. */
export function numbersIn(form) {
  if (!form.reportValidity()) return null;
  const values = {};
  let isConfirmed = true;
  for (const input of form.elements) {
    const found = input.disabled ? undefined : fields.get(input)?.read();
    if (!found || found.isEmpty) continue;
    if (found.failure) return null;
    if (found.isOther) {
      fields.get(input).confirm(found);
      isConfirmed = false;
    }
    values[input.name] = found.value;
  }
  return isConfirmed ? values : null;
}

/** Content of a field: {value, isOther}, {isEmpty} or {failure}.
 * @returns {{value?: number, isOther?: boolean, isEmpty?: boolean, failure?: string}} */
function understood(text, limits) {
  const found = readNumber(text, language.value);
  if (found.why === "empty") return { isEmpty: true };
  const shown = text.trim();
  if (found.readings) {
    const [large, small] = found.readings.map((one) => exact(one));
    return { failure: t("number.ambiguous", { text: shown, small, large }) };
  }
  if (found.why) return { failure: t(`number.${found.why}`, { text: shown, example: exact(2.5) }) };
  if (found.isHexadecimal && (limits.unit || !limits.isWhole)) return { failure: t("number.hexadecimal", { text: shown }) };
  if (limits.isWhole && !Number.isInteger(found.value)) return { failure: t("number.whole", { text: shown }) };
  const isInside = found.value >= (limits.low ?? -Infinity) && found.value <= (limits.high ?? Infinity);
  const { low, high, unit } = limits;
  if (!isInside) return { failure: t("number.out_of_range", { value: inFull(found.value, limits.unit), range: range(low, high, unit) }) };
  return found;
}

function said(found, text, says, limits) {
  if (found.isEmpty) return "";
  if (found.failure) return found.failure;
  const value = inFull(found.value, limits.unit);
  return found.isOther ? t("number.other", { text: text.trim(), value }) : t(says, { value });
}
