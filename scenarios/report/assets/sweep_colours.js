// Colours of values: a scale from low to high for numbers, the colours of lines for words.
//
//   tlpsimColours.scale(share)               colour of a share of the range, 0 to 1
//   tlpsimColours.on(colour)                 black or white, which is read better on it
//   tlpsimColours.by(column, rows)           { count, of(row) -> number of a colour or -1, colour(number), legend() }
//   tlpsimColours.bar(least, most, unit)     the scale with its ends, as an element
"use strict";

window.tlpsimColours = (() => {
  const theme = window.tlpsimTheme;
  const { make } = window.tlpsimLines;
  const STEPS = 48;
  // Viridis at equal shares: its lightness rises evenly, also for those who do not see all colours.
  const VIRIDIS = [[68, 1, 84], [71, 44, 122], [59, 81, 139], [44, 113, 142], [33, 144, 141], [39, 173, 129],
    [92, 200, 99], [170, 220, 50], [253, 231, 37]];
  const MOST_NAMES = 7; // colours of lines

  const luminance = ([red, green, blue]) => 0.299 * red + 0.587 * green + 0.114 * blue;

  function parts(colour) {
    if (colour.startsWith("rgb")) return colour.match(/[\d.]+/g).map(Number);
    return [1, 3, 5].map((place) => parseInt(colour.slice(place, place + 2), 16));
  }

  const dark = () => luminance(parts(theme.colour("page"))) < 128;

  function scale(share) {
    const place = Math.min(Math.max(share, 0), 1) * (VIRIDIS.length - 1);
    const low = Math.min(Math.floor(place), VIRIDIS.length - 2);
    return `rgb(${VIRIDIS[low].map((value, i) => Math.round(value + (place - low) * (VIRIDIS[low + 1][i] - value)))})`;
  }

  /** The part of the scale that is seen on the page as points and lines. */
  const visible = (share) => scale(dark() ? 0.22 + 0.78 * share : 0.87 * share);
  const on = (colour) => (luminance(parts(colour)) > 135 ? "#10151a" : "#ffffff");

  function bar(least, most, unit, colour = scale) {
    const stops = Array.from({ length: 13 }, (_, i) => colour(i / 12)).join(",");
    const strip = make("span", { class: "ramp" });
    strip.style.backgroundImage = `linear-gradient(90deg, ${stops})`;
    return make("span", { class: "scale" }, theme.figures(least, 3), strip, `${theme.figures(most, 3)} ${unit}`);
  }

  /** Words with the colours of their levels. */
  function names(words, colour) {
    return make("ul", { class: "legend" }, ...words.map((word, level) => {
      const dot = make("span", { class: "swatch dots" });
      dot.style.setProperty("--swatch", colour(level));
      return make("li", {}, dot, word);
    }));
  }

  function by(column, rows) {
    if (!column) return { count: 1, of: () => 0, colour: () => theme.colour("series-1"), legend: () => make("span") };
    if (column.text && column.levels.length <= MOST_NAMES) {
      const item = (name, i) => make("li", {}, make("span", { class: `swatch dots s${i + 1}` }), name);
      return { count: column.levels.length, of: (row) => column.of(row), colour: (number) => theme.series(number + 1),
        legend: () => make("ul", { class: "legend" }, ...column.levels.map(item)) };
    }
    let least = Infinity, most = -Infinity;
    for (const row of rows) {
      const value = column.of(row);
      if (value < least) least = value;
      if (value > most) most = value;
    }
    const span = most - least || 1;
    const of = (row) => {
      const value = column.of(row);
      return Number.isNaN(value) ? -1 : Math.round(((value - least) / span) * (STEPS - 1));
    };
    const legend = () => (column.text
      ? names(column.levels, (level) => visible((level - least) / span))
      : bar(least, most, column.unit, visible));
    return { count: STEPS, of, colour: (number) => visible(number / (STEPS - 1)), legend };
  }

  return { scale, on, by, bar, STEPS };
})();
