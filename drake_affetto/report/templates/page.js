"use strict";
(() => {
  const root = document.documentElement;
  const figures = JSON.parse(document.getElementById("figures").textContent);
  const darkOf = JSON.parse(document.getElementById("colors").textContent);
  const dark = matchMedia("(prefers-color-scheme: dark)");
  const narrow = matchMedia("(max-width: 520px)");
  const charts = [...document.querySelectorAll(".chart")];
  const config = { displayModeBar: false, responsive: true, scrollZoom: false, doubleClick: false };

  function figureOf(div) {
    let text = figures[div.dataset.chart];
    if (dark.matches) text = text.replace(/#[0-9a-f]{6}\b/g, (color) => darkOf[color] ?? color);
    const figure = JSON.parse(text);
    if (narrow.matches) {
      const layout = figure.layout;
      layout.template.layout.font.size = 12;
      if (layout.coloraxis?.colorbar) {
        Object.assign(layout.coloraxis.colorbar, { orientation: "h", y: -0.2, yanchor: "top", title: { text: layout.coloraxis.colorbar.title.text, side: "top" } });
      }
    }
    return figure;
  }

  async function draw(div) {
    const { data, layout } = figureOf(div);
    await Plotly.react(div, data, layout, config);
    div.classList.remove("empty");
    root.dataset.chartsDrawn = document.querySelectorAll(".chart > .plot-container .main-svg:first-child").length;
  }

  // One after the other, so that the page can be read and scrolled meanwhile.
  let round = 0;
  async function drawAll() {
    const own = ++round;
    for (const div of charts) {
      await new Promise((done) => setTimeout(done));
      if (own !== round) return;
      await draw(div);
    }
    root.dataset.theme = dark.matches ? "dark" : "light";
  }
  root.dataset.charts = charts.length;
  root.dataset.chartsDrawn = 0;
  dark.addEventListener("change", drawAll);
  narrow.addEventListener("change", drawAll);
  drawAll();

  // A replay is a page of its own, kept packed until it is asked for. It runs
  // in a frame that cannot reach this page.
  for (const stage of document.querySelectorAll(".stage")) {
    const { replay, title } = stage.dataset;
    const packed = document.getElementById(replay).textContent;
    const again = stage.parentElement.querySelector(".again");
    let unpacked;
    async function show() {
      const bytes = Uint8Array.from(atob(packed), (letter) => letter.charCodeAt(0));
      const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
      unpacked ??= await new Response(stream).text();
      const frame = document.createElement("iframe");
      frame.title = title;
      frame.setAttribute("sandbox", "allow-scripts");
      frame.tabIndex = 0;
      frame.srcdoc = unpacked;
      stage.replaceChildren(frame);
      again.hidden = false;
      return frame;
    }
    stage.querySelector("button").addEventListener("click", async (event) => {
      event.target.disabled = true;
      event.target.textContent = "Unpacking …";
      try {
        (await show()).focus();
      } catch (error) {
        event.target.textContent = `This browser cannot unpack it: open ${replay}.html instead`;
      }
    });
    again.addEventListener("click", show);
  }
})();
