// The worst jobs by the statistic that is shown, of those that are selected; its headings sort.
//
//   tlpsimWorst.mount(figure)
"use strict";

window.tlpsimWorst = (() => {
  const sweep = window.tlpsimSweep;
  const { make } = sweep;
  const LENGTHS = [10, 25, 100];
  // Beside the statistic that is chosen.
  const BESIDE = ["platform.position.surge|expected_extreme", "tendons|expected_maximum", "tendons|expected_minimum"];
  const WORST = {
    max: (value) => -value,
    min: (value) => value,
    abs: (value) => -Math.abs(value),
  };

  function mount(figure) {
    const { data } = sweep, place = figure.querySelector(".drawing");
    const state = { length: LENGTHS[0], by: "", sort: "", falling: false, domain: "", chosen: new Set() };
    const source = sweep.source("table", () => state.chosen.clear());
    const controls = sweep.choosers(["signal", "statistic"]);
    if (data.domains.length > 1) {
      const domains = [["", "of both domains"], ...data.domains.map((name) => [name, `${name} domain`])];
      controls.append(sweep.field("jobs", domains, "", (value) => {
        state.domain = value;
        draw();
      }));
    }
    controls.append(sweep.field("rows", LENGTHS.map((each) => [each, String(each)]), state.length, (value) => {
      state.length = Number(value);
      draw();
    }));
    const box = make("div", { class: "box", tabindex: "0", role: "region", "aria-label": "Worst jobs" });
    place.before(controls);
    place.append(box);

    /** Columns: { name, label, text, of(row) to sort, told(row) }. */
    function columns() {
      const { signal, statistic } = sweep.choice, chosen = `${signal}|${statistic}`;
      const values = [chosen, ...BESIDE.filter((name) => name !== chosen && data.column(name))].map((name) => {
        const column = data.column(name), found = (row) => sweep.valueText({ ...column, unit: "" }, row);
        return { name, label: sweep.named(column.label, column.unit), of: column.of,
          told: (row) => found(row) + sweep.governing(row, column.signal, column.statistic) };
      });
      const settings = data.varied.filter(({ design }) => !design).map(({ name, label, unit }) => {
        const column = data.column(name);
        return { name, label: sweep.named(label, unit), text: column.text, of: column.of,
          told: (row) => sweep.valueText({ ...column, unit: "" }, row) };
      });
      const own = [["variant", data.variants.length > 1], ["domain", data.domains.length > 1]].filter(([, there]) => there);
      const jobs = own.map(([name]) => ({ name, label: name, text: true, of: data.column(name).of,
        told: (row) => data.column(name).short[data[name][row]] }));
      if (data.replicated) {
        jobs.push({ name: "replicate", label: "replicate", of: (row) => data.replicate[row],
          told: (row) => (data.domain[row] ? String(data.replicate[row]) : "–") });
      }
      const file = { name: "file", label: "file", text: true, of: (row) => data.files[row],
        told: (row) => data.files[row] || "–" };
      return [{ name: "case", label: "case", of: (row) => data.case[row], told: (row) => String(data.case[row]) },
        values[0], ...jobs, ...settings, ...values.slice(1), ...(data.files.some(Boolean) ? [file] : [])];
    }

    /** The worst rows of those that other figures select, in the order that is asked for. */
    function rows(all) {
      const { signal, statistic } = sweep.choice, values = data.values(signal, statistic);
      const selected = sweep.selected(source), domain = sweep.DOMAINS.indexOf(state.domain), found = [];
      for (let row = 0; row < data.count; row++) {
        const wanted = (!selected || selected[row]) && (domain < 0 || data.domain[row] === domain);
        if (wanted && !Number.isNaN(values[row])) found.push(row);
      }
      const worst = WORST[data.statistic.get(statistic).worst];
      const shown = found.sort((a, b) => worst(values[a]) - worst(values[b])).slice(0, state.length);
      const by = all.find(({ name }) => name === state.sort);
      if (!by) return shown;
      const last = (value) => (Number.isNaN(value) ? Infinity : value);
      const order = (a, b) => (typeof a === "string" ? a.localeCompare(b) : last(a) - last(b));
      return shown.sort((a, b) => (state.falling ? order(by.of(b), by.of(a)) : order(by.of(a), by.of(b))));
    }

    function heading(column) {
      const sorted = state.sort === column.name;
      const arrow = sorted ? (state.falling ? " ▾" : " ▴") : "";
      const button = make("button", { type: "button", class: "sort" }, `${column.label}${arrow}`);
      button.addEventListener("click", () => {
        Object.assign(state, { sort: column.name, falling: sorted ? !state.falling : !column.text });
        draw();
        [...box.querySelectorAll("button.sort")].find((each) => each.textContent.startsWith(column.label))?.focus();
      });
      return make("th", { scope: "col", class: column.text ? "words" : "",
        "aria-sort": sorted ? (state.falling ? "descending" : "ascending") : "none" }, button);
    }

    function pick(row) {
      state.chosen.has(row) ? state.chosen.delete(row) : state.chosen.add(row);
      const mask = new Uint8Array(data.count);
      for (const each of state.chosen) mask[each] = 1;
      const which = state.chosen.size === 1 ? `case ${data.case[[...state.chosen][0]]}` : `${state.chosen.size} jobs`;
      source.set(state.chosen.size ? mask : null, `${which} of the table`);
    }

    function line(row, all) {
      const chosen = state.chosen.has(row);
      const number = String(data.case[row]);
      const button = make("button", { type: "button", "aria-pressed": String(chosen), "aria-label": `Select case ${number}` },
        number);
      button.addEventListener("click", () => {
        pick(row);
        const focus = () => box.querySelector(`tr[data-row="${row}"] button`)?.focus();
        requestAnimationFrame(() => requestAnimationFrame(focus)); // once the table is drawn anew
      });
      const kind = ({ name, text }) => (name === "file" ? "words file" : text ? "words" : "");
      const cells = all.slice(1).map((column) => make("td", { class: kind(column) }, column.told(row)));
      const found = make("tr", { "data-row": String(row), class: chosen ? "chosen" : "" },
        make("th", { scope: "row" }, button), ...cells);
      found.addEventListener("pointerenter", () => sweep.hover(row));
      found.addEventListener("pointerleave", () => sweep.hover(-1));
      return found;
    }

    function draw() {
      const { name, label } = sweep.chosenColumn();
      // Another statistic begins with its worst.
      if (state.by !== name) Object.assign(state, { by: name, sort: "", falling: false });
      const all = columns(), shown = rows(all);
      const words = `Worst jobs by ${label}${sweep.selected(source) ? ", of the selection" : ""}`;
      sweep.titled(figure, words);
      const caption = make("caption", { class: "unseen" }, words);
      const table = make("table", {}, caption, make("thead", {}, make("tr", {}, ...all.map(heading))),
        make("tbody", {}, ...shown.map((row) => line(row, all))));
      const none = make("p", { class: "small" }, "None of the selected jobs has a value.");
      box.replaceChildren(table, ...(shown.length ? [] : [none]));
    }

    function over(row) {
      for (const each of box.querySelectorAll("tr[data-row]")) {
        each.classList.toggle("hovered", Number(each.dataset.row) === row);
      }
    }

    draw();
    sweep.onChange(draw);
    sweep.onHover(over);
    figure.tlpsimWorst = { state, draw };
  }

  return { mount };
})();
