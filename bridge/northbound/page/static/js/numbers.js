// Numbers as people type them, by the grammar of docs/reference/numbers.md. bridge/parameter/number_text.py is the same
// in Python; tests/support/number_cases.json holds both to it. It imports nothing: a test runs it without a browser.
//
// The language of the page decides between what two languages read differently: in English 1.500 is one and a half, and
// in German it may be fifteen hundred.

const BLANKS = /^[ \t\u00a0\u2009\u202f]+|[ \t\u00a0\u2009\u202f]+$/g;
/** Characters: no number that a drive holds has more. */
const MOST = 60;
const OTHER = { en: "de", de: "en" };
const PLAIN = { en: plain("\\.", ","), de: plain(",", "\\.") };

// A number without sign and exponent: groups, blanks as groups, or digits, and decimals.
function plain(mark, group) {
  const blanks = "[1-9][0-9]{0,2}(?<blank>[ \u00a0\u2009\u202f])[0-9]{3}(?:\\k<blank>[0-9]{3})*";
  const groups = `[1-9][0-9]{0,2}(?:${group}[0-9]{3})+`;
  return new RegExp(`^(?=.*[0-9])(?<whole>(?<groups>${groups})|${blanks}|[0-9]*)(?:${mark}(?<decimals>[0-9]+))?$`);
}

/** The number in `text` as it is written in `language`: {value, isOther, isHexadecimal}, `isOther` where it is in the
 * notation of the other language. Or {why, readings}: "empty", "no_number", "other_digits", "too_large", or "ambiguous"
 * with the two numbers that it may mean.
 * @returns {{value?: number, isOther?: boolean, isHexadecimal?: boolean, why?: string, readings?: number[]}} */
export function readNumber(text, language) {
  const bare = text.replace(BLANKS, "");
  if (!bare) return { why: "empty" };
  if (/\p{Nd}/u.test(bare.replace(/[0-9]/g, ""))) return { why: "other_digits" };
  if ([...bare].length > MOST) return { why: /^[0-9]+$/.test(bare) ? "too_large" : "no_number" };
  const [, sign, magnitude] = /^([-+\u2212]?)(.*)$/s.exec(bare);
  const minus = sign === "-" || sign === "\u2212" ? "-" : "";
  const hexadecimal = /^(?:0x([0-9a-f]+)|([0-9][0-9a-f]*)h)$/i.exec(magnitude);
  if (hexadecimal) return { isHexadecimal: true, ...kept(minus, `0x${hexadecimal[1] ?? hexadecimal[2]}`) };
  const own = read(magnitude, language);
  const other = read(magnitude, OTHER[language]);
  if (!own && !other) return { why: "no_number" };
  if (!own) return { isOther: true, ...kept(minus, other.text) };
  // A group of three behind the other language's decimal mark.
  if (other && own.hasGroups && own.text !== other.text) {
    return { why: "ambiguous", readings: [own, other].map((one) => kept(minus, one.text).value) };
  }
  return kept(minus, own.text);
}

function read(magnitude, language) {
  const [, mantissa, exponent] = /^(.*?)(?:e([-+\u2212]?[0-9]{1,3}))?$/is.exec(magnitude);
  const found = PLAIN[language].exec(mantissa)?.groups;
  if (!found) return null;
  const decimals = found.decimals ? `.${found.decimals}` : "";
  const power = exponent ? `e${exponent.replace("\u2212", "-")}` : "";
  return { text: `${found.whole.replace(/[^0-9]/g, "") || "0"}${decimals}${power}`, hasGroups: found.groups !== undefined };
}

// A whole number that a browser cannot keep digit by digit is none.
function kept(minus, text) {
  const value = Number(text);
  const isWhole = /^(0x[0-9a-f]+|[0-9]+)$/i.test(text);
  if (!Number.isFinite(value) || (isWhole && !Number.isSafeInteger(value))) return { why: "too_large" };
  return { value: minus ? 0 - value : value };
}
