// The figures of the paper's questions: policies by success and violation, rates by horizon.
SafemanipReport.charts = (() => {
  "use strict";

  const { element, name, words } = SafemanipReport.dom;
  const { run } = SafemanipReport.data;
  const { theme } = SafemanipReport;
  const COLOURS = 8;
  const live = [];
  let chosen = null;

  // With a policy chosen, the others fade.
  const colour = (at) => theme.colour(`series-${at % COLOURS}`) + (chosen === null || chosen === at ? "" : "30");
  // A letter beside each point: what is told apart by colour is told apart without it, too.
  const letter = (at) => (at < 26 ? String.fromCharCode(65 + at) : String(at + 1));

  /** Letters of some policies, neighbours as a range: A–D, F. */
  function lettersOf(members) {
    const parts = [];
    for (const at of [...members].sort((one, other) => one - other)) {
      const end = parts[parts.length - 1];
      if (end && end[1] === at - 1) end[1] = at;
      else parts.push([at, at]);
    }
    return parts
      .map(([first, last]) =>
        first === last ? letter(first) : `${letter(first)}${last === first + 1 ? ", " : "–"}${letter(last)}`,
      )
      .join(", ");
  }

  const ticks = (_, splits) => splits.map((value) => `${Math.round(value * 100)} %`);

  function axis(label) {
    return {
      label,
      labelFont: "12px system-ui, sans-serif",
      labelSize: 18,
      size: 26,
      font: "12px system-ui, sans-serif",
      stroke: () => theme.colour("faint"),
      grid: { stroke: () => theme.colour("line"), width: 1 },
      ticks: { show: false },
    };
  }

  /** A chart in an element of its own, as wide as that; drawn again with another theme or width. */
  function chart(title, options, data) {
    const box = element("div.chart", { role: "img", aria: { label: title } });
    let drawn = null;
    const draw = () => {
      if (!box.clientWidth) return;
      drawn?.destroy();
      drawn = new uPlot(
        { ...options, width: box.clientWidth, height: Math.min(360, Math.max(260, box.clientWidth * 0.6)) },
        data,
        box,
      );
    };
    new ResizeObserver(() => drawn?.width !== box.clientWidth && draw()).observe(box);
    live.push(draw);
    return element("figure", {}, element("figcaption", {}, title), box);
  }

  /** Success against violation: a point for each policy, with the intervals of both. */
  function trade() {
    const points = run.policies
      .map(({ name: policy, total }, at) => ({
        policy,
        at,
        success: total.success_rate,
        violation: total.violation_rate,
      }))
      .filter((point) => point.success.value !== null && point.violation.value !== null)
      .sort((one, other) => one.success.value - other.success.value);
    if (!points.length) return null;

    function marks(u) {
      const { ctx } = u;
      const x = (value) => u.valToPos(value, "x", true);
      const y = (value) => u.valToPos(value, "y", true);
      const size = 5 * devicePixelRatio;
      ctx.save();
      ctx.font = `600 ${12 * devicePixelRatio}px system-ui, sans-serif`;
      const groups = [];
      for (const point of points) {
        const { at, success, violation } = point;
        const place = [x(success.value), y(violation.value)];
        const near = groups.find((own) => Math.hypot(own.place[0] - place[0], own.place[1] - place[1]) < 2 * size);
        if (near) near.members.push(at);
        else groups.push({ place, members: [at] });
        ctx.strokeStyle = ctx.fillStyle = colour(at);
        ctx.globalAlpha = 0.45;
        ctx.lineWidth = 2 * devicePixelRatio;
        ctx.beginPath();
        ctx.moveTo(x(success.low), y(violation.value));
        ctx.lineTo(x(success.high), y(violation.value));
        ctx.moveTo(x(success.value), y(violation.low));
        ctx.lineTo(x(success.value), y(violation.high));
        ctx.stroke();
        ctx.globalAlpha = 1;
        ctx.beginPath();
        ctx.arc(x(success.value), y(violation.value), size, 0, 7);
        ctx.fill();
      }
      labels(u, groups);
      ctx.restore();
    }

    /** Policies at one place have one label, which is on no other. */
    function labels(u, groups) {
      const { ctx } = u;
      const taken = [];
      for (const { place, members } of groups) {
        const text = lettersOf(members);
        const width = ctx.measureText(text).width;
        const left = place[0] > u.bbox.left + u.bbox.width * 0.85;
        const high = place[1] < u.bbox.top + 16 * devicePixelRatio;
        const from = left ? place[0] - width - 8 * devicePixelRatio : place[0] + 8 * devicePixelRatio;
        let below = place[1] + (high ? 16 : -7) * devicePixelRatio;
        const way = (high ? 14 : -14) * devicePixelRatio;
        const hits = (own) =>
          Math.abs(own.below - below) < Math.abs(way) && from < own.to && own.from < from + width;
        while (taken.some(hits)) below += way;
        taken.push({ below, from, to: from + width });
        const shown = members.includes(chosen) ? chosen : members.length === 1 ? members[0] : null;
        ctx.textAlign = "left";
        ctx.fillStyle = shown === null ? theme.colour("ink") : colour(shown);
        ctx.fillText(text, from, below);
      }
    }

    return chart(
      "Success against violation, with 95 % intervals",
      {
        legend: { show: false },
        cursor: { show: false },
        padding: [10, 14, 0, 0],
        scales: { x: { time: false, range: [-0.02, 1.02] }, y: { range: [-0.02, 1.02] } },
        axes: [
          { ...axis("success rate"), values: ticks },
          { ...axis("violation rate"), values: ticks, size: 56 },
        ],
        series: [{}, { paths: () => null, points: { show: false } }],
        hooks: { draw: [marks] },
      },
      [points.map((point) => point.success.value), points.map((point) => point.violation.value)],
    );
  }

  /** The letters of policies beside the last points of their lines, none on another. */
  const ends = (values) => (u) => {
    const { ctx } = u;
    const gap = 13 * devicePixelRatio;
    const places = values
      .map((own, at) => ({ at, last: own.findLastIndex((value) => value !== null) }))
      .filter((place) => place.last >= 0)
      .map((place) => ({
        ...place,
        x: u.valToPos(place.last, "x", true),
        y: u.valToPos(values[place.at][place.last], "y", true),
      }))
      .sort((one, other) => one.y - other.y);
    ctx.save();
    ctx.font = `600 ${11 * devicePixelRatio}px system-ui, sans-serif`;
    ctx.textBaseline = "middle";
    const below = new Map();
    for (const place of places) {
      const y = Math.max(place.y, (below.get(place.last) ?? -Infinity) + gap);
      below.set(place.last, y);
      ctx.fillStyle = colour(place.at);
      ctx.fillText(letter(place.at), place.x + 12 * devicePixelRatio, y);
    }
    ctx.restore();
  };

  /** A share over the horizons, a line for each policy. */
  function horizons(share, title) {
    const names = [...new Set(run.policies.flatMap((policy) => Object.keys(policy.groups.horizons)))];
    if (names.length < 2) return null;
    const values = run.policies.map((policy) =>
      names.map((own) => policy.groups.horizons[own]?.[share].value ?? null),
    );
    return chart(
      title,
      {
        legend: { show: false },
        cursor: { show: false },
        padding: [10, 28, 0, 0],
        scales: { x: { time: false, range: [-0.25, names.length - 0.75] }, y: { range: [-0.02, 1.02] } },
        axes: [
          {
            ...axis("horizon"),
            splits: () => names.map((_, at) => at),
            values: (_, splits) => splits.map((at) => words(names[at] ?? "")),
          },
          { ...axis(""), values: ticks, size: 48, labelSize: 0 },
        ],
        series: [
          {},
          ...run.policies.map((_, at) => ({
            stroke: () => colour(at),
            width: 2,
            dash: at < COLOURS ? undefined : [6, 4],
            points: { show: true, size: 8, fill: () => colour(at), stroke: () => colour(at) },
          })),
        ],
        hooks: { draw: [ends(values)] },
      },
      [names.map((_, at) => at), ...values],
    );
  }

  function legend() {
    return element(
      "ul.legend",
      {},
      run.policies.map(({ name: policy }, at) => {
        const choose = (value) => () => {
          chosen = value;
          live.forEach((draw) => draw());
        };
        const on = {
          mouseenter: choose(at),
          mouseleave: choose(null),
          focus: choose(at),
          blur: choose(null),
        };
        return element(
          "li",
          { tabIndex: 0, on },
          element("b", { style: { color: `var(--series-${at % COLOURS})` } }, letter(at)),
          " ",
          name(policy),
        );
      }),
    );
  }

  function build() {
    const figures = [
      trade(),
      horizons("violation_rate", "Violation rate by horizon"),
      horizons("unsafe_share_of_successes", "Unsafe share of successes by horizon"),
    ].filter(Boolean);
    return figures.length ? [element("div.figures", {}, figures), legend()] : [];
  }

  theme.listen(() => live.forEach((draw) => draw()));
  return { build };
})();
