// The sea surface of the animation: eq. (1) of scenarios/report/sea_surface.py.
//
//   tlpsimSea.surface(content, elevations, step) -> { update(frame, x, y), at(x, y) }
//
// `content` is the content's "sea", `elevations` its arrays unpacked, `step` the time between frames, s. `frame` counts
// frames, also fractions of them, and x, y is where the platform's reference point is then, m. `at` gives the elevation
// at the frame of the last update, m.
"use strict";

(() => {
  const SPACING = 2; // m, between the places of a profile; the shortest wave is 10 m long

  /** Kernels h_m(s) of all places s: rows of 2 half + 1 weights for the samples half later ... half earlier. */
  function kernels(numbers, frequency, half, step, reach) {
    const places = 2 * Math.ceil(reach / SPACING) + 1, taps = 2 * half + 1;
    const table = new Float32Array(places * taps);
    const scale = 2 * step * (frequency[1] - frequency[0]);
    const taper = Float64Array.from({ length: taps }, (_, i) => {
      const end = (1 - Math.abs(i - half) / (half + 1)) / 0.1; // of the outermost tenth, where hardly anything is
      return scale * (end < 1 ? 0.5 - 0.5 * Math.cos(Math.PI * end) : 1);
    });
    const sums = new Float64Array(taps);
    for (let place = 0; place < places; place++) {
      const s = (place - (places - 1) / 2) * SPACING;
      sums.fill(0);
      for (let j = 0; j < frequency.length; j++) {
        const turn = 2 * Math.PI * frequency[j] * step, start = -half * turn - numbers[j] * s;
        let c = Math.cos(start), d = Math.sin(start);
        const ct = Math.cos(turn), st = Math.sin(turn);
        for (let i = 0; i < taps; i++) {
          sums[i] += c;
          const turned = c * ct - d * st;
          d = c * st + d * ct;
          c = turned;
        }
      }
      for (let i = 0; i < taps; i++) table[place * taps + i] = sums[i] * taper[i];
    }
    return { table, places, taps };
  }

  /** Value between samples 1 and 2 of four, by the cubic through their values and central differences. */
  function between(a, b, c, d, share) {
    return b + 0.5 * share * (c - a + share * (2 * a - 5 * b + 4 * c - d + share * (3 * (b - c) + d - a)));
  }

  function surface(content, elevations, step) {
    const { half, frequency, heading, reach } = content;
    const shared = content.wavenumber.map((numbers) => kernels(numbers, frequency, half, step, reach));
    const parts = heading.map((angle, j) => {
      const { table, places, taps } = shared[content.wavenumber_of[j]];
      return { cos: Math.cos(angle), sin: Math.sin(angle), record: elevations[j], table, places, taps,
        profile: new Float32Array(places), from: 0 };
    });
    const samples = new Float64Array(2 * half + 1);

    /** Place on the profile of a part: index, and the share of the next one. */
    const found = { index: 0, share: 0 };
    function find(part, x, y) {
      const place = (x * part.cos + y * part.sin - part.from) / SPACING + (part.places - 1) / 2;
      const inside = Math.min(Math.max(place, 0), part.places - 1.001);
      found.index = Math.floor(inside);
      found.share = inside - found.index;
    }

    return {
      update(frame, x, y) {
        const whole = Math.floor(frame), share = frame - whole;
        for (const part of parts) {
          const { record, table, taps, profile } = part, last = record.length - 1;
          for (let i = 0; i < taps; i++) {
            const k = whole + 2 * half - i; // the sample `half` before the frame's own is record[whole]
            const at = (n) => record[Math.min(Math.max(n, 0), last)];
            samples[i] = between(at(k - 1), at(k), at(k + 1), at(k + 2), share);
          }
          for (let place = 0; place < profile.length; place++) {
            let sum = 0;
            for (let i = 0, row = place * taps; i < taps; i++) sum += table[row + i] * samples[i];
            profile[place] = sum;
          }
          part.from = content.at_platform ? x * part.cos + y * part.sin : 0;
        }
      },
      at(x, y) {
        let sum = 0;
        for (const part of parts) {
          find(part, x, y);
          sum += part.profile[found.index] * (1 - found.share) + part.profile[found.index + 1] * found.share;
        }
        return sum;
      },
    };
  }

  window.tlpsimSea = { surface, between };
})();
