// What is looked at is in the address: filters, order, the rollout and the step. It can be sent around.
SafemanipReport.address = (() => {
  "use strict";

  const PAUSE_MS = 250;
  const listeners = [];
  let pending = {};
  let timer = 0;

  /** What is asked for, what is not written yet included. */
  function read() {
    const written = Object.fromEntries(new URLSearchParams(location.hash.slice(1)));
    return kept({ ...written, ...pending });
  }

  const kept = (values) =>
    Object.fromEntries(Object.entries(values).filter(([, value]) => value !== null && value !== ""));

  /** Change some of it; null takes one away. A new entry of the history, and everybody is told. */
  function change(values) {
    const hash = `#${new URLSearchParams(kept({ ...read(), ...values }))}`;
    forget();
    if (hash === (location.hash || "#")) return;
    history.pushState(null, "", hash);
    tell();
  }

  /** Change some of it in place, without telling anybody; what moves fast is written at times only. */
  function remember(values) {
    pending = { ...pending, ...values };
    if (!timer) timer = setTimeout(write, PAUSE_MS);
  }

  function write() {
    const hash = `#${new URLSearchParams(read())}`;
    forget();
    if (hash !== (location.hash || "#")) history.replaceState(null, "", hash);
  }

  function forget() {
    clearTimeout(timer);
    timer = 0;
    pending = {};
  }

  function tell() {
    for (const listen of listeners) listen(read());
  }

  /** The address of a rollout, for a link. */
  function toRollout(rollout, more = {}) {
    const others = kept({ ...read(), step: null, violation: null, about: null });
    return `#${new URLSearchParams({ ...others, rollout: key(rollout), ...more })}`;
  }

  const key = (rollout) => `${rollout.task}/${rollout.seed}/${rollout.policy}`;

  // Links, and the way back through the history.
  addEventListener("hashchange", () => {
    forget();
    tell();
  });

  return { read, change, remember, key, toRollout, listen: (act) => listeners.push(act) };
})();
