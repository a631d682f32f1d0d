// What is wrong, in words. The server finds the troubles; here they get their texts.

import { address } from "./route.js";
import { clock, span } from "./format.js";
import { drives, nodes } from "./site.js";
import { ownerName } from "./owner.js";
import { faultIn, many, maybe, t } from "./texts.js";

/** The rank of the worst of `troubles`; "none" where there is none, "unknown" before the server has told. */
export function worst(troubles) {
  if (troubles === null) return "unknown";
  return troubles[0]?.rank ?? "none";
}

/** How the plant is, in one sentence. */
export function sentence(troubles) {
  if (troubles === null) return t("frame.loading");
  if (!troubles.length) return many("plant.fine", drives.value.length);
  const first = `${nameOf(troubles[0].place)}: ${headline(troubles[0])}, ${since(troubles[0])}`;
  const others = troubles.length - 1;
  return others ? `${first}. ${many("plant.others", others)}` : `${first}.`;
}

/** What is wrong in a few words: "drive fault E010/10.3". */
export function headline(trouble) {
  return t(`trouble.${trouble.kind}`, said(trouble));
}

/** What it means and where it comes from; empty where the headline says it all. */
export function explanation(trouble) {
  return maybe(`trouble.${trouble.kind}.why`, withDefaults(trouble));
}

/** What to do. */
export function remedy(trouble) {
  return said(trouble).remedy || maybe(`trouble.${trouble.kind}.remedy`, withDefaults(trouble));
}

export function since(trouble) {
  return t(trouble.or_longer ? "since.longer" : "since", { time: clock(trouble.since) });
}

export function lasting(trouble) {
  return span(Date.now() - trouble.since);
}

/** What people call the place. */
export function nameOf(place) {
  if (place === "bridge") return t("place.bridge");
  return place.replace(/^bus\//, "");
}

// The facts in the reader's language, as far as the drive's family has its faults in it.
function said(trouble) {
  const family = drives.value.find((one) => one.name === trouble.place)?.mapping;
  return { ...trouble.facts, ...faultIn(family, trouble.facts.number) };
}

/** The address of the page that shows the place. */
export function pageOfPlace(place) {
  if (drives.value.some((one) => one.name === place)) return address("drive", ...place.split("/"));
  if (place === "bridge") return address("system");
  const bus = place.startsWith("bus/") ? place.slice(4) : nodes.value.find((one) => one.name === place)?.bus;
  return bus ? address("bus", bus) : address("plant");
}

function withDefaults(trouble) {
  const facts = { ...said(trouble) };
  if ("owner" in facts) facts.owner = ownerName(facts.owner);
  for (const name of ["why", "how", "who", "owner", "cause"]) facts[name] ||= t("unknown");
  return facts;
}
