// Values below the cursor, in all figures with the same horizontal axis at once; a click shows a figure in the width of the page.
(() => {
  const space = "http://www.w3.org/2000/svg";
  const shown = v => Number(v.toPrecision(5)).toString().replace("-", "\u2212");
  const axis = (text) => {
    const [low, high, kind] = text.split(" ");
    return { low: +low, high: +high, value: v => kind === "log" ? 10 ** v : v };
  };
  const plots = [...document.querySelectorAll("svg[data-frame]")].map(svg => {
    const [left, right, bottom, top] = svg.dataset.frame.split(" ").map(Number);
    const line = svg.appendChild(document.createElementNS(space, "path"));
    line.setAttribute("class", "cursor");
    const text = svg.appendChild(document.createElementNS(space, "text"));
    text.setAttribute("class", "values");
    text.setAttribute("x", right);
    text.setAttribute("y", bottom + 400);
    text.setAttribute("text-anchor", "end");
    const x = axis(svg.dataset.x), y = axis(svg.dataset.y);
    return { svg, left, right, bottom, top, x, y, line, text, title: svg.dataset.xTitle };
  });
  // Heights of a curve where it passes a place: one for a curve over time, several where it comes back.
  const heights = (curve, at) => {
    const found = [];
    for (let k = 1; k < curve.numberOfItems; k++) {
      const a = curve.getItem(k - 1), b = curve.getItem(k);
      if ((a.x - at) * (b.x - at) <= 0 && a.x !== b.x) found.push(a.y + (b.y - a.y) * (at - a.x) / (b.x - a.x));
    }
    return found.length > 3 ? [] : found;
  };
  const show = (plot, part) => {
    if (!(part >= 0 && part <= 1)) return hide(plot);
    const at = plot.left + part * (plot.right - plot.left);
    plot.line.setAttribute("d", `M${at} ${plot.bottom}V${plot.top}`);
    const words = [];
    for (const curve of plot.svg.querySelectorAll("[data-series]")) {
      const values = heights(curve.points, at).map(height => {
        const up = (plot.bottom - height) / (plot.bottom - plot.top);
        return shown(plot.y.value(plot.y.low + up * (plot.y.high - plot.y.low)));
      });
      if (values.length) words.push([curve.dataset.series, [...new Set(values)].join(" and ")].join(" ").trim());
    }
    const place = shown(plot.x.value(plot.x.low + part * (plot.x.high - plot.x.low)));
    plot.text.textContent = `${place}: ${[...new Set(words)].join("; ")}`;
  };
  const hide = plot => {
    plot.line.removeAttribute("d");
    plot.text.textContent = "";
  };
  for (const plot of plots) {
    plot.svg.addEventListener("pointermove", event => {
      const point = new DOMPoint(event.clientX, event.clientY).matrixTransform(plot.svg.getScreenCTM().inverse());
      const part = (point.x - plot.left) / (plot.right - plot.left);
      const value = plot.x.low + part * (plot.x.high - plot.x.low);
      for (const other of plots) {
        if (other === plot) show(other, part);
        else if (other.title === plot.title) show(other, (value - other.x.low) / (other.x.high - other.x.low));
      }
    });
    plot.svg.addEventListener("pointerleave", () => plots.forEach(hide));
    plot.svg.addEventListener("click", () => plot.svg.closest("figure").classList.toggle("large"));
  }
})();
