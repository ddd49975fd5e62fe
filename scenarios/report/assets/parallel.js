// Parallel coordinates: an axis for each setting and response, a line for each job.
//
//   tlpsimParallel.mount(figure)
//
// Dragging along an axis keeps the jobs within, with Shift besides what is kept; dragging the stretch moves it, a double
// click on the axis clears it; dragging a name moves the axis. The fields below do the same.
"use strict";

window.tlpsimParallel = (() => {
  const sweep = window.tlpsimSweep, plane = window.tlpsimPlane, colours = window.tlpsimColours;
  const theme = window.tlpsimTheme;
  const { make } = sweep;
  const HEIGHT = 420;
  const ROOM = { top: 78, bottom: 26, side: 52 };
  const LEAST = 92; // pixels between axes
  const NEAR = 20; // pixels from an axis
  const FINE = 400; // lines, from which on they are fine
  const THIN = 1500; // lines while something is dragged
  const MOST_LEVELS = 12; // of a setting that are all written
  const MOST_ROWS = 4; // of a name
  const SHORTEST = 4; // pixels of a stretch
  const FIRST = ["platform.position.surge|expected_extreme", "platform.position.sway|expected_extreme",
    "tendons|expected_maximum", "tendons|expected_minimum", "tendons|damage_equivalent_range"];

  function mount(figure) {
    const { data } = sweep, place = figure.querySelector(".drawing");
    const source = sweep.source("parallel", () => {
      for (const axis of axes) axis.kept = [];
      limits();
    });
    const own = ["variant", "domain"].filter((name) => data[`${name}s`].length > 1);
    const settings = [...data.varied.map(({ name, label }) => [name, label]), ...own.map((name) => [name, name])];
    const every = data.signals.flatMap(({ name, label }) =>
      data.statisticsOf(name).map((each) => [`${name}|${each.name}`, `${label}, ${each.label}`]));
    const known = FIRST.filter((name) => data.column(name));
    const first = known.length ? known : every.slice(0, 3).map(([name]) => name);
    const axes = [...settings.map(([name]) => name), ...first].map(axisOf);
    const state = { axes, colour: first[0], at: axes[0], dragged: null };
    const layers = plane.canvas(scrolled(), HEIGHT, "Parallel coordinates; the fields below limit and move axes");
    layers.over.removeAttribute("tabindex"); // its keys are those of the fields
    layers.over.setAttribute("role", "img");
    const legend = make("span", {}), fields = make("div", { class: "controls axes" });
    const colour = sweep.field("colour", [...settings, ...every], state.colour, (name) => {
      state.colour = name;
      draw();
    });
    const more = sweep.field("add axis", [["", "…"], ...settings, ...every], "", (name) => {
      if (name && !axes.some(({ column }) => column.name === name)) axes.push((state.at = axisOf(name)));
      more.querySelector("select").value = "";
      fill();
      draw();
    });
    place.before(make("div", { class: "controls" }, colour, legend, more));
    place.after(fields);

    function scrolled() {
      const box = make("div", { class: "box" });
      place.append(box);
      return box;
    }

    function axisOf(name) {
      const column = data.column(name);
      let least = Infinity, most = -Infinity;
      for (let row = 0; row < data.count; row++) {
        const value = column.of(row);
        if (value < least) least = value;
        if (value > most) most = value;
      }
      const about = column.text ? 0.3 : least === most ? Math.abs(least) * 0.05 || 1 : 0;
      return { column, from: least - about, to: most + about, kept: [] };
    }

    // The fields

    const button = (label, words, done) => {
      const found = make("button", { type: "button", "aria-label": words, title: words }, label);
      found.addEventListener("click", done);
      return found;
    };

    function fill() {
      const options = axes.map(({ column }, i) => [i, sweep.headed(column)]);
      const which = sweep.field("axis", options, axes.indexOf(state.at), (value) => {
        state.at = axes[Number(value)];
        fill();
      });
      const number = (end) => {
        const input = make("input", { type: "text", inputmode: "decimal", size: 7, "aria-label": `${end} of the axis` });
        input.addEventListener("change", typed);
        return make("label", { class: "field" }, make("span", {}, end), input);
      };
      fields.replaceChildren(which, ...(state.at.column.text ? [words()] : [number("from"), number("to")]),
        button("clear", "Clear this axis", () => keep(state.at, [])),
        button("◂", "Move this axis to the left", () => move(-1)),
        button("▸", "Move this axis to the right", () => move(1)),
        button("remove", "Remove this axis", remove));
      limits();
    }

    /** A field for the words of an axis. */
    function words() {
      const { levels } = state.at.column;
      return sweep.field("keep", [["", "all"], ...levels.map((name, i) => [i, name])], "", (value) =>
        keep(state.at, value === "" ? [] : [[Number(value) - 0.5, Number(value) + 0.5]]));
    }

    function typed() {
      const number = ({ value }) => Number.parseFloat(value.replace("−", "-").replace(",", "."));
      const [from, to] = [...fields.querySelectorAll("input")].map(number);
      const range = [Number.isNaN(from) ? state.at.from : from, Number.isNaN(to) ? state.at.to : to];
      keep(state.at, Number.isNaN(from) && Number.isNaN(to) ? [] : [[Math.min(...range), Math.max(...range)]]);
    }

    /** What is kept of the axis, in its fields. */
    function limits() {
      const inputs = fields.querySelectorAll("input"), kept = state.at.kept[0];
      inputs.forEach((input, i) => (input.value = kept ? theme.figures(kept[i], 4) : ""));
      if (state.at.column.text && fields.children.length) {
        const one = kept && kept[1] - kept[0] <= 1;
        fields.querySelectorAll("select")[1].value = one ? String(Math.round((kept[0] + kept[1]) / 2)) : "";
      }
    }

    function move(step) {
      const from = axes.indexOf(state.at), to = from + step;
      if (to < 0 || to >= axes.length) return;
      axes.splice(from, 1);
      axes.splice(to, 0, state.at);
      fill();
      draw();
    }

    function remove() {
      if (axes.length < 3) return;
      const [gone] = axes.splice(axes.indexOf(state.at), 1);
      state.at = axes[0];
      fill();
      if (gone.kept.length) apply();
      draw();
    }

    function keep(axis, kept) {
      axis.kept = kept;
      apply();
      limits();
    }

    /** Selects the jobs that are within the stretches of all axes that have any. */
    function apply() {
      const limited = axes.filter(({ kept }) => kept.length);
      if (!limited.length) return source.set(null);
      const within = (row) => ({ column, kept, from, to }) => {
        const value = column.of(row), slack = 1e-4 * (to - from); // values are packed
        return kept.some(([low, high]) => value >= low - slack && value <= high + slack);
      };
      const mask = Uint8Array.from({ length: data.count }, (_, row) => Number(limited.every(within(row))));
      source.set(mask, limited.map(worded).join("; "));
    }

    function worded({ column, kept }) {
      const one = ([low, high]) => {
        if (!column.text) return `${theme.figures(low, 3)} to ${theme.figures(high, 3)} ${column.unit}`.trim();
        return column.levels.filter((_, i) => i >= low && i <= high).join(", ");
      };
      return `${column.label} ${kept.map(one).join(" or ")}`;
    }

    // Drawing

    const across = (number) => ROOM.side + (number * (layers.size().width - 2 * ROOM.side)) / Math.max(axes.length - 1, 1);
    const moved = (axis) => state.dragged?.axis === axis && state.dragged.moves;
    const left = (axis) => (moved(axis) ? state.dragged.x : across(axes.indexOf(axis)));
    const low = HEIGHT - ROOM.bottom, tall = low - ROOM.top;
    const up = (axis, value) => low - ((value - axis.from) / (axis.to - axis.from)) * tall;
    const valueAt = (axis, y) => axis.from + (Math.min(Math.max(low - y, 0), tall) / tall) * (axis.to - axis.from);

    function draw() {
      const [pen] = layers.pens(2 * ROOM.side + LEAST * (axes.length - 1));
      const rows = Array.from({ length: data.count }, (_, row) => row);
      const colouring = colours.by(data.column(state.colour), rows), selected = sweep.selected();
      const batches = new Map();
      const every = state.dragged ? Math.ceil(data.count / THIN) : 1;
      for (let row = 0; row < data.count; row += every) {
        const number = selected && !selected[row] ? -2 : colouring.of(row);
        if (!batches.has(number)) batches.set(number, []);
        batches.get(number).push(row);
      }
      const places = axes.map(left), order = axes.map((_, i) => i).sort((a, b) => places[a] - places[b]);
      const drawn = data.count / every, fine = drawn > FINE;
      const clear = Math.min(0.85, Math.max(0.2, (fine ? 10 : 6) / Math.sqrt(drawn)));
      pen.lineWidth = fine ? 1 / devicePixelRatio : 1; // lines of one dot are drawn twenty times as fast
      for (const [number, batch] of [...batches].sort(([a], [b]) => a - b)) {
        pen.strokeStyle = number < 0 ? theme.colour("line") : colouring.colour(number);
        pen.globalAlpha = number < 0 ? Math.min(clear, 0.5) : selected ? Math.min(0.9, 2 * clear) : clear;
        lines(pen, batch, order, places);
      }
      pen.globalAlpha = 1;
      axes.forEach((axis, i) => drawAxis(pen, axis, places[i]));
      legend.replaceChildren(colouring.legend());
      sweep.titled(figure, `All settings and responses, in colours of ${data.column(state.colour).label}`);
      over();
    }

    /** Lines of some rows; one without a value at an axis is broken there. */
    function lines(pen, rows, order, places) {
      pen.beginPath();
      for (const row of rows) {
        let joined = false;
        for (const i of order) {
          const value = axes[i].column.of(row);
          if (!(value >= axes[i].from && value <= axes[i].to)) {
            joined = false;
            continue;
          }
          pen[joined ? "lineTo" : "moveTo"](places[i], up(axes[i], value));
          joined = true;
        }
      }
      pen.stroke();
    }

    function drawAxis(pen, axis, x) {
      const { column, kept } = axis;
      pen.strokeStyle = theme.colour("text");
      pen.lineWidth = 1.2;
      plane.line(pen, x, ROOM.top, x, low);
      Object.assign(pen, { textAlign: "left", textBaseline: "middle", font: plane.FONT.replace("12px", "11px") });
      const words = column.text && (column.short ?? column.levels);
      const values = column.levels?.length <= MOST_LEVELS ? column.levels : plane.ticks(axis.from, axis.to, 6);
      const marks = words ? words.map((name, i) => [i, name]) : values.map((value) => [value, theme.figures(value, 4)]);
      const every = Math.ceil((14 * marks.length) / tall);
      marks.filter((_, i) => i % every === 0).forEach(([value, word]) => {
        const y = up(axis, value);
        plane.line(pen, x - 3, y, x + 3, y);
        const short = plane.cut(pen, word, LEAST - 16);
        pen.lineWidth = 3;
        pen.strokeStyle = theme.colour("page");
        pen.lineJoin = "round";
        pen.strokeText(short, x + 6, y);
        pen.lineWidth = 1.2;
        pen.strokeStyle = pen.fillStyle = theme.colour("text");
        pen.fillText(short, x + 6, y);
      });
      pen.font = plane.FONT;
      name(pen, column, x);
      for (const [from, to] of kept) {
        pen.fillStyle = pen.strokeStyle = theme.colour("accent");
        pen.globalAlpha = 0.28;
        const top = Math.max(up(axis, to), ROOM.top), end = Math.min(up(axis, from), low);
        pen.fillRect(x - 8, top, 16, Math.max(end - top, 2));
        pen.globalAlpha = 1;
        pen.strokeRect(x - 8, top, 16, Math.max(end - top, 2));
      }
    }

    /** Name of an axis in a few lines, with its unit. */
    function name(pen, { label, unit }, x) {
      const apart = (layers.size().width - 2 * ROOM.side) / Math.max(axes.length - 1, 1);
      const room = Math.min(apart, 2 * ROOM.side) - 8, rows = [""];
      for (const word of sweep.named(label, unit).split(" ")) {
        const longer = `${rows.at(-1)} ${word}`.trim();
        if (pen.measureText(longer).width <= room || !rows.at(-1)) rows[rows.length - 1] = longer;
        else rows.push(word);
      }
      const shown = rows.length > MOST_ROWS ? [...rows.slice(0, MOST_ROWS - 1), `… ${rows.at(-1)}`] : rows;
      pen.fillStyle = theme.colour("muted");
      Object.assign(pen, { textAlign: "center", textBaseline: "bottom" });
      shown.forEach((line, i) => {
        pen.fillText(plane.cut(pen, line, room + 6), x, ROOM.top - 10 - 14 * (shown.length - 1 - i));
      });
    }

    /** The line of the job that is pointed at. */
    function over() {
      const pen = layers.overPen(), row = sweep.hovered;
      if (row < 0) return;
      pen.strokeStyle = theme.colour("text");
      pen.lineWidth = 2.4;
      const places = axes.map(left);
      lines(pen, [row], axes.map((_, i) => i).sort((a, b) => places[a] - places[b]), places);
    }

    // Pointer

    const at = (event) => {
      const box = layers.over.getBoundingClientRect();
      return [event.clientX - box.left, event.clientY - box.top];
    };
    const nearest = (x, near) => axes.find((axis) => Math.abs(across(axes.indexOf(axis)) - x) <= near);

    /** The job whose line is nearest, between the two axes about the pointer. */
    function lineAt(x, y) {
      const right = axes.findIndex((_, i) => across(i) >= x);
      if (right < 1) return -1;
      const [one, other] = [axes[right - 1], axes[right]], begin = across(right - 1);
      const share = (x - begin) / (across(right) - begin), selected = sweep.selected();
      let best = -1, distance = 6;
      for (let row = 0; row < data.count; row++) {
        if (selected && !selected[row]) continue;
        const found = Math.abs((1 - share) * up(one, one.column.of(row)) + share * up(other, other.column.of(row)) - y);
        if (found < distance) [best, distance] = [row, found];
      }
      return best;
    }

    layers.over.addEventListener("pointerdown", (event) => {
      if (event.button) return;
      const [x, y] = at(event), named = y < ROOM.top - 4, axis = nearest(x, named ? LEAST / 2 : NEAR);
      if (!axis) return;
      layers.over.setPointerCapture(event.pointerId);
      state.at = axis;
      fill();
      const value = valueAt(axis, y), held = axis.kept.findIndex(([from, to]) => value >= from && value <= to);
      state.dragged = { axis, moves: named, x: across(axes.indexOf(axis)), start: [x, y], before: axis.kept, value,
        held: event.shiftKey ? -1 : held };
      sweep.tip(event, null);
      sweep.hover(-1);
    });
    layers.over.addEventListener("pointermove", (event) => {
      const [x, y] = at(event), { dragged } = state;
      if (!dragged) {
        const axis = nearest(x, y < ROOM.top - 4 ? LEAST / 2 : NEAR / 2);
        layers.over.style.cursor = axis ? (y < ROOM.top - 4 ? "grab" : "row-resize") : "default";
        const row = y < ROOM.top ? -1 : lineAt(x, y);
        sweep.hover(row);
        return sweep.tip(event, row < 0 ? null : sweep.told(row, axes.map(({ column }) => column.name)));
      }
      const { axis } = dragged;
      if (dragged.moves) {
        dragged.x = x;
        const to = axes.findIndex((_, i) => Math.abs(across(i) - x) < LEAST / 2), from = axes.indexOf(axis);
        if (to >= 0 && to !== from) {
          axes.splice(from, 1);
          axes.splice(to, 0, axis);
        }
        return sweep.changed();
      }
      if (Math.abs(y - dragged.start[1]) < SHORTEST) return;
      if (dragged.held >= 0) {
        const shift = valueAt(axis, y) - dragged.value;
        axis.kept = dragged.before.map(([from, to], i) => (i === dragged.held ? [from + shift, to + shift] : [from, to]));
      } else {
        const ends = [dragged.value, valueAt(axis, y)].sort((a, b) => a - b);
        axis.kept = [...(event.shiftKey ? dragged.before : []), ends];
      }
      apply();
      limits();
    });
    const ended = (event) => {
      const { dragged } = state;
      if (!dragged) return;
      state.dragged = null;
      fill();
      draw();
      // A click beside what is kept changes nothing; so does one on a name.
      if (event.type === "pointercancel") keep(dragged.axis, dragged.before);
    };
    layers.over.addEventListener("pointerup", ended);
    layers.over.addEventListener("pointercancel", ended);
    layers.over.addEventListener("dblclick", (event) => {
      const axis = nearest(at(event)[0], NEAR);
      if (axis) keep(axis, []);
    });
    layers.over.addEventListener("pointerleave", (event) => {
      sweep.tip(event, null);
      sweep.hover(-1);
    });

    fill();
    draw();
    sweep.onChange(draw);
    sweep.onHover(over);
    new ResizeObserver(draw).observe(place);
    figure.tlpsimParallel = { state, axes, keep, draw, across, up, apply };
  }

  return { mount };
})();
