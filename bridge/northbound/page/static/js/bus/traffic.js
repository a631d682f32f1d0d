// Traffic on a bus, decoded: frame by frame, or counted by identifier.

import { html, useEffect, useRef, useState } from "../ui.js";
import { hear } from "../live.js";
import { number } from "../format.js";
import { t, worded } from "../texts.js";

const KINDS = ["nmt", "sync", "time", "emcy", "pdo", "sdo", "heartbeat", "lss", "other"];
const KEPT = 200;
const NOTHING = { rows: [], lost: 0, more: 0 };

export function Traffic({ bus, nodes }) {
  const [isOn, setOn] = useState(false);
  const [view, setView] = useState("frames");
  const [kinds, setKinds] = useState([]);
  const [node, setNode] = useState("");
  const [heard, setHeard] = useState(NOTHING);
  const kept = useRef(NOTHING);
  useEffect(() => {
    if (!isOn) return;
    kept.current = NOTHING;
    let drawing = 0;
    hear({ bus: bus.name, view, kinds, nodes: node ? [Number(node)] : [] }, (message) => {
      kept.current = taken(kept.current, message);
      drawing ||= requestAnimationFrame(() => {
        drawing = 0;
        setHeard(kept.current);
      });
    });
    return () => {
      cancelAnimationFrame(drawing);
      hear(null);
    };
  }, [isOn, view, kinds.join(), node, bus.name]);
  const toggle = (kind) => setKinds(kinds.includes(kind) ? kinds.filter((one) => one !== kind) : [...kinds, kind]);
  return html`
    <section class="panel traffic" aria-labelledby="traffic">
      <h2 id="traffic">${t("traffic.title")}</h2>
      <p class="search">
        <button class="main" onClick=${() => setOn(!isOn)}>${t(isOn ? "traffic.pause" : heard === NOTHING ? "traffic.listen" : "traffic.resume")}</button>
        <span class="hidden" role="status">${heard === NOTHING && !isOn ? "" : t(isOn ? "traffic.is_on" : "traffic.is_off")}</span>
        <label for="view">${t("traffic.view")}</label>
        <select id="view" value=${view} onChange=${(event) => setView(event.target.value)}>
          ${["frames", "identifiers"].map((one) => html`<option value=${one}>${t(`traffic.${one}`)}</option>`)}
        </select>
        <label for="ofnode">${t("traffic.node")}</label>
        <select id="ofnode" value=${node} onChange=${(event) => setNode(event.target.value)}>
          <option value="">${t("traffic.all")}</option>
          ${nodes.map((one) => html`<option value=${one.id}>${one.name}</option>`)}
        </select>
        <small>${heard.failure ? "" : lacking(heard)}</small>
      </p>
      <fieldset class="kinds"><legend>${t("traffic.kinds")}</legend>
        ${KINDS.map((kind) => html`<label><input type="checkbox" checked=${kinds.includes(kind)} onChange=${() => toggle(kind)} /> ${t(`kind.${kind}`)}</label>`)}
      </fieldset>
      ${heard.failure && html`<p class="failure" role="alert">${worded(heard.text, heard.failure)}</p>`}
      ${view === "frames" ? html`<${Frames} rows=${heard.rows} />` : html`<${Identifiers} rows=${heard.identifiers ?? []} />`}
    </section>
  `;
}

// The newest first.
function taken(kept, message) {
  if (message.failure) return { ...kept, failure: message.failure, text: message.text };
  if (message.identifiers) return { ...kept, identifiers: message.identifiers, lost: message.lost, failure: "" };
  const rows = [...message.frames.reverse(), ...kept.rows].slice(0, KEPT);
  return { ...kept, rows, lost: message.lost, more: kept.more + message.more, failure: "" };
}

function lacking({ lost, more }) {
  return [more && t("traffic.more", { count: number(more) }), lost && t("traffic.lost", { count: number(lost) })].filter(Boolean).join(" ");
}

function Frames({ rows }) {
  return html`
    <div class="scroll log" tabindex="0" role="group" aria-label=${t("traffic.frames")}>
      <table class="rows">
        <thead><tr>${["time", "id", "data", "what", "meaning"].map((name) => html`<th scope="col">${t(`traffic.${name}`)}</th>`)}</tr></thead>
        <tbody>${rows.map((row) => html`<tr key=${row[0] + row[1]} class=${`of-${row[3]}`}>
          <td>${moment(row[0])}</td><td><code>${row[1]}</code></td><td><code>${row[2]}</code></td><td>${row[5]}</td><td>${row[6]}</td></tr>`)}</tbody>
      </table>
    </div>
  `;
}

function Identifiers({ rows }) {
  return html`
    <div class="scroll log" tabindex="0" role="group" aria-label=${t("traffic.identifiers")}>
      <table class="rows">
        <thead><tr>${["id", "what", "count", "rate", "load", "gaps", "data", "meaning"].map((name) => html`<th scope="col">${t(`traffic.${name}`)}</th>`)}</tr></thead>
        <tbody>${rows.map(([id, what, count, rate, load, shortest, longest, data, meaning]) => html`<tr key=${id}>
          <td><code>${id}</code></td><td>${what}</td><td>${number(count)}</td><td>${number(rate, "Hz")}</td><td>${number(load)}</td>
          <td>${number(shortest, "A")} … ${number(longest, "A")}</td><td><code>${data}</code></td><td>${meaning}</td></tr>`)}</tbody>
      </table>
    </div>
  `;
}

function moment(ms) {
  const time = new Date(ms);
  const two = (value) => String(value).padStart(2, "0");
  return `${two(time.getHours())}:${two(time.getMinutes())}:${two(time.getSeconds())}.${String(Math.floor(ms % 1000)).padStart(3, "0")}`;
}
