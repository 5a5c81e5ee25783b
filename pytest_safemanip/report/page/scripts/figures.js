// Bars, intervals and matrices of the overview: plain elements, readable without colours.
SafemanipReport.figures = (() => {
  "use strict";

  const { element, name, percent, counted, words } = SafemanipReport.dom;
  const OUTCOMES = {
    success_and_safe: "success and safe",
    success_but_unsafe: "success but unsafe",
    fail_but_safe: "fail but safe",
    fail_and_unsafe: "fail and unsafe",
    incomplete: "incomplete",
  };

  /** What a rate says, in words. */
  function told(rate) {
    if (rate.value === null) return "undefined: there is no case";
    return `${percent(rate.value)}: ${rate.hits} of ${rate.of}, 95 % CI ${percent(rate.low)} to ${percent(rate.high)}`;
  }

  /** A rate on an axis from 0 to 100 %: a point, and its interval as a bar. */
  function interval(rate, kind) {
    if (rate.value === null) return element("div.interval.undefined", { title: told(rate) }, element("span.value", {}, "–"));
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
        .map(([key, label]) => element("li", {}, element("span.swatch", { className: `swatch ${key}` }), label)),
    );
  }

  /** Groups by policy: a cell for each, shaded by its share. */
  function matrix({ kind, groups, policies, share, choose }) {
    const cell = (policy, group) => {
      const rate = policy.groups[kind][group]?.[share];
      if (!rate || rate.value === null) return element("td.cell.undefined", { title: rate ? told(rate) : "not in this group" }, "–");
      return element(
        "td.cell",
        { style: { "--share": String(rate.value) }, title: `${policy.name}, ${words(group)}: ${told(rate)}` },
        element(
          "button",
          { type: "button", on: { click: () => choose(policy.name, group) } },
          element("span.shade", {}),
          element("span.number", {}, percent(rate.value)),
        ),
      );
    };
    const tasks = (group) => Math.max(...policies.map((policy) => policy.groups[kind][group]?.tasks ?? 0));
    return element(
      "div.scroll",
      { tabIndex: 0 },
      element(
        "table.matrix",
        {},
        element("thead", {}, element("tr", {}, element("th", {}, ""), policies.map((policy) => element("th", { scope: "col" }, name(policy.name))))),
        element(
          "tbody",
          {},
          groups.map((group) =>
            element(
              "tr",
              {},
              element("th", { scope: "row" }, words(group), kind === "tasks" ? null : element("span.faint", {}, ` ${counted(tasks(group), "task")}`)),
              policies.map((policy) => cell(policy, group)),
            ),
          ),
        ),
      ),
    );
  }

  return { OUTCOMES, interval, outcomeBar, legend, matrix, told };
})();
