// The stretch of time that is shown, and how mouse, fingers and keys change it.
//
//   const stretch = tlpsimGestures.stretch(changed)     changed() is called when another stretch is to be shown
//   stretch.whole, stretch.view                         [from, to], s
//   stretch.show(from, to), zoom(factor, centre), pan(share), reset()
//   tlpsimGestures.attach(plot, stretch)                wheel and fingers on a plot
//   tlpsimGestures.keys(element, stretch)               keys on an element that has the focus
"use strict";

window.tlpsimGestures = (() => {
  const ZOOM = 1.35; // of a step of the wheel or a key
  const STEP = 0.2; // of the stretch, of a key
  const CLOSEST = 20; // pixels between two fingers

  function stretch(changed) {
    const state = { whole: [0, 1], view: [0, 1], show, zoom, pan, reset: () => show(...state.whole) };

    function show(from, to) {
      const [first, last] = state.whole;
      const length = Math.min(Math.max(to - from, 1e-6 * (last - first), 1e-9), last - first);
      const begin = Math.min(Math.max(from, first), last - length);
      if (begin === state.view[0] && begin + length === state.view[1]) return;
      state.view = [begin, begin + length];
      changed();
    }

    function zoom(factor, centre = (state.view[0] + state.view[1]) / 2) {
      show(centre - (centre - state.view[0]) * factor, centre + (state.view[1] - centre) * factor);
    }

    function pan(share) {
      const shift = share * (state.view[1] - state.view[0]);
      show(state.view[0] + shift, state.view[1] + shift);
    }

    return state;
  }

  /** The wheel with Ctrl, or on a plot that was clicked; otherwise the page scrolls. With Shift it moves along. */
  function wheel(plot, state) {
    return (event) => {
      const used = plot.over.closest(".plot") === document.activeElement;
      if (!event.ctrlKey && !event.metaKey && !event.shiftKey && !used) return;
      event.preventDefault();
      const place = event.clientX - plot.over.getBoundingClientRect().left;
      if (event.shiftKey) state.pan(Math.sign(event.deltaY || event.deltaX) * STEP);
      else state.zoom(ZOOM ** Math.sign(event.deltaY), plot.posToVal(place, "x"));
    };
  }

  function attach(plot, state) {
    const { over } = plot;
    over.addEventListener("wheel", wheel(plot, state), { passive: false });
    const fingers = new Map();
    over.addEventListener("pointerdown", (event) => {
      if (event.pointerType === "touch") fingers.set(event.pointerId, event.clientX);
      else over.closest(".plot").focus({ preventScroll: true });
    });
    over.addEventListener("pointermove", (event) => {
      if (!fingers.has(event.pointerId)) return;
      const before = [...fingers.values()];
      fingers.set(event.pointerId, event.clientX);
      const after = [...fingers.values()];
      if (after.length === 1) state.pan((before[0] - after[0]) / over.clientWidth);
      if (after.length !== 2) return;
      const gap = ([a, b]) => Math.max(Math.abs(a - b), CLOSEST);
      const middle = (after[0] + after[1]) / 2 - over.getBoundingClientRect().left;
      state.zoom(gap(before) / gap(after), plot.posToVal(middle, "x"));
    });
    for (const end of ["pointerup", "pointercancel", "pointerleave"]) {
      over.addEventListener(end, (event) => fingers.delete(event.pointerId));
    }
  }

  function keys(element, state) {
    const actions = {
      ArrowLeft: () => state.pan(-STEP),
      ArrowRight: () => state.pan(STEP),
      "+": () => state.zoom(1 / ZOOM),
      "=": () => state.zoom(1 / ZOOM),
      "-": () => state.zoom(ZOOM),
      0: state.reset,
      Escape: state.reset,
    };
    element.addEventListener("keydown", (event) => {
      if (!actions[event.key] || event.ctrlKey || event.metaKey || event.altKey) return;
      event.preventDefault();
      actions[event.key]();
    });
  }

  return { stretch, attach, keys };
})();
