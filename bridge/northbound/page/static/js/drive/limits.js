// Present limits of a drive's setpoints.

import { nature } from "../site.js";
import { good } from "../drivestate.js";

/** {low, high} of the setpoint `name`: as the drive's own parameter scales it, where that has been read, else as the
 * site file does. They are left out where unknown: the bridge still refuses values out of range.
 * @returns {{low?: number, high?: number}} */
export function limitsOf(drive, name) {
  const { low, high, scaled_by: scales, of_full: limits } = nature(name);
  if (!scales) return { low, high };
  const scale = scales[activeSet(drive)];
  if (!scale) return {};
  const full = good(`${drive.name}/${scale}`);
  return full > 0 ? { low: limits[0] * full, high: limits[1] * full } : { low, high };
}

// Number of the parameter set in use, from 0 on.
function activeSet({ name, set_bits: bits }) {
  const status = good(`${name}/status/drive_status_word`) ?? 0;
  return bits.reduce((sum, bit, place) => sum + (((status >> bit) & 1) << place), 0);
}
