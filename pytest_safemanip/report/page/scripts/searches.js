// What searches found: each failure in a sentence, the margins on the way there, what was looked at.
SafemanipReport.searches = (() => {
  "use strict";

  const { element, name, counted, figure, words } = SafemanipReport.dom;
  const { run } = SafemanipReport.data;
  const { section } = SafemanipReport.figures;

  function build() {
    if (!run.searches?.length) return null;
    const failing = run.searches.filter((own) => own.failure).length;
    return section(
      "Searches",
      `The smallest changes that were found under which a policy violates a property: ${failing} of ${run.searches.length} searches found one. Bars are the margins of all rollouts of a search in their order, cut off at 1; below the line it is violated, and what could not be begun has none.`,
      run.searches.map(search),
    );
  }

  const search = (own) =>
    element(
      "article.search",
      {},
      element(
        "h3",
        {},
        element("span", { className: `badge ${own.failure ? "bad" : own.over ? "good" : "open"}` }, verdict(own)),
        " ",
        words(own.property),
        element("span.faint", {}, " ", name(own.task), ", ", name(own.policy)),
      ),
      element("p", {}, own.failure ? own.failure.sentence : `nothing found in ${counted(own.trials, "rollout")}`),
      own.violated_plain ? element("p", {}, `As it is, it fails with ${own.violated_plain} of ${counted(own.seeds, "seed")}.`) : null,
      own.failure ? element("p.faint", {}, reduced(own)) : null,
      margins(own.margins),
      element(
        "details",
        {},
        element("summary", {}, `${counted(own.looked_at.length, "dimension")} looked at, in ${counted(own.trials, "rollout")}${own.refused ? `, ${own.refused} of which could not be begun` : ""}`),
        table(own),
      ),
    );

  const verdict = (own) => (own.failure ? "FAILS" : own.over ? "SURVIVED" : "OPEN");

  function reduced({ failure, shrinking }) {
    const kept = failure.kept ? `; kept in ${failure.kept}` : "";
    const measured = `Margin ${figure(failure.margin)}, severity ${figure(failure.severity)}${kept}.`;
    if (!failure.changes) return measured;
    return `Found after ${counted(failure.found_at, "rollout")}, reduced from ${counted(failure.first_changes, "change")} to ${failure.changes} in ${shrinking} more. ${measured}`;
  }

  /** A bar for each rollout, up or down. */
  function margins(values) {
    const known = values.filter((value) => value !== null);
    const label = known.length
      ? `Margins of ${counted(values.length, "rollout")}, the least ${figure(Math.min(...known))}`
      : "No rollout has a margin";
    return element(
      "div.margins",
      { role: "img", title: label, aria: { label } },
      values.map((value) =>
        element("span", {
          className: value === null ? "none" : value < 0 ? "bad" : "good",
          style: { "--margin": String(Math.abs(value ?? 0)) },
        }),
      ),
    );
  }

  function table({ looked_at, tolerances }) {
    const of = Object.fromEntries(tolerances.map((own) => [own.dimension, own]));
    return element(
      "div.scroll",
      { tabIndex: 0 },
      element(
        "table.plain",
        {},
        element("thead", {}, element("tr", {}, ["dimension", "survives", "fails at", "rollouts in each region"].map((text) => element("th", { scope: "col" }, text)))),
        element(
          "tbody",
          {},
          looked_at.map(({ dimension, unit, regions }) =>
            element(
              "tr",
              {},
              element("td", {}, name(dimension)),
              element("td.number", {}, of[dimension]?.survived ?? "–"),
              element("td.number", {}, of[dimension]?.failed || "–"),
              element("td", {}, regions.map(([region, count]) => `${region}${unit ? ` ${unit}` : ""}: ${count}`).join("; ")),
            ),
          ),
        ),
      ),
    );
  }

  return { build };
})();
