// Figures of curves: spectra, probabilities.
//
//   tlpsimLines.mount(element, content)
//
// `content` is { title, height, choices: [{ label, views: [view] }] }, a view being
//   { label, x: { label, log, from, to }, y: ..., marks: [{ x, label }, { y, label }],
//     series: [{ label, colour, dash, points, x: [], y: [], low: [], high: [] }] }
// A choice is another quantity, a view another way to draw it. Figures beside each other that have the same views
// change together. Drag over a stretch to see it larger; a double click shows all.
"use strict";

window.tlpsimLines = (() => {
  const theme = window.tlpsimTheme;
  const BAND_OPACITY = "33"; // of a colour's last byte
  const DECADES = 12; // of a logarithmic axis, at most
  const ROOM = 0.12; // of the height, above the data

  function make(tag, attributes = {}, ...children) {
    const element = document.createElement(tag);
    for (const [name, value] of Object.entries(attributes)) {
      if (name === "class") element.className = value;
      else if (name in element && typeof value !== "string") element[name] = value;
      else element.setAttribute(name, value);
    }
    element.append(...children);
    return element;
  }

  /** Buttons of which one is pressed. */
  function buttons(labels, name, chosen) {
    const row = make("div", { class: "buttons", role: "group", "aria-label": name });
    labels.forEach((label, index) => {
      const button = make("button", { type: "button", "aria-pressed": String(index === 0) }, label);
      button.addEventListener("click", () => {
        [...row.children].forEach((each) => each.setAttribute("aria-pressed", String(each === button)));
        chosen(index);
      });
      row.append(button);
    });
    return row;
  }

  function legend(series) {
    const items = series.map(({ label, colour, dash, points }) => {
      const kind = points ? "dots" : dash ? "dashes" : "line";
      return make("li", {}, make("span", { class: `swatch ${kind} s${colour}` }), label);
    });
    return make("ul", { class: "legend" }, ...items);
  }

  /** Range of an axis: what is asked for, or what the data have, with room above for the names of marks. */
  function range({ from, to, log }, room) {
    return (_, least, most) => {
      if (least === null || least === undefined) return log ? [0.1, 1] : [0, 1];
      const low = Math.max(from ?? least, log ? most * 10 ** -DECADES : -Infinity);
      const high = to ?? (log ? most * (most / low) ** room : most + room * (most - low));
      return low < high ? [low, high] : log ? [low / 2, low * 2] : [low - 1, low + 1];
    };
  }

  /** Data and series for uPlot: a curve is one series, or three with the limits of its band. */
  function prepared(view) {
    const tables = [];
    const series = [{ label: view.x.label }];
    const bands = [];
    const { from = null, to = null } = view.x;
    for (const { label, colour, dash, points, x, y, low, high } of view.series) {
      const inside = x.map((at) => at >= (from ?? -Infinity) && at <= (to ?? Infinity));
      const positive = (values) => values.filter((_, i) => inside[i]).map((v) => (v > 0 || !view.y.log ? v : null));
      const columns = [x.filter((_, i) => inside[i]), positive(y)];
      const stroke = () => theme.series(colour);
      if (low) {
        columns.push(positive(high), positive(low));
        bands.push({ series: [series.length + 1, series.length + 2], fill: () => theme.series(colour) + BAND_OPACITY });
      }
      const dots = points ? { paths: () => null, points: { show: true, size: 4, fill: stroke } } : { points: { show: false } };
      series.push({ label, stroke, width: dash ? 1.8 : 1.1, dash: dash ? [7, 4] : undefined, spanGaps: true, ...dots });
      const edge = { stroke: "transparent", width: 0, points: { show: false }, spanGaps: true };
      if (low) series.push({ ...edge, label: "high" }, { ...edge, label: "low" });
      tables.push(columns);
    }
    return { data: uPlot.join(tables), series, bands };
  }

  /** Vertical lines with their names, { x, label }, and level ones, { y, label }. */
  function marked(all) {
    const marks = all.filter(({ y }) => y === undefined), level = all.filter(({ y }) => y !== undefined);
    const stacked = marks.some(({ label }) => label.length > 8);
    return (plot) => {
      const { ctx, bbox } = plot;
      ctx.save();
      ctx.strokeStyle = ctx.fillStyle = theme.colour("muted");
      const dot = devicePixelRatio;
      ctx.lineWidth = dot;
      ctx.setLineDash([4 * dot, 3 * dot]);
      ctx.font = `${11 * dot}px system-ui, sans-serif`;
      ctx.textBaseline = "top";
      for (const [line, { x, label }] of marks.entries()) {
        const place = plot.valToPos(x, "x", true);
        if (!(place > bbox.left && place < bbox.left + bbox.width)) continue;
        const fits = place + 4 * dot + ctx.measureText(label).width < bbox.left + bbox.width;
        ctx.textAlign = fits ? "left" : "right";
        ctx.beginPath();
        ctx.moveTo(place, bbox.top);
        ctx.lineTo(place, bbox.top + bbox.height);
        ctx.stroke();
        // Each name on a line of its own, where marks may be close to each other.
        ctx.fillText(label, place + (fits ? 4 : -4) * dot, bbox.top + (1 + (stacked ? 13 * line : 0)) * dot);
      }
      Object.assign(ctx, { textAlign: "right", textBaseline: "bottom" });
      for (const { y, label } of level) {
        const place = plot.valToPos(y, "y", true);
        if (!(place > bbox.top && place < bbox.top + bbox.height)) continue;
        ctx.beginPath();
        ctx.moveTo(bbox.left, place);
        ctx.lineTo(bbox.left + bbox.width, place);
        ctx.stroke();
        ctx.fillText(label, bbox.left + bbox.width - 4 * dot, place - dot);
      }
      ctx.restore();
    };
  }

  /** What the pointer is at, above the figure. */
  function told(output, view) {
    return (plot) => {
      const { left, top } = plot.cursor;
      if (left < 0) output.textContent = "";
      else output.textContent = `${theme.figures(plot.posToVal(left, "x"), 3)}; ${theme.figures(plot.posToVal(top, "y"), 3)}`;
    };
  }

  function mount(figure, content) {
    const place = figure.querySelector(".drawing");
    const grid = figure.closest(".grid");
    const output = make("output", { class: "readout" });
    const below = make("div");
    figure.querySelector("figcaption").append(output);
    let [choice, way, plot] = [0, 0, null];

    function draw() {
      plot?.destroy();
      const view = content.choices[choice].views[way];
      const { data, series, bands } = prepared(view);
      const scales = {
        x: { time: false, distr: view.x.log ? 3 : 1, range: range({ log: view.x.log }, 0) },
        y: { distr: view.y.log ? 3 : 1, range: range(view.y, ROOM) },
      };
      const options = {
        width: theme.width(place),
        height: content.height,
        scales,
        series,
        bands,
        axes: theme.axes(view.x, view.y),
        legend: { show: false },
        padding: [8, 8, 0, 0],
        cursor: { points: { show: false }, drag: { x: true, y: false } },
        hooks: { draw: [marked(view.marks ?? [])], setCursor: [told(output, view)] },
      };
      plot = new uPlot(options, data, place);
      if (!grid) below.replaceChildren(legend(view.series));
    }

    const names = content.choices[0].views.map((view) => view.label);
    const showView = (index) => {
      way = index;
      draw();
    };
    const controls = make("div", { class: "controls" });
    if (content.choices.length > 1) {
      const select = make("select", { "aria-label": "quantity" });
      content.choices.forEach(({ label }, index) => select.append(new Option(label, index)));
      select.addEventListener("change", () => {
        choice = Number(select.value);
        draw();
      });
      controls.append(select);
    }
    if (grid) joined(grid, names, content.choices[0].views[0].series, showView);
    else if (names.length > 1) controls.append(buttons(names, "scales", showView));
    if (controls.children.length) place.before(controls);
    place.after(below);
    draw();
    const fit = () => plot.setSize({ width: theme.width(place), height: content.height });
    new ResizeObserver(fit).observe(place);
    theme.onChange(() => {
      fit();
      plot.redraw(false, true);
    });
    figure.tlpsimPlot = () => plot;
  }

  /** One row of controls and one legend for figures beside each other. */
  function joined(grid, names, series, showView) {
    if (!grid.tlpsimViews) {
      grid.tlpsimViews = [];
      const controls = make("div", { class: "controls" });
      if (names.length > 1) {
        controls.append(buttons(names, "scales", (index) => grid.tlpsimViews.forEach((show) => show(index))));
      }
      controls.append(legend(series));
      grid.before(controls);
    }
    grid.tlpsimViews.push(showView);
  }

  return { mount, make, marked };
})();
