// A statistic of each job against a setting, in colours of another one; headings also around a circle.
//
//   tlpsimScatter.mount(figure, content)     content.x: setting to begin with, "" for the first
"use strict";

window.tlpsimScatter = (() => {
  const sweep = window.tlpsimSweep, plane = window.tlpsimPlane, colours = window.tlpsimColours;
  const theme = window.tlpsimTheme;
  const { make } = sweep;
  const HEIGHT = 360, ROUND = 460;
  const MOST_LINES = 14; // colours whose worst values are joined
  const MOST_PLACES = 60; // of the setting, at which they are joined
  const MANY = 2500; // points, from which on they are smaller
  const BESIDE = 67.5; // degrees, where the values of circles stand
  const RADIANS = Math.PI / 180;
  const WORSE = { max: Math.max, min: Math.min, abs: (a, b) => (Math.abs(b) > Math.abs(a) ? b : a) };

  function mount(figure, content) {
    const { data } = sweep, place = figure.querySelector(".drawing");
    const settings = data.varied.map(({ name, label }) => [name, label]);
    const first = data.varied.find(({ name }) => name === content.x) ?? data.varied[0];
    const second = data.varied.find(({ name }) => name.endsWith("significant_height") && name !== first.name)
      ?? data.varied.find((each) => each !== first);
    const state = { x: first.name, colour: second?.name ?? "", round: false };
    const source = sweep.source("trend", () => {});
    const controls = sweep.choosers(["signal", "statistic", "domain", "variant"]);
    const across = sweep.field("across", settings, state.x, (name) => {
      state.x = name;
      draw();
    });
    const all = [["variant", "variant: all"], ["domain", "domain: both"]].filter(([name]) => data[`${name}s`].length > 1);
    const colour = sweep.field("colour", [["", "none"], ...settings, ...all], state.colour, (name) => {
      state.colour = name;
      draw();
    });
    const circle = make("button", { type: "button", "aria-pressed": "false" }, "around the circle");
    circle.addEventListener("click", () => {
      state.round = !state.round;
      circle.setAttribute("aria-pressed", String(state.round));
      draw();
    });
    const legend = make("div", { class: "controls" });
    place.before(controls, make("div", { class: "controls" }, across, colour, circle));
    const round = () => state.round && state.x.endsWith("heading_deg");
    const layers = plane.canvas(place, () => (round() ? ROUND : HEIGHT),
      "Response against a setting; arrow keys go from job to job");
    place.after(legend);
    let list = [];
    const found = plane.points(layers, {
      told: tell,
      picked: (point) => (point ? select([point], sweep.text(point.row).split(";")[0]) : source.set(null)),
      framed: (points) => select(points, `${points.length} points`, true),
      left: () => tell(null, null),
    });

    /** Selects the points' cases, or only their own jobs. */
    function select(points, text, jobs = false) {
      const mask = new Uint8Array(data.count);
      for (const { row } of points) for (const each of jobs ? [row] : data.rows[data.place[row]]) mask[each] = 1;
      source.set(points.length ? mask : null, text);
    }

    const everyVariant = () => data.ofVariants(state.x) || data.ofVariants(state.colour);

    /** Rows that are shown: those of the variant and domain, or of all where these are colours. */
    function shown(x, values) {
      const domain = sweep.DOMAINS.indexOf(sweep.choice.domain), rows = [];
      for (let row = 0; row < data.count; row++) {
        if (!everyVariant() && data.variant[row] !== sweep.choice.variant) continue;
        if (state.colour !== "domain" && data.domain[row] !== domain) continue;
        if (!Number.isNaN(values[row]) && !Number.isNaN(x.of(row))) rows.push(row);
      }
      return rows;
    }

    function draw() {
      const { signal, statistic } = sweep.choice, values = data.values(signal, statistic);
      const x = data.column(state.x), y = data.column(`${signal}|${statistic}`), rows = shown(x, values);
      circle.hidden = !state.x.endsWith("heading_deg");
      const colouring = colours.by(state.colour ? data.column(state.colour) : null, rows);
      const [pen] = layers.pens(), size = layers.size();
      const at = round() ? circular(pen, size, rows, values) : cartesian(pen, size, x, y, rows, values);
      const selected = sweep.selected(source), own = source.mask;
      list = rows.map((row) => {
        const [left, top] = at(x.of(row), values[row]);
        const faint = (selected && !selected[row]) || (own && !own[row]);
        return { row, x: left, y: top, colour: colouring.of(row), faint };
      });
      joined(pen, at, x, rows, values, colouring);
      plane.dots(pen, list, rows.length > MANY ? 2 : 3.2, colouring.colour);
      found.put(list);
      legend.replaceChildren(...sweep.legend(state.colour, colouring));
      const fixed = [state.colour === "domain" ? "" : "domain", everyVariant() ? "" : "variant"];
      sweep.titled(figure, `${sweep.chosen(fixed)} against ${x.label}`);
      over();
    }

    function cartesian(pen, size, x, y, rows, values) {
      const box = plane.frame(pen, size, plane.axis(x, rows.map(x.of)), plane.axis(y, rows.map((row) => values[row])));
      return (value, height) => [box.x(value), box.y(height)];
    }

    /** Headings counter-clockwise from x, which points to the right; values outward. */
    function circular(pen, { width, height }, rows, values) {
      let least = 0, most = 0;
      for (const row of rows) [least, most] = [Math.min(least, values[row]), Math.max(most, values[row])];
      const centre = [width / 2, height / 2], radius = Math.min(width, height) / 2 - 30;
      const steps = plane.ticks(least, most || 1, 4), reach = (value) => ((value - least) / (most - least || 1)) * radius;
      const point = (angle, far) =>
        [centre[0] + far * Math.cos(angle * RADIANS), centre[1] - far * Math.sin(angle * RADIANS)];
      pen.strokeStyle = theme.colour("grid");
      pen.fillStyle = theme.colour("muted");
      Object.assign(pen, { textAlign: "center", textBaseline: "middle", lineWidth: 1 });
      for (const value of steps) {
        pen.beginPath();
        pen.arc(...centre, Math.max(reach(value), 0), 0, 2 * Math.PI);
        pen.stroke();
        pen.fillText(theme.figures(value, 3), ...point(BESIDE, reach(value)));
      }
      for (let angle = 0; angle < 360; angle += 45) {
        plane.line(pen, ...centre, ...point(angle, radius));
        pen.fillText(`${angle}°${{ 0: " x", 90: " y" }[angle] ?? ""}`, ...point(angle, radius + 16));
      }
      return (angle, value) => point(angle, reach(value));
    }

    /** Lines through the worst mean over replicates at each value, a line for each colour of a few. */
    function joined(pen, at, x, rows, values, colouring) {
      const by = state.colour ? data.column(state.colour) : null;
      if (x.text || !(x.levels?.length <= MOST_PLACES) || (by && !(by.levels?.length <= MOST_LINES))) return;
      const worse = WORSE[data.statistic.get(sweep.choice.statistic).worst], groups = new Map(), sums = new Map();
      for (const row of rows) {
        const name = 2 * data.place[row] + data.domain[row], sum = sums.get(name) ?? { row, sum: 0, count: 0 };
        sum.sum += values[row];
        sum.count++;
        sums.set(name, sum);
      }
      for (const { row, sum, count } of sums.values()) {
        const number = colouring.of(row), value = sum / count;
        if (!groups.has(number)) groups.set(number, new Map());
        const line = groups.get(number), place = x.of(row);
        line.set(place, line.has(place) ? worse(line.get(place), value) : value);
      }
      const faded = sweep.selected() ? 0.25 : 0.9;
      for (const [number, line] of groups) {
        const ends = [...line].sort(([a], [b]) => a - b);
        const whole = round() && ends.length > 2 && ends.at(-1)[0] - ends[0][0] >= 270;
        pen.strokeStyle = colouring.colour(number);
        pen.globalAlpha = faded;
        pen.lineWidth = 1.6;
        pen.beginPath();
        ends.forEach(([place, value], i) => pen[i ? "lineTo" : "moveTo"](...at(place, value)));
        if (whole) pen.closePath();
        pen.stroke();
        pen.globalAlpha = 1;
      }
    }

    function tell(point, event) {
      if (event) sweep.tip(event, point && sweep.told(point.row));
      else sweep.tip({}, null);
      layers.say(point && event && !event.isTrusted ? sweep.text(point.row) : "");
      sweep.hover(point ? point.row : -1);
    }

    function over() {
      const pen = layers.overPen(), point = sweep.hovered >= 0 && list.find(({ row }) => row === sweep.hovered);
      if (point) plane.ring(pen, point.x, point.y);
    }

    draw();
    sweep.onChange(draw);
    sweep.onHover(over);
    new ResizeObserver(draw).observe(place);
    figure.tlpsimScatter = { state, source, points: () => list, draw };
  }

  return { mount };
})();
