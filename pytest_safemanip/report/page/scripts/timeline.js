// One timeline of lanes that share their steps: a cursor, a window, keys and fingers to move them.
SafemanipReport.timeline = (() => {
  "use strict";

  const { element, seconds } = SafemanipReport.dom;
  const AROUND_S = 1.0;

  /**
   * A timeline in an element.
   *
   * @param details of the rollout
   * @param onStep called with the step whenever it changes
   */
  function build(details, onStep) {
    const last = details.steps - 1;
    let window = [0, last];
    let step = 0;
    let lanes = [];
    let focus = null;
    let playing = 0;

    const cursor = element("div.cursor", { aria: { hidden: "true" } });
    const flag = element("span.flag", {});
    const tracks = element("div.tracks", {});
    const ruler = element("div.ruler", {});
    const slider = element("input", {
      type: "range",
      id: "step",
      min: 0,
      max: last,
      step: 1,
      aria: { label: "Step" },
      on: { input: () => seek(Number(slider.value)) },
    });
    const where = element("output.where", { id: "where" });
    const button = (label, title, act, id) =>
      element(
        "button.small",
        { type: "button", title, id, aria: { label: title }, on: { click: act } },
        label,
      );
    const play = button("Play", "Play (space)", toggle, "play");
    const zoom = button("Zoom", "Zoom to the violation (z)", () => zoomed(), "zoom");
    const controls = element(
      "div.controls",
      {},
      button("Unsafe step", "To the first unsafe step (b)", () => focus && seek(focus.first), "to-violation"),
      button("◀", "One step back (left arrow)", () => seek(step - 1), "back"),
      play,
      button("▶", "One step on (right arrow)", () => seek(step + 1), "on"),
      zoom,
      where,
    );
    cursor.append(flag);
    const box = element(
      "div.timeline",
      {},
      controls,
      element("div.slide", {}, slider),
      element("div.area", {}, ruler, tracks, cursor),
    );

    function track(lane) {
      return element(
        "div.track",
        { className: lane.group ? `track ${lane.group}` : "track" },
        element("div.label", { title: lane.title }, element("span.text", {}, lane.label), lane.value),
        lane.plot,
      );
    }

    /** Show other lanes; `about` is the violation that they are about. */
    function show(groups, about) {
      for (const lane of lanes) lane.dispose?.();
      lanes = groups.flatMap((group) => group.lanes);
      focus = about;
      zoom.disabled = !about;
      tracks.replaceChildren(
        ...groups.map((group) =>
          element("div.group", {}, element("h4", {}, group.title), group.lanes.map(track)),
        ),
      );
      redraw();
    }

    function redraw() {
      for (const lane of lanes) lane.draw(window);
      marks();
      place();
    }

    /** The ruler: seconds, the settle tail, and where the violation is. */
    function marks() {
      const [from, to] = window;
      const size = to - from + 1;
      const share = (at) => `${(100 * (at - from)) / size}%`;
      const every =
        [0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 60, 120].find((gap) => (size * details.dt) / gap <= 10) ?? 300;
      const parts = [];
      for (
        let tick = Math.ceil((from * details.dt) / every);
        tick * every <= (to + 1) * details.dt;
        tick += 1
      ) {
        const at = (tick * every) / details.dt;
        parts.push(
          element("span.tick", { style: { left: share(at) } }, at - from > 0.93 * size ? "" : `${Number((tick * every).toFixed(1))} s`),
        );
      }
      const band = (first, end, className, title) => {
        const start = Math.max(first, from);
        const stop = Math.min(end, to) + 1;
        if (stop > start)
          parts.push(
            element("span", {
              className: `band ${className}`,
              title,
              style: { left: SafemanipReport.lanes.within((100 * (start - from)) / size, className), width: `${(100 * (stop - start)) / size}%` },
            }),
          );
      };
      if (details.acting <= last) band(details.acting, last, "tail", "the robot has stopped");
      if (focus) band(focus.first, focus.last, "unsafe", "unsafe");
      ruler.replaceChildren(element("div.label", {}), element("div.plot", {}, parts));
    }

    function place() {
      const [from, to] = window;
      const inside = step >= from && step <= to;
      cursor.hidden = !inside;
      cursor.style.setProperty("--at", String((step + 0.5 - from) / (to - from + 1)));
      flag.textContent = String(step);
      slider.value = String(step);
      slider.setAttribute("aria-valuetext", `step ${step}, ${seconds(step * details.dt)}`);
      where.textContent = `step ${step} of ${last}, ${seconds(step * details.dt)}`;
      for (const lane of lanes) lane.seek(step);
    }

    function seek(next) {
      if (!Number.isFinite(next)) return; // of an address that somebody wrote
      const bounded = Math.min(Math.max(Math.round(next), 0), last);
      if (bounded === step) return;
      step = bounded;
      if (step < window[0] || step > window[1]) shift();
      place();
      onStep(step);
    }

    /** Move the window so that the step is within it. */
    function shift() {
      const size = window[1] - window[0];
      const from = Math.min(Math.max(step - Math.floor(size / 2), 0), Math.max(last - size, 0));
      window = [from, from + size];
      for (const lane of lanes) lane.draw(window);
      marks();
    }

    function zoomed() {
      const around = Math.round(AROUND_S / details.dt);
      const whole = window[0] === 0 && window[1] === last;
      window =
        whole && focus
          ? [Math.max((focus.opened ?? focus.first) - around, 0), Math.min(focus.last + around, last)]
          : [0, last];
      zoom.textContent = whole && focus ? "Whole" : "Zoom";
      redraw();
    }

    function toggle() {
      if (playing) return stop();
      if (step === last) seek(0);
      play.textContent = "Pause";
      let before = performance.now();
      let part = step;
      const tick = (now) => {
        part += (now - before) / 1000 / details.dt;
        before = now;
        seek(part);
        if (step >= last) return stop();
        playing = requestAnimationFrame(tick);
      };
      playing = requestAnimationFrame(tick);
    }

    function stop() {
      cancelAnimationFrame(playing);
      playing = 0;
      play.textContent = "Play";
    }

    /** The step below a pointer. */
    function below(event) {
      const plot = ruler.querySelector(".plot").getBoundingClientRect();
      const share = (event.clientX - plot.left) / plot.width;
      return window[0] + Math.floor(share * (window[1] - window[0] + 1));
    }

    const area = box.querySelector(".area");
    area.addEventListener("pointerdown", (event) => {
      if (event.button !== 0 || event.clientX < ruler.querySelector(".plot").getBoundingClientRect().left)
        return;
      area.setPointerCapture(event.pointerId);
      seek(below(event));
    });
    area.addEventListener("pointermove", (event) => {
      if (area.hasPointerCapture(event.pointerId)) seek(below(event));
    });

    const resized = new ResizeObserver(() => redraw());
    resized.observe(area);

    const KEYS = {
      ArrowLeft: (event) => seek(step - (event.shiftKey ? 10 : 1)),
      ArrowRight: (event) => seek(step + (event.shiftKey ? 10 : 1)),
      Home: () => seek(0),
      End: () => seek(last),
      " ": toggle,
      b: () => focus && seek(focus.first),
      z: () => focus && zoomed(),
    };

    return {
      box,
      show,
      seek,
      redraw,
      key(event) {
        if (!(event.key in KEYS)) return false;
        KEYS[event.key](event);
        return true;
      },
      step: () => step,
      dispose() {
        stop();
        resized.disconnect();
        for (const lane of lanes) lane.dispose?.();
      },
    };
  }

  return { build };
})();
