// What the animation draws, of three.js: hull, tendons, sea, arrows, surroundings; scene.js moves it.
//
//   tlpsimWorld.hull(three, hull) -> group                       in body axes
//   tlpsimWorld.tendons(three, content, range) -> group          userData.update(body, states, distance)
//   tlpsimWorld.sea(three, extent) -> mesh                       userData.update(surface, large)
//   tlpsimWorld.arrow(three, row), surroundings(three, content) -> group
//
// Lengths are in m, at their true scale; only tendons, arrows and anchors are thicker than they are.
"use strict";

(() => {
  const GRID = 4; // m, of the sea surface
  const TENSIONS = ["#2c7bb6", "#4fb3bf", "#cdbb45", "#f08a2c", "#c4161c"]; // low to high
  const SLACK = "#d02bd0";
  const ARROWS = { wind: ["#8e44ad", 62], waves: ["#1273b0", 16], current: ["#1f8a4d", -14] }; // colour, height in m
  const HULL = { columns: "#f0ad33", pontoons: "#e09d28", deck: "#a9b4bf" };
  const SEA = [[0.01, 0.1, 0.2], [0.03, 0.24, 0.4], [0.3, 0.6, 0.75]]; // trough, mean water level, crest
  const GREY = "#6f7b86";

  /** Hull and deck, which move with the platform. */
  function hull(three, parts) {
    const body = new three.Group();
    const material = (part) => new three.MeshLambertMaterial({ color: HULL[part] });
    for (const { x, y, radius, bottom, top } of parts.columns) {
      const column = new three.Mesh(new three.CylinderGeometry(radius, radius, top - bottom, 40), material("columns"));
      column.rotation.x = Math.PI / 2; // its axis is y in three.js
      column.position.set(x, y, 0.5 * (top + bottom));
      body.add(column);
    }
    for (const part of ["pontoons", "deck"]) {
      for (const { centre, size } of parts[part]) {
        const box = new three.Mesh(new three.BoxGeometry(...size), material(part));
        box.position.set(...centre);
        body.add(box);
      }
    }
    return body;
  }

  /** A text of constant size on the screen. */
  function label(three, text, colour, place) {
    const canvas = document.createElement("canvas"), pen = canvas.getContext("2d");
    const font = "600 40px system-ui, sans-serif";
    pen.font = font;
    const width = Math.ceil(pen.measureText(text).width) + 24, height = 60;
    Object.assign(canvas, { width, height }); // which forgets the font
    Object.assign(pen, { font, textAlign: "center", textBaseline: "middle", lineWidth: 8, lineJoin: "round" });
    pen.strokeStyle = "#ffffffd8";
    pen.strokeText(text, width / 2, height / 2);
    pen.fillStyle = colour;
    pen.fillText(text, width / 2, height / 2);
    const map = new three.CanvasTexture(canvas);
    map.colorSpace = "srgb";
    const sprite = new three.Sprite(new three.SpriteMaterial({ map, sizeAttenuation: false, depthTest: false }));
    sprite.scale.set((0.017 * width) / height, 0.017, 1);
    sprite.position.set(...place);
    sprite.renderOrder = 3;
    return sprite;
  }

  /** An arrow that comes from upstream and points at the platform, level, along a heading. */
  function arrow(three, { name, heading }) {
    const [colour, height] = ARROWS[name];
    const group = new three.Group();
    const material = new three.MeshLambertMaterial({ color: colour, emissive: colour, emissiveIntensity: 0.4 });
    const shaft = new three.Mesh(new three.CylinderGeometry(1.6, 1.6, 44, 16), material);
    const head = new three.Mesh(new three.ConeGeometry(5, 15, 24), material);
    for (const part of [shaft, head]) part.rotation.z = -Math.PI / 2; // from y to x
    shaft.position.x = -122;
    head.position.x = -93;
    group.add(shaft, head, label(three, name, colour, [-116, 0, 8]));
    group.rotation.z = heading;
    group.position.z = height;
    return group;
  }

  /** Lines, from points (n, 3) that are joined in pairs. */
  function segments(three, points) {
    const geometry = new three.BufferGeometry();
    geometry.setAttribute("position", new three.BufferAttribute(new Float32Array(points.flat()), 3));
    return new three.LineSegments(geometry, new three.LineBasicMaterial({ color: GREY }));
  }

  /** What does not move: sea bed, mean water level, axes, tendons at rest. */
  function surroundings(three, content) {
    const group = new three.Group(), { extent, water_depth: depth, tendons: ends } = content;
    const onCircle = (angle) => [extent * Math.cos(angle), extent * Math.sin(angle), 0];
    const round = Array.from({ length: 97 }, (_, i) => onCircle((Math.PI * i) / 48));
    const level = segments(three, round.slice(1).flatMap((point, i) => [round[i], point]));
    const axes = segments(three, [[75, 0, 0], [150, 0, 0], [0, 75, 0], [0, 150, 0]]);
    const rest = segments(three, ends.fairleads.flatMap((top, i) => [top, ends.anchors[i]]));
    const bed = new three.Group(); // it hides from above, where it would be a disc without meaning behind the sea
    const ground = new three.Mesh(new three.CylinderGeometry(0.6 * extent, 0.6 * extent, 2, 96),
      new three.MeshLambertMaterial({ color: "#b3a68c" }));
    ground.rotation.x = Math.PI / 2;
    ground.position.z = -depth - 1;
    bed.add(ground, label(three, "sea bed", GREY, [0.51 * extent, -0.32 * extent, -depth]));
    for (const [x, y, z] of ends.anchors) {
      const anchor = new three.Mesh(new three.BoxGeometry(14, 14, 5), new three.MeshLambertMaterial({ color: "#59636d" }));
      anchor.position.set(x, y, z);
      bed.add(anchor);
    }
    group.add(level, axes, rest, bed, label(three, "x", GREY, [156, 0, 0]), label(three, "y", GREY, [0, 156, 0]),
      label(three, "mean water level", GREY, [0.85 * extent, -0.53 * extent, 0]));
    group.userData.bed = bed;
    return group;
  }

  /** The sea: a disc of a square grid, transparent so that the hull shows below, and fading at its edge. */
  function sea(three, extent) {
    const side = 2 * Math.round(extent / GRID) + 1, index = [];
    const places = new Float32Array(3 * side * side), colours = new Float32Array(4 * side * side);
    for (let row = 0; row < side; row++) {
      for (let column = 0; column < side; column++) {
        const i = row * side + column, x = column * GRID - extent, y = row * GRID - extent;
        const radius = Math.hypot(x, y) / extent;
        places.set([x, y, 0], 3 * i);
        colours[4 * i + 3] = 0.62 * Math.min(Math.max((1 - radius) / 0.15, 0), 1);
        if (row && column && radius < 1) index.push(i - side - 1, i - side, i, i - side - 1, i, i - 1);
      }
    }
    const geometry = new three.BufferGeometry();
    const arrays = [["position", places, 3], ["normal", new Float32Array(places.length), 3], ["color", colours, 4]];
    for (const [name, values, size] of arrays) {
      geometry.setAttribute(name, new three.BufferAttribute(values, size).setUsage(three.DynamicDrawUsage));
    }
    geometry.setIndex(index);
    const mesh = new three.Mesh(geometry, new three.MeshPhongMaterial({ vertexColors: true, transparent: true,
      depthWrite: false, side: three.DoubleSide, specular: "#3c4a52", shininess: 40 }));
    mesh.frustumCulled = false; // its bounds change with the waves
    mesh.renderOrder = 2;

    /** Heights and normals from `surface`, null for calm water; colours by the height over `large`, m. */
    mesh.userData.update = (surface, large) => {
      const { position, normal, color } = geometry.attributes;
      const z = (i) => places[3 * i + 2];
      if (surface) for (let i = 0; i < side * side; i++) places[3 * i + 2] = surface.at(places[3 * i], places[3 * i + 1]);
      for (let row = 0; row < side; row++) {
        const below = Math.max(row - 1, 0), above = Math.min(row + 1, side - 1);
        for (let column = 0; column < side; column++) {
          const i = row * side + column, left = Math.max(column - 1, 0), right = Math.min(column + 1, side - 1);
          const dx = (z(row * side + right) - z(row * side + left)) / ((right - left) * GRID);
          const dy = (z(above * side + column) - z(below * side + column)) / ((above - below) * GRID);
          const length = Math.hypot(dx, dy, 1);
          normal.array[3 * i] = -dx / length;
          normal.array[3 * i + 1] = -dy / length;
          normal.array[3 * i + 2] = 1 / length;
          const share = Math.min(Math.max(z(i) / large, -1), 1), end = SEA[share < 0 ? 0 : 2];
          for (let c = 0; c < 3; c++) colours[4 * i + c] = SEA[1][c] + Math.abs(share) * (end[c] - SEA[1][c]);
        }
      }
      for (const attribute of [position, normal, color]) attribute.needsUpdate = true;
    };
    return mesh;
  }

  /** Tendons, each a tube in the colour of its tension, or a dashed line where it is slack or lost. */
  function tendons(three, content, range) {
    const { fairleads, anchors, aside, diameter } = content.tendons;
    const scale = TENSIONS.map((colour) => new three.Color(colour)), up = new three.Vector3(0, 0, 1);
    const group = new three.Group();
    const tube = new three.CylinderGeometry(1, 1, 1, 10).rotateX(Math.PI / 2).translate(0, 0, 0.5);
    const beside = ([x, y, z], i) => new three.Vector3(x + aside[i][0], y + aside[i][1], z);
    const rows = fairleads.map((fairlead, i) => {
      const ends = new three.BufferAttribute(new Float32Array(6), 3);
      // Without shading, so that the colour is that of the scale.
      const mesh = new three.Mesh(tube, new three.MeshBasicMaterial({ color: GREY }));
      const line = new three.Line(new three.BufferGeometry().setAttribute("position", ends),
        new three.LineDashedMaterial({ color: SLACK, dashSize: 8, gapSize: 6 }));
      mesh.frustumCulled = line.frustumCulled = false;
      group.add(mesh, line);
      return { mesh, line, ends, fairlead: beside(fairlead, i), bottom: beside(anchors[i], i), least: 0.5 * diameter[i] };
    });
    const top = new three.Vector3(), span = new three.Vector3();

    /** `states[i]` is { value, slack, lost }, missing without tensions; `distance` is that of the camera, m. */
    group.userData.update = (body, states, distance) => {
      rows.forEach(({ mesh, line, ends, fairlead, bottom, least }, i) => {
        const state = states[i];
        line.visible = Boolean(state && (state.slack || state.lost));
        mesh.visible = !line.visible;
        top.copy(fairlead);
        // One that is lost has parted at its top; where it went nobody computed, so it is shown beside its place.
        if (state?.lost) top.multiply({ x: 1.4, y: 1.4, z: 1 }).add({ x: 0, y: 0, z: -20 });
        else top.applyMatrix4(body.matrixWorld);
        if (line.visible) {
          ends.array.set([...bottom.toArray(), ...top.toArray()]);
          ends.needsUpdate = true;
          line.computeLineDistances();
          return;
        }
        span.subVectors(top, bottom);
        const radius = Math.max(least, 0.6, 0.0009 * distance);
        mesh.position.copy(bottom);
        mesh.scale.set(radius, radius, span.length());
        mesh.quaternion.setFromUnitVectors(up, span.normalize());
        if (!state) return;
        const place = Math.min(Math.max((state.value - range[0]) / (range[1] - range[0]), 0), 0.9999) * (scale.length - 1);
        mesh.material.color.lerpColors(scale[Math.floor(place)], scale[Math.floor(place) + 1], place % 1);
      });
    };
    return group;
  }

  window.tlpsimWorld = { hull, tendons, sea, arrow, surroundings, ARROWS, TENSIONS, SLACK };
})();
