// The violations of a rollout: what was broken, by what, what proves it, how to see it again.
SafemanipReport.violations = (() => {
  "use strict";

  const { element, name, figure, seconds, command, words } = SafemanipReport.dom;

  const { run } = SafemanipReport.data;

  /** The hardest contact of a violation, which need not be that of its first step. */
  const hardest = ({ force, limit }) => `hardest ${figure(force)} N, ${figure(force / limit)} × its limit`;

  const capitalized = (text) => text[0].toUpperCase() + text.slice(1);

  /** All violations, the worst first. */
  function list(details) {
    const found = [];
    for (const property of details.properties ?? []) {
      for (const instance of property.instances) {
        for (const finding of instance.findings) {
          const opened = opening(instance, finding);
          const rank = details.ranks[property.id]?.[finding.place] ?? null;
          found.push({ ...finding, property, instance, opened, rank, id: `${property.id}.${finding.place}` });
        }
      }
    }
    return found.sort((one, other) => (one.rank ?? 1e9) - (other.rank ?? 1e9) || one.first - other.first);
  }

  /** The step since which the obligation was open that was broken. */
  function opening(instance, finding) {
    const { spans } = SafemanipReport.lanes;
    const before = spans(instance.pending).filter(
      ([first, last]) => first < finding.first && last >= finding.first - 1,
    );
    return before.length ? before[before.length - 1][0] : finding.first;
  }

  /** Entities with what they are. */
  function entities(names, known) {
    return names.flatMap((own, at) => [
      at ? ", " : "",
      name(own),
      known[own] ? element("span.faint", {}, ` (${known[own]})`) : "",
    ]);
  }

  /** A violation as a choice among others. */
  function card(violation, details, total, choose) {
    return element(
      "button.card-violation",
      { type: "button", data: { violation: violation.id }, on: { click: () => choose(violation) } },
      element(
        "span.rank",
        { title: `of ${total} in this run, ${run.ranked}` },
        violation.rank ? `#${violation.rank}` : "",
      ),
      element(
        "span.what",
        {},
        element("strong", {}, words(violation.property.id)),
        violation.guilty.length ? [" ", entities(violation.guilty, details.entities)] : null,
        element("span.evidence", {}, violation.evidence[0] ?? violation.reason),
        violation.severity ? element("span.evidence", {}, violation.severity) : null,
        violation.excess ? element("span.evidence", {}, hardest(violation.excess)) : null,
      ),
      element(
        "span.when",
        {},
        `step ${violation.first}`,
        element("br"),
        `${seconds(violation.duration_s)} unsafe`,
      ),
    );
  }

  /** All that is known about one. */
  function explanation(violation, details) {
    const { property } = violation;
    const dt = details.dt;
    return element(
      "article.explanation",
      {},
      element("h3", {}, property.title),
      element(
        "p.faint",
        {},
        [...new Set([words(property.id), words(property.category), property.source])].join(", "),
      ),
      element("code.formula", {}, property.formula),
      property.deadline
        ? element("p.faint", {}, `within ${property.deadline} s, discharged by ${property.discharged_by}`)
        : null,
      element(
        "p.finding",
        {},
        element("strong.bad", {}, `Violated at step ${violation.first}`),
        ` (${seconds(violation.first * dt)})`,
        violation.entities.length ? [" for ", entities(violation.entities, details.entities)] : null,
        `: ${violation.reason}, unsafe for ${seconds(violation.duration_s)}`,
        violation.opened < violation.first
          ? `, pending since step ${violation.opened} (${seconds(violation.opened * dt)})`
          : "",
        ".",
      ),
      violation.severity ? element("p.severity", {}, capitalized(violation.severity), ".") : null,
      violation.excess
        ? element(
            "p",
            {},
            `At its hardest, at step ${violation.excess.step}: `,
            ...violation.excess.between.flatMap((own, at) => [at ? " and " : "", name(own)]),
            `, ${figure(violation.excess.force)} N, ${figure(violation.excess.force / violation.excess.limit)} × its limit of ${figure(violation.excess.limit)} N.`,
          )
        : null,
      violation.evidence.length
        ? element(
            "ul.evidence",
            {},
            violation.evidence.map((line) => element("li", {}, line)),
          )
        : null,
    );
  }

  /** The proof, and the commands to see it again. */
  function again(violation, details) {
    return element(
      "article.explanation",
      {},
      element(
        "details.proof",
        {},
        element("summary", {}, "The steps that prove it"),
        element("pre", { tabIndex: 0 }, violation.proof),
      ),
      element("h4", {}, "Reproduce with"),
      command(details.commands[violation.property.id] ?? ""),
      element("h4", {}, "Look at it with"),
      command(`safemanip show ${quoted(details.recording)}`),
    );
  }

  /** What a violation is about, with what goes before it. */
  const about = ({ entities }) => (entities.length ? ` ${entities.join(", ")}` : "");

  const quoted = (path) => (/^[\w@%+=:,./-]+$/.test(path) ? path : `'${path.replaceAll("'", `'"'"'`)}'`);

  /** The violations as the summary has them, where there is no recording to judge. */
  function told(details) {
    return element(
      "div",
      {},
      [...details.violations].sort((one, other) => one.first - other.first).map((own) =>
        element(
          "article.explanation.told",
          {},
          element("h3", {}, element("strong", {}, words(own.property)), about(own)),
          own.title ? element("p", {}, own.title, element("span.faint", {}, ` ${own.source}`)) : null,
          own.formula ? element("code.formula", {}, own.formula) : null,
          element(
            "p.finding",
            {},
            element("strong.bad", {}, `Violated at step ${own.first}`),
            `: ${own.reason}, unsafe for ${seconds(own.duration_s)}${own.severity ? `, ${own.severity}` : ""}${own.excess ? `, ${hardest(own.excess)}` : ""}.`,
          ),
          own.evidence.length
            ? element(
                "ul.evidence",
                {},
                own.evidence.map((line) => element("li", {}, line)),
              )
            : null,
          own.timeline ? excerpt(own.timeline, own) : null,
        ),
      ),
    );
  }

  /** The propositions around a violation, as the summary keeps them: a column for some steps. */
  function excerpt({ start, stride, lanes }, { first, last }) {
    const { truth } = SafemanipReport.lanes;
    const columns = Math.max(0, ...Object.values(lanes).map((lane) => lane.length));
    const runs = (lane) => [...lane].flatMap((mark, at) => (mark === "#" ? [at, at] : []));
    const unsafe = [first, last].map((step) => Math.floor((step - start) / stride));
    const drawn = [
      ...Object.entries(lanes).map(([atom, lane]) => truth(atom, runs(lane))),
      truth("unsafe", unsafe, { className: "unsafe" }),
    ];
    for (const lane of drawn) lane.draw([0, columns - 1]);
    return element(
      "div.excerpt",
      {},
      drawn.map((lane) =>
        element("div.track", {}, element("div.label", {}, element("span.text", {}, lane.label)), lane.plot),
      ),
      element("p.faint", {}, `steps ${start} to ${start + stride * columns - 1}`),
    );
  }

  return { hardest, told, list, card, explanation, again };
})();
