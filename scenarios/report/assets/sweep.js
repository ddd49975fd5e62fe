// The jobs of a sweep, which of them are selected, and what is shown of them: what all its linked figures share.
//
//   tlpsimSweep.mount(figure, content, unpack)   reads the data, and draws the bar that says what is selected
//   tlpsimSweep.data      as of `packed_sweep`, unpacked; rows are jobs, from 0
//     .count, .case[row], .variant[row], .domain[row], .replicate[row], .failed[row], .keys[k].which[row], .files[row]
//     .place[row] -> number of its case among all; .rows[place] -> rows of the case
//     .values(signal, statistic) -> Float32Array, undefined where the page has none
//     .column(name) -> { name, label, unit, text, levels, of(row) } of a setting, "domain", "variant" or "SIGNAL|STATISTIC"
//   tlpsimSweep.source(label, cleared) -> { set(mask, text) }       a figure that selects; mask (rows) or null for all
//   tlpsimSweep.selected(source)  Uint8Array of what is selected, by all sources but this one; null for all
//   tlpsimSweep.choice            { signal, statistic, domain, variant } that all figures show
//   tlpsimSweep.choosers(names)   fields to choose them; those of one name change together
//   tlpsimSweep.chosen(names), .chosenColumn(), .titled(figure, words)     the choice in words, and a figure's title
//   tlpsimSweep.headed(column), .legend(name, colouring)                   name with its unit, and what colours say
//   tlpsimSweep.onChange(draw)    drawn anew when choices, selection or colours change
//   tlpsimSweep.onHover(draw), .hover(row), .hovered   the job that the pointer is at, -1 for none
//   tlpsimSweep.tip(event, lines), .told(row), .text(row)          what is said of a job
"use strict";

window.tlpsimSweep = (() => {
  const theme = window.tlpsimTheme;
  const { make } = window.tlpsimLines;
  const DIGIT = 32768; // of whole numbers in two parts, as `packed_whole` has it
  const DOMAINS = ["frequency", "time"];
  const FIRST = [["platform.position.surge", "expected_extreme"], ["tendons", "expected_maximum"]];
  const sources = new Map(), drawn = [], hovers = [], fields = [];
  const sweep = { data: null, choice: {}, hovered: -1 };
  let selected = null, waiting = false, tip = null;

  // Data

  async function read(content, unpack) {
    const whole = async ({ low, high }) => {
      const [below, above] = await Promise.all([unpack(low), unpack(high)]);
      return Uint32Array.from(below, (value, i) => Math.round(value) + DIGIT * Math.round(above[i]));
    };
    const data = { ...content };
    for (const name of ["case", "variant", "replicate", "domain", "failed"]) data[name] = await whole(content[name]);
    data.probability = content.probability ? await unpack(content.probability) : null;
    data.keys = [];
    for (const key of content.keys) data.keys.push({ ...key, which: await whole(key.which) });
    const values = new Map();
    await Promise.all(content.values.map(async ({ signal, statistic, packed }) => {
      values.set(`${signal}|${statistic}`, await unpack(packed));
    }));
    const places = new Map();
    data.rows = [];
    data.place = Uint32Array.from(data.case, (number, row) => {
      const name = `${data.variant[row]}|${number}`;
      if (!places.has(name)) {
        places.set(name, places.size);
        data.rows.push([]);
      }
      data.rows[places.get(name)].push(row);
      return places.get(name);
    });
    data.values = (signal, statistic) => values.get(`${signal}|${statistic}`);
    data.signal = new Map(content.signals.map((each) => [each.name, each]));
    data.statistic = new Map(content.statistics.map((each) => [each.name, each]));
    data.varied = data.keys.filter(({ levels }) => levels.length > 1);
    data.domains = DOMAINS.filter((_, number) => data.domain.includes(number));
    data.replicated = data.replicate.some((number) => number !== data.replicate[data.domain.indexOf(1)] && number > 0);
    /** Whether a setting, or the choice of one, stands for all variants. */
    data.ofVariants = (name) => name === "variant" || Boolean(data.keys.find((key) => key.name === name)?.design);
    data.statisticsOf = (signal) => content.statistics.filter(({ name }) => values.has(`${signal}|${name}`));
    const columns = new Map();
    data.column = (name) => {
      if (!columns.has(name)) columns.set(name, column(data, name));
      return columns.get(name);
    };
    return data;
  }

  /** A setting, a domain, a variant or a statistic as numbers; of texts the number of its level. */
  function column(data, name) {
    const key = data.keys.find((each) => each.name === name);
    if (key) {
      const { which, levels, text } = key;
      return { ...key, of: text ? (row) => which[row] : (row) => levels[which[row]] ?? NaN };
    }
    const named = { domain: DOMAINS, variant: data.variants.map((each, i) => each || String(i + 1)) };
    const short = { domain: DOMAINS, variant: data.variants.map((_, i) => String(i + 1)) };
    if (named[name]) {
      return { name, label: name, unit: "", text: true, levels: named[name], short: short[name],
        of: (row) => data[name][row] };
    }
    const [signal, statistic] = name.split("|"), values = data.values(signal, statistic);
    return values && { name, label: quantity(data, signal, statistic), unit: unitOf(data, signal, statistic),
      text: false, levels: null, signal, statistic, of: (row) => values[row] };
  }

  const quantity = (data, signal, statistic) =>
    `${data.signal.get(signal).label}, ${data.statistic.get(statistic).label}`;
  const unitOf = (data, signal, statistic) => {
    const own = data.statistic.get(statistic).unit;
    return own === "signal" ? data.signal.get(signal).unit : own;
  };
  const named = (label, unit) => (unit ? `${label}, ${unit}` : label);

  // Selection

  function source(label, cleared) {
    const state = { label, cleared, mask: null, text: "" };
    sources.set(state, state);
    state.set = (mask, text = "") => {
      Object.assign(state, { mask, text });
      selected = combined(null);
      changed();
    };
    return state;
  }

  function combined(without) {
    const masks = [...sources.keys()].filter((each) => each.mask && each !== without).map(({ mask }) => mask);
    if (!masks.length) return null;
    return Uint8Array.from(masks[0], (_, row) => (masks.every((mask) => mask[row]) ? 1 : 0));
  }

  function clear() {
    for (const state of sources.keys()) {
      Object.assign(state, { mask: null, text: "" });
      state.cleared();
    }
    selected = null;
    changed();
  }

  /** All figures are drawn once, in the next frame. */
  function changed() {
    if (waiting) return;
    waiting = true;
    requestAnimationFrame(() => {
      waiting = false;
      for (const draw of drawn) draw();
    });
  }

  function hover(row) {
    if (row === sweep.hovered) return;
    sweep.hovered = row;
    for (const draw of hovers) draw(row);
  }

  // What is shown

  function choose(name, value) {
    sweep.choice[name] = value;
    const offered = sweep.data.statisticsOf(sweep.choice.signal).map((each) => each.name);
    if (!offered.includes(sweep.choice.statistic)) sweep.choice.statistic = offered[0];
    for (const fill of fields) fill();
    changed();
  }

  const OPTIONS = {
    signal: () => sweep.data.signals.map(({ name, label }) => [name, label]),
    statistic: () => sweep.data.statisticsOf(sweep.choice.signal).map(({ name, label, unit }) =>
      [name, named(label, unit === "signal" ? sweep.data.signal.get(sweep.choice.signal).unit : unit)]),
    domain: () => sweep.data.domains.map((name) => [name, `${name} domain`]),
    variant: () => sweep.data.variants.map((label, number) => [number, label || String(number + 1)]),
  };

  /** A labelled field of options [value, text]. */
  function field(label, options, value, picked) {
    const select = make("select", { "aria-label": label });
    fillField(select, options, value);
    select.addEventListener("change", () => picked(select.value));
    return make("label", { class: "field" }, make("span", { "aria-hidden": "true" }, label), select);
  }

  function fillField(select, options, value) {
    select.replaceChildren(...options.map(([name, text]) => new Option(text, name)));
    select.value = String(value);
  }

  function choosers(names) {
    const row = make("div", { class: "controls" });
    for (const name of names) {
      if (OPTIONS[name]().length < 2) continue;
      const whole = name === "variant" ? Number : String;
      const found = field(name, OPTIONS[name](), sweep.choice[name], (value) => choose(name, whole(value)));
      fields.push(() => fillField(found.querySelector("select"), OPTIONS[name](), sweep.choice[name]));
      row.append(found);
    }
    return row;
  }

  /** The title of a figure says what it shows, also on paper. */
  function titled(figure, words) {
    figure.querySelector("figcaption").textContent = words;
  }

  const chosenColumn = () => sweep.data.column(`${sweep.choice.signal}|${sweep.choice.statistic}`);
  const headed = ({ label, unit }) => named(label, unit);

  /** What the colours of a column say; nothing without one. */
  function legend(name, colouring) {
    return name ? [make("span", { class: "muted" }, headed(sweep.data.column(name))), colouring.legend()] : [];
  }

  /** Of the choice: "surge, expected extreme, m: time domain, variant 2: ..." */
  function chosen(names) {
    const { domain, variant } = sweep.choice;
    const more = [];
    if (names.includes("domain")) more.push(`${domain} domain`);
    if (names.includes("variant") && sweep.data.variants.length > 1) more.push(`variant ${sweep.data.variants[variant]}`);
    return `${headed(chosenColumn())}${more.length ? ` (${more.join("; ")})` : ""}`;
  }

  // What is said of a job

  /** A value of a column in words. */
  function valueText(column, row) {
    const value = column.of(row);
    if (column.text) return (column.short ?? column.levels)[value];
    const figures = column.statistic ? fixed(value) : theme.figures(value, 6);
    return `${figures}${column.unit && !Number.isNaN(value) ? ` ${column.unit}` : ""}`;
  }

  /** Four figures, also where the last of them are zeros, so that numbers below each other are compared at a glance. */
  function fixed(value) {
    const size = Math.abs(value);
    return size >= 1e-3 && size < 1e4 ? value.toPrecision(4).replace("-", "−") : theme.figures(value, 4);
  }

  /** The tendon that governs in a row, where the page has the tendons one by one. */
  function governing(row, signal, statistic) {
    if (signal !== "tendons") return "";
    const value = sweep.data.values(signal, statistic)[row];
    const spread = 1e-3 * Math.abs(value);
    const near = ({ name, tendon }) =>
      tendon && Math.abs((sweep.data.values(name, statistic)?.[row] ?? NaN) - value) <= spread;
    const found = Number.isFinite(value) ? sweep.data.signals.filter(near) : [];
    return found.length ? ` (${found.map((each) => each.tendon).join(", ")})` : "";
  }

  function told(row, columns = []) {
    const { data } = sweep;
    const job = [`case ${data.case[row]}`];
    if (data.names[row]) job[0] += ` (${data.names[row]})`;
    if (data.domains.length > 1) job.push(`${DOMAINS[data.domain[row]]} domain`);
    if (data.replicated && data.domain[row]) job.push(`replicate ${data.replicate[row]}`);
    if (data.failed[row]) job.push("failed");
    const lines = [["", job.join(", ")]];
    if (data.variants.length > 1) lines.push(["variant", data.variants[data.variant[row]]]);
    for (const { name, label, design } of data.varied) {
      if (!design) lines.push([label, valueText(data.column(name), row)]);
    }
    const { signal, statistic } = sweep.choice;
    const shown = new Set([`${signal}|${statistic}`, ...columns.filter((name) => name.includes("|"))]);
    for (const name of shown) {
      const found = data.column(name);
      if (found) lines.push([found.label, valueText(found, row) + governing(row, found.signal, found.statistic)]);
    }
    return lines;
  }

  const text = (row, columns) => told(row, columns).map(([name, value]) => (name ? `${name} ${value}` : value)).join("; ");

  /** Lines [name, value] beside the pointer; none hides them. */
  function showTip(event, lines) {
    if (!tip) document.body.append((tip = make("div", { class: "tip", "aria-hidden": "true" })));
    tip.hidden = !lines;
    if (!lines) return;
    tip.replaceChildren(...lines.map(([name, value]) =>
      make("div", { class: name ? "" : "head" }, ...(name ? [make("span", {}, name)] : []), make("b", {}, value))));
    const { width, height } = tip.getBoundingClientRect();
    const left = event.clientX + 16 + width > innerWidth ? event.clientX - 12 - width : event.clientX + 16;
    const top = Math.min(event.clientY + 12, innerHeight - height - 8);
    tip.style.left = `${Math.max(left, 4)}px`;
    tip.style.top = `${Math.max(top, 4)}px`;
  }

  // The bar

  function bar(place) {
    const output = make("output", { class: "count" });
    const chips = make("span", { class: "chips" });
    const button = make("button", { type: "button" }, "Clear selection");
    button.addEventListener("click", clear);
    place.append(output, chips, button);
    const figure = (number) => number.toLocaleString("en").replaceAll(",", "\u202f");
    const count = (number, what) => `${figure(number)} ${what}${number === 1 ? "" : "s"}`;

    function draw() {
      const { data } = sweep;
      place.closest("figure").classList.toggle("active", Boolean(selected));
      button.hidden = !selected;
      const cases = new Set(data.place.filter((_, row) => !selected || selected[row])).size;
      const rows = selected ? selected.reduce((sum, each) => sum + each, 0) : data.count;
      output.textContent = selected
        ? `${count(rows, "job")} (${count(cases, "case")}) of ${figure(data.count)} selected`
        : `${count(rows, "job")} of ${count(cases, "case")}: the figures are linked, select in any of them`;
      chips.replaceChildren(...[...sources.keys()].filter(({ mask }) => mask).map((state) => {
        const words = { type: "button", class: "chip", "aria-label": `Remove: ${state.text}` };
        const chip = make("button", words, `${state.text} ✕`);
        chip.addEventListener("click", () => {
          state.cleared();
          state.set(null);
        });
        return chip;
      }));
    }
    drawn.push(draw);
    draw();
  }

  async function mount(figure, content, unpack) {
    const data = (sweep.data = await read(content, unpack));
    const [signal, statistic] = FIRST.find(([signal, statistic]) => data.values(signal, statistic))
      ?? [content.values[0].signal, content.values[0].statistic];
    sweep.choice = { signal, statistic, domain: data.domains[0], variant: 0 };
    bar(figure.querySelector(".drawing"));
    if (content.left_out) figure.append(make("p", { class: "small" }, `${content.left_out}.`));
    addEventListener("keydown", (event) => {
      if (event.key === "Escape" && selected) clear();
    });
  }

  theme.onChange(() => drawn.forEach((draw) => draw())); // at once: paper does not wait for the next frame
  return Object.assign(sweep, { mount, source, selected: (without) => (without ? combined(without) : selected), clear,
    choose, choosers, chosen, chosenColumn, headed, legend, titled, field, fillField, make, named, hover, tip: showTip,
    told, text, valueText, governing, DOMAINS,
    changed, onChange: (draw) => drawn.push(draw), onHover: (draw) => hovers.push(draw) });
})();
