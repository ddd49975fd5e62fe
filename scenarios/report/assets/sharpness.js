// Figures are drawn with two dots or more to a pixel of the page, so that they are sharp on paper too.
// uPlot takes `devicePixelRatio` when it starts and when the ratio changes.
"use strict";

(() => {
  const LEAST = 2;
  const found = Object.getOwnPropertyDescriptor(window, "devicePixelRatio");
  Object.defineProperty(window, "devicePixelRatio", {
    configurable: true,
    get: () => Math.max(LEAST, found.get.call(window)),
  });
})();
