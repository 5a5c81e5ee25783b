// The rollouts: filtered, sorted and searched, a link to each.
SafemanipReport.table = (() => {
  "use strict";

  const { element, name, counted, words } = SafemanipReport.dom;
  const { run, OUTCOMES } = SafemanipReport.data;
  const { address, figures } = SafemanipReport;
  const AT_ONCE = 50;
  const RANKS = {
    fail_and_unsafe: 0,
    success_but_unsafe: 1,
    incomplete: 2,
    fail_but_safe: 3,
    success_and_safe: 4,
  };
  const COLUMNS = [
    {
      id: "worst",
      label: "worst",
      title: "the severity of the worst violation: how far beyond its limit, how hard, how fast and how long",
      down: true,
      by: (own) => own.worst,
    },
    { id: "task", label: "task", by: (own) => own.task },
    { id: "policy", label: "policy", by: (own) => own.policy },
    { id: "seed", label: "seed", by: (own) => own.seed },
    { id: "outcome", label: "outcome", by: (own) => RANKS[own.outcome] },
    {
      id: "properties",
      label: "properties",
      title: "by the number of violated ones",
      down: true,
      by: (own) => own.outcomes.split("V").length,
    },
    { id: "violations", label: "violations", down: true, by: (own) => own.violations },
    {
      id: "cost",
      label: "cost",
      title: "of all its violations: what their properties weigh, and as much for each further second",
      down: true,
      by: (own) => own.cost ?? 0,
    },
    { id: "steps", label: "steps", title: "of the robot, without the settling after them", by: (own) => own.steps },
  ];
  const categories = [...new Set(run.properties.map((own) => own.category))];
  const unique = (key) => [...new Set(run.rollouts.map((own) => own[key]))];
  const ordered = (key) => unique(key).sort();
  const FILTERS = [
    { id: "policy", label: "policy", values: unique("policy"), keeps: (own, value) => own.policy === value },
    {
      id: "outcome",
      label: "outcome",
      values: Object.keys(figures.OUTCOMES),
      words: figures.OUTCOMES,
      keeps: (own, value) => own.outcome === value,
    },
    {
      id: "verdict",
      label: "verdict",
      values: ["violated", "unresolved"],
      keeps: (own, value) => own[value],
    },
    {
      id: "category",
      label: "violated category",
      values: categories,
      keeps: (own, value) => violates(own, (of) => of.category === value),
    },
    {
      id: "property",
      label: "violated property",
      values: run.properties.map((own) => own.id),
      keeps: (own, value) => violates(own, (of) => of.id === value),
    },
    { id: "suite", label: "suite", values: ordered("suite"), keeps: (own, value) => own.suite === value },
    {
      id: "horizon",
      label: "horizon",
      values: ordered("horizon"),
      keeps: (own, value) => own.horizon === value,
    },
    { id: "task", label: "task", values: ordered("task"), keeps: (own, value) => own.task === value },
  ];
  let shown = AT_ONCE;
  let rows = [];

  const violates = (rollout, is) =>
    run.properties.some((property, at) => rollout.outcomes[at] === "V" && is(property));

  /** The rollouts that the address asks for, in its order. */
  function selected(state = address.read()) {
    const search = (state.q ?? "").toLowerCase().split(/\s+/).filter(Boolean);
    const filters = FILTERS.filter((filter) => state[filter.id]);
    const found = run.rollouts.filter(
      (own) =>
        filters.every((filter) => filter.keeps(own, state[filter.id])) &&
        search.every((word) => own.text.includes(word)),
    );
    const [id, way] = (state.sort ?? "worst").split(".");
    const column = COLUMNS.find((own) => own.id === id) ?? COLUMNS[0];
    const compare = (one, other) => (one < other ? -1 : one > other ? 1 : 0);
    return found.sort(
      (one, other) =>
        order(column, way) * compare(column.by(one), column.by(other)) || one.number - other.number,
    );
  }

  // A column begins with what is worst, or with what comes first.
  const order = (column, way) => (column.down ? -1 : 1) * (way === "back" ? -1 : 1);

  /** Show the rollouts that filters keep, and no others. */
  function choose(filters) {
    address.change({
      q: null,
      policy: null,
      outcome: null,
      verdict: null,
      property: null,
      category: null,
      suite: null,
      horizon: null,
      task: null,
      ...filters,
    });
    document.getElementById("rollouts").scrollIntoView({ block: "start" });
  }

  function controls(state) {
    const search = element("input", {
      type: "search",
      id: "search",
      placeholder: "search (/)",
      value: state.q ?? "",
      autocomplete: "off",
      aria: { label: "Search in tasks, policies, instructions, violations, errors and reasons to give up" },
      on: {
        input: (event) => {
          address.remember({ q: event.target.value });
          redraw();
        },
      },
    });
    const boxes = FILTERS.filter((filter) => filter.values.length > 1).map((filter) =>
      element(
        "label.choice",
        {},
        `${filter.label} `,
        element(
          "select",
          {
            id: `filter-${filter.id}`,
            on: { change: (event) => address.change({ [filter.id]: event.target.value || null }) },
          },
          element("option", { value: "" }, "all"),
          filter.values.map((value) =>
            element(
              "option",
              { value, selected: state[filter.id] === value },
              filter.words?.[value] ??
                (filter.id === "category" || filter.id === "property" ? words(value) : value),
            ),
          ),
        ),
      ),
    );
    const clear = element(
      "button.small",
      {
        type: "button",
        id: "clear",
        on: {
          click: () =>
            address.change({ q: null, ...Object.fromEntries(FILTERS.map((filter) => [filter.id, null])) }),
        },
      },
      "Clear",
    );
    return element("div.choices", {}, search, boxes, clear);
  }

  function head(state) {
    const [id, way] = (state.sort ?? "worst").split(".");
    return element(
      "thead",
      {},
      element(
        "tr",
        {},
        COLUMNS.map((column) => {
          const active = column.id === id;
          const falls = order(column, way) < 0;
          return element(
            "th",
            {
              scope: "col",
              className: `col-${column.id}`,
              aria: { sort: active ? (falls ? "descending" : "ascending") : "none" },
            },
            element(
              "button.sort",
              {
                type: "button",
                title: column.title ?? "",
                data: { sort: column.id },
                on: {
                  click: () =>
                    address.change({ sort: active && way !== "back" ? `${column.id}.back` : column.id }),
                },
              },
              column.label,
              element("span.arrow", { aria: { hidden: "true" } }, active ? (falls ? " ▼" : " ▲") : ""),
            ),
          );
        }),
      ),
    );
  }

  /** A mark for each property, in the order of the run's. */
  function marks(rollout) {
    const say = [...rollout.outcomes].map(
      (letter, at) => `${words(run.properties[at].id)}: ${OUTCOMES[letter]}`,
    );
    const violated = say.filter((text) => text.endsWith(": violated")).length;
    return element(
      "span.marks",
      {
        role: "img",
        aria: { label: `${violated} of ${rollout.outcomes.replaceAll("-", "").length} properties violated` },
      },
      [...rollout.outcomes].map((letter, at) =>
        element("i", { className: `mark ${letter === "-" ? "absent" : letter}`, title: say[at] }),
      ),
    );
  }

  function row(rollout) {
    const href = address.toRollout(rollout);
    return element(
      "tr",
      { className: rollout.outcome, data: { number: String(rollout.number) } },
      element("td.number.col-worst", {}, rollout.violated ? rollout.worst.toFixed(2) : ""),
      element("td.col-task", {}, element("a", { href }, name(rollout.task))),
      element("td.col-policy", {}, name(rollout.policy)),
      element("td.number.col-seed", {}, element("span.seed", {}, "seed "), String(rollout.seed)),
      element(
        "td.col-outcome",
        {},
        element("span.swatch", { className: `swatch ${rollout.outcome}` }),
        figures.OUTCOMES[rollout.outcome],
        rollout.error ? element("span.faint.error", {}, ` ${rollout.error}`) : null,
        rollout.failure ? element("span.faint.error", {}, ` gave up: ${rollout.failure}`) : null,
      ),
      element("td.col-properties", {}, marks(rollout)),
      element("td.number.col-violations", {}, rollout.violations ? String(rollout.violations) : ""),
      element("td.number.col-cost", {}, rollout.cost ? rollout.cost.toFixed(2) : ""),
      element("td.number.col-steps", {}, rollout.steps ? String(rollout.steps) : ""),
    );
  }

  const section = element("section.card", { id: "rollouts" });
  const count = element("p.faint", { id: "count", role: "status" });
  const table = element("table.rollouts", {});
  const more = element("button", { type: "button", on: { click: () => ((shown += 10 * AT_ONCE), fill()) } });

  function build() {
    const state = address.read();
    shown = AT_ONCE;
    section.replaceChildren(
      element("h2", {}, "Rollouts"),
      controls(state),
      count,
      element("div.scroll", {}, table),
      more,
    );
    redraw();
    return section;
  }

  function redraw() {
    rows = selected();
    fill();
  }

  function fill() {
    const none = element("tr", {}, element("td.faint.none", { colSpan: COLUMNS.length }, "No rollout matches."));
    const body = rows.length ? rows.slice(0, shown).map(row) : [none];
    table.replaceChildren(head(address.read()), element("tbody", {}, body));
    const violated = rows.filter((own) => own.violated).length;
    count.textContent = `${counted(rows.length, "rollout")} of ${run.rollouts.length}, ${violated} violated`;
    more.hidden = rows.length <= shown;
    more.textContent = `Show more (${rows.length - shown} left)`;
  }

  return { build, selected, choose };
})();
