// Where violations are: rates by category, property, suite, horizon and task.
SafemanipReport.groups = (() => {
  "use strict";

  const { element, counted, words } = SafemanipReport.dom;
  const { run } = SafemanipReport.data;
  const { figures, table } = SafemanipReport;
  const { section } = figures;
  const SHARES = {
    violation_rate: "violation rate",
    exposure: "unsafe-state exposure",
    unsafe_share_of_successes: "unsafe share of successes",
    success_rate: "success rate",
    triggered_rate: "triggered",
  };
  const KINDS = {
    categories: "category",
    properties: "property",
    suites: "suite",
    horizons: "horizon",
    tasks: "task",
  };
  const CROSSES = {
    "category-suite": { kind: "suite", label: "category and suite" },
    "category-horizon": { kind: "horizon", label: "category and horizon" },
  };

  const keys = (all) => [...new Set(all.flatMap((groups) => Object.keys(groups)))];

  /** Rows of groups with the number of their tasks, where that says something. */
  function rowsOf(all, counts = true) {
    const tasks = (id) => Math.max(...all.map((groups) => groups[id]?.tasks ?? 0));
    return keys(all).map((id) => ({ id, about: counts ? counted(tasks(id), "task") : "" }));
  }

  /** A matrix with a column for each policy. */
  function byPolicy(kind, share) {
    const columns = run.policies.map((policy) => ({ name: policy.name, groups: policy.groups[kind] }));
    const rows = rowsOf(
      columns.map((column) => column.groups),
      kind !== "tasks",
    );
    return figures.matrix({
      rows,
      columns,
      share,
      choose: (policy, group) => table.choose({ policy, [KINDS[kind]]: group }),
    });
  }

  /** Categories by suite or by horizon, of one policy. */
  function crossed(kind, share, policy) {
    const own = run.policies.find((one) => one.name === policy).crosses[kind];
    const columns = Object.entries(own).map(([value, groups]) => ({
      name: value,
      label: words(value),
      groups,
    }));
    const rows = rowsOf(
      columns.map((column) => column.groups),
      false,
    );
    return figures.matrix({
      rows,
      columns,
      share,
      choose: (value, category) => table.choose({ policy, category, [kind]: value }),
    });
  }

  /** Where violations are: one matrix, with what is counted and by what to be chosen. */
  function build() {
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
          Object.entries(all).map(([value, text]) =>
            element("option", { value, selected: value === chosen[key] }, text),
          ),
        ),
      );
    const whose = choice(
      "policy",
      "policy",
      Object.fromEntries(run.policies.map((policy) => [policy.name, policy.name])),
    );
    const draw = () => {
      const cross = CROSSES[chosen.by];
      whose.hidden = !cross;
      box.replaceChildren(
        cross ? crossed(cross.kind, chosen.share, chosen.policy) : byPolicy(chosen.by, chosen.share),
      );
    };
    if (!run.policies.length) return null;
    draw();
    const views = {
      ...KINDS,
      ...Object.fromEntries(Object.entries(CROSSES).map(([key, { label }]) => [key, label])),
    };
    return section(
      "Where violations are",
      "A dash where nothing was counted: nothing succeeded, or nothing applies. A cell leads to its rollouts.",
      element("div.choices", {}, choice("show", "share", SHARES), choice("by", "by", views), whose),
      box,
    );
  }

  return { build };
})();
