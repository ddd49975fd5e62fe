// A map of a statistic over two settings: the worst of all cases of a cell.
//
//   tlpsimCells.mount(figure)
"use strict";

window.tlpsimCells = (() => {
  const sweep = window.tlpsimSweep, plane = window.tlpsimPlane, colours = window.tlpsimColours;
  const theme = window.tlpsimTheme;
  const { make } = sweep;
  const MOST = 40; // values of a setting that are cells of their own
  const STRETCHES = [8, 40]; // cells along an axis whose values are taken together, fewer where there are few jobs
  const MOST_FIXED = 60; // values of a setting that may be fixed
  const TALL = { least: 250, most: 520, cell: 34 };
  const FIRST = [["peak_period", "significant_height"], ["heading_deg", "significant_height"]]; // x and y, by their endings
  const WORSE = {
    max: (value, other) => value > other,
    min: (value, other) => value < other,
    abs: (value, other) => Math.abs(value) > Math.abs(other),
  };

  /** Cells along an axis: values of a setting, or stretches of them. */
  function along(key, jobs) {
    const { levels, which, text } = key;
    if (text || levels.length <= MOST) {
      const labels = levels.map((value) => (text ? value : theme.figures(value, 4)));
      return { key, count: levels.length, of: (row) => which[row], labels };
    }
    const count = Math.min(Math.max(Math.round(Math.sqrt(jobs / 2)), STRETCHES[0]), STRETCHES[1]);
    const least = levels[0], width = (levels.at(-1) - least) / count;
    const cell = levels.map((value) => Math.min(Math.floor((value - least) / width), count - 1));
    const labels = Array.from({ length: count }, (_, i) => theme.figures(least + (i + 0.5) * width, 3));
    return { key, count, of: (row) => cell[which[row]], labels };
  }

  function mount(figure) {
    const { data } = sweep, place = figure.querySelector(".drawing");
    const ends = (ending) => data.varied.find(({ name }) => name.endsWith(ending));
    const [x, y] = FIRST.map((pair) => pair.map(ends)).find((pair) => pair.every(Boolean))
      ?? [...data.varied].sort((a, b) => Number(a.design) - Number(b.design));
    const state = { x: x.name, y: y.name, fixed: {}, cells: [], at: null, chosen: new Set(), from: null };
    const source = sweep.source("map", () => state.chosen.clear());
    const controls = sweep.choosers(["signal", "statistic", "domain", "variant"]);
    const row = make("div", { class: "controls" }), legend = make("div", { class: "controls" });
    place.before(controls, row);
    const layers = plane.canvas(place, tall, "Map of the response; arrow keys move, Enter selects a cell");
    place.after(legend);
    let grid = null;

    const cellsOf = (axis) => along(data.keys.find(({ name }) => name === state[axis]), data.rows.length);

    function tall() {
      const rows = cellsOf("y").count;
      return Math.min(Math.max(rows * TALL.cell + 60, TALL.least), TALL.most);
    }

    /** Fields of the two axes, and of what the other settings are held at. */
    function fill() {
      const options = data.varied.map(({ name, label }) => [name, label]);
      const axis = (which, other) => sweep.field(which === "x" ? "across" : "upward", options, state[which], (name) => {
        if (name === state[other]) state[other] = state[which];
        state[which] = name;
        state.fixed = {};
        deselect();
        fill();
        draw();
      });
      const rest = others().filter(({ levels }) => levels.length <= MOST_FIXED);
      const held = (key) => {
        const options = [["", "worst of all"], ...key.levels.map((_, number) => [number, levelText(key, number)])];
        return sweep.field(key.label, options, state.fixed[key.name] ?? "", (value) => {
          state.fixed[key.name] = value === "" ? undefined : Number(value);
          deselect();
          draw();
        });
      };
      row.replaceChildren(axis("x", "y"), axis("y", "x"), ...rest.map(held));
    }

    /** Settings that are neither axis; those of the design come with the variant. */
    const others = () =>
      data.varied.filter((key) => ![state.x, state.y].includes(key.name) && !key.design && !follows(key));
    const levelText = ({ levels, text, unit }, number) =>
      (text ? levels[number] : `${theme.figures(levels[number], 4)} ${unit}`);

    /** Whether a setting has one value in each cell, as the wind that goes with a significant height. */
    function follows({ which }) {
      const [x, y] = ["x", "y"].map(cellsOf), known = new Map();
      for (let row = 0; row < data.count; row++) {
        const cell = y.of(row) * (x.count + 1) + x.of(row);
        if (!known.has(cell)) known.set(cell, which[row]);
        else if (known.get(cell) !== which[row]) return false;
      }
      return true;
    }

    const everyVariant = () => data.ofVariants(state.x) || data.ofVariants(state.y);

    function deselect() {
      if (!state.chosen.size) return;
      state.chosen.clear();
      source.set(null);
    }

    const held = (row) =>
      data.varied.every(({ name, which }) => state.fixed[name] === undefined || which[row] === state.fixed[name]);

    /** Each cell with its worst case: { value, row, rows, failed }. */
    function computed(across, upward) {
      const { signal, statistic, domain } = sweep.choice, values = data.values(signal, statistic);
      const worse = WORSE[data.statistic.get(statistic).worst], number = sweep.DOMAINS.indexOf(domain);
      const empty = () => ({ value: NaN, row: -1, rows: [], failed: 0 });
      const cells = Array.from({ length: across.count * upward.count }, empty);
      const all = everyVariant();
      for (const rows of data.rows) {
        const place = [across.of(rows[0]), upward.of(rows[0])];
        if (!held(rows[0]) || !(place[0] < across.count && place[1] < upward.count)) continue;
        const cell = cells[place[1] * across.count + place[0]];
        for (const row of rows) cell.rows.push(row); // of all variants: a sea state is selected for each of them
        if (!all && data.variant[rows[0]] !== sweep.choice.variant) continue;
        let sum = 0, count = 0, first = -1;
        for (const row of rows) {
          if (data.domain[row] !== number) continue;
          if (data.failed[row]) cell.failed++;
          if (Number.isNaN(values[row])) continue;
          sum += values[row];
          if (!count++) first = row;
        }
        const mean = sum / count;
        if (count && (cell.row < 0 || worse(mean, cell.value))) Object.assign(cell, { value: mean, row: first });
      }
      return cells;
    }

    function draw() {
      const [x, y] = ["x", "y"].map(cellsOf);
      const cells = computed(x, y), [pen] = layers.pens(), { width, height } = layers.size();
      const box = { left: plane.ROOM.left + 4, right: width - 4, top: 4, bottom: height - plane.ROOM.bottom };
      const wide = (box.right - box.left) / x.count, high = (box.bottom - box.top) / y.count;
      grid = { x, y, cells, box, wide, high };
      let least = Infinity, most = -Infinity;
      for (const { value } of cells) {
        if (value < least) least = value;
        if (value > most) most = value;
      }
      const { unit } = sweep.chosenColumn(), selected = sweep.selected(source);
      const known = cells.map(({ value }) => value).filter((value) => !Number.isNaN(value));
      const digits = decimals(known), longest = Math.max(0, ...known.map((v) => pen.measureText(v.toFixed(digits)).width));
      cells.forEach((cell, number) => {
        const left = box.left + (number % x.count) * wide, top = box.bottom - (Math.floor(number / x.count) + 1) * high;
        if (!cell.rows.length) return;
        const faint = selected && !cell.rows.some((row) => selected[row]);
        pen.globalAlpha = faint ? 0.22 : 1;
        if (Number.isNaN(cell.value)) empty(pen, left, top, cell.failed);
        else {
          const share = most > least ? (cell.value - least) / (most - least) : 0.5, colour = colours.scale(share);
          pen.fillStyle = colour;
          pen.fillRect(left + 0.5, top + 0.5, wide - 1, high - 1);
          if (longest + 6 <= wide && high >= 15) {
            pen.fillStyle = faint ? theme.colour("muted") : colours.on(colour);
            pen.globalAlpha = 1;
            Object.assign(pen, { textAlign: "center", textBaseline: "middle" });
            pen.fillText(cell.value.toFixed(digits).replace("-", "−"), left + wide / 2, top + high / 2);
          }
        }
        pen.globalAlpha = 1;
        if (state.chosen.has(number)) outline(pen, left, top, 2.5);
      });
      axes(pen, width, height);
      sweep.titled(figure, [sweep.chosen(everyVariant() ? ["domain"] : ["domain", "variant"]), ...heldAt()].join("; "));
      legend.replaceChildren(colours.bar(least < Infinity ? least : NaN, most > -Infinity ? most : NaN, unit));
      state.at = null;
      over();
    }

    /** What the other settings are held at, in words. */
    function heldAt() {
      return others().map((key) => {
        const number = state.fixed[key.name];
        const worst = `worst of ${key.levels.length} values of ${key.label}`;
        return number === undefined ? worst : `${key.label} ${levelText(key, number)}`;
      });
    }

    function decimals(values) {
      const size = Math.max(...values.map(Math.abs), 1e-12);
      return Math.min(Math.max(2 - Math.floor(Math.log10(size)), 0), 4);
    }

    function empty(pen, left, top, failed) {
      pen.strokeStyle = theme.colour(failed ? "attention" : "line");
      pen.lineWidth = 1;
      pen.strokeRect(left + 1.5, top + 1.5, grid.wide - 3, grid.high - 3);
      if (!failed) return;
      const [x, y, size] = [left + grid.wide / 2, top + grid.high / 2, Math.min(grid.wide, grid.high, 14) / 3];
      pen.lineWidth = 2;
      plane.line(pen, x - size, y - size, x + size, y + size);
      plane.line(pen, x - size, y + size, x + size, y - size);
    }

    function outline(pen, left, top, thick) {
      pen.strokeStyle = theme.colour("text");
      pen.lineWidth = thick;
      pen.strokeRect(left + thick / 2, top + thick / 2, grid.wide - thick, grid.high - thick);
    }

    function axes(pen, width, height) {
      const { x, y, box, wide, high } = grid;
      pen.fillStyle = theme.colour("muted");
      const longest = Math.max(...x.labels.map((label) => Math.min(pen.measureText(label).width, 70)));
      const every = Math.ceil(longest / Math.max(wide - 6, 4));
      Object.assign(pen, { textAlign: "center", textBaseline: "top" });
      x.labels.forEach((label, i) => {
        if (i % every === 0) pen.fillText(plane.cut(pen, label, wide * every), box.left + (i + 0.5) * wide, box.bottom + 5);
      });
      Object.assign(pen, { textAlign: "right", textBaseline: "middle" });
      const steps = Math.ceil(14 / high);
      y.labels.forEach((label, i) => {
        const short = plane.cut(pen, label, plane.ROOM.left - 22);
        if (i % steps === 0) pen.fillText(short, box.left - 6, box.bottom - (i + 0.5) * high);
      });
      Object.assign(pen, { textAlign: "center", textBaseline: "bottom" });
      pen.fillText(sweep.named(x.key.label, x.key.unit), (box.left + box.right) / 2, height - 6);
      plane.upright(pen, sweep.named(y.key.label, y.key.unit), (box.top + box.bottom) / 2);
    }

    // Pointer and keys

    const inside = (event) => {
      const { left, top } = layers.over.getBoundingClientRect(), { box, x, y, wide, high } = grid;
      const column = Math.floor((event.clientX - left - box.left) / wide);
      const row = Math.floor((box.bottom - (event.clientY - top)) / high);
      return column >= 0 && column < x.count && row >= 0 && row < y.count ? row * x.count + column : null;
    };

    const between = (one, other) => {
      const { x } = grid, found = [], across = [one % x.count, other % x.count].sort((a, b) => a - b);
      const up = [Math.floor(one / x.count), Math.floor(other / x.count)].sort((a, b) => a - b);
      for (let row = up[0]; row <= up[1]; row++) {
        for (let column = across[0]; column <= across[1]; column++) found.push(row * x.count + column);
      }
      return found.filter((number) => grid.cells[number].rows.length);
    };

    function over() {
      const pen = layers.overPen();
      if (!grid) return;
      const corner = (number) => [grid.box.left + (number % grid.x.count) * grid.wide,
        grid.box.bottom - (Math.floor(number / grid.x.count) + 1) * grid.high];
      const marked = state.at === null ? [] : state.from === null ? [state.at] : between(state.from, state.at);
      for (const number of marked) outline(pen, ...corner(number), 2);
      if (sweep.hovered >= 0 && held(sweep.hovered)) {
        outline(pen, ...corner(grid.y.of(sweep.hovered) * grid.x.count + grid.x.of(sweep.hovered)), 2);
      }
    }

    function tell(number, event) {
      state.at = number;
      const cell = number === null ? null : grid.cells[number];
      const lines = cell && (cell.row >= 0
        ? [...sweep.told(cell.row).slice(0, -1), [sweep.chosenColumn().label, valued(cell)]]
        : cell.rows.length ? [["", cell.failed ? "failed" : "no value"], ...cellSettings(number)] : null);
      if (event) sweep.tip(event, lines);
      sweep.hover(cell && cell.row >= 0 ? cell.row : -1);
      layers.say(lines ? lines.map((each) => each.join(" ")).join("; ") : "");
      over();
    }

    function valued(cell) {
      const { signal, statistic } = sweep.choice, { unit } = sweep.chosenColumn();
      return `${theme.figures(cell.value, 4)} ${unit}${sweep.governing(cell.row, signal, statistic)}`;
    }

    const cellSettings = (number) => [[grid.x.key.label, grid.x.labels[number % grid.x.count]],
      [grid.y.key.label, grid.y.labels[Math.floor(number / grid.x.count)]]];

    function choose(numbers, add) {
      const only = numbers.length === 1 && state.chosen.has(numbers[0]);
      const before = only && (add || state.chosen.size === 1);
      if (!add) state.chosen.clear();
      for (const number of numbers) before ? state.chosen.delete(number) : state.chosen.add(number);
      if (!state.chosen.size) return source.set(null);
      const mask = new Uint8Array(data.count);
      for (const number of state.chosen) for (const row of grid.cells[number].rows) mask[row] = 1;
      const first = [...state.chosen][0];
      source.set(mask, state.chosen.size === 1
        ? cellSettings(first).map((each) => each.join(" ")).join(", ")
        : `${state.chosen.size} cells of the map`);
    }

    layers.over.addEventListener("pointerdown", (event) => {
      if (event.button) return;
      state.from = inside(event);
      layers.over.setPointerCapture(event.pointerId);
    });
    layers.over.addEventListener("pointermove", (event) => tell(inside(event), event));
    layers.over.addEventListener("pointerup", (event) => {
      const from = state.from, to = inside(event);
      state.from = null;
      if (from === null) return;
      const numbers = between(from, to ?? state.at ?? from);
      if (numbers.length) choose(numbers, event.shiftKey || event.ctrlKey || event.metaKey);
    });
    layers.over.addEventListener("pointercancel", () => (state.from = null));
    const left = (event) => {
      tell(null, null);
      sweep.tip(event, null);
    };
    layers.over.addEventListener("pointerleave", left);
    layers.over.addEventListener("blur", left);
    layers.over.addEventListener("keydown", (event) => {
      const step = { ArrowRight: [1, 0], ArrowLeft: [-1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key];
      const { x, y, box, wide, high } = grid;
      if (step) {
        const at = state.at ?? 0;
        const column = Math.min(Math.max((at % x.count) + step[0], 0), x.count - 1);
        const row = Math.min(Math.max(Math.floor(at / x.count) + step[1], 0), y.count - 1);
        const { left, top } = layers.over.getBoundingClientRect();
        const middle = [box.left + (column + 0.5) * wide, box.bottom - (row + 0.5) * high];
        tell(row * x.count + column, { clientX: left + middle[0], clientY: top + middle[1] });
        event.preventDefault();
      } else if ((event.key === "Enter" || event.key === " ") && state.at !== null) {
        const at = state.at;
        if (grid.cells[at].rows.length) choose([at], event.shiftKey);
        event.preventDefault();
        requestAnimationFrame(() => tell(at, null));
      }
    });

    fill();
    draw();
    sweep.onChange(draw);
    sweep.onHover(over);
    new ResizeObserver(draw).observe(place);
    figure.tlpsimCells = { state, cells: () => grid, draw };
  }

  return { mount };
})();
