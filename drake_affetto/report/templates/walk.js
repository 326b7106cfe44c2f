"use strict";
// Charts by keyboard: the arrow keys walk through the points of the chart that
// has the focus. The point is marked as the mouse would, and what it says is
// spoken.
(() => {
  const spoken = document.getElementById("spoken");
  const places = new WeakMap();

  // What can be walked: for each trace its points in their order, as Plotly
  // numbers them. Traces that tell the mouse nothing are decoration.
  function seriesOf(chart) {
    const found = [];
    for (const trace of chart._fullData ?? []) {
      if (trace.visible !== true || trace.hoverinfo === "skip") continue;
      const points = [];
      if (trace.type === "heatmap") {
        trace.z.forEach((row, i) => row.forEach((z, j) => {
          if (Number.isFinite(z)) points.push([i, j]);
        }));
      } else {
        const count = Math.min(trace.x?.length ?? 0, trace.y?.length ?? 0);
        for (let i = 0; i < count; i++) {
          if (trace.x[i] != null && trace.y[i] != null) points.push(i);
        }
      }
      if (points.length) found.push({ curve: trace.index, points });
    }
    return found;
  }

  function clear(chart) {
    Plotly.Fx.unhover(chart);
    chart.parentElement.querySelector(".ring").hidden = true;
    places.delete(chart);
  }

  // What the label says that Plotly has just drawn, line by line.
  function labelOf(chart) {
    const lines = [];
    for (const label of chart.querySelectorAll(".hoverlayer .hovertext")) {
      for (const part of label.querySelectorAll("text")) {
        const inner = [...part.querySelectorAll("tspan.line")].map((line) => line.textContent);
        lines.push(inner.length ? inner.join(", ").replaceAll(":, ", ": ") : part.textContent);
      }
    }
    return lines.map((line) => line.trim()).filter(Boolean).join(", ").replaceAll(":, ", ": ");
  }

  // Where a point is: in the axes' own numbers, and in pixels of the chart.
  function locate(chart, curve, point) {
    const calculated = chart.calcdata.find(([first]) => first.trace?.index === curve);
    const trace = calculated[0].trace;
    let at;
    if (trace.type === "heatmap") {
      const middle = (edges, i) => (edges[i] + edges[i + 1]) / 2;
      at = { x: middle(calculated[0].x, point[1]), y: middle(calculated[0].y, point[0]) };
    } else {
      at = { x: calculated[point].x, y: calculated[point].y };
    }
    const pixel = (axis, value) => {
      const found = chart._fullLayout[axis.replace(/^[xy]/, "$&axis")];
      return found._offset + found.c2p(value);
    };
    return { ...at, left: pixel(trace.xaxis, at.x), top: pixel(trace.yaxis, at.y), type: trace.type };
  }

  function show(chart, series, place) {
    const { curve, points } = series[place.series];
    const point = points[place.point];
    const at = locate(chart, curve, point);
    // Without this a label that is soon followed by another is skipped.
    Plotly.Fx.unhover(chart);
    // A cell of a map is found by its place, a point by its number.
    Plotly.Fx.hover(chart, at.type === "heatmap"
      ? { xval: at.x, yval: at.y }
      : [{ curveNumber: curve, pointNumber: point }]);
    const ring = chart.parentElement.querySelector(".ring");
    ring.hidden = false;
    ring.style.left = `${at.left}px`;
    ring.style.top = `${at.top}px`;
    let text = labelOf(chart);
    const name = (chart._fullData[curve].name ?? "").replace(/<[^>]*>/g, " ");
    if (name && !/^trace \d+$/.test(name) && !text.includes(name.split(" (")[0])) text = `${name}: ${text}`;
    const many = series.length > 1 ? `, series ${place.series + 1} of ${series.length}` : "";
    spoken.textContent = `${text}. Point ${place.point + 1} of ${points.length}${many}.`;
  }

  function step(series, place, key) {
    const last = series[place.series].points.length - 1;
    if (key === "ArrowRight") place.point = Math.min(place.point + 1, last);
    else if (key === "ArrowLeft") place.point = Math.max(place.point - 1, 0);
    else if (key === "Home") place.point = 0;
    else if (key === "End") place.point = last;
    else {
      const by = key === "ArrowDown" ? 1 : series.length - 1;
      place.series = (place.series + by) % series.length;
      place.point = Math.min(place.point, series[place.series].points.length - 1);
    }
  }

  const KEYS = ["ArrowRight", "ArrowLeft", "ArrowDown", "ArrowUp", "Home", "End"];
  for (const walk of document.querySelectorAll(".walk")) {
    const chart = walk.querySelector(".chart");
    walk.addEventListener("keydown", (event) => {
      if (event.ctrlKey || event.altKey || event.metaKey) return;
      if (event.key === "Escape" && places.has(chart)) {
        clear(chart);
        spoken.textContent = "";
        return;
      }
      if (!KEYS.includes(event.key)) return;
      const series = seriesOf(chart);
      if (!series.length) return;
      event.preventDefault();
      let place = places.get(chart);
      if (place === undefined || place.series >= series.length) {
        // The first key shows where the walk begins.
        place = { series: 0, point: event.key === "End" ? series[0].points.length - 1 : 0 };
        places.set(chart, place);
      } else {
        step(series, place, event.key);
      }
      show(chart, series, place);
    });
    walk.addEventListener("focusout", () => {
      if (places.has(chart)) clear(chart);
    });
  }
})();
