/* What is around the picture of a replay: texts, buttons, the slider. */
(function () {
  "use strict";

  window.SafemanipReplay = window.SafemanipReplay || {inner: {}};

  function make(name, className, parent, text) {
    const found = document.createElement(name);
    found.className = className;
    if (text !== undefined) found.textContent = text;
    if (parent) parent.append(found);
    return found;
  }

  function seconds(step, dt) {
    return `${(step * dt).toFixed(2)} s`;
  }

  function words(data, entity) {
    const {name, category} = data.entities[entity];
    return category && category !== name ? `${name} (${category})` : name;
  }

  /** The buttons, the slider and the lines of text below and above the picture. */
  function panel(root, data, withControls) {
    const stage = make("div", "smr-stage", root);
    const canvas = make("canvas", "smr-canvas", stage);
    canvas.tabIndex = 0;
    canvas.setAttribute("role", "img");
    canvas.setAttribute("aria-label", `3D replay of ${data.task}, ${data.policy}, seed ${data.seed}`);
    const message = make("div", "smr-message", stage);
    const readout = make("div", "smr-readout", stage);
    const labels = make("div", "smr-labels", stage);
    const bar = make("div", "smr-bar", root);
    const play = make("button", "smr-button", bar, "\u25b6");
    play.type = "button";
    play.setAttribute("aria-label", "play");
    const line = make("div", "smr-line", bar);
    const marks = make("div", "smr-marks", line);
    for (const finding of data.findings) {
      const mark = make("span", "smr-mark", marks);
      const last = Math.max(1, data.steps - 1);
      mark.style.left = `${(100 * finding.first) / last}%`;
      mark.style.width = `${(100 * (finding.last - finding.first)) / last}%`;
      mark.title = `${finding.property}, step ${finding.first}`;
    }
    const slider = make("input", "smr-slider", line);
    slider.type = "range";
    slider.min = 0;
    slider.max = data.steps - 1;
    slider.step = 1;
    slider.setAttribute("aria-label", "step");
    const clock = make("span", "smr-clock", bar);
    const jump = make("button", "smr-button", bar, "Violation");
    jump.type = "button";
    jump.hidden = data.findings.length === 0;
    const reset = make("button", "smr-button", bar, "Reset view");
    reset.type = "button";
    bar.hidden = !withControls;
    return {stage, canvas, labels, message, readout, bar, play, slider, clock, jump, reset};
  }

  Object.assign(SafemanipReplay.inner, {make, panel, seconds, words});
})();
