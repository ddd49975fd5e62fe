// Long signals drawn quickly: where a pixel covers several samples, the smallest and the largest of them.
//
//   tlpsimThinning.signal(low, high, group)  a signal from samples, of which low and high are one array and group is 1,
//                                            or from envelopes of `group` samples each
//   tlpsimThinning.between(signal, time, from, to, pixels) -> [times, values]   for uPlot; null where nothing was
//   tlpsimThinning.at(signal, time, moment) -> [low, high]                      of the sample next to a moment
//   tlpsimThinning.extreme(signal, largest) -> index of the sample
"use strict";

window.tlpsimThinning = (() => {
  const FACTOR = 8; // between two levels of envelopes

  function coarser({ low, high, group }) {
    const count = Math.ceil(low.length / FACTOR);
    const next = { low: new Float32Array(count), high: new Float32Array(count), group: group * FACTOR };
    for (let cell = 0; cell < count; cell++) {
      [next.low[cell], next.high[cell]] = limits(low, high, cell * FACTOR, (cell + 1) * FACTOR);
    }
    return next;
  }

  /** Smallest of `low` and largest of `high` from one index to before another; NaN where there is no number. */
  function limits(low, high, from, to) {
    let least = Infinity;
    let most = -Infinity;
    for (let i = from, end = Math.min(to, low.length); i < end; i++) {
      if (low[i] < least) least = low[i];
      if (high[i] > most) most = high[i];
    }
    return least <= most ? [least, most] : [NaN, NaN];
  }

  function signal(low, high, group) {
    const levels = [{ low, high, group }];
    while (levels.at(-1).low.length > FACTOR) levels.push(coarser(levels.at(-1)));
    return { group, levels };
  }

  /** Index of the first time that is not before a moment. */
  function search(time, moment) {
    let [low, high] = [0, time.length];
    while (low < high) {
      const middle = (low + high) >> 1;
      if (time[middle] < moment) low = middle + 1;
      else high = middle;
    }
    return low;
  }

  const known = (value) => (Number.isNaN(value) ? null : value);

  function between(shown, time, from, to, pixels) {
    const last = time.length - 1;
    // A sample beyond either end, so that the line goes on to the edge.
    const begin = Math.max(0, search(time, from) - 1);
    const end = Math.min(last, search(time, to));
    const finest = shown.levels[0];
    const times = [];
    const values = [];
    if (shown.group === 1 && end - begin <= 2 * pixels) {
      for (let i = begin; i <= end; i++) {
        times.push(time[i]);
        values.push(known(finest.low[i]));
      }
      return [times, values];
    }
    let bucket = Math.max(Math.ceil((end - begin + 1) / pixels), 1);
    const level = shown.levels.findLast((each) => each.group <= bucket) ?? finest;
    bucket = Math.ceil(bucket / level.group) * level.group;
    const cells = bucket / level.group;
    for (let start = Math.floor(begin / bucket) * bucket; start <= end; start += bucket) {
      const cell = start / level.group;
      const [least, most] = limits(level.low, level.high, cell, cell + cells);
      const middle = Math.min(start + (bucket >> 1), last);
      times.push(time[start]);
      values.push(known(least));
      if (middle > start) {
        times.push(time[middle]);
        values.push(known(most));
      }
    }
    return [times, values];
  }

  function at(shown, time, moment) {
    const after = Math.min(search(time, moment), time.length - 1);
    const near = after > 0 && moment - time[after - 1] < time[after] - moment ? after - 1 : after;
    const { low, high } = shown.levels[0];
    const cell = Math.floor(near / shown.group);
    return [low[cell], high[cell]];
  }

  function extreme(shown, largest) {
    const { low, high } = shown.levels[0];
    const values = largest ? high : low;
    let best = -1;
    for (let i = 0; i < values.length; i++) {
      if (!Number.isNaN(values[i]) && (best < 0 || values[i] > values[best] === largest)) best = i;
    }
    return best * shown.group;
  }

  return { signal, between, at, extreme };
})();
