// Fills the figures of the page from its data. `window.tlpsimReady` is a promise of when all of them are drawn.
"use strict";

window.tlpsimReady = (async () => {
  const { contents, arrays } = JSON.parse(document.getElementById("data").textContent);
  // In the page each array stands once; whoever shows it has its number.
  const whole = (packed) => (packed.data === undefined ? packed : { ...packed, data: arrays[packed.data] });
  const unpack = (packed) => window.tlpsimUnpack(whole(packed));
  const times = (packed) => window.tlpsimTimes(whole(packed));

  const mounts = {
    lines: (figure, content) => window.tlpsimLines.mount(figure, content),
    series: (figure, content) => window.tlpsimSeries.mount(figure, content, unpack, times),
    // The first of a sweep has the data of those after it.
    sweep: (figure, content) => window.tlpsimSweep.mount(figure, content, unpack),
    sweep_cells: (figure, content) => window.tlpsimCells.mount(figure, content),
    sweep_scatter: (figure, content) => window.tlpsimScatter.mount(figure, content),
    sweep_parallel: (figure, content) => window.tlpsimParallel.mount(figure, content),
    sweep_domains: (figure, content) => window.tlpsimDomains.mount(figure, content),
    sweep_worst: (figure, content) => window.tlpsimWorst.mount(figure, content),
  };

  /** Mounts a figure; one that fails says so in its place, and the others go on. */
  async function fill(element, mount) {
    try {
      await mount(element, contents[Number(element.dataset.content)]);
    } catch (error) {
      const text = document.createElement("p");
      text.className = "banner";
      text.textContent = `This figure cannot be drawn here: ${error.message}`;
      element.append(text);
      console.error(error);
    }
  }

  const contentsList = document.querySelector("nav details");
  if (matchMedia("(max-width: 1099px)").matches) contentsList.open = false;

  for (const figure of document.querySelectorAll("figure.chart")) await fill(figure, mounts[figure.dataset.kind]);
  for (const place of document.querySelectorAll(".scene")) {
    await fill(place, (element, content) => window.tlpsimScene.mount(element, content, unpack));
  }
})();
