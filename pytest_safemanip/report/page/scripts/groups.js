// Where violations are: rates by category, property, suite, horizon and task.
SafemanipReport.groups = (() => {
  "use strict";

  const { element, counted, words } = SafemanipReport.dom;
  const { run } = SafemanipReport.data;
  const { address, figures, table } = SafemanipReport;
  const { section } = figures;
  const SHARES = {
    violation_rate: "violation rate",
    exposure: "unsafe-state exposure",
    unsafe_share_of_successes: "unsafe share of successes",
    success_rate: "success rate",
    triggered_rate: "triggered",
  };
  const OUTCOMES = {
    violation_rate: { verdict: "violated" },
    exposure: { verdict: "violated" },
    unsafe_share_of_successes: { outcome: "success_but_unsafe" },
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

  /** What shows the rollouts behind a cell; null where there are none to be shown. */
  function leads(kind, share, group, filters) {
    // A category or a property chooses the rollouts that violate it.
    const violating = kind === "categories" || kind === "properties";
    if (violating && (figures.NEUTRAL.has(share) || !group.violation_rate.hits)) return null;
    if (!group[share].hits) return null;
    return () => table.choose({ ...filters, ...(OUTCOMES[share] ?? {}) });
  }

  /** A matrix with a column for each policy. */
  function byPolicy(kind, share) {
    const columns = run.policies.map((policy) => ({ name: policy.name, groups: policy.groups[kind] }));
    if (run.floor)
      columns.push({ name: "demonstrations", label: "floor: demonstrations", groups: run.floor.groups[kind], floor: true });
    const rows = rowsOf(
      columns.map((column) => column.groups),
      kind !== "tasks",
    );
    return figures.matrix({
      rows,
      columns,
      share,
      // Demonstrations are not among the rollouts of the page.
      choose: (column, id, group) =>
        column.floor ? null : leads(kind, share, group, { policy: column.name, [KINDS[kind]]: id }),
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
      choose: (column, category, group) =>
        leads("categories", share, group, { policy, category, [kind]: column.name }),
    });
  }

  /** Where violations are: one matrix, with what is counted and by what to be chosen. */
  function build() {
    const state = address.read();
    const among = (all, value, otherwise) => (Object.hasOwn(all, value) ? value : otherwise);
    const names = Object.fromEntries(run.policies.map((policy) => [policy.name, policy.name]));
    const views = {
      ...KINDS,
      ...Object.fromEntries(Object.entries(CROSSES).map(([key, { label }]) => [key, label])),
    };
    const chosen = {
      share: among(SHARES, state.share, "violation_rate"),
      by: among(views, state.by, "categories"),
      policy: among(names, state.of, run.policies[0]?.name),
    };
    const change = (key, value) => {
      chosen[key] = value;
      address.remember({ [key === "policy" ? "of" : key]: value });
      draw();
    };
    const box = element("div", {});
    const choice = (label, key, all) =>
      element(
        "label.choice",
        {},
        `${label} `,
        element(
          "select",
          { id: `show-${key}`, on: { change: (event) => change(key, event.target.value) } },
          Object.entries(all).map(([value, text]) =>
            element("option", { value, selected: value === chosen[key] }, text),
          ),
        ),
      );
    const whose = choice("policy", "policy", names);
    const draw = () => {
      const cross = CROSSES[chosen.by];
      whose.hidden = !cross;
      box.replaceChildren(
        cross ? crossed(cross.kind, chosen.share, chosen.policy) : byPolicy(chosen.by, chosen.share),
      );
    };
    if (!run.policies.length) return null;
    draw();
    return section(
      "Where violations are",
      "A dash where nothing was counted: nothing succeeded, or nothing applies; never: no rollout triggered it. A cell leads to its rollouts.",
      element("div.choices", {}, choice("show", "share", SHARES), choice("by", "by", views), whose),
      box,
    );
  }

  return { build };
})();
