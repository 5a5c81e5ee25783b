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
    return `${percent(rate.value)}: ${rate.hits} of ${rate.of}, 95 % CI ${percent(rate.low)} to ${percent(rate.high)}`;
  }

  /** A rate on an axis from 0 to 100 %: a point, and its interval as a bar. */
  function interval(rate, kind) {
    if (rate.value === null)
      return element("div.interval.undefined", { title: told(rate) }, element("span.value", {}, "–"));
    const share = (value) => `${value * 100}%`;
    return element(
      "div.interval",
      { className: `interval ${kind}`, title: told(rate), role: "img", aria: { label: told(rate) } },
      element("span.value", {}, percent(rate.value)),
      element(
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
   * @param choose called with the name of a column and the id of a group
   */
  function matrix({ rows, columns, share, choose }) {
    const cell = (column, { id }) => {
      const rate = column.groups[id]?.[share];
      if (!rate || rate.value === null)
        return element("td.cell.undefined", { title: rate ? told(rate) : "not in this group" }, "–");
      return element(
        "td.cell",
        { style: { "--share": String(rate.value) }, title: `${column.name}, ${words(id)}: ${told(rate)}` },
        element(
          "button",
          { type: "button", on: { click: () => choose(column.name, id) } },
          element("span.shade", {}),
          element("span.number", {}, percent(rate.value)),
        ),
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

  return { OUTCOMES, badge, section, interval, outcomeBar, legend, matrix, told };
})();
