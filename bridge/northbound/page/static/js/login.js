// Login form.

import { html, useRef, useState } from "./ui.js";
import { begin, hasVisitors, login, siteName } from "./session.js";
import { t } from "./texts.js";

export function Login() {
  const [failure, setFailure] = useState("");
  const [isBusy, setBusy] = useState(false);
  const form = useRef();
  const onSubmit = async (event) => {
    event.preventDefault();
    setBusy(true);
    const given = new FormData(form.current);
    const told = await login(given.get("user"), given.get("password")).catch(() => ({ error: "unreachable" }));
    setBusy(false);
    if (told.error) setFailure(t(`login.${told.error}`, { s: Math.ceil(told.pause_s ?? 0) }));
  };
  return html`
    <main class="login">
      <h1><span class="product">drivebridge</span> ${siteName}</h1>
      <form ref=${form} onSubmit=${onSubmit}>
        <label>${t("login.user")} <input name="user" autocomplete="username" required autofocus /></label>
        <label>${t("login.password")}
          <input name="password" type="password" autocomplete="current-password" required />
        </label>
        <p class="failure" role="alert">${failure}</p>
        <button class="main" disabled=${isBusy}>${t("login.enter")}</button>
        ${hasVisitors.value && html`<button type="button" class="plain" onClick=${begin}>${t("login.back")}</button>`}
      </form>
    </main>
  `;
}
