// Time series in panels below each other, on one axis of time.
//
//   tlpsimSeries.mount(element, content, unpack, times)
//
// `content` is { records: [{ label, times: { component: packed } }], signals: { name: { unit, description, component,
// group, records: [{ values } or { low, high } or null] } }, panels: [{ title, signals: [name], shown }], from, events:
// [{ time, label }] }; events are marked in each panel.
// What is drawn is thinned to the pixels of the stretch that is shown (thinning.js).
"use strict";

window.tlpsimSeries = (() => {
  const theme = window.tlpsimTheme;
  const thinning = window.tlpsimThinning;
  const { make } = window.tlpsimLines;

  function mount(figure, content, unpack, times) {
    const place = figure.querySelector(".drawing");
    const shown = content.records.map(() => true);
    const panels = new Map(); // by number
    const cache = new Map();
    const stretch = window.tlpsimGestures.stretch(update);
    const table = { content, shown, stretch, moment: null, signalOf, point };
    let waiting = false;

    // Data

    function once(key, make) {
      if (!cache.has(key)) cache.set(key, make());
      return cache.get(key);
    }

    const timesOf = (record, component) =>
      once(`${record} ${component}`, () => times(content.records[record].times[component]));

    /** The signal of a record with its times; null where it was not recorded. */
    async function signalOf(name, record) {
      const { component, records } = content.signals[name];
      const packed = records[record];
      if (!packed) return null;
      return once(`${record} ${name} signal`, async () => {
        const [time, low, high] = await Promise.all([
          timesOf(record, component),
          unpack(packed.values ?? packed.low),
          packed.high ? unpack(packed.high) : null,
        ]);
        return { time, shown: thinning.signal(low, high ?? low, packed.group) };
      });
    }

    async function wholeRange() {
      const ends = [];
      for (const [record, { times: components }] of content.records.entries()) {
        for (const component of Object.keys(components)) {
          const time = await timesOf(record, component);
          if (time.length) ends.push(time[0], time[time.length - 1]);
        }
      }
      return ends.length ? [Math.min(...ends), Math.max(...ends)] : [0, 1];
    }

    // Drawing

    /** Draw all panels at the next frame of the screen. */
    function update() {
      if (waiting) return;
      waiting = true;
      requestAnimationFrame(drawNow);
    }

    function drawNow() {
      waiting = false;
      [from.value, to.value] = stretch.view.map((end) => theme.figures(end).replace("−", "-"));
      for (const panel of panels.values()) panel.refresh();
    }

    /** The pointer is at another time, or nowhere (null). */
    function point(moment) {
      if (moment === table.moment) return;
      table.moment = moment;
      clock.textContent = moment === null ? "" : `t = ${theme.figures(moment)} s`;
      for (const panel of panels.values()) panel.tell();
    }

    // Controls

    const area = make("div", { class: "panels" });
    const clock = make("output", { class: "readout" });
    const field = (name) => make("input", { type: "text", inputmode: "decimal", size: 8, "aria-label": `${name}, s` });
    const [from, to] = [field("from"), field("to")];
    const typed = () => {
      const ends = [from, to].map((each) => Number.parseFloat(each.value));
      if (ends.every(Number.isFinite) && ends[0] < ends[1]) stretch.show(...ends);
    };
    for (const each of [from, to]) each.addEventListener("change", typed);

    function lengths() {
      const centred = (length) => () => {
        const centre = (stretch.view[0] + stretch.view[1]) / 2;
        stretch.show(centre - length / 2, centre + length / 2);
      };
      const actions = [
        ["all", stretch.reset],
        ["10 min", centred(600)],
        ["1 min", centred(60)],
        ["−", () => stretch.zoom(2)],
        ["+", () => stretch.zoom(1 / 2)],
      ];
      const names = { all: "whole record", "−": "show more", "+": "show less" };
      return actions.map(([label, action]) => {
        const button = make("button", { type: "button", "aria-label": names[label] ?? `show ${label}` }, label);
        button.addEventListener("click", action);
        return button;
      });
    }

    /** Check boxes of the records, where there are several. */
    function recordBoxes() {
      if (content.records.length < 2) return [];
      const boxes = content.records.map(({ label }, record) => {
        const box = make("input", { type: "checkbox", checked: true });
        box.addEventListener("change", async () => {
          shown[record] = box.checked;
          for (const panel of panels.values()) await panel.load();
        });
        return make("label", {}, box, make("span", { class: `swatch line s${record + 1}` }), label);
      });
      return [make("fieldset", { class: "records" }, make("legend", {}, "records"), ...boxes)];
    }

    function chooser() {
      const search = make("input", { type: "search", placeholder: "part of a name", "aria-label": "search signals" });
      const list = make("div", { class: "choices" });
      const items = content.panels.map((panel, number) => {
        const box = make("input", { type: "checkbox", checked: panel.shown });
        box.addEventListener("change", () => (box.checked ? open(number) : close(number)));
        const single = panel.signals.length === 1 ? content.signals[panel.signals[0]] : null;
        const label = make("label", { title: single?.description ?? panel.signals.join(", ") }, box, panel.title);
        if (single?.unit) label.append(make("span", { class: "unit" }, single.unit));
        list.append(label);
        return [`${panel.title} ${panel.signals.join(" ")}`.toLowerCase(), label];
      });
      search.addEventListener("input", () => {
        const wanted = search.value.trim().toLowerCase();
        for (const [text, label] of items) label.hidden = !text.includes(wanted);
      });
      const title = make("summary", {}, `Signals (${Object.keys(content.signals).length})`);
      return make("details", { class: "chooser" }, title, search, list);
    }

    async function open(number) {
      if (panels.has(number)) return;
      const panel = new window.tlpsimPanel(table, content.panels[number]);
      panels.set(number, panel);
      const later = [...panels.keys()].filter((each) => each > number).sort((a, b) => a - b);
      area.insertBefore(panel.element, later.length ? panels.get(later[0]).element : null);
      await panel.load();
    }

    function close(number) {
      panels.get(number)?.sight.disconnect();
      panels.get(number)?.plot?.destroy();
      panels.get(number)?.element.remove();
      panels.delete(number);
    }

    async function begin() {
      stretch.whole = await wholeRange();
      stretch.view = [...stretch.whole];
      const row = make("div", { class: "controls sticky" }, ...lengths(), make("label", {}, "from ", from), make("label", {}, "to ", to, " s"), clock);
      const help =
        "Drag over a stretch to see it larger, double-click for all. Wheel: with Ctrl, or after a click on a panel. " +
        "Fingers: drag and pinch. Keys on a panel: ← → + − 0.";
      place.append(row, ...recordBoxes(), chooser(), area, make("p", { class: "small help" }, help));
      for (const [number, panel] of content.panels.entries()) if (panel.shown) await open(number);
      update();
      new ResizeObserver(resize).observe(area);
      theme.onChange(() => {
        for (const panel of panels.values()) {
          panel.fit();
          if (panel.stale) panel.draw();
          panel.plot?.redraw(false, true);
        }
      });
    }

    function resize() {
      for (const panel of panels.values()) panel.fit();
    }

    figure.tlpsimSeries = { stretch, panels };
    return begin();
  }

  return { mount };
})();
