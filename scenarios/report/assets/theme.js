// Colours of the figures, those of report.css: light, dark, and light again on paper.
//
//   tlpsimTheme.colour("text")    value of the style's variable --text
//   tlpsimTheme.series(2)         colour of a line; 0 is that of the text
//   tlpsimTheme.onChange(draw)    draw() is called when the colours change, and around printing
//   tlpsimTheme.width(element)    how wide a figure in it is to be, also on paper
//   tlpsimTheme.axes(x, y)        axes for uPlot, from { label, log }
//   tlpsimTheme.figures(value)    a number as text
"use strict";

window.tlpsimTheme = (() => {
  const COUNT = 7;
  const PAPER = { whole: 680, half: 325 }; // widths on paper, which the browser tells too late
  const FONT = '12px system-ui, -apple-system, "Segoe UI", Roboto, sans-serif';
  // Pixels for the figures of a logarithmic axis, below (2) and beside (3): of a power of ten, and for twos and fives.
  const ROOM = { 2: { decade: 40, fine: 140 }, 3: { decade: 18, fine: 70 } };
  const AROUND = { x: 70, y: 60 }; // pixels of axes and their names
  const root = document.documentElement;
  const listeners = [];
  const known = new Map();
  const superscript = (text) => [...text].map((letter) => "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"["-0123456789".indexOf(letter)]).join("");

  function colour(name) {
    if (!known.has(name)) known.set(name, getComputedStyle(root).getPropertyValue(`--${name}`).trim());
    return known.get(name);
  }

  const series = (number) => (number === 0 ? colour("text") : colour(`series-${((number - 1) % COUNT) + 1}`));

  function width(element, least = 200) {
    if (root.classList.contains("printing")) return element.closest(".grid") ? PAPER.half : PAPER.whole;
    return Math.max(element.clientWidth, least);
  }

  function changed() {
    known.clear();
    for (const draw of listeners) draw();
  }

  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", changed);
  addEventListener("beforeprint", () => {
    root.classList.add("printing");
    changed();
  });
  addEventListener("afterprint", () => {
    root.classList.remove("printing");
    changed();
  });

  /** A number with at most six figures, in powers of ten where it is far from one. */
  function figures(value, count = 6) {
    if (value === null || value === undefined || Number.isNaN(value)) return "–";
    const size = Math.abs(value);
    if (size !== 0 && (size < 1e-4 || size >= 1e7)) {
      const [mantissa, exponent] = value.toExponential(Math.min(count - 1, 3)).split("e");
      return `${Number(mantissa)}·10${superscript(String(Number(exponent)))}`.replace("-", "−");
    }
    return String(Number(value.toPrecision(count))).replace("-", "−");
  }

  const isDecade = (value) => Math.abs(Math.log10(value) - Math.round(Math.log10(value))) < 1e-9;
  const only = (keep) => (_, splits) => splits.map((value) => (keep(value) ? value : null));

  /** Lines of a logarithmic axis: 1 to 9 times each power of ten. uPlot's own do not end from some beginnings. */
  function logarithmic(_plot, _axis, least, most) {
    const found = [];
    for (let power = Math.floor(Math.log10(least)); power <= Math.log10(most); power++) {
      for (let digit = 1; digit < 10; digit++) found.push(Number(`${digit}e${power}`));
    }
    return found.filter((value) => value >= least && value <= most);
  }

  /** Which of them have a figure: powers of ten, where there is room, and the twos and fives where there is more. */
  function figured(plot, splits, number) {
    const { scale, side } = plot.axes[number];
    const length = side === 2 ? plot.width - AROUND.x : plot.height - AROUND.y; // the frame itself is not known yet
    const decade = length / Math.log10(plot.scales[scale].max / plot.scales[scale].min);
    const every = Math.ceil(ROOM[side].decade / decade);
    const round = (value) => isDecade(value) && Math.round(Math.log10(value)) % every === 0;
    const fine = (value) => [1, 2, 5].includes(Number(value.toExponential()[0]));
    return only(decade > ROOM[side].fine ? fine : round)(plot, splits);
  }

  /** A figure of a logarithmic axis; one far from one as a power of ten. */
  function power(value) {
    const exponent = Math.log10(value);
    return isDecade(value) && Math.abs(exponent) > 3.5 ? `10${superscript(String(Math.round(exponent)))}` : figures(value);
  }

  const texts = (text) => (_, splits) => splits.map((value) => (value === null ? null : text(value)));

  function axis(side, { label, log }, size) {
    return {
      side,
      label,
      labelSize: 18,
      labelGap: 2,
      size,
      space: side === 2 ? 60 : 24,
      font: FONT,
      labelFont: FONT,
      stroke: () => colour("muted"),
      grid: { stroke: () => colour("grid"), width: 1, filter: log && side === 3 ? only(isDecade) : (_, splits) => splits },
      ticks: { stroke: () => colour("grid"), width: 1, size: 4 },
      values: texts(log ? power : figures),
      ...(log ? { splits: logarithmic, filter: figured } : {}),
    };
  }

  const axes = (x, y) => [axis(2, x, 30), axis(3, y, 58)];

  return { colour, series, width, onChange: (draw) => listeners.push(draw), axes, figures };
})();
