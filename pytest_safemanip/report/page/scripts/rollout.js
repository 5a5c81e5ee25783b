// One rollout: its violations, its timeline, and its replay where there is one.
SafemanipReport.rollout = (() => {
  "use strict";

  const { element, name, seconds, counted, words, notice } = SafemanipReport.dom;
  const { run, OUTCOMES } = SafemanipReport.data;
  const { address, lanes, signals, violations, figures } = SafemanipReport;
  const total = run.rollouts.reduce((sum, own) => sum + own.violations, 0);
  const FEW = 4; // as many as the style sheet shows at first
  let current = null;

  function head(rollout, details) {
    const list = SafemanipReport.table.selected();
    const at = list.findIndex((own) => own.number === rollout.number);
    const step = (to, label, title) => {
      const other = list[at + to];
      return element(
        "a.button",
        {
          href: other && at >= 0 ? address.toRollout(other) : undefined,
          title,
          className: other && at >= 0 ? "button" : "button off",
          id: to < 0 ? "previous" : "next",
        },
        label,
      );
    };
    return element(
      "div.head",
      {},
      element(
        "nav.steps",
        { aria: { label: "Rollouts" } },
        element(
          "a.button",
          { href: "#", id: "overview-link", on: { click: (event) => (event.preventDefault(), close()) } },
          "← Overview",
        ),
        step(-1, "‹ previous", "Previous rollout of the table (k)"),
        step(1, "next ›", "Next rollout of the table (j)"),
      ),
      element(
        "h1",
        {},
        name(rollout.task),
        element("span.faint", {}, " "),
        name(rollout.policy),
        element("span.faint", {}, ` seed ${rollout.seed}`),
      ),
      element(
        "p.summary",
        {},
        element("span.swatch", { className: `swatch ${rollout.outcome}` }),
        figures.OUTCOMES[rollout.outcome],
        details?.steps ? `, ${duration(details)}` : "",
        `, suite ${words(rollout.suite)}, horizon ${words(rollout.horizon)}`,
        details?.episode
          ? `, ${details.episode.backend}, ${details.episode.scenes} scenes, ${details.episode.assets} assets`
          : "",
      ),
      details?.instruction ? element("blockquote", {}, name(details.instruction)) : null,
      rollout.error ? element("p.warning", {}, rollout.error) : null,
      rollout.failure ? element("p.warning", {}, `The policy gave up: ${rollout.failure}`) : null,
      details?.note ? element("p.warning", {}, details.note) : null,
    );
  }

  /** The steps of the robot, and those in which what it let go settles. */
  function duration({ acting, steps, dt }) {
    const settling = steps - acting;
    const own = `${counted(acting, "step")} (${seconds(acting * dt)})`;
    return settling > 0
      ? `${own} and ${settling} to settle`
      : `${own}, truncated (no settle tail)`;
  }

  /** The lanes of an instance of a property, then what was measured. */
  function groupsOf(details, property, instance) {
    const about = instance.entities.length
      ? `${words(property.id)}: ${instance.entities.join(", ")}`
      : words(property.id);
    const calls = new Set(instance.lanes.map((lane) => lane.call));
    const behind = details.signals.filter((signal) => signal.of.some((call) => calls.has(call)));
    const others = details.signals.filter((signal) => !signal.of.length);
    return [
      {
        title: about,
        lanes: [
          ...instance.lanes.map((lane) => lanes.truth(lane.atom, lane.runs, { title: lane.call })),
          lanes.obligation(property, instance, details.steps, details.dt),
          lanes.automaton(property, instance, details.steps),
        ],
      },
      { title: "measured", lanes: [...behind, ...others].map(signals.lane) },
      {
        title: "task",
        lanes: [
          lanes.truth("success", details.success, { className: "success", title: "the task's own check" }),
        ],
      },
    ];
  }

  function moments(details, seek) {
    return element(
      "ol.moments",
      { aria: { label: "Key moments" } },
      details.moments.map((moment) =>
        element(
          "li",
          {},
          element(
            "button.moment",
            {
              type: "button",
              className: `moment ${moment.kind}`,
              data: { step: String(moment.step) },
              on: { click: () => seek(moment.step) },
            },
            element("span.at", {}, seconds(moment.step * details.dt)),
            moment.text,
          ),
        ),
      ),
    );
  }

  /** The properties of the rollout; those that were triggered can be looked at. */
  function properties(details, choose) {
    const ORDER = { VIOLATED: 0, UNRESOLVED: 1, SATISFIED: 2, VACUOUS: 3 };
    const sorted = [...details.properties].sort((one, other) => ORDER[one.outcome] - ORDER[other.outcome]);
    return element(
      "ul.properties",
      {},
      sorted.flatMap((property) =>
        property.instances.length
          ? property.instances.map((instance) =>
              element(
                "li",
                {},
                element(
                  "button.instance",
                  {
                    type: "button",
                    data: { instance: `${property.id}:${instance.entities.join(",")}` },
                    on: { click: () => choose(property, instance) },
                  },
                  element("i", { className: `mark ${instance.findings.length ? "V" : letter(property)}` }),
                  words(property.id),
                  instance.entities.length
                    ? element("span.faint", {}, ` ${instance.entities.join(", ")}`)
                    : "",
                ),
              ),
            )
          : [
              element(
                "li.none",
                {},
                element("i.mark.N", {}),
                words(property.id),
                element("span.faint", {}, ` ${OUTCOMES[letter(property)]}`),
              ),
            ],
      ),
    );
  }

  const letter = (property) =>
    ({ VIOLATED: "S", UNRESOLVED: "U", SATISFIED: "S", VACUOUS: "N" })[property.outcome];

  /** The replay in 3D, where the page has one of the rollout; `mount` once the box has its size. */
  function replay(details, onStep) {
    const box = element("div.replay", { id: "replay", aria: { label: "Replay in 3D" } });
    box.hidden = !details.replay || typeof SafemanipReplay === "undefined";
    let scene = null;
    return {
      box,
      mount() {
        if (box.hidden) return;
        try {
          scene = SafemanipReplay.mount(box, details.replay, { onStep, controls: false });
        } catch (error) {
          box.replaceChildren(element("p.faint", {}, `No replay: ${error.message}`));
        }
      },
      seek: (step) => scene?.seek(step),
      highlight: (names) => scene?.highlight(names.length ? names : null),
      look: (property, first) => scene?.look(property, first),
      dispose: () => scene?.dispose(),
    };
  }

  /** The video of the rollout, where the run has one; as long as it is not played, it follows. */
  function clip(details, onStep) {
    if (!details.video) return { box: null, seek: () => {} };
    const video = element("video", {
      id: "video",
      src: details.video,
      controls: true,
      muted: true,
      preload: "metadata",
      on: { timeupdate: () => video.paused || onStep(video.currentTime / details.dt) },
    });
    const box = element("details.clip", { open: true }, element("summary", {}, "Video"), video);
    return { box, seek: (step) => video.paused && (video.currentTime = step * details.dt) };
  }

  function build(rollout, details) {
    if (!details?.steps) {
      const why = details
        ? ""
        : run.details[rollout.number] === undefined && rollout.success !== null
          ? "No timeline: the page has those of rollouts with a violation."
          : "";
      return element(
        "div.rollout",
        {},
        head(rollout, details),
        why ? element("p.faint", {}, why) : null,
        details?.violations?.length
          ? element("section.card", {}, element("h2", {}, "Violations"), violations.told(details))
          : null,
        details?.commands ? commands(details) : null,
      );
    }
    const found = violations.list(details);
    const explained = element("div.explained", {});
    const proved = element("div.proved", {});
    const moved = (step) => {
      scene.seek(step);
      film.seek(step);
      address.remember({ step: String(step) });
    };
    const line = SafemanipReport.timeline.build(details, moved);
    const scene = replay(details, (step) => line.seek(step));
    const film = clip(details, (step) => line.seek(step));
    let shown = null;
    const cards = element("div.violations.few", {});
    const others = element(
      "button.small.rest",
      { type: "button", on: { click: () => (cards.classList.remove("few"), others.remove()) } },
      `Show ${found.length - FEW} more`,
    );
    others.hidden = found.length <= FEW;

    function mark(selector) {
      for (const own of body.querySelectorAll(".chosen")) own.classList.remove("chosen");
      body.querySelector(selector)?.classList.add("chosen");
    }

    function chooseViolation(violation, step = violation.first) {
      line.show(groupsOf(details, violation.property, violation.instance), violation);
      line.seek(step);
      scene.highlight(violation.guilty);
      scene.look(violation.property.id, violation.first);
      explained.replaceChildren(violations.explanation(violation, details));
      proved.replaceChildren(violations.again(violation, details));
      shown = violation;
      mark(`[data-violation="${CSS.escape(violation.id)}"]`);
      address.remember({ violation: violation.id });
    }

    function chooseInstance(property, instance) {
      const own = found.find((violation) => violation.instance === instance);
      if (own) return chooseViolation(own);
      line.show(groupsOf(details, property, instance), null);
      scene.highlight(instance.entities);
      proved.replaceChildren();
      explained.replaceChildren(
        element(
          "article.explanation",
          {},
          element("h3", {}, property.title),
          element("code.formula", {}, property.formula),
          element("p.faint", {}, `${property.outcome.toLowerCase()}: ${instance.entities.join(", ")}`),
        ),
      );
      mark(`[data-instance="${CSS.escape(`${property.id}:${instance.entities.join(",")}`)}"]`);
      address.remember({ violation: null });
    }

    /** Choose one of the cards; where its lanes are out of sight, as on a phone, go there. */
    function chooseCard(violation) {
      chooseViolation(violation);
      const over = body.querySelector(".over");
      if (over.getBoundingClientRect().top > 0.8 * innerHeight) over.scrollIntoView({ block: "start" });
    }

    cards.append(...found.map((violation) => violations.card(violation, details, total, chooseCard)));
    const body = element(
      "div.rollout",
      {},
      head(rollout, details),
      element(
        "div.columns",
        { className: `columns ${scene.box.hidden && !film.box ? "" : "seen"}` },
        scene.box.hidden && !film.box ? null : element("section.card.scene", {}, scene.box, film.box),
        element(
          "section.card.side",
          {},
          found.length ? [element("h2", {}, counted(found.length, "violation")), cards, others] : null,
          explained,
        ),
        element(
          "section.card.more",
          {},
          proved,
          element(
            "details.others",
            { open: !found.length },
            element("summary", {}, "All properties"),
            properties(details, chooseInstance),
          ),
        ),
        element(
          "section.card.over",
          {},
          element("h2", {}, "Timeline"),
          moments(details, (step) => line.seek(step)),
          line.box,
          element(
            "p.faint.keys",
            {},
            "← → step, shift for ten; b unsafe step; n p other violations; z zoom; space play; j k other rollouts; esc overview",
          ),
        ),
      ),
    );
    const state = address.read();
    const wanted =
      found.find((own) => own.id === state.violation) ??
      found.find((own) => own.property.id === state.about) ??
      found[0];
    const told = details.properties.filter((property) => property.instances.length);
    const first = told.find((property) => property.outcome === "UNRESOLVED") ?? told[0];
    // The lanes need their width, which they have once they are on the page.
    const begin = () => {
      scene.mount();
      if (wanted) chooseViolation(wanted, state.step === undefined ? wanted.first : Number(state.step));
      else if (first) chooseInstance(first, first.instances[0]);
      if (!wanted && state.step !== undefined) line.seek(Number(state.step));
    };
    const other = (way) => {
      const at = found.findIndex((own) => own.id === address.read().violation);
      if (found.length) chooseViolation(found[(at + way + found.length) % found.length]);
    };
    current = {
      follow(next) {
        const own = found.find((violation) => violation.id === next.violation);
        if (own && own !== shown) chooseViolation(own);
        if (next.step !== undefined) line.seek(Number(next.step));
      },
      key(event) {
        if (event.key === "n") other(1);
        else if (event.key === "p") other(-1);
        else return line.key(event);
        return true;
      },
      redraw: line.redraw,
      dispose() {
        line.dispose();
        scene.dispose();
      },
    };
    return { body, begin };
  }

  function commands(details) {
    return element(
      "details",
      {},
      element("summary", {}, "Reproduce with"),
      Object.values(details.commands).map((text) => SafemanipReport.dom.command(text)),
    );
  }

  function leave() {
    current?.dispose();
    current = null;
  }

  const close = () => address.change({ rollout: null, step: null, violation: null, about: null });

  /** Show a rollout in an element. */
  async function open(rollout, into) {
    leave();
    let details = null;
    try {
      details = await SafemanipReport.data.details(rollout.number);
    } catch (error) {
      notice(error.message);
      details = { note: error.message, ranks: {}, commands: {} };
    }
    if (address.read().rollout !== address.key(rollout)) return; // somebody was faster
    const made = build(rollout, details);
    into.replaceChildren(made.body ?? made);
    made.begin?.();
    into.focus({ preventScroll: true });
    document.title = `${rollout.task}, ${rollout.policy}, seed ${rollout.seed}`;
  }

  return {
    open,
    leave,
    close,
    follow: (state) => current?.follow(state),
    key: (event) => current?.key(event) ?? false,
    redraw: () => current?.redraw(),
  };
})();
