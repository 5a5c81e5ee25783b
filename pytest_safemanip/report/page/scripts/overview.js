// The run as a whole: what the gates decided, rates with intervals, the figures.
SafemanipReport.overview = (() => {
  "use strict";

  const { element, name, percent, seconds, words } = SafemanipReport.dom;
  const { run } = SafemanipReport.data;
  const { address, baseline, charts, figures, groups, searches, table } = SafemanipReport;
  const { badge, section } = figures;

  function headline() {
    const every = run.rollouts;
    const done = every.filter((rollout) => rollout.success !== null);
    const violated = done.filter((rollout) => rollout.violated);
    // Rates over several policies are of nothing; the table of policies has those of each.
    const pooled = run.policies.length === 1 && done.length > 1;
    const told = (number, what) =>
      pooled
        ? [percent(number / done.length), `${what}, ${number} of ${done.length}`]
        : [String(number), `of ${done.length} ${what}`];
    const successes = done.filter((rollout) => rollout.success).length;
    const tiles = [
      [String(done.length), `of ${every.length} rollouts complete`],
      told(successes, "successful"),
      told(violated.length, "violated"),
      [String(violated.filter((rollout) => rollout.success).length), "successful, yet unsafe"],
    ];
    const { verdict, text } = run.headline;
    return [
      element("p.banner", { id: "banner", className: `banner ${verdict}` }, element("strong", {}, verdict), ` ${text}`),
      run.notes.map((note) => element("p.warning", { role: "note" }, note)),
      element(
        "div.tiles",
        {},
        tiles.map(([figure, label]) =>
          element("div.tile", {}, element("strong", {}, figure), element("span", {}, label)),
        ),
      ),
    ];
  }

  function gates() {
    if (!run.release?.gates.length) return null;
    const order = { FAIL: 0, INCOMPLETE: 1, INCONCLUSIVE: 2, PASS: 3 };
    const rows = [...run.release.gates].sort(
      (one, other) => (order[one.verdict] ?? 1) - (order[other.verdict] ?? 1),
    );
    return section(
      "Gates",
      null,
      element(
        "div.scroll",
        { tabIndex: 0 },
        element(
          "table.plain.gates",
          {},
          element(
            "thead",
            {},
            element(
              "tr",
              {},
              ["verdict", "gate", "policy", "found"].map((text) => element("th", { scope: "col" }, text)),
            ),
          ),
          element(
            "tbody",
            {},
            rows.map((gate) =>
              element(
                "tr",
                {},
                element(
                  "td",
                  {},
                  badge(gate.verdict),
                  gate.required ? null : element("span.faint", {}, " not required"),
                ),
                element(
                  "td",
                  {},
                  gate.name === gate.gate ? null : element("strong.called", {}, gate.name),
                  element("code", {}, gate.gate),
                ),
                element("td", {}, name(gate.policy)),
                element(
                  "td.number",
                  {},
                  found(gate),
                  gate.why ? element("span.faint.why", {}, gate.why) : null,
                ),
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
    return gate.interval
      ? `${counts}, ${gate.basis} ${percent(gate.interval[0])} to ${percent(gate.interval[1])}`
      : counts;
  }

  /** The worst violation of each property, which is where one looks first. */
  function worst() {
    const found = Object.entries(run.worst).sort(([, one], [, other]) => one.rank - other.rank);
    if (!found.length) return null;
    const item = ([id, violation]) => {
      const rollout = run.rollouts[violation.rollout];
      const href = address.toRollout(rollout, { violation: `${id}.${violation.place}` });
      return element(
        "li",
        {},
        element("a.worst", { href }, element("strong", {}, words(id)), ` ${violation.entities.join(", ")}`),
        element("span.evidence", {}, violation.evidence[0] ?? violation.reason),
        element(
          "span.faint",
          {},
          name(rollout.task),
          ", ",
          name(rollout.policy),
          `, seed ${rollout.seed}, step ${violation.first}, unsafe for ${seconds(violation.duration_s)}${violation.severity ? `, ${violation.severity}` : ""}${violation.excess ? `, ${SafemanipReport.violations.hardest(violation.excess)}` : ""}`,
        ),
      );
    };
    const about = `The worst first, ${run.ranked}.`;
    return section("The worst violation of each property", about, element("ol.worst", {}, found.map(item)));
  }

  function policies() {
    return section(
      "Success against violation",
      "Rates with Wilson's 95 % intervals for these tasks. A policy that does more tasks is not a safer one. Exposure leaves out the settle tail.",
      element(
        "div.scroll",
        { tabIndex: 0 },
        element(
          "table.policies",
          {},
          element(
            "thead",
            {},
            element(
              "tr",
              {},
              ["policy", "rollouts", "success", "violation", "exposure", "outcomes"].map((text) =>
                element("th", { scope: "col" }, text),
              ),
            ),
          ),
          element(
            "tbody",
            {},
            run.policies.map(({ name: policy, total }) =>
              element(
                "tr",
                {},
                element("th", { scope: "row" }, name(policy)),
                element(
                  "td.number",
                  { data: { label: "rollouts" } },
                  total.complete === total.rollouts
                    ? String(total.rollouts)
                    : `${total.complete} of ${total.rollouts}`,
                ),
                element(
                  "td",
                  { data: { label: "success" } },
                  figures.interval(total.success_rate, "success"),
                ),
                element(
                  "td",
                  { data: { label: "violation" } },
                  figures.interval(total.violation_rate, "violation"),
                ),
                element("td", { data: { label: "exposure" } }, figures.interval(total.exposure, "exposure")),
                element(
                  "td.wide",
                  { data: { label: "outcomes" } },
                  figures.outcomeBar(total.outcomes, (outcome) => table.choose({ policy, outcome })),
                ),
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

  function about() {
    const rows = [...Object.entries(run.settings), ...Object.entries(run.versions)];
    return section(
      "About this run",
      null,
      element(
        "dl.about",
        {},
        rows.map(([key, value]) =>
          element("div", { className: value.length > 60 ? "wide" : "" }, element("dt", {}, words(key)), element("dd", {}, name(value))),
        ),
      ),
    );
  }

  const build = () => [
    headline(),
    gates(),
    worst(),
    policies(),
    searches.build(),
    baseline.build(),
    // A matrix of many policies needs the whole width.
    element(run.policies.length > 8 ? "div.stacked" : "div.pair", {}, [groups.build(), questions()]),
  ];

  return { build, about };
})();
