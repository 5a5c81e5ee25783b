// Dark or light: as the system is, until somebody chooses.
SafemanipReport.theme = (() => {
  "use strict";

  const dark = matchMedia("(prefers-color-scheme: dark)");
  const listeners = [];
  const paper = matchMedia("print");
  let chosen = remembered();

  function remembered() {
    try {
      return localStorage.getItem("safemanip-theme");
    } catch {
      return null; // some browsers keep nothing for pages from a disk
    }
  }

  // Paper is light.
  const current = () => (paper.matches ? "light" : (chosen ?? (dark.matches ? "dark" : "light")));

  function apply() {
    document.documentElement.dataset.theme = current();
    for (const listen of listeners) listen();
  }

  function toggle() {
    chosen = current() === "dark" ? "light" : "dark";
    try {
      localStorage.setItem("safemanip-theme", chosen);
    } catch {
      // it holds until the page is left
    }
    apply();
  }

  /** A colour of the style sheet, for what is drawn on a canvas. */
  const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();

  dark.addEventListener("change", apply);
  paper.addEventListener("change", apply);
  document.documentElement.dataset.theme = current();

  return { current, toggle, colour, listen: (act) => listeners.push(act) };
})();
