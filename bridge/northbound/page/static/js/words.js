// Words of points in the reader's language: their text values, and the reasons why their quality is not good.

import { good } from "./drivestate.js";
import { worded } from "./texts.js";
import { reason, texts } from "./values.js";

/** The words of a point while it is good; empty else. */
export const words = (name) => worded(texts(name).value, good(name) ?? "");

/** Reason why the quality of a point is not good; empty where none is given. */
export const why = (name) => worded(texts(name).reason, reason(name));
