// Time against frequency domain: each case with the mean over its replicates and their range, and the line 1:1.
//
//   tlpsimDomains.mount(figure)
"use strict";

window.tlpsimDomains = (() => {
  const sweep = window.tlpsimSweep, plane = window.tlpsimPlane, colours = window.tlpsimColours;
  const theme = window.tlpsimTheme;
  const { make } = sweep;
  const HEIGHT = 420;
  const OFF = 0.1; // of the dashed lines
  const MANY = 2500; // points, from which on they are smaller
  // The largest value of a record is compared with what is expected of it.
  const AGAINST = { maximum: "expected_maximum", minimum: "expected_minimum" };

  function mount(figure) {
    const { data } = sweep, place = figure.querySelector(".drawing");
    const state = { colour: "" };
    const source = sweep.source("domains", () => {});
    const settings = data.varied.map(({ name, label }) => [name, label]);
    const all = data.variants.length > 1 ? [["variant", "variant: all"]] : [];
    const colour = sweep.field("colour", [["", "none"], ...settings, ...all], "", (name) => {
      state.colour = name;
      draw();
    });
    const output = make("p", { class: "small" }), legend = make("div", { class: "controls" });
    place.before(sweep.choosers(["signal", "statistic", "variant"]), make("div", { class: "controls" }, colour));
    const layers = plane.canvas(place, HEIGHT, "Time against frequency domain; arrow keys go from case to case");
    place.after(output, legend);
    let list = [];
    const found = plane.points(layers, {
      told: tell,
      picked: (point) => (point ? select([point], `case ${data.case[point.row]}`) : source.set(null)),
      framed: (points) => select(points, `${points.length} cases of both domains`),
      left: () => tell(null, null),
    });

    function select(points, text) {
      const mask = new Uint8Array(data.count);
      for (const { row } of points) for (const each of data.rows[data.place[row]]) mask[each] = 1;
      source.set(points.length ? mask : null, text);
    }

    /** Cases with a value in both domains: { row, across, mean, low, high, count }. */
    function pairs() {
      const { signal, statistic } = sweep.choice;
      const recorded = data.values(signal, statistic), spectral = data.values(signal, AGAINST[statistic] ?? statistic);
      if (!spectral) return [];
      const cases = [];
      for (const rows of data.rows) {
        if (!data.ofVariants(state.colour) && data.variant[rows[0]] !== sweep.choice.variant) continue;
        let across = NaN, sum = 0, count = 0, low = Infinity, high = -Infinity;
        for (const row of rows) {
          if (data.domain[row] === 0) across = spectral[row];
          else if (!Number.isNaN(recorded[row])) {
            sum += recorded[row];
            count++;
            low = Math.min(low, recorded[row]);
            high = Math.max(high, recorded[row]);
          }
        }
        if (count && !Number.isNaN(across)) cases.push({ row: rows[0], across, mean: sum / count, low, high, count });
      }
      return cases;
    }

    function draw() {
      const { statistic } = sweep.choice, cases = pairs(), { unit } = sweep.chosenColumn();
      const [pen] = layers.pens(), size = layers.size();
      const colouring = colours.by(state.colour ? data.column(state.colour) : null, cases.map(({ row }) => row));
      const every = cases.flatMap(({ across, low, high }) => [across, low, high]);
      const label = data.statistic.get(statistic).label;
      const against = data.statistic.get(AGAINST[statistic] ?? statistic).label;
      const axis = (name) => plane.axis({ label: name, unit, levels: null, text: false }, every);
      const x = axis(`frequency domain: ${against}`), y = axis(`time domain: ${label}`);
      const box = plane.frame(pen, size, x, y);
      lines(pen, box, x);
      const selected = sweep.selected(source), own = source.mask;
      const marked = (row, mask) => data.rows[data.place[row]].some((each) => mask[each]);
      list = cases.map((each) => ({ ...each, x: box.x(each.across), y: box.y(each.mean), colour: colouring.of(each.row),
        faint: (selected && !marked(each.row, selected)) || (own && !marked(each.row, own)) }));
      pen.lineWidth = 1;
      for (const faint of [true, false]) {
        pen.strokeStyle = theme.colour(faint ? "line" : "muted");
        pen.globalAlpha = list.length > MANY ? 0.3 : 0.8;
        pen.beginPath();
        for (const { x, low, high, count, faint: own } of list) {
          if (count < 2 || Boolean(own) !== faint) continue;
          pen.moveTo(x, box.y(low));
          pen.lineTo(x, box.y(high));
        }
        pen.stroke();
      }
      pen.globalAlpha = 1;
      plane.dots(pen, list, list.length > MANY ? 2 : 3.4, colouring.colour);
      found.put(list);
      output.textContent = told(cases);
      const fixed = data.ofVariants(state.colour) ? [] : ["variant"];
      sweep.titled(figure, `${sweep.chosen(fixed)}: time against frequency domain`);
      legend.replaceChildren(...sweep.legend(state.colour, colouring));
      over();
    }

    /** The line 1:1, and those 10 % off. */
    function lines(pen, box, { from, to }) {
      pen.save();
      pen.beginPath();
      pen.rect(box.left, box.top, box.right - box.left, box.bottom - box.top);
      pen.clip();
      pen.strokeStyle = theme.colour("muted");
      for (const [slope, dash] of [[1, []], [1 + OFF, [5, 4]], [1 - OFF, [5, 4]]]) {
        pen.setLineDash(dash);
        pen.lineWidth = dash.length ? 1 : 1.4;
        plane.line(pen, box.x(from), box.y(slope * from), box.x(to), box.y(slope * to));
      }
      pen.restore();
    }

    /** How far the domains are apart, over all cases shown. */
    function told(cases) {
      const ratios = cases.map(({ across, mean }) => mean / across).filter(Number.isFinite).sort((a, b) => a - b);
      if (!ratios.length) return "No case has a value in both domains.";
      const share = ratios.filter((each) => Math.abs(each - 1) <= OFF).length / ratios.length; // rounded down
      const middle = ratios[Math.floor(ratios.length / 2)];
      return `Time over frequency domain: ${middle.toFixed(2)} in the median, ${ratios[0].toFixed(2)} to `
        + `${ratios.at(-1).toFixed(2)}; ${Math.floor(1000 * share) / 10} % of ${ratios.length} cases within 10 %.`;
    }

    function tell(point, event) {
      if (!point) {
        sweep.tip(event ?? {}, null);
        sweep.hover(-1);
        return;
      }
      const { unit } = sweep.chosenColumn(), figures = (value) => theme.figures(value, 4);
      const number = (value) => `${figures(value)} ${unit}`;
      const settings = sweep.told(point.row).slice(1, -1); // without the job, and its value
      const range = point.count > 1 ? ` (${point.count}: ${figures(point.low)} to ${figures(point.high)})` : "";
      const words = [["", `case ${data.case[point.row]}`], ...settings, ["frequency domain", number(point.across)],
        ["time domain", number(point.mean) + range], ["ratio", theme.figures(point.mean / point.across, 3)]];
      sweep.tip(event, words);
      layers.say(event.isTrusted ? "" : words.map((each) => each.join(" ")).join("; "));
      sweep.hover(point.row);
    }

    function over() {
      const pen = layers.overPen();
      if (sweep.hovered < 0) return;
      const point = list.find(({ row }) => data.place[row] === data.place[sweep.hovered]);
      if (point) plane.ring(pen, point.x, point.y);
    }

    draw();
    sweep.onChange(draw);
    sweep.onHover(over);
    new ResizeObserver(draw).observe(place);
    figure.tlpsimDomains = { state, points: () => list, draw };
  }

  return { mount };
})();
