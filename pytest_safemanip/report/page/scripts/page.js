// Puts the page together, and shows what the address asks for.
SafemanipReport.page = (() => {
  "use strict";

  const { element } = SafemanipReport.dom;
  const { run, find } = SafemanipReport.data;
  const { address, theme, overview, table, rollout } = SafemanipReport;
  const main = document.getElementById("main");
  let shown = null;
  let scrolled = 0;

  const themeButton = element(
    "button.small",
    { type: "button", id: "theme", title: "Dark or light (t)", on: { click: theme.toggle } },
    "◐",
  );
  document
    .getElementById("bar")
    .append(
      element(
        "a.brand",
        { href: "#", on: { click: (event) => (event.preventDefault(), rollout.close()) } },
        "Safety report",
      ),
      element("span.faint", {}, `${run.title}, ${run.written}`),
      themeButton,
    );

  const home = element("div.home", {});
  const unknown = element("p", { id: "unknown", role: "alert" });
  main.before(unknown);

  function showHome() {
    rollout.leave();
    const first = !home.childElementCount;
    if (first) home.append(...[overview.build(), table.build(), overview.about()].flat(3).filter(Boolean));
    else table.build();
    if (shown !== home) {
      main.replaceChildren(home);
      scrollTo(0, scrolled);
    }
    shown = home;
    document.title = `Safety report: ${run.title}`;
  }

  function show(state) {
    const wanted = state.rollout ? find(state.rollout) : null;
    unknown.hidden = !state.rollout || Boolean(wanted);
    unknown.className = unknown.hidden ? "" : "warning";
    unknown.textContent = unknown.hidden ? "" : `There is no rollout ${state.rollout} in this run.`;
    if (!wanted) return showHome();
    if (shown === home) scrolled = scrollY;
    if (shown === wanted) return rollout.follow(state);
    shown = wanted;
    scrollTo(0, 0);
    return rollout.open(wanted, main);
  }

  function neighbour(way) {
    document.getElementById(way > 0 ? "next" : "previous")?.click();
  }

  addEventListener("keydown", (event) => {
    const typing = event.target.closest?.("input:not([type=range]), select, textarea");
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    if (event.key === "Escape" && address.read().rollout) return rollout.close();
    if (typing) return undefined;
    if (event.key === "t") return theme.toggle();
    if (event.key === "/" && document.getElementById("search")) {
      event.preventDefault();
      return document.getElementById("search").focus();
    }
    if (event.key === "j") return neighbour(1);
    if (event.key === "k") return neighbour(-1);
    // A button keeps its own space key.
    if (event.key === " " && event.target.closest?.("button, summary, a")) return undefined;
    if (rollout.key(event)) event.preventDefault();
    return undefined;
  });

  theme.listen(() => rollout.redraw());
  address.listen(show);
  show(address.read());
})();
