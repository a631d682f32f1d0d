// What points say, in the reader's language: their values that are words, and why their quality is not good.

import { good } from "./drivestate.js";
import { worded } from "./texts.js";
import { reason, texts } from "./values.js";

/** The words of a point while it is good; empty else. */
export const words = (name) => worded(texts(name).value, good(name) ?? "");

/** Why the quality of a point is not good; empty where that is not told. */
export const why = (name) => worded(texts(name).reason, reason(name));
