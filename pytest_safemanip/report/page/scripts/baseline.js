// The comparison with a baseline: what changed, and which rollouts flipped.
SafemanipReport.baseline = (() => {
  "use strict";

  const { element, name, percent, counted, words } = SafemanipReport.dom;
  const { run, find } = SafemanipReport.data;
  const { address, figures } = SafemanipReport;
  const { badge, section } = figures;

  function build() {
    const release = run.release;
    if (release?.refused)
      return section("Baseline", null, element("p.warning", {}, `No comparison: ${release.refused}`));
    if (!release?.baseline) return null;
    const { place, comparisons, flips, unpaired, absent, earlier } = release.baseline;
    const signed = (value) => (value === null ? "–" : `${value > 0 ? "+" : ""}${(value * 100).toFixed(1)}`);
    return section(
      "Against the baseline",
      `${place}. Changes in points with 90 % intervals; p is one-sided and adjusted; MDE is the minimum detectable effect at a power of 80 %.${unpaired ? ` ${counted(unpaired, "rollout")} without a counterpart.` : ""}${absent ? ` ${absent} of the baseline's ${counted(earlier, "rollout")} have no counterpart.` : ""}`,
      element(
        "div.scroll",
        { tabIndex: 0 },
        element(
          "table.plain",
          {},
          element(
            "thead",
            {},
            element(
              "tr",
              {},
              ["verdict", "what", "policy", "before", "now", "change", "p", "MDE", "pairs"].map((text) =>
                element("th", { scope: "col" }, text),
              ),
            ),
          ),
          element(
            "tbody",
            {},
            comparisons.map((own) =>
              element(
                "tr",
                {},
                element(
                  "td",
                  {},
                  badge(own.verdict),
                  own.required ? null : element("span.faint", {}, " not required"),
                ),
                element("td", {}, words(own.name), own.why ? element("span.faint", {}, ` ${own.why}`) : null),
                element("td", {}, name(own.policy)),
                element("td.number", {}, rate(own, 0)),
                element("td.number", {}, rate(own, 1)),
                element(
                  "td.number",
                  {},
                  own.interval && tested(own)
                    ? `${signed(own.difference)} (${signed(own.interval[0])} to ${signed(own.interval[1])})`
                    : "–",
                ),
                element("td.number", {}, tested(own) ? Math.min(own.p_worse ?? 1, own.p_better ?? 1).toFixed(3) : "–"),
                element("td.number", {}, tested(own) ? signed(own.detectable) : "–"),
                element(
                  "td.number",
                  {},
                  String(Object.values(own.pairs).reduce((sum, count) => sum + count, 0)),
                ),
              ),
            ),
          ),
        ),
      ),
      flips.length ? flipLists(flips) : element("p.faint", {}, "No rollout flipped."),
    );
  }

  /** Whether some rollout triggered it; what nothing triggered was not tested. */
  const tested = ({ triggered }) => !triggered || triggered.some(Boolean);

  /** How often it was violated, before (0) or now (1). */
  const rate = ({ before, now, triggered }, at) =>
    triggered && !triggered[at] && before !== null ? "never" : percent([before, now][at]);

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
            const text = [
              `${flip.task}, seed ${flip.seed}, `,
              name(flip.policy),
              `: ${words(flip.property)}`,
            ];
            return element(
              "li",
              {},
              rollout
                ? element("a", { href: address.toRollout(rollout, { about: flip.property }) }, text)
                : text,
            );
          }),
        ),
      );
    return element(
      "div",
      {},
      list(
        "Regressed",
        flips.filter((flip) => flip.regressed),
      ),
      list(
        "Fixed",
        flips.filter((flip) => !flip.regressed),
      ),
    );
  }

  return { build };
})();
