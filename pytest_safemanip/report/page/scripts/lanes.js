// Lanes over the steps: values of propositions, obligations, states of the automaton.
SafemanipReport.lanes = (() => {
  "use strict";

  const { element } = SafemanipReport.dom;

  /** Pairs of a run-length code: [[first, last], ...]. */
  function spans(runs) {
    const found = [];
    for (let at = 0; at < runs.length; at += 2) found.push([runs[at], runs[at + 1]]);
    return found;
  }

  const holds = (runs, step) => spans(runs).some(([first, last]) => first <= step && step <= last);

  /** The state at a step, of a code of changes. */
  function stateAt(changes, step) {
    let state = changes[1];
    for (let at = 0; at < changes.length && changes[at] <= step; at += 2) state = changes[at + 1];
    return state;
  }

  // A violation stays visible beside the cursor, at the last step, too.
  const within = (share, className) =>
    className.includes("unsafe") ? `min(${share}%, calc(100% - 9px))` : `${share}%`;

  /** A block over some steps, in a window of steps. */
  function block(window, first, last, className, title, text) {
    const [from, to] = window;
    if (last < from || first > to) return null;
    const size = to - from + 1;
    const start = Math.max(first, from);
    const end = Math.min(last, to) + 1;
    return element(
      "span",
      {
        className: `block ${className}`,
        title: title ?? "",
        style: {
          left: within((100 * (start - from)) / size, className),
          width: `${(100 * (end - start)) / size}%`,
        },
      },
      text ?? "",
    );
  }

  /** A lane that is true or false. */
  function truth(label, runs, { className = "true", title } = {}) {
    const plot = element("div.lane", {});
    const value = element("span.value", {});
    return {
      label,
      title: title ?? label,
      plot,
      value,
      draw(window) {
        plot.replaceChildren(
          ...spans(runs)
            .map(([first, last]) =>
              block(window, first, last, className, `${label}: steps ${first} to ${last}`),
            )
            .filter(Boolean),
        );
      },
      seek(step) {
        const now = holds(runs, step);
        value.textContent = now ? "true" : "false";
        value.classList.toggle("on", now);
      },
    };
  }

  /** What the automaton owes: pending obligations, and where they are broken. */
  function obligation(property, instance, steps, dt) {
    const plot = element("div.lane.tall", {});
    const value = element("span.value", {});
    const { states } = property;
    return {
      label: "obligation",
      title: "what the monitor still asks for, and where nothing can make it good any more",
      plot,
      value,
      draw(window) {
        const blocks = [];
        for (let at = 0; at < instance.states.length; at += 2) {
          const last = (instance.states[at + 2] ?? steps) - 1;
          const state = states[instance.states[at + 1]];
          if (state.residual && state.kind !== "false")
            blocks.push(
              block(
                window,
                instance.states[at],
                last,
                "pending",
                `pending: ${state.residual}`,
                state.residual,
              ),
            );
        }
        if (property.deadline) {
          const room = Math.floor(property.deadline / dt + 1e-9);
          for (const [first, last] of spans(instance.pending)) {
            if (last - first + 1 >= room)
              blocks.push(
                block(
                  window,
                  first + room,
                  first + room,
                  "due",
                  `due within ${property.deadline} s, by step ${first + room}`,
                ),
              );
          }
        }
        const unsafe = spans(instance.unsafe);
        unsafe.forEach(([first, last], at) => {
          const drawn = block(window, first, last, "unsafe", `unsafe: steps ${first} to ${last}`);
          // Wide enough to be seen, but not into the next one.
          const room = (100 * ((unsafe[at + 1]?.[0] ?? window[1] + steps) - first)) / (window[1] - window[0] + 1);
          drawn?.style.setProperty("min-width", `clamp(1px, calc(${room}% - 2px), 9px)`);
          blocks.push(drawn);
        });
        plot.replaceChildren(...blocks.filter(Boolean));
      },
      seek(step) {
        const state = states[stateAt(instance.states, step)];
        const unsafe = holds(instance.unsafe, step);
        value.textContent = unsafe ? "unsafe" : state.residual ? "pending" : "nothing";
        value.classList.toggle("bad", unsafe);
        value.classList.toggle("on", !unsafe && Boolean(state.residual));
      },
    };
  }

  /** Which state the automaton is in. */
  function automaton(property, instance, steps) {
    const plot = element("div.lane.states", {});
    const value = element("span.value", {});
    return {
      label: "automaton",
      title: "state of the property's automaton after each step",
      plot,
      value,
      draw(window) {
        const blocks = [];
        for (let at = 0; at < instance.states.length; at += 2) {
          const number = instance.states[at + 1];
          const last = (instance.states[at + 2] ?? steps) - 1;
          const { kind, residual } = property.states[number];
          blocks.push(
            block(
              window,
              instance.states[at],
              last,
              `state ${kind.replace(" ", "-")}`,
              `state ${number}, ${kind}${residual ? `: ${residual}` : ""}`,
              String(number),
            ),
          );
        }
        plot.replaceChildren(...blocks.filter(Boolean));
      },
      seek(step) {
        value.textContent = `state ${stateAt(instance.states, step)}`;
      },
    };
  }

  return { truth, obligation, automaton, spans, holds, stateAt, within };
})();
