// What is looked at is in the address: filters, order, the rollout and the step. It can be sent around.
SafemanipReport.address = (() => {
  "use strict";

  const listeners = [];

  function read() {
    return Object.fromEntries(new URLSearchParams(location.hash.slice(1)));
  }

  /** Change some of it; null takes one away. A new entry of the history unless `quiet`. */
  function change(values, quiet = false) {
    const next = { ...read(), ...values };
    const kept = Object.entries(next).filter(([, value]) => value !== null && value !== "");
    const hash = `#${new URLSearchParams(kept)}`;
    if (hash === (location.hash || "#")) return;
    if (quiet) history.replaceState(null, "", hash);
    else history.pushState(null, "", hash);
    if (!quiet) tell();
  }

  function tell() {
    for (const listen of listeners) listen(read());
  }

  /** The address of a rollout, for a link. */
  function toRollout(rollout, more = {}) {
    const { rollout: _, step: __, violation: ___, ...others } = read();
    return `#${new URLSearchParams({ ...others, rollout: key(rollout), ...more })}`;
  }

  const key = (rollout) => `${rollout.task}/${rollout.seed}/${rollout.policy}`;

  addEventListener("hashchange", tell);
  addEventListener("popstate", tell);

  return { read, change, key, toRollout, listen: (act) => listeners.push(act) };
})();
