// Elements and text. Text of recordings becomes text nodes only: nothing is ever parsed as HTML.
const SafemanipReport = {};

SafemanipReport.dom = (() => {
  "use strict";

  /** An element: element("a.button", {href, on: {click}, aria: {label}}, "text", child, ...). */
  function element(kind, given = {}, ...children) {
    const [tag, ...classes] = kind.split(".");
    const made = document.createElement(tag || "div");
    if (classes.length) made.className = classes.join(" ");
    for (const [name, value] of Object.entries(given)) {
      if (value === undefined || value === null) continue;
      if (name === "on") for (const [event, act] of Object.entries(value)) made.addEventListener(event, act);
      else if (name === "aria")
        for (const [key, text] of Object.entries(value)) made.setAttribute(`aria-${key}`, text);
      else if (name === "data") Object.assign(made.dataset, value);
      else if (name === "style")
        for (const [key, text] of Object.entries(value)) made.style.setProperty(key, text);
      else if (name in made) made[name] = value;
      else made.setAttribute(name, value);
    }
    made.append(
      ...children.flat(3).filter((child) => child !== null && child !== undefined && child !== false),
    );
    return made;
  }

  /** A name that a stranger chose, whatever direction it is read in; it may break after its signs and between its words. */
  const name = (text) =>
    element(
      "bdi",
      {},
      text.split(/(?<=[:_/-])|(?<=\.)(?!\d)|(?<=[a-z])(?=[A-Z])/).flatMap((part, at) => (at ? [document.createElement("wbr"), part] : [part])),
    );

  const percent = (value) => (value === null || value === undefined ? "–" : `${(value * 100).toFixed(1)} %`);
  const seconds = (value) => `${value.toFixed(2)}\u00a0s`;
  const counted = (number, noun) => `${number} ${noun}${number === 1 ? "" : "s"}`;
  const words = (id) => id.replaceAll("_", " ");

  /** A number with three digits that matter. */
  function figure(value) {
    if (!Number.isFinite(value)) return "–";
    if (value === 0) return "0";
    const size = Math.abs(value);
    if (size >= 1e6 || size < 0.001) return value.toExponential(1);
    return size >= 1000 ? value.toFixed(0) : String(Number(value.toPrecision(3)));
  }

  let fading = 0;

  /** A short notice for everybody, screen readers included. */
  function notice(text) {
    const box = document.getElementById("notice");
    box.textContent = text;
    box.classList.add("shown");
    clearTimeout(fading);
    fading = setTimeout(() => box.classList.remove("shown"), 2500);
  }

  async function copy(text) {
    try {
      await navigator.clipboard.writeText(text);
    } catch {
      // Pages from a disk may not use the clipboard in every browser.
      const field = element("textarea", { value: text, className: "offscreen" });
      document.body.append(field);
      field.select();
      document.execCommand("copy");
      field.remove();
    }
    notice("Copied");
  }

  /** A command with a button that copies it. */
  function command(text) {
    return element(
      "div.command",
      {},
      element("code", {}, text),
      element("button.small", { type: "button", on: { click: () => copy(text) } }, "Copy"),
    );
  }

  return { element, name, percent, seconds, counted, words, figure, notice, copy, command };
})();
