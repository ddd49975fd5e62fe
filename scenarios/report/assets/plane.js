// A canvas with two axes, points that are found by pointer and keys, and a rectangle to drag.
//
//   tlpsimPlane.canvas(place, height, label) -> { base, over, size(), pens() }     two canvases on each other
//   tlpsimPlane.ticks(from, to, count) -> values
//   tlpsimPlane.axis(column, values) -> { from, to, levels, label }                of values that are drawn
//   tlpsimPlane.frame(pen, size, x, y) -> { x(value), y(value), left, right, top, bottom }     draws axes
//   tlpsimPlane.points(layers, handlers) -> { put(list) }    pointer and keys on points { row, x, y }, in pixels;
//     handlers: told(point, event), picked(point), framed(points), left()
"use strict";

window.tlpsimPlane = (() => {
  const theme = window.tlpsimTheme;
  const { make } = window.tlpsimLines;
  const FONT = "12px system-ui, -apple-system, 'Segoe UI', Roboto, sans-serif";
  const ROOM = { left: 62, right: 12, top: 10, bottom: 46 };
  const NEAR = 14; // pixels between pointer and point
  const FAINT = 0.28; // opacity of what is not selected
  const DRAGGED = 5; // pixels, from which on a click is a drag
  const AROUND = 0.04; // of the range, beside the data

  function canvas(place, height, label) {
    const base = make("canvas", {}), over = make("canvas", { tabindex: "0", role: "application", "aria-label": label });
    const live = make("span", { class: "unseen", role: "status" });
    const box = make("div", { class: "plane" }, base, over, live);
    place.append(box);
    let shown = { width: 0, height };

    /** Sizes the canvases as the page is, and clears them. */
    function pens(wanted = 0) {
      // On paper nothing scrolls.
      const paper = document.documentElement.classList.contains("printing");
      const width = paper ? theme.width(place) : Math.max(theme.width(place), wanted);
      const high = typeof height === "function" ? height() : height;
      shown = { width, height: high };
      return [base, over].map((each) => {
        each.width = Math.round(width * devicePixelRatio);
        each.height = Math.round(high * devicePixelRatio);
        Object.assign(each.style, { width: `${width}px`, height: `${high}px` });
        return pen(each);
      });
    }

    function pen(each) {
      const found = each.getContext("2d");
      found.setTransform(devicePixelRatio, 0, 0, devicePixelRatio, 0, 0);
      found.clearRect(0, 0, shown.width, shown.height);
      found.font = FONT;
      return found;
    }

    return { base, over, box, pens, overPen: () => pen(over), size: () => shown, say: (text) => (live.textContent = text) };
  }

  function ticks(from, to, count) {
    const rough = (to - from) / Math.max(count, 1), power = 10 ** Math.floor(Math.log10(rough));
    const step = [1, 2, 5, 10].map((each) => each * power).find((each) => each >= rough * 0.999);
    const found = [];
    for (let i = Math.ceil(from / step - 1e-9); i * step <= to + 1e-9 * step; i++) {
      found.push(Number((i * step).toPrecision(12)));
    }
    return found;
  }

  /** Range of an axis; where a setting has few values, they are its ticks. */
  function axis(column, values) {
    let least = Infinity, most = -Infinity;
    for (const value of values) {
      if (value < least) least = value;
      if (value > most) most = value;
    }
    if (!(least <= most)) [least, most] = [0, 1];
    const about = column.text ? 0.6 : AROUND * (most - least) || 0.05 * Math.abs(most) || 1;
    return { from: least - about, to: most + about, levels: column.levels, text: column.text,
      label: window.tlpsimSweep.named(column.label, column.unit) };
  }

  /** Places of an axis that have a figure or a word. */
  function marks({ from, to, levels, text }, length, each) {
    if (text) return levels.map((name, number) => [number, name]);
    const inside = levels?.filter((value) => value >= from && value <= to) ?? [];
    const few = inside.length > 1 && inside.length * each <= length;
    return (few ? inside : ticks(from, to, length / each)).map((value) => [value, theme.figures(value, 4)]);
  }

  /** A word no longer than so many pixels. */
  function cut(pen, word, room) {
    if (pen.measureText(word).width <= room) return word;
    let end = word.length;
    while (end > 1 && pen.measureText(`${word.slice(0, end)}…`).width > room) end--;
    return `${word.slice(0, end)}…`;
  }

  function frame(pen, { width, height }, x, y) {
    const box = { left: ROOM.left, right: width - ROOM.right, top: ROOM.top, bottom: height - ROOM.bottom };
    box.x = (value) => box.left + ((value - x.from) / (x.to - x.from)) * (box.right - box.left);
    box.y = (value) => box.bottom - ((value - y.from) / (y.to - y.from)) * (box.bottom - box.top);
    pen.strokeStyle = theme.colour("grid");
    pen.fillStyle = theme.colour("muted");
    pen.lineWidth = 1;
    Object.assign(pen, { textAlign: "center", textBaseline: "top" });
    const across = marks(x, box.right - box.left, 54);
    for (const [value, word] of across) {
      line(pen, box.x(value), box.top, box.x(value), box.bottom);
      pen.fillText(x.text ? cut(pen, word, (box.right - box.left) / across.length) : word, box.x(value), box.bottom + 5);
    }
    Object.assign(pen, { textAlign: "right", textBaseline: "middle" });
    for (const [value, word] of marks(y, box.bottom - box.top, 30)) {
      line(pen, box.left, box.y(value), box.right, box.y(value));
      pen.fillText(cut(pen, word, ROOM.left - 24), box.left - 6, box.y(value));
    }
    Object.assign(pen, { textAlign: "center", textBaseline: "bottom" });
    pen.fillText(cut(pen, x.label, width), (box.left + box.right) / 2, height - 6);
    upright(pen, cut(pen, y.label, box.bottom - box.top + 40), (box.top + box.bottom) / 2);
    return box;
  }

  function upright(pen, word, middle) {
    pen.save();
    pen.translate(4, middle);
    pen.rotate(-Math.PI / 2);
    Object.assign(pen, { textAlign: "center", textBaseline: "top" });
    pen.fillText(word, 0, 0);
    pen.restore();
  }

  function line(pen, ...[x, y, to, end]) {
    pen.beginPath();
    pen.moveTo(x, y);
    pen.lineTo(to, end);
    pen.stroke();
  }

  function points(layers, { told, picked, framed, left }) {
    const { over } = layers;
    let list = [], start = null, at = -1;

    const place = (event) => {
      const { left: x, top: y } = over.getBoundingClientRect();
      return [event.clientX - x, event.clientY - y];
    };

    function nearest(x, y) {
      let best = null, distance = NEAR ** 2;
      for (const point of list) {
        const found = (point.x - x) ** 2 + (point.y - y) ** 2;
        if (found < distance) [best, distance] = [point, found];
      }
      return best;
    }

    const corners = ([x, y], [to, end]) =>
      ({ left: Math.min(x, to), right: Math.max(x, to), top: Math.min(y, end), bottom: Math.max(y, end) });
    const far = (event) => Math.hypot(...place(event).map((value, i) => value - start[i])) > DRAGGED;

    over.addEventListener("pointerdown", (event) => {
      if (event.button) return;
      start = place(event);
      over.setPointerCapture(event.pointerId);
    });
    over.addEventListener("pointermove", (event) => {
      if (start && far(event)) {
        told(null, event);
        rectangle(layers.overPen(), corners(start, place(event)));
      } else if (!start) told(nearest(...place(event)), event);
    });
    over.addEventListener("pointerup", (event) => {
      if (!start) return;
      const drag = far(event) && corners(start, place(event));
      start = null;
      layers.overPen();
      const { left: from, right: to, top, bottom } = drag || {};
      if (drag) framed(list.filter(({ x, y }) => x >= from && x <= to && y >= top && y <= bottom));
      else picked(nearest(...place(event)));
    });
    over.addEventListener("pointercancel", () => {
      start = null;
      layers.overPen();
    });
    over.addEventListener("pointerleave", () => left());
    over.addEventListener("blur", () => left());
    over.addEventListener("keydown", (event) => {
      const step = { ArrowRight: 1, ArrowUp: 1, ArrowLeft: -1, ArrowDown: -1 }[event.key];
      if (step && list.length) {
        const sorted = [...list].sort((a, b) => a.x - b.x || b.y - a.y);
        at = (at + step + sorted.length) % sorted.length;
        const { x, y } = over.getBoundingClientRect();
        told(sorted[at], { clientX: x + sorted[at].x, clientY: y + sorted[at].y });
        layers.current = sorted[at];
        event.preventDefault();
      } else if ((event.key === "Enter" || event.key === " ") && layers.current) {
        picked(layers.current);
        event.preventDefault();
      }
    });

    return { put: (found) => ([list, at] = [found, -1]) };
  }

  function rectangle(pen, { left, right, top, bottom }) {
    pen.fillStyle = pen.strokeStyle = theme.colour("accent");
    pen.globalAlpha = 0.16;
    pen.fillRect(left, top, right - left, bottom - top);
    pen.globalAlpha = 1;
    pen.strokeRect(left, top, right - left, bottom - top);
  }

  /** Dots in batches of one colour: `dots` are { x, y, colour, faint }. */
  function dots(pen, list, radius, colour) {
    const batches = new Map();
    for (const dot of list) {
      const name = dot.faint ? -1 : dot.colour;
      if (!batches.has(name)) batches.set(name, []);
      batches.get(name).push(dot);
    }
    for (const [number, batch] of [...batches].sort(([a], [b]) => a - b)) {
      pen.fillStyle = number < 0 ? theme.colour("muted") : colour(number);
      pen.globalAlpha = number < 0 ? FAINT : 1;
      pen.beginPath();
      for (const { x, y } of batch) {
        pen.moveTo(x + radius, y);
        pen.arc(x, y, radius, 0, 2 * Math.PI);
      }
      pen.fill();
    }
    pen.globalAlpha = 1;
  }

  function ring(pen, x, y, radius = 7) {
    pen.lineWidth = 2;
    pen.strokeStyle = theme.colour("text");
    pen.beginPath();
    pen.arc(x, y, radius, 0, 2 * Math.PI);
    pen.stroke();
  }

  return { canvas, ticks, axis, frame, points, dots, ring, line, cut, rectangle, upright, FONT, ROOM };
})();
