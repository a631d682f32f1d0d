// Frame around every page: the site's name, the menu, the user, and the plant's condition in a sentence.

import { classes, html, useEffect } from "./ui.js";
import { isOneTooMany } from "./connection.js";
import { connect, disconnect, isConnected, leave, show, troubles, waiting } from "./live.js";
import { logout, session, siteName } from "./session.js";
import { leaveBy } from "./leaving.js";
import { Login } from "./login.js";
import { menu, pageOf, pathOf } from "./pages.js";
import { address, route } from "./route.js";
import { onRoute, toMain } from "./focus.js";
import { language, t } from "./texts.js";
import { theme } from "./theme.js";
import { Icon } from "./icons.js";
import { sentence, worst } from "./trouble.js";

export function Frame() {
  const who = session.value;
  if (who === undefined) return html`<p class="waiting">${t("frame.loading")}</p>`;
  if (who === null) return html`<${Login} />`;
  return html`<${Inside} key=${who.token} />`;
}

function Inside() {
  const path = pathOf(route.value);
  const page = pageOf(path);
  const topics = page ? page.topics(route.value) : [];
  useEffect(() => {
    connect();
    document.addEventListener("visibilitychange", onVisibility);
    return () => {
      document.removeEventListener("visibilitychange", onVisibility);
      disconnect();
    };
  }, []);
  useEffect(() => show(topics), [topics.join()]);
  useEffect(() => onRoute(), [route.value.join("/")]);
  useEffect(() => {
    const place = route.value.slice(1).join("/");
    document.title = [place || t(`page.${path}`), siteName.value].join(" · ");
  });
  return html`
    <a class="skip" href="#main" onClick=${toMain}>${t("frame.skip")}</a>
    <header class="top">
      <a class="site" href=${address("plant")}><span class="product">drivebridge</span> ${siteName}</a>
      <nav aria-label=${t("frame.menu")}>
        ${menu.map(
          (one) => html`<a href=${address(one)} aria-current=${one === path ? "page" : undefined}>
            ${t(`page.${one}`)}
          </a>`,
        )}
      </nav>
      <${Tools} />
    </header>
    <${Sentence} />
    <main id="main" tabindex="-1">
      ${page ? html`<${page.View} route=${route.value} />` : html`<p class="waiting">${t("frame.loading")}</p>`}
    </main>
  `;
}

function onVisibility() {
  if (document.hidden) leave();
}

// The plant's condition in one line.
function Sentence() {
  const isKnown = isConnected.value && (troubles.value?.length || !waiting.value);
  const rank = isKnown ? worst(troubles.value) : "unknown";
  return html`
    <p class=${classes("sentence", `is-${rank}`)} role="status">
      <${Icon} name=${rank === "none" ? "ok" : rank} />
      <span>${said()}</span>
    </p>
  `;
}

function said() {
  if (isConnected.value || troubles.value === null) return sentence(troubles.value);
  return t(isOneTooMany.value ? "frame.too_many" : "frame.disconnected");
}

function Tools() {
  const who = session.value;
  return html`
    <div class="tools">
      <button class="plain" onClick=${() => (language.value = language.value === "en" ? "de" : "en")}
        lang=${language.value === "en" ? "de" : "en"}>${language.value === "en" ? "Deutsch" : "English"}</button>
      <button class="plain" onClick=${nextTheme} aria-label=${t("frame.theme", { theme: t(`theme.${theme.value}`) })}
        title=${t("frame.theme", { theme: t(`theme.${theme.value}`) })}><${Icon} name=${theme.value} /></button>
      <span class="who">${who.user || t("frame.visitor")} <small>${t(`role.${who.role}`)}</small></span>
      ${who.user && html`<button onClick=${() => leaveBy(logout)}>${t("frame.logout")}</button>`}
      ${!who.user && who.has_users && html`<button onClick=${() => leaveBy(() => (session.value = null))}>${t("frame.login")}</button>`}
    </div>
  `;
}

function nextTheme() {
  const all = ["system", "light", "dark"];
  theme.value = all[(all.indexOf(theme.value) + 1) % all.length];
}
