// Arrays that scenarios/report/packing.py packed.
//
//   async tlpsimUnpack(packed) -> Float32Array     of `pack`: packed.count values; NaN where there was no finite number
//   async tlpsimTimes(packed)  -> Float64Array     of `pack_times`: packed.count times, s
//
// `packed` is what Python made, read from JSON: { count, offset, scale, differences, data }. Both reject with an Error
// when the data are damaged. Values of one array are read each time anew: keep the result.
"use strict";

(() => {
  const MISSING = 65535;

  /** Bytes of base64 text that holds a zlib stream. */
  async function inflated(text) {
    const packed = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
    const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
    return new Uint8Array(await new Response(stream).arrayBuffer());
  }

  async function unpack(packed) {
    const { count, offset, scale, differences } = packed;
    const bytes = await inflated(packed.data);
    if (bytes.length !== 2 * count) throw new Error(`${bytes.length} bytes of an array of ${count} values`);
    const coded = new Uint16Array(count); // sums wrap at 2^16, as the differences did
    for (let i = 0; i < count; i++) {
      const folded = (bytes[i] << 8) | bytes[count + i];
      coded[i] = (folded >>> 1) ^ -(folded & 1);
    }
    for (let order = 0; order < differences; order++) {
      for (let i = 1; i < count; i++) coded[i] += coded[i - 1];
    }
    const values = new Float32Array(count);
    for (let i = 0; i < count; i++) values[i] = coded[i] === MISSING ? NaN : offset + scale * coded[i];
    return values;
  }

  async function times(packed) {
    if (packed.data === undefined) return Float64Array.from({ length: packed.count }, (_, i) => packed.start + i * packed.step);
    const bytes = await inflated(packed.data);
    if (bytes.length !== 8 * packed.count) throw new Error(`${bytes.length} bytes of ${packed.count} times`);
    return new Float64Array(bytes.buffer);
  }

  window.tlpsimUnpack = unpack;
  window.tlpsimTimes = times;
})();
