/* The colours of a replay, on light and dark pages. */
(function () {
  "use strict";

  window.SafemanipReplay = window.SafemanipReplay || {inner: {}};

  // Okabe and Ito's colours: told apart by colour-blind people.
  const THEMES = {
    light: {
      back: "#f4f5f7", guilty: "#d55e00", contact: "#0072b2", robot: "#e9eaec", hand: "#5d6570",
      object: "#56b4e9", room: "#dcdfe3", edge: "#49515c",
    },
    dark: {
      back: "#15181c", guilty: "#ff8b33", contact: "#7cc7f2", robot: "#c9cdd2", hand: "#8b949e",
      object: "#3f8fc0", room: "#33383f", edge: "#0b0d0f",
    },
  };
  const FIXTURES = [
    [/counter|island/i, {light: "#cfc6b8", dark: "#6e675c"}],
    [/cabinet|drawer|box|shel|panel/i, {light: "#dcc9a6", dark: "#7d6e53"}],
    [/./, {light: "#b9c0c7", dark: "#5a626b"}],
  ];

  function lightness(colour) {
    return 0.2126 * colour.r + 0.7152 * colour.g + 0.0722 * colour.b;
  }

  function fixtureColour(category, theme) {
    return FIXTURES.find(([pattern]) => pattern.test(category))[1][theme];
  }

  Object.assign(SafemanipReplay.inner, {THEMES, fixtureColour, lightness});
})();
