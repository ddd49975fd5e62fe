// The animation of a run: hull, tendons, sea, wind and current, from the content of scenarios/report/scene.py.
//
//   await tlpsimScene.mount(element, content, unpack) -> scene
//
// fills `element` with the picture and its controls; `unpack` is that of unpack.js. It needs three.bundle.min.js,
// sea.js and world.js, and loads nothing. Without WebGL it says so, and the scene is null. Axes are those of
// docs/conventions.md; a point r of the body is at x + R r, R = Rz(yaw) Ry(pitch) Rx(roll), which three.js calls the
// order "ZYX".
"use strict";

(() => {
  const SPEEDS = [1, 2, 5, 10, 20, 50];
  const FACTORS = [1, 5, 20, 50]; // by which heave, roll and pitch are drawn larger
  const HINT = "Drag to turn the view; press on it and turn the wheel, or use two fingers, to come closer. ";
  const LINES = "Thin grey lines: tendons at rest, mean water level, axes.";
  const STYLE = `
    .tlpsim-scene { font: inherit; }
    .tlpsim-scene .view { width: 100%; aspect-ratio: 16 / 10; max-height: 72vh; min-height: 260px;
      border-radius: 6px; overflow: hidden; background: #e4edf3; color: #1d2b36; }
    .tlpsim-scene .view { background: light-dark(#e4edf3, #131d27); color: light-dark(#1d2b36, #dbe5ec); }
    .tlpsim-scene canvas { display: block; width: 100%; height: 100%; }
    .tlpsim-scene .stage { position: relative; }
    .tlpsim-scene .over { position: absolute; max-width: min(27em, 60%); padding: .4em .6em; font-size: .8rem;
      line-height: 1.35; pointer-events: none; border-radius: 4px;
      background: #ffffffb8; background: light-dark(#ffffffb8, #0d141bb8); }
    .tlpsim-scene .key { top: .5em; left: .5em; }
    .tlpsim-scene .scale { bottom: .5em; left: .5em; right: auto; }
    .tlpsim-scene .bar { width: 11em; height: .7em; margin: .2em 0 .1em; border-radius: 2px; }
    .tlpsim-scene .ticks { display: flex; justify-content: space-between; width: 11em; }
    .tlpsim-scene .sign { display: inline-block; width: .8em; height: .8em; margin-right: .35em; border-radius: 50%; }
    .tlpsim-scene .controls { display: flex; flex-wrap: wrap; gap: .4em .7em; align-items: center; margin: .5em 0; }
    .tlpsim-scene button, .tlpsim-scene select { font: inherit; min-height: 2.4em; padding: .2em .7em; }
    .tlpsim-scene .play { min-width: 5.5em; }
    .tlpsim-scene input[type=range] { flex: 1 1 14em; min-width: 10em; height: 2.4em; }
    .tlpsim-scene .time { min-width: 11em; font-variant-numeric: tabular-nums; }
    .tlpsim-scene .state { display: flex; flex-wrap: wrap; gap: .1em 1.1em; margin: .3em 0; font-size: .9rem;
      font-variant-numeric: tabular-nums; }
    .tlpsim-scene .notes { margin: .3em 0; font-size: .8rem; opacity: .8; }
    @media (pointer: coarse) { .tlpsim-scene button, .tlpsim-scene select, .tlpsim-scene input { min-height: 44px; } }
    @media (max-width: 600px) { .tlpsim-scene .view { aspect-ratio: 4 / 5; max-height: 66vh; }
      .tlpsim-scene .over { position: static; padding: .3em 0; max-width: none; } }
    @media print { .tlpsim-scene { color: #1d2b36; } .tlpsim-scene canvas { object-fit: contain; }
      .tlpsim-scene .controls > :not(.time), .tlpsim-scene .hint { display: none; }
      .tlpsim-scene .stage { break-inside: avoid; } }`;

  const grouped = (seconds) => {
    const whole = Math.floor(seconds + 1e-6), pad = (n) => String(n).padStart(2, "0");
    return `${seconds.toFixed(1)} s (${Math.floor(whole / 3600)}:${pad(Math.floor(whole / 60) % 60)}:${pad(whole % 60)})`;
  };
  const signed = (value, digits) => value.toFixed(digits).replace("-", "−");
  const numbered = (numbers) => `${numbers.length > 1 ? "tendons" : "tendon"} ${numbers.join(", ")}`;

  /** An element with attributes and children. */
  function make(name, attributes = {}, ...children) {
    const made = document.createElement(name);
    for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
    made.append(...children);
    return made;
  }

  /** Lowest and highest tension of tendons that hold, N, in whole tenths of a MN. */
  function tensionRange(tension) {
    let low = Infinity, high = -Infinity;
    tension?.of.forEach((series, i) => {
      for (const value of tension.values[series]) {
        if (value <= tension.slack[i]) continue;
        low = Math.min(low, value);
        high = Math.max(high, value);
      }
    });
    return low <= high ? [Math.floor(low / 1e5) * 1e5, Math.ceil(high / 1e5) * 1e5] : [0, 1e5];
  }

  async function mount(element, content, unpack) {
    if (!document.getElementById("tlpsim-scene-style")) {
      document.head.append(make("style", { id: "tlpsim-scene-style" }, STYLE));
    }
    const canvas = make("canvas", { role: "img", "aria-label": "Animation of the platform, its tendons and the sea" });
    const context = canvas.getContext("webgl2", { antialias: true, alpha: true, preserveDrawingBuffer: true });
    if (!context) {
      element.replaceChildren(make("p", { class: "tlpsim-scene-missing" },
        "The animation needs WebGL 2, which this browser does not have or has switched off. All else of the page works."));
      return null;
    }
    const three = window.tlpsimThree, world = window.tlpsimWorld, { time, tension } = content;
    const position = await Promise.all(content.position.map(unpack));
    if (tension) tension.values = await Promise.all(tension.series.map(unpack));
    const elevations = content.sea ? await Promise.all(content.sea.elevation.map(unpack)) : [];
    const range = tensionRange(tension);
    const last = time.count - 1;
    let frame = 0, factor = FACTORS[0], speed = 5, playing = false, visible = false, asked = 0, clock = 0, water = null;

    // Page

    const select = (values, chosen, text) => make("select", {}, ...values.map((value) =>
      make("option", value === chosen ? { value, selected: "" } : { value }, text(value))));
    const play = make("button", { type: "button", class: "play" }, "Play");
    const slider = make("input", { type: "range", min: 0, max: last, step: 1, value: 0, "aria-label": "Time" });
    const clockText = make("span", { class: "time" });
    const speeds = select(SPEEDS, speed, (value) => `${value}×`);
    const factors = select(FACTORS, factor, (value) => (value === 1 ? "true" : `${value}×`));
    const scaleText = make("div");
    const state = make("div", { class: "state", "aria-live": "off" });
    const key = make("div", { class: "over key" });
    const arrows = content.arrows.map((row) => {
      const sign = make("span", { class: "sign", style: `background:${world.ARROWS[row.name][0]}` });
      const words = make("div", {}, sign, `${row.name}: ${row.label}`);
      key.append(words);
      return { ...row, words, shape: world.arrow(three, row) };
    });
    const scale = make("div", { class: "over scale" }, scaleText);
    if (tension) {
      const ticks = [range[0], 0.5 * (range[0] + range[1]), range[1]].map((value) => (value / 1e6).toFixed(2));
      const bar = make("div", { class: "bar", style: `background:linear-gradient(90deg,${world.TENSIONS})` });
      scale.prepend("Tension, MN", bar, make("div", { class: "ticks" }, ...ticks.map((text) => make("span", {}, text))));
      const goes = tension.of.some((series, i) => tension.values[series].some((value) => value <= tension.slack[i]));
      if (goes) scale.insertBefore(make("div", {}, make("span", { class: "sign", style: `background:${world.SLACK}` }),
        "dashed: slack, or lost (its place is not computed)"), scaleText);
    }
    const view = make("div", { class: "view" }, canvas);
    const views = make("span", {});
    element.replaceChildren(make("div", { class: "tlpsim-scene" }, make("div", { class: "stage" }, view, key, scale),
      make("div", { class: "controls" }, play, slider, clockText),
      make("div", { class: "controls" }, make("label", {}, "Speed ", speeds),
        make("label", {}, "Heave, roll, pitch ", factors), views),
      state, make("p", { class: "notes" }, make("span", { class: "hint" }, HINT), [LINES, ...content.notes].join(" "))));

    // World

    const renderer = new three.WebGLRenderer({ canvas, context, antialias: true, alpha: true, preserveDrawingBuffer: true });
    const all = new three.Scene(), camera = new three.PerspectiveCamera(25, 1, 5, 20000);
    camera.up.set(0, 0, 1);
    const controls = new three.OrbitControls(camera, canvas);
    const body = world.hull(three, content.hull), sea = world.sea(three, content.extent);
    const tendons = world.tendons(three, content, range), surroundings = world.surroundings(three, content);
    const sun = new three.DirectionalLight("#ffffff", 1.8);
    sun.position.set(-0.5, -0.8, 1.2);
    all.add(new three.HemisphereLight("#ffffff", "#8a98a4", 2.2), sun, body, sea, tendons, surroundings,
      ...arrows.map((each) => each.shape));
    const variances = elevations.map((each) => each.reduce((sum, value) => sum + value ** 2, 0) / each.length);
    const large = 2.2 * Math.sqrt(variances.reduce((sum, each) => sum + each, 0)) || 1; // m, elevation of the colours' ends

    /** Values of the run at `frame`, which may lie between two of its frames. */
    function now() {
      const whole = Math.min(Math.floor(frame), last), share = frame - whole;
      const at = (series, k) => series[Math.min(Math.max(k, 0), last)];
      const pose = position.map((series) => window.tlpsimSea.between(
        at(series, whole - 1), at(series, whole), at(series, whole + 1), at(series, whole + 2), share));
      const seconds = time.start + frame * time.step;
      const states = (tension?.of ?? []).map((series, i) => {
        const values = tension.values[series];
        const value = at(values, whole) + share * (at(values, whole + 1) - at(values, whole));
        const lost = tension.lost[i] !== null && seconds >= tension.lost[i];
        return { value, lost, slack: !lost && value <= tension.slack[i] };
      });
      return { pose, states, seconds };
    }

    function tell({ pose, states, seconds }) {
      const degrees = (angle, digits) => `${signed((angle * 180) / Math.PI, digits)}°`;
      const parts = [`surge ${signed(pose[0], 2)} m`, `sway ${signed(pose[1], 2)} m`, `heave ${signed(100 * pose[2], 1)} cm`,
        `roll ${degrees(pose[3], 3)}`, `pitch ${degrees(pose[4], 3)}`, `yaw ${degrees(pose[5], 2)}`];
      if (water) parts.push(`wave at the platform ${signed(water.at(pose[0], pose[1]), 2)} m`);
      const order = states.map((each, i) => ({ ...each, number: i + 1 })).filter((each) => !each.lost);
      if (order.length) {
        order.sort((a, b) => a.value - b.value);
        const [low, high] = [order[0], order[order.length - 1]];
        const mega = (each) => `${(each.value / 1e6).toFixed(2)} MN (tendon ${each.number})`;
        parts.push(`tension ${mega(low)} to ${mega(high)}`);
      }
      for (const name of ["slack", "lost"]) {
        const numbers = states.flatMap((each, i) => (each[name] ? [i + 1] : []));
        if (numbers.length) parts.push(`${name}: ${numbered(numbers)}`);
      }
      state.replaceChildren(...parts.map((part) => make("span", {}, part)));
      clockText.textContent = grouped(seconds);
      slider.value = Math.round(frame);
      slider.setAttribute("aria-valuetext", `${seconds.toFixed(1)} s`);
      play.textContent = playing ? "Pause" : "Play";
      scaleText.textContent = factor === 1 ? "All motions true to scale."
        : `Heave, roll and pitch drawn ${factor} times as large; surge, sway and yaw true to scale.`;
    }

    function draw() {
      asked = 0;
      if (!water && content.sea) water = window.tlpsimSea.surface(content.sea, elevations, time.step);
      const present = now(), { pose, states } = present;
      body.position.set(pose[0], pose[1], factor * pose[2]);
      body.rotation.set(factor * pose[3], factor * pose[4], pose[5], "ZYX");
      body.updateMatrixWorld();
      water?.update(frame, pose[0], pose[1]);
      sea.userData.update(water, large);
      const away = camera.position.clone().sub(controls.target);
      tendons.userData.update(body, states, away.length());
      surroundings.userData.bed.visible = away.z < 0.85 * away.length();
      for (const { from, until, words, shape } of arrows) {
        shape.visible = (from === null || present.seconds >= from) && (until === null || present.seconds < until);
        words.hidden = !shape.visible;
      }
      tell(present);
      renderer.render(all, camera);
    }

    /** Draws once, soon, if anybody sees it. */
    function ask() {
      if (visible && !asked) asked = requestAnimationFrame(tick);
    }

    function tick(stamp) {
      if (playing) {
        frame = Math.min(frame + (Math.min(stamp - clock, 250) / 1000) * (speed / time.step), last);
        clock = stamp;
        if (frame >= last) playing = false;
      }
      draw();
      if (playing) ask();
    }

    function seek(seconds) {
      frame = Math.min(Math.max((seconds - time.start) / time.step, 0), last);
      ask();
    }

    function run(wanted) {
      playing = wanted;
      if (playing && frame >= last) frame = 0;
      clock = performance.now();
      ask();
    }

    const depth = content.water_depth;
    const seen = { // what the camera looks at, from where, and the height and breadth that it sees there, m
      Close: [[0, 0, -2], [-0.62, -1, 0.34], 160, 280],
      Whole: [[0, 0, -0.5 * depth + 10], [-0.62, -1, 0.27], 1.1 * depth + 130, 400],
      Side: [[0, 0, -2], [0, -1, 0.02], 140, 260],
      Above: [[0, 0, 0], [0, -0.001, 1], 340, 340],
    };
    function look(name) {
      const [target, direction, height, breadth] = seen[name];
      const tall = Math.max(height, breadth / camera.aspect) / 2 / Math.tan((camera.fov * Math.PI) / 360);
      controls.target.set(...target);
      camera.position.set(...direction).setLength(tall).add(controls.target);
      controls.update();
      ask();
    }
    for (const name of Object.keys(seen)) {
      const button = make("button", { type: "button" }, name);
      button.addEventListener("click", () => look(name));
      views.append(button, " ");
    }

    function resize() {
      const width = view.clientWidth, height = view.clientHeight;
      if (!width || !height) return;
      renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2));
      renderer.setSize(width, height, false);
      camera.aspect = width / height;
      camera.updateProjectionMatrix();
      ask();
    }

    resize();
    look("Close");
    play.addEventListener("click", () => run(!playing));
    slider.addEventListener("input", () => seek(time.start + slider.valueAsNumber * time.step));
    speeds.addEventListener("change", () => { speed = Number(speeds.value); });
    factors.addEventListener("change", () => { factor = Number(factors.value); ask(); });
    controls.addEventListener("change", ask);
    // The wheel scrolls the page until the picture is touched, and again when the pointer has left it.
    controls.enableZoom = false;
    canvas.addEventListener("pointerdown", () => { controls.enableZoom = true; });
    canvas.addEventListener("pointerleave", () => { controls.enableZoom = false; });
    window.addEventListener("beforeprint", draw);
    new ResizeObserver(resize).observe(view);
    new IntersectionObserver((entries) => {
      visible = entries[entries.length - 1].isIntersecting;
      clock = performance.now();
      ask();
    }).observe(view);

    return {
      seek,
      play: () => run(true),
      pause: () => run(false),
      look,
      draw,
      setFactor(value) { factor = value; ask(); },
      /** Where a point of the body is drawn, m. */
      pointInEarth: (point) => new three.Vector3(...point).applyMatrix4(body.matrixWorld).toArray(),
      elevation: (x, y) => (water ? water.at(x, y) : 0),
      seconds: () => time.start + frame * time.step,
      pose: () => now().pose,
    };
  }

  window.tlpsimScene = { mount };
})();
