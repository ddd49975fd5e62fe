// A panel of time series: a frame with one or more signals, its name, and the values at the pointer.
//
//   new tlpsimPanel(table, { title, signals })      `element` is to be put into the page, then `await load()`
//
// The panels of a figure share `table`: { content, shown, stretch, moment, signalOf(name, record), point(moment) },
// with the content of series.js, the records that are shown, and the time at the pointer (null for none).
"use strict";

window.tlpsimPanel = (() => {
  const theme = window.tlpsimTheme;
  const thinning = window.tlpsimThinning;
  const { tlpsimGestures } = window;
  const { make } = window.tlpsimLines;
  const HEIGHT = 132;
  const AXIS = 52; // pixels beside the frame
  const AROUND = 30; // s, on either side of an extreme
  const DOT = 12; // pixels between samples that are drawn as dots
  const DASHES = [undefined, [6, 4], [2, 3], [8, 3, 2, 3]];

  /** Whether samples are so far from each other that each is shown as a dot. */
  const apart = (plot, _, first, last) => (last - first) * DOT < plot.over.clientWidth;

  const padded = (_, least, most) => {
    if (least === null || least === undefined) return [0, 1];
    const margin = 0.06 * (most - least) || Math.abs(most) * 0.05 || 1;
    return [least - margin, most + margin];
  };

  class Panel {
    constructor(table, { title, signals }) {
      this.table = table;
      this.names = signals;
      this.lines = []; // of { name, record, index, time, shown }, as they are drawn
      this.legend = []; // the same, as they are named
      this.hidden = new Set(); // indices of names
      this.values = make("span", { class: "values" });
      const events = ["smallest", "largest"].map((kind, largest) => {
        const button = make("button", { type: "button", title: `show the ${kind} value` }, largest ? "max" : "min");
        button.setAttribute("aria-label", `${title}: show the ${kind} value`);
        button.addEventListener("click", () => this.extreme(largest === 1));
        return button;
      });
      const { unit, description } = table.content.signals[signals[0]];
      const name = make("b", { title: signals.length === 1 ? description : signals.join(", ") }, title);
      this.head = make("div", { class: "panel-head" }, name, make("span", { class: "unit" }, unit), this.values, ...events);
      this.place = make("div", { class: "plot", tabindex: "0", role: "img", "aria-label": `${title} over time` });
      this.element = make("div", { class: "panel" }, this.head, this.place);
      tlpsimGestures.keys(this.place, table.stretch);
      this.visible = true;
      this.stale = false; // whether another stretch is to be drawn when it comes into sight
      this.sight = new IntersectionObserver(([entry]) => this.seen(entry.isIntersecting), { rootMargin: "200px" });
      this.sight.observe(this.place);
    }

    async load() {
      const found = [];
      for (const [index, name] of this.names.entries()) {
        for (const record of this.table.content.records.keys()) {
          const signal = this.table.shown[record] ? await this.table.signalOf(name, record) : null;
          if (signal) found.push({ name, record, index, ...signal });
        }
      }
      this.legend = found;
      // The smallest on top, so that the largest does not hide them.
      const spread = ({ shown: { levels } }) => Math.max(...levels.at(-1).high) - Math.min(...levels.at(-1).low);
      this.lines = [...found].sort((a, b) => spread(b) - spread(a));
      const groups = found.map((line) => line.shown.group).filter((group) => group > 1);
      this.note = groups.length ? `envelope of ${Math.max(...groups)} samples` : "";
      this.build();
    }

    style({ index, record }) {
      const several = this.table.shown.filter(Boolean).length > 1;
      if (this.names.length === 1) return { colour: several ? record + 1 : 1, dash: undefined };
      return { colour: index + 1, dash: several ? DASHES[record % DASHES.length] : undefined };
    }

    build() {
      this.plot?.destroy();
      const { stretch } = this.table;
      const series = [{}];
      for (const line of this.lines) {
        const { colour, dash } = this.style(line);
        const stroke = () => theme.series(colour);
        series.push({ stroke, width: 1.2, dash, spanGaps: false, points: { show: apart, size: 4, fill: stroke } });
      }
      const [x, y] = theme.axes({ log: false }, { log: false });
      const options = {
        width: this.width(),
        height: HEIGHT,
        series,
        scales: { x: { time: false }, y: { range: padded } },
        axes: [{ ...x, label: undefined, size: 22 }, { ...y, label: undefined, size: AXIS }],
        legend: { show: false },
        padding: [6, 8, 0, 0],
        cursor: {
          points: { show: false },
          y: false,
          drag: { x: true, y: false, setScale: false },
          sync: { key: "tlpsim", scales: ["x", null] },
          bind: { dblclick: () => stretch.reset },
        },
        hooks: {
          drawClear: [(plot) => this.transient(plot)],
          draw: [(plot) => this.events(plot)],
          setSelect: [(plot) => this.selected(plot)],
          setCursor: [(plot) => this.pointed(plot)],
        },
      };
      this.plot = new uPlot(options, [[0, 1], ...this.lines.map(() => [null, null])], this.place);
      tlpsimGestures.attach(this.plot, stretch);
      this.draw();
    }

    width() {
      return theme.width(this.place, 160);
    }

    fit() {
      if (!this.plot || this.plot.width === this.width()) return;
      this.plot.setSize({ width: this.width(), height: HEIGHT });
      this.draw();
    }

    seen(visible) {
      this.visible = visible;
      if (visible && this.stale) this.draw();
    }

    /** Draw what is in sight, the others later. */
    refresh() {
      this.stale = true;
      if (this.visible) this.draw();
    }

    draw() {
      if (!this.plot) return;
      this.stale = false;
      const { view } = this.table.stretch;
      const pixels = Math.max(this.plot.width - AXIS, 50); // the frame itself is laid out later
      const tables = this.lines.map(({ index, time, shown: signal }) =>
        this.hidden.has(index) ? [[], []] : thinning.between(signal, time, ...view, pixels),
      );
      const data = tables.length ? uPlot.join(tables) : [[]];
      this.plot.batch(() => {
        this.plot.setData(data, false);
        this.plot.setScale("x", { min: view[0], max: view[1] });
      });
      this.tell();
    }

    /** What the colours stand for, and values at the pointer, of each record. */
    tell() {
      const single = this.names.length === 1;
      const items = this.names.map((name, index) => {
        const lines = this.legend.filter((line) => line.index === index);
        if (!lines.length) return "";
        const values = this.table.moment === null ? [] : lines.map((line) => this.value(line, lines.length > 1 && single));
        if (single) return make("span", { class: "value" }, ...values);
        const label = name.replace(/\.(surge|sway|heave|roll|pitch|yaw)$/, "");
        const button = make("button", { type: "button", class: "value", title: "show or hide" });
        button.setAttribute("aria-pressed", String(!this.hidden.has(index)));
        button.append(make("span", { class: `swatch line s${index + 1}` }), label, ...values);
        button.addEventListener("click", () => this.toggle(index));
        return button;
      });
      this.values.replaceChildren(...items, ...(this.note ? [make("i", {}, this.note)] : []));
    }

    value(line, coloured) {
      const [low, high] = thinning.at(line.shown, line.time, this.table.moment);
      const same = low === high || Number.isNaN(low);
      const text = same ? theme.figures(low, 5) : `${theme.figures(low, 5)} to ${theme.figures(high, 5)}`;
      const swatch = coloured ? [make("span", { class: `swatch line s${line.record + 1}` })] : [];
      return make("b", {}, " ", ...swatch, text, " ");
    }

    toggle(index) {
      if (!this.hidden.delete(index)) this.hidden.add(index);
      this.draw();
    }

    extreme(largest) {
      let best = null;
      for (const { time, shown: signal } of this.lines.filter((line) => !this.hidden.has(line.index))) {
        const index = thinning.extreme(signal, largest);
        if (index < 0) continue;
        const [low, high] = thinning.at(signal, time, time[index]);
        const value = largest ? high : low;
        if (best === null || value > best.value === largest) best = { value, time: time[index] };
      }
      if (best) this.table.stretch.show(best.time - AROUND, best.time + AROUND);
    }

    // uPlot's hooks

    /** Grey behind what statistics leave out. */
    transient(plot) {
      const { left, top, width, height } = plot.bbox;
      const { content, stretch } = this.table;
      const end = Math.min(plot.valToPos(content.from, "x", true), left + width);
      if (!(end > left) || content.from <= stretch.whole[0]) return;
      plot.ctx.save();
      plot.ctx.fillStyle = theme.colour("shade");
      plot.ctx.fillRect(left, top, end - left, height);
      plot.ctx.restore();
    }

    /** Lines at the events of the scenario, with what happens. */
    events(plot) {
      window.tlpsimLines.marked(this.table.content.events.map(({ time, label }) => ({ x: time, label })))(plot);
    }

    selected(plot) {
      const { left, width } = plot.select;
      if (width < 3) return;
      const ends = [plot.posToVal(left, "x"), plot.posToVal(left + width, "x")];
      plot.setSelect({ left: 0, top: 0, width: 0, height: 0 }, false);
      this.table.stretch.show(...ends);
    }

    pointed(plot) {
      const { left } = plot.cursor;
      this.table.point(left === null || left < 0 ? null : plot.posToVal(left, "x"));
    }
  }

  return Panel;
})();
