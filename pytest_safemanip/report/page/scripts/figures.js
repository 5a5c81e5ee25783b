// Bars, intervals and matrices of the overview: plain elements, readable without colours.
SafemanipReport.figures = (() => {
  "use strict";

  const { element, name, percent, words } = SafemanipReport.dom;
  const OUTCOMES = {
    success_and_safe: "success and safe",
    success_but_unsafe: "success but unsafe",
    fail_but_safe: "fail but safe",
    fail_and_unsafe: "fail and unsafe",
    incomplete: "incomplete",
  };

  const GOOD = new Set(["PASS", "HELD", "IMPROVED"]);
  const BAD = new Set(["FAIL", "REGRESSED"]);

  const badge = (verdict) =>
    element(
      "span",
      { className: `badge ${GOOD.has(verdict) ? "good" : BAD.has(verdict) ? "bad" : "open"}` },
      verdict,
    );

  /** Rates that are no alarm when they are high. */
  const NEUTRAL = new Set(["success_rate", "triggered_rate"]);

  function section(title, about, ...content) {
    return element(
      "section.card",
      {},
      element("h2", {}, title),
      about ? element("p.faint", {}, about) : null,
      content,
    );
  }

  /** What a rate says, in words. */
  function told(rate) {
    if (rate.value === null) return "undefined: there is no case";
    if (rate.of === 1) return shown(rate);
    return `${percent(rate.value)}: ${rate.hits} of ${rate.of}, 95 % CI ${percent(rate.low)} to ${percent(rate.high)}`;
  }

  /** A rate as a figure; one rollout makes none, apart from the share of its time. */
  const shown = (rate) =>
    rate.of === 1 && !rate.ofTime ? `${rate.hits} of 1` : percent(rate.value);

  /** A rate on an axis from 0 to 100 %: a point, and its interval as a bar. */
  function interval(rate, kind) {
    if (rate.value === null)
      return element("div.interval.undefined", { title: told(rate) }, element("span.value", {}, "–"));
    const share = (value) => `${value * 100}%`;
    return element(
      "div.interval",
      { className: `interval ${kind}`, title: told(rate), role: "img", aria: { label: told(rate) } },
      element("span.value", {}, shown(rate)),
      rate.of === 1 ? null : element(
        "span.axis",
        {},
        element("span.range", { style: { left: share(rate.low), width: share(rate.high - rate.low) } }),
        element("span.point", { style: { left: share(rate.value) } }),
      ),
    );
  }

  /** The four outcomes of some rollouts as parts of one bar. */
  function outcomeBar(outcomes, choose) {
    const total = Object.values(outcomes).reduce((sum, count) => sum + count, 0);
    const parts = Object.entries(outcomes).filter(([, count]) => count);
    return element(
      "div.stack",
      {},
      parts.map(([key, count]) =>
        element(
          "button.part",
          {
            type: "button",
            className: `part ${key}`,
            style: { "flex-grow": String(count) },
            title: `${OUTCOMES[key]}: ${count} of ${total}, ${percent(count / total)}`,
            aria: { label: `${OUTCOMES[key]}: ${count} of ${total}` },
            on: { click: () => choose(key) },
          },
          String(count),
        ),
      ),
    );
  }

  function legend() {
    return element(
      "ul.legend",
      {},
      Object.entries(OUTCOMES)
        .filter(([key]) => key !== "incomplete")
        .map(([key, label]) =>
          element("li", {}, element("span.swatch", { className: `swatch ${key}` }), label),
        ),
    );
  }

  /**
   * Groups by columns: a cell for each, shaded by its share.
   *
   * @param rows of {id, about}: groups, and what is said beside their names
   * @param columns of {name, groups}: groups by id
   * @param share which of the rates of a group
   * @param choose given a column, the id of a group and the group: what its cell leads to; null if nothing
   */
  function matrix({ rows, columns, share, choose }) {
    const neutral = NEUTRAL.has(share);
    const cell = (column, { id }) => {
      const group = column.groups[id];
      const rate = group?.[share];
      if (!rate || rate.value === null)
        return element("td.cell.undefined", { title: rate ? told(rate) : "not in this group" }, "–");
      const about = `${column.name}, ${words(id)}`;
      // What was never put to the test was not found safe.
      if (!neutral && !group.triggered_rate.hits)
        return element("td.cell.undefined", { title: `${about}: never triggered` }, "never");
      const go = choose(column, id, group);
      const content = [element("span.shade", {}), element("span.number", {}, shown(rate))];
      return element(
        "td.cell",
        {
          className: neutral ? "cell neutral" : "cell",
          style: { "--share": String(rate.value) },
          title: `${about}: ${told(rate)}`,
        },
        go ? element("button", { type: "button", on: { click: go } }, content) : element("span.plain", {}, content),
      );
    };
    return element(
      "div.scroll",
      { tabIndex: 0 },
      element(
        "table.matrix",
        {},
        element(
          "thead",
          {},
          element(
            "tr",
            {},
            element("th", {}, ""),
            columns.map((column) => element("th", { scope: "col" }, name(column.label ?? column.name))),
          ),
        ),
        element(
          "tbody",
          {},
          rows.map((row) =>
            element(
              "tr",
              {},
              element("th", { scope: "row" }, words(row.id), element("span.faint", {}, ` ${row.about}`)),
              columns.map((column) => cell(column, row)),
            ),
          ),
        ),
      ),
    );
  }

  return { OUTCOMES, badge, section, interval, outcomeBar, legend, matrix, told, NEUTRAL };
})();
