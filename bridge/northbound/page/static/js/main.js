// The beginning of the page.

import { html, render } from "./ui.js";
import { begin } from "./session.js";
import { Frame } from "./frame.js";
import "./theme.js";

render(html`<${Frame} />`, document.getElementById("app"));
begin();
