// A bar for a share of 0 … 1; it warns above `warn`, or below `low`. Beside it stands the number.

import { classes, html } from "./ui.js";

export function Meter({ share, warn = 2, low = -1 }) {
  const width = Math.max(0, Math.min(1, share)) * 60;
  return html`
    <svg class=${classes("meter", { late: share > warn || share < low })} viewBox="0 0 60 8" aria-hidden="true">
      <rect class="track" width="60" height="8" /><rect class="fill" width=${width} height="8" />
    </svg>
  `;
}
