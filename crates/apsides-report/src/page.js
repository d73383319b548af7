// Values below the cursor, in all figures with the same horizontal axis at once. Drawing a frame zooms into it, along the horizontal axis
// in those figures together; a double click shows all again, a click a figure in the width of the page.
(() => {
  const space = "http://www.w3.org/2000/svg";
  const shown = v => Number(v.toPrecision(5)).toString().replace("-", "\u2212");
  const axis = (text) => {
    const [low, high, kind] = text.split(" ");
    return { low: +low, high: +high, value: v => kind === "log" ? 10 ** v : v };
  };
  const added = (parent, name, attributes) => {
    const element = parent.appendChild(document.createElementNS(space, name));
    for (const key in attributes) element.setAttribute(key, attributes[key]);
    return element;
  };
  // The data stand in a window of their own, which is moved over them; lines and dots keep their size.
  const windowed = (svg, [left, right, bottom, top]) => {
    const group = svg.querySelector(".plot");
    for (const dot of [...group.querySelectorAll("circle")]) {
      const [x, y, r] = ["cx", "cy", "r"].map(name => +dot.getAttribute(name));
      const line = added(group, "path", { d: `M${x} ${y}h0`, stroke: dot.getAttribute("fill"), "stroke-width": 2 * r });
      dot.replaceWith(line);
    }
    // Widths that do not scale are those on the screen.
    const scale = svg.getBoundingClientRect().width / svg.viewBox.baseVal.width;
    for (const element of group.children) {
      element.setAttribute("vector-effect", "non-scaling-stroke");
      element.setAttribute("stroke-width", scale * element.getAttribute("stroke-width"));
    }
    const size = { x: left, y: top, width: right - left, height: bottom - top };
    const view = added(svg, "svg", { ...size, preserveAspectRatio: "none" });
    svg.insertBefore(view, group);
    view.append(group);
    return view;
  };
  const plots = [...document.querySelectorAll("svg[data-frame]")].map(svg => {
    const frame = svg.dataset.frame.split(" ").map(Number);
    const [left, right, bottom, top] = frame;
    const line = added(svg, "path", { class: "cursor" });
    const box = added(svg, "path", { class: "cursor" });
    const text = added(svg, "text", { class: "values", x: right, y: 160, "text-anchor": "end" });
    const labels = ["x", "y"].map(name => svg.querySelector(`g.${name}`));
    const x = axis(svg.dataset.x), y = axis(svg.dataset.y);
    // The parts of both axes that are seen, from 0 to 1.
    return { svg, left, right, bottom, top, x, y, line, box, text, labels, title: svg.dataset.xTitle, view: null, seen: [[0, 1], [0, 1]] };
  });
  const value = (axis, part) => axis.low + part * (axis.high - axis.low);
  const part = (axis, value) => (value - axis.low) / (axis.high - axis.low);
  const steps = (low, high) => {
    const rough = (high - low) / 6, power = 10 ** Math.floor(Math.log10(rough));
    const step = [1, 2, 2.5, 5, 10].map(s => s * power).find(s => s >= rough) || 10 * power;
    const found = [];
    for (let k = Math.ceil(low / step - 1e-9); k <= high / step + 1e-9; k++) found.push(k * step);
    return found;
  };
  const zoom = (plot, seen) => {
    const { svg, left, right, bottom, top } = plot;
    plot.view = plot.view || windowed(svg, [left, right, bottom, top]);
    plot.seen = seen;
    const [[a, b], [c, d]] = seen, wide = right - left, tall = bottom - top;
    plot.view.setAttribute("viewBox", `${left + a * wide} ${bottom - d * tall} ${(b - a) * wide} ${(d - c) * tall}`);
    [plot.x, plot.y].forEach((axis, k) => {
      const [low, high] = seen[k];
      const isWhole = low === 0 && high === 1;
      plot.labels[k].style.display = isWhole ? "" : "none";
      svg.querySelectorAll(`.zoomed-${k}`).forEach(element => element.remove());
      if (isWhole) return;
      const ends = [value(axis, low), value(axis, high)];
      for (const tick of steps(...ends)) {
        const at = (tick - ends[0]) / (ends[1] - ends[0]);
        const place = k === 0
          ? { x: left + at * wide, y: bottom + 60, dy: "0.76em", "text-anchor": "middle" }
          : { x: left - 60, y: bottom - at * tall, dy: "0.5ex", "text-anchor": "end" };
        const text = added(svg, "text", { ...place, class: `zoomed-${k}`, fill: "currentColor" });
        text.textContent = shown(axis.value(tick));
      }
    });
  };
  const alike = plot => plots.filter(other => other === plot || (other.title === plot.title && plot.title.startsWith("time")));
  // A height on the page has so many steps: digits beyond them are none of the data.
  const read = (axis, part) => {
    if (axis.value(0) === 1) return axis.value(value(axis, part));
    const step = 10 ** Math.floor(Math.log10((axis.high - axis.low) / 2000));
    return Math.round(value(axis, part) / step) * step;
  };
  // Heights of a curve where it passes a place: one for a curve over time, several where it comes back.
  const heights = (curve, at) => {
    const found = [];
    for (let k = 1; k < curve.numberOfItems; k++) {
      const a = curve.getItem(k - 1), b = curve.getItem(k);
      if ((a.x - at) * (b.x - at) <= 0 && a.x !== b.x) found.push(a.y + (b.y - a.y) * (at - a.x) / (b.x - a.x));
    }
    return found.length > 3 ? [] : found;
  };
  const show = (plot, whole) => {
    const [low, high] = plot.seen[0];
    if (!(whole >= low && whole <= high)) return hide(plot);
    const on = plot.left + (whole - low) / (high - low) * (plot.right - plot.left);
    const at = plot.left + whole * (plot.right - plot.left);
    plot.line.setAttribute("d", `M${on} ${plot.bottom}V${plot.top}`);
    const words = [];
    for (const curve of plot.svg.querySelectorAll("[data-series]")) {
      const values = heights(curve.points, at).map(height => {
        const up = (plot.bottom - height) / (plot.bottom - plot.top);
        return shown(read(plot.y, up));
      });
      if (values.length) words.push([curve.dataset.series, [...new Set(values)].join(" and ")].join(" ").trim());
    }
    plot.text.textContent = `${shown(plot.x.value(value(plot.x, whole)))}: ${[...new Set(words)].join("; ")}`;
  };
  const hide = plot => {
    plot.line.removeAttribute("d");
    plot.text.textContent = "";
  };
  // The place of an event on both axes, from 0 to 1 of what the figure has.
  const placed = (plot, event) => {
    const point = new DOMPoint(event.clientX, event.clientY).matrixTransform(plot.svg.getScreenCTM().inverse());
    const on = [(point.x - plot.left) / (plot.right - plot.left), (plot.bottom - point.y) / (plot.bottom - plot.top)];
    return on.map((p, k) => plot.seen[k][0] + p * (plot.seen[k][1] - plot.seen[k][0]));
  };
  // From this part of the frame on a drag is meant.
  const meant = 0.02, both = 0.15;
  for (const plot of plots) {
    let from = null, dragged = false;
    const drag = event => {
      const to = placed(plot, event), ranges = [];
      for (const k of [0, 1]) {
        const [low, high] = plot.seen[k], inside = p => Math.min(Math.max(p, low), high);
        ranges.push([Math.min(inside(from[k]), inside(to[k])), Math.max(inside(from[k]), inside(to[k]))]);
        ranges[k].part = (ranges[k][1] - ranges[k][0]) / (high - low);
      }
      return ranges;
    };
    plot.svg.addEventListener("pointerdown", event => {
      const at = placed(plot, event);
      const isInside = at.every((p, k) => p >= plot.seen[k][0] && p <= plot.seen[k][1]);
      from = isInside && event.button === 0 && event.pointerType === "mouse" ? at : null;
      dragged = false;
    });
    plot.svg.addEventListener("pointermove", event => {
      if (from) {
        const [x, y] = drag(event), isBoth = y.part > both, seen = plot.seen;
        dragged = dragged || x.part > meant;
        const on = (range, k, low, high) => range.map(p => low + (p - seen[k][0]) / (seen[k][1] - seen[k][0]) * (high - low));
        const [a, b] = on(x, 0, plot.left, plot.right);
        const [c, d] = isBoth ? on(y, 1, plot.bottom, plot.top) : [plot.bottom, plot.top];
        if (dragged) plot.box.setAttribute("d", `M${a} ${c}H${b}V${d}H${a}Z`);
      }
      const whole = placed(plot, event)[0];
      for (const other of plots) {
        if (other === plot) show(other, whole);
        else if (other.title === plot.title) show(other, part(other.x, value(plot.x, whole)));
      }
    });
    const done = event => {
      plot.box.removeAttribute("d");
      if (from && dragged) {
        const [x, y] = drag(event), isBoth = y.part > both;
        const ends = x.map(p => value(plot.x, p));
        for (const other of x.part > meant ? alike(plot) : []) {
          const along = ends.map(v => Math.min(Math.max(part(other.x, v), 0), 1));
          if (along[1] > along[0]) zoom(other, [along, other === plot && isBoth ? [...y] : other.seen[1]]);
        }
      }
      from = null;
    };
    plot.svg.addEventListener("pointerup", done);
    plot.svg.addEventListener("pointerleave", event => {
      done(event);
      plots.forEach(hide);
    });
    plot.svg.addEventListener("dblclick", () => {
      // Its first click has changed the size.
      plot.svg.closest("figure").classList.toggle("large");
      alike(plot).filter(p => p.view).forEach(p => zoom(p, [[0, 1], [0, 1]]));
    });
    plot.svg.addEventListener("click", event => {
      if (!dragged && event.detail === 1) plot.svg.closest("figure").classList.toggle("large");
    });
  }
})();
