// Owners of drives, as people call them.

import { self } from "./live.js";
import { t } from "./texts.js";
import { good } from "./drivestate.js";

/** The owner of `drive`, as people call it. */
export function ownerOf(drive) {
  const owner = good(`${drive}/supervision/owner`);
  return owner === null ? t("unknown") : ownerName(owner);
}

/** The owner in words: "you", "admin (web page)", "192.168.1.20 (Modbus)"; "nobody". */
export function ownerName(owner) {
  if (!owner) return t("plant.nobody");
  if (owner === self.value) return t("owner.you");
  const [source, ...rest] = owner.split(":");
  const user = rest.join(":");
  const [name, tab] = user.split("#");
  if (source === "local" && tab) return t("owner.page", { name: name === "visitor" ? t("frame.visitor") : name });
  return t("owner.other", { name: user, source: t(`source.${source}`) });
}
