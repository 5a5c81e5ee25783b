// Physical quantities over the steps, with the limits that propositions hold them against.
SafemanipReport.signals = (() => {
  "use strict";

  const { element, figure } = SafemanipReport.dom;
  const { theme } = SafemanipReport;
  const HEIGHT = 56;

  /** The range of the vertical axis: all values, and the limits that are near enough to be drawn. */
  function range(signal) {
    const known = signal.values.filter((value) => value !== null);
    const low = known.length ? Math.min(...known) : 0;
    const high = known.length ? Math.max(...known) : 1;
    const limits = signal.limits.map((limit) => limit.value);
    // A limit far above all that was measured would press the curve flat.
    const near = limits.filter((limit) => limit <= 4 * Math.max(high, 1e-9) || limits.length === 1);
    const from = Math.min(low, ...near, low >= 0 ? 0 : low);
    const to = Math.max(high, ...near);
    const room = (to - from || 1) * 0.08;
    return [from - (from < 0 ? room : 0), to + room];
  }

  function lane(signal) {
    const plot = element("div.lane.signal", {});
    const value = element("span.value", {});
    const share = element("span.share", {});
    const limit = signal.limits.find((own) => own.value) ?? null;
    const unit = signal.unit ? ` ${signal.unit}` : "";
    const [low, high] = range(signal);
    const steps = signal.values.map((_, step) => step + 0.5);
    let chart = null;
    let window = [0, steps.length - 1];

    function limits(u) {
      const { ctx } = u;
      ctx.save();
      ctx.strokeStyle = theme.colour("bad");
      ctx.fillStyle = theme.colour("bad");
      ctx.lineWidth = devicePixelRatio;
      ctx.font = `${10 * devicePixelRatio}px system-ui, sans-serif`;
      ctx.textAlign = "right";
      const written = [];
      for (const limit of signal.limits) {
        if (limit.value > high || limit.value < low) continue;
        const y = Math.round(u.valToPos(limit.value, "y", true)) + 0.5;
        ctx.setLineDash([4 * devicePixelRatio, 3 * devicePixelRatio]);
        ctx.beginPath();
        ctx.moveTo(u.bbox.left, y);
        ctx.lineTo(u.bbox.left + u.bbox.width, y);
        ctx.stroke();
        const text = `${figure(limit.value)}${unit}`;
        const at = y + (y < u.bbox.top + 14 * devicePixelRatio ? 11 : -3) * devicePixelRatio;
        // Beside a label at the same height, not over it.
        const near = written.filter((own) => Math.abs(own.at - at) < 12 * devicePixelRatio);
        const right = Math.min(u.bbox.left + u.bbox.width - 4, ...near.map((own) => own.left - 8));
        ctx.fillText(text, right, at);
        written.push({ at, left: right - ctx.measureText(text).width });
      }
      ctx.restore();
    }

    function make() {
      chart?.destroy();
      chart = new uPlot(
        {
          width: Math.max(plot.clientWidth, 50),
          height: HEIGHT,
          padding: [0, 0, 0, 0],
          legend: { show: false },
          cursor: { show: false },
          axes: [{ show: false }, { show: false }],
          scales: {
            x: { time: false, range: () => [window[0], window[1] + 1] },
            y: { range: () => [low, high] },
          },
          series: [
            {},
            {
              stroke: theme.colour("signal"),
              width: 1.5,
              points: { show: false },
              fill: theme.colour("signal-fill"),
            },
          ],
          hooks: { draw: [limits] },
        },
        [steps, signal.values],
        plot,
      );
    }

    return {
      label: signal.name,
      title: [
        signal.name,
        signal.of.length ? `behind ${signal.of.join(", ")}` : "",
        ...signal.limits.map((own) => `${own.name} = ${figure(own.value)}${unit}`),
      ]
        .filter(Boolean)
        .join("\n"),
      of: signal.of,
      plot,
      value,
      draw(next) {
        window = next;
        make();
      },
      seek(step) {
        const now = signal.values[step];
        value.textContent = now === null || now === undefined ? "–" : `${figure(now)}${unit}`;
        share.textContent = limit && now !== null ? `${figure(now / limit.value)} × limit` : "";
        value.append(share);
      },
      dispose() {
        chart?.destroy();
        chart = null;
      },
    };
  }

  return { lane };
})();
