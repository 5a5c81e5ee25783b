// The run as a whole: gates, rates with intervals, where violations are, the comparison with a baseline.
SafemanipReport.overview = (() => {
  "use strict";

  const { element, name, percent, counted, words } = SafemanipReport.dom;
  const { run, find } = SafemanipReport.data;
  const { address, charts, figures } = SafemanipReport;
  const SHARES = {
    violation_rate: "violation rate",
    exposure: "unsafe-state exposure",
    unsafe_share_of_successes: "unsafe share of successes",
    success_rate: "success rate",
    triggered_rate: "triggered",
  };
  const KINDS = { categories: "category", properties: "property", suites: "suite", horizons: "horizon", tasks: "task" };
  const CROSSES = { "category-suite": { kind: "suite", label: "category and suite" }, "category-horizon": { kind: "horizon", label: "category and horizon" } };
  const GOOD = new Set(["PASS", "HELD", "IMPROVED"]);
  const BAD = new Set(["FAIL", "REGRESSED"]);

  const badge = (verdict) =>
    element("span", { className: `badge ${GOOD.has(verdict) ? "good" : BAD.has(verdict) ? "bad" : "open"}` }, verdict);

  function section(title, about, ...content) {
    return element("section.card", {}, element("h2", {}, title), about ? element("p.faint", {}, about) : null, content);
  }

  /** The rollouts that a click means, in the table below. */
  function choose(filters) {
    address.change({ q: null, policy: null, outcome: null, property: null, category: null, suite: null, horizon: null, task: null, ...filters });
    document.getElementById("rollouts").scrollIntoView({ block: "start" });
  }

  function headline() {
    const every = run.rollouts;
    const done = every.filter((rollout) => rollout.success !== null);
    const violated = done.filter((rollout) => rollout.violated);
    const failed = (run.release?.gates ?? []).filter((gate) => BAD.has(gate.verdict) && gate.required);
    const tiles = [
      [String(done.length), `of ${every.length} rollouts complete`],
      [percent(done.length ? done.filter((rollout) => rollout.success).length / done.length : null), "successful"],
      [percent(done.length ? violated.length / done.length : null), `violated, ${violated.length} of ${done.length}`],
      [String(violated.filter((rollout) => rollout.success).length), "successful, yet unsafe"],
    ];
    if (run.release?.gates.length) tiles.push([String(failed.length), `of ${counted(run.release.gates.length, "gate")} failed`]);
    return [
      run.notes.map((note) => element("p.warning", { role: "note" }, note)),
      element("div.tiles", {}, tiles.map(([figure, label]) => element("div.tile", {}, element("strong", {}, figure), element("span", {}, label)))),
    ];
  }

  function gates() {
    if (!run.release?.gates.length) return null;
    const order = { FAIL: 0, INCOMPLETE: 1, INCONCLUSIVE: 2, PASS: 3 };
    const rows = [...run.release.gates].sort((one, other) => (order[one.verdict] ?? 1) - (order[other.verdict] ?? 1));
    return section(
      "Gates",
      null,
      element(
        "div.scroll",
        { tabIndex: 0 },
        element(
          "table.plain.gates",
          {},
          element("thead", {}, element("tr", {}, ["verdict", "gate", "policy", "found", ""].map((text) => element("th", { scope: "col" }, text)))),
          element(
            "tbody",
            {},
            rows.map((gate) =>
              element(
                "tr",
                {},
                element("td", {}, badge(gate.verdict), gate.required ? null : element("span.faint", {}, " not required")),
                element("td", {}, element("code", {}, gate.gate)),
                element("td", {}, name(gate.policy)),
                element("td.number", {}, found(gate)),
                element("td.faint.why", {}, gate.why),
              ),
            ),
          ),
        ),
      ),
    );
  }

  function found(gate) {
    if (gate.value === null) return "undefined";
    if (gate.total === null) return String(gate.value);
    const counts = `${Number(gate.hits.toFixed(2))} of ${gate.total} = ${percent(gate.value)}`;
    return gate.interval ? `${counts}, ${gate.basis} ${percent(gate.interval[0])} to ${percent(gate.interval[1])}` : counts;
  }

  function policies() {
    return section(
      "Success against violation",
      "Rates with Wilson's 95 % intervals for these tasks. A policy that does more tasks is not a safer one.",
      element(
        "div.scroll",
        { tabIndex: 0 },
        element(
          "table.policies",
          {},
          element(
            "thead",
            {},
            element("tr", {}, ["policy", "rollouts", "success", "violation", "exposure", "outcomes"].map((text) => element("th", { scope: "col" }, text))),
          ),
          element(
            "tbody",
            {},
            run.policies.map(({ name: policy, total }) =>
              element(
                "tr",
                {},
                element("th", { scope: "row" }, name(policy)),
                element("td.number", { data: { label: "rollouts" } }, total.complete === total.rollouts ? String(total.rollouts) : `${total.complete} of ${total.rollouts}`),
                element("td", { data: { label: "success" } }, figures.interval(total.success_rate, "success")),
                element("td", { data: { label: "violation" } }, figures.interval(total.violation_rate, "violation")),
                element("td", { data: { label: "exposure" } }, figures.interval(total.exposure, "exposure")),
                element("td.wide", { data: { label: "outcomes" } }, figures.outcomeBar(total.outcomes, (outcome) => choose({ policy, outcome }))),
              ),
            ),
          ),
        ),
      ),
      figures.legend(),
    );
  }

  function questions() {
    const drawn = charts.build();
    return drawn.length ? section("Figures", null, drawn) : null;
  }

  const keys = (all) => [...new Set(all.flatMap((groups) => Object.keys(groups)))];

  /** Rows of groups with the number of their tasks, where that says something. */
  function rowsOf(all, counts = true) {
    const tasks = (id) => Math.max(...all.map((groups) => groups[id]?.tasks ?? 0));
    return keys(all).map((id) => ({ id, about: counts ? counted(tasks(id), "task") : "" }));
  }

  /** A matrix with a column for each policy. */
  function byPolicy(kind, share) {
    const columns = run.policies.map((policy) => ({ name: policy.name, groups: policy.groups[kind] }));
    const rows = rowsOf(columns.map((column) => column.groups), kind !== "tasks");
    return figures.matrix({ rows, columns, share, choose: (policy, group) => choose({ policy, [KINDS[kind]]: group }) });
  }

  /** Categories by suite or by horizon, of one policy. */
  function crossed(kind, share, policy) {
    const own = run.policies.find((one) => one.name === policy).crosses[kind];
    const columns = Object.entries(own).map(([value, groups]) => ({ name: value, label: words(value), groups }));
    const rows = rowsOf(columns.map((column) => column.groups), false);
    return figures.matrix({ rows, columns, share, choose: (value, category) => choose({ policy, category, [kind]: value }) });
  }

  /** Where violations are: one matrix, with what is counted and by what to be chosen. */
  function groups() {
    const chosen = { share: "violation_rate", by: "categories", policy: run.policies[0]?.name };
    const box = element("div", {});
    const choice = (label, key, all) =>
      element(
        "label.choice",
        {},
        `${label} `,
        element(
          "select",
          { id: `show-${key}`, on: { change: (event) => ((chosen[key] = event.target.value), draw()) } },
          Object.entries(all).map(([value, text]) => element("option", { value, selected: value === chosen[key] }, text)),
        ),
      );
    const whose = choice("policy", "policy", Object.fromEntries(run.policies.map((policy) => [policy.name, policy.name])));
    const draw = () => {
      const cross = CROSSES[chosen.by];
      whose.hidden = !cross;
      box.replaceChildren(cross ? crossed(cross.kind, chosen.share, chosen.policy) : byPolicy(chosen.by, chosen.share));
    };
    if (!run.policies.length) return null;
    draw();
    const views = { ...KINDS, ...Object.fromEntries(Object.entries(CROSSES).map(([key, { label }]) => [key, label])) };
    return section(
      "Where violations are",
      "A dash where nothing was counted: nothing succeeded, or nothing applies. A cell leads to its rollouts.",
      element("div.choices", {}, choice("show", "share", SHARES), choice("by", "by", views), whose),
      box,
    );
  }

  function baseline() {
    const release = run.release;
    if (release?.refused) return section("Baseline", null, element("p.warning", {}, `No comparison: ${release.refused}`));
    if (!release?.baseline) return null;
    const { place, comparisons, flips, unpaired } = release.baseline;
    const signed = (value) => (value === null ? "–" : `${value > 0 ? "+" : ""}${(value * 100).toFixed(1)}`);
    return section(
      "Against the baseline",
      `${place}. Changes in points with 90 % intervals; p is one-sided and adjusted.${unpaired ? ` ${counted(unpaired, "rollout")} without a counterpart.` : ""}`,
      element(
        "div.scroll",
        { tabIndex: 0 },
        element(
          "table.plain",
          {},
          element("thead", {}, element("tr", {}, ["verdict", "what", "policy", "before", "now", "change", "p", "pairs"].map((text) => element("th", { scope: "col" }, text)))),
          element(
            "tbody",
            {},
            comparisons.map((own) =>
              element(
                "tr",
                {},
                element("td", {}, badge(own.verdict), own.required ? null : element("span.faint", {}, " not required")),
                element("td", {}, words(own.name), own.why ? element("span.faint", {}, ` ${own.why}`) : null),
                element("td", {}, name(own.policy)),
                element("td.number", {}, percent(own.before)),
                element("td.number", {}, percent(own.now)),
                element("td.number", {}, own.interval ? `${signed(own.difference)} (${signed(own.interval[0])} to ${signed(own.interval[1])})` : "–"),
                element("td.number", {}, Math.min(own.p_worse ?? 1, own.p_better ?? 1).toFixed(3)),
                element("td.number", {}, String(Object.values(own.pairs).reduce((sum, count) => sum + count, 0))),
              ),
            ),
          ),
        ),
      ),
      flips.length ? flipLists(flips) : element("p.faint", {}, "No rollout flipped."),
    );
  }

  function flipLists(flips) {
    const list = (title, chosen) =>
      element(
        "details",
        { open: title === "Regressed" && chosen.length < 30 },
        element("summary", {}, `${title}: ${chosen.length}`),
        element(
          "ul.flips",
          {},
          chosen.map((flip) => {
            const rollout = find(address.key(flip));
            const text = [`${flip.task}, seed ${flip.seed}, `, name(flip.policy), `: ${words(flip.property)}`];
            return element("li", {}, rollout ? element("a", { href: address.toRollout(rollout, { property: flip.property }) }, text) : text);
          }),
        ),
      );
    return element("div", {}, list("Regressed", flips.filter((flip) => flip.regressed)), list("Fixed", flips.filter((flip) => !flip.regressed)));
  }

  function about() {
    const rows = [...Object.entries(run.settings), ...Object.entries(run.versions)];
    return section(
      "About this run",
      null,
      element("dl.about", {}, rows.map(([key, value]) => element("div", {}, element("dt", {}, words(key)), element("dd", {}, value)))),
    );
  }

  const build = () => [headline(), gates(), policies(), baseline(), element("div.pair", {}, [groups(), questions()])];

  return { build, about };
})();
