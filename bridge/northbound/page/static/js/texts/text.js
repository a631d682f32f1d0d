// Texts of the bridge in words: a code with facts fills the template that has this code, as bridge/text/templates.py
// does it. The facts of a text may be texts themselves.

const JOINED_BY = ", ";
const PIECE = /\{\{|\}\}|\{(\w+)(!r)?(?::([^}]*))?\}/g;

/** `text`, {code, facts}, by `templates`, a mapping of codes. */
export function rendered(text, templates) {
  return templates[text.code].replace(PIECE, (piece, name, quoted, format) => {
    if (!name) return piece[0];
    return shown(text.facts[name], quoted, format, (one) => rendered(one, templates));
  });
}

/** True if `text` and the texts among its facts have templates: a tab may be older than the bridge that it shows. */
export function isKnown(text, templates) {
  if (!(text.code in templates)) return false;
  const texts = Object.values(text.facts).flat().filter((fact) => typeof fact === "object");
  return texts.every((one) => isKnown(one, templates));
}

function shown(fact, quoted, format, words) {
  if (Array.isArray(fact)) return fact.map((one) => (typeof one === "string" ? one : words(one))).join(format || JOINED_BY);
  if (typeof fact === "object") return words(fact);
  if (typeof fact === "string") return quoted ? inQuotes(fact) : fact;
  return format ? formatted(fact, format) : String(fact);
}

// A text quoted as Python's `repr` quotes it.
function inQuotes(text) {
  const mark = text.includes("'") && !text.includes('"') ? '"' : "'";
  return mark + text.replaceAll("\\", "\\\\").replaceAll(mark, `\\${mark}`).replaceAll("\n", "\\n") + mark;
}

/** `number` in a format of Python's: decimals (".1f"), six digits or so many ("g", ".3g"), hexadecimal ("04X"). */
export function formatted(number, format) {
  const [, decimals] = /^\.(\d+)f$/.exec(format) ?? [];
  if (decimals) return fixed(number, Number(decimals));
  const general = /^(?:\.(\d+))?g$/.exec(format);
  if (general) return inDigits(number, Number(general[1] ?? 6));
  const [, width] = /^0?(\d*)X$/.exec(format) ?? [];
  if (width !== undefined) return number.toString(16).toUpperCase().padStart(Number(width), "0");
  return String(number);
}

// A number that lies exactly between two goes to the even one.
function fixed(number, decimals) {
  if (number < 0) return `-${fixed(-number, decimals)}`;
  const halves = number * 2 ** (decimals + 1);
  const scaled = number * 10 ** decimals;
  if (Number.isInteger(halves) && Math.abs(scaled % 1) === 0.5) return (2 * Math.round(scaled / 2) / 10 ** decimals).toFixed(decimals);
  return number.toFixed(decimals);
}

function inDigits(number, most) {
  const [digits, power] = number.toExponential(most - 1).split("e");
  if (Number(power) >= -4 && Number(power) < most) return String(Number(number.toPrecision(most)));
  return `${Number(digits)}e${power[0]}${power.slice(1).padStart(2, "0")}`;
}
