// The run, and the details of its rollouts: within the page, or in files beside it.
SafemanipReport.data = (() => {
  "use strict";

  const OUTCOMES = {
    V: "violated",
    U: "unresolved",
    S: "satisfied",
    N: "not triggered",
    E: "not judged",
    "-": "not asked for",
  };
  const run = JSON.parse(document.getElementById("data").textContent);
  const known = new Map();
  const waiting = new Map();

  run.rollouts.forEach((rollout, number) => {
    rollout.number = number;
    rollout.violated = rollout.outcomes.includes("V");
    rollout.unresolved = rollout.outcomes.includes("U");
    rollout.outcome = outcome(rollout);
    const violated = run.properties.filter((_, at) => rollout.outcomes[at] === "V").map((own) => own.id);
    const { task, policy, seed, suite, horizon, error, failure, about } = rollout;
    const told = [error, failure && `gave up: ${failure}`, about, run.instructions[number] ?? ""];
    rollout.text = [task, policy, `seed ${seed}`, suite, horizon, ...violated, ...told].join(" ").toLowerCase();
  });

  function outcome(rollout) {
    if (rollout.success === null) return "incomplete";
    if (rollout.success) return rollout.violated ? "success_but_unsafe" : "success_and_safe";
    return rollout.violated ? "fail_and_unsafe" : "fail_but_safe";
  }

  /** The details of a rollout; null if it has none. Rejects where its file is missing. */
  function details(number) {
    if (known.has(number)) return Promise.resolve(known.get(number));
    const place = run.details[number];
    if (place === undefined) return Promise.resolve(null);
    if (place === "") {
      keep(number, JSON.parse(document.getElementById(`rollout-${number}`).textContent));
      return Promise.resolve(known.get(number));
    }
    if (!waiting.has(number)) waiting.set(number, load(number, place));
    return waiting.get(number);
  }

  // A script rather than fetch(), which reads no files of a page from a disk.
  function load(number, place) {
    return new Promise((resolve, reject) => {
      const script = document.createElement("script");
      script.src = place;
      script.onload = () => (known.has(number) ? resolve(known.get(number)) : script.onerror());
      script.onerror = () => {
        waiting.delete(number);
        reject(new Error(`${place} is missing: keep it beside this page`));
      };
      document.head.append(script);
    });
  }

  function keep(number, content) {
    for (const signal of content.signals ?? []) signal.values = unpacked(signal);
    content.ranks = run.ranks[number] ?? {};
    known.set(number, content);
  }

  /** The numbers of a signal; null where there is none. */
  function unpacked({ low, high, data }) {
    const bytes = atob(data);
    const values = [];
    for (let at = 0; at + 1 < bytes.length; at += 2) {
      const level = bytes.charCodeAt(at) | (bytes.charCodeAt(at + 1) << 8);
      values.push(level === 65535 ? null : low + (level / 65534) * (high - low));
    }
    return values;
  }

  const find = (key) => run.rollouts.find((rollout) => SafemanipReport.address.key(rollout) === key);

  SafemanipReport.received = keep;
  return { run, details, find, OUTCOMES };
})();
