"use strict";
(() => {
  const data = JSON.parse(document.getElementById("viewer-data").textContent);
  const root = document.getElementById("viewer");
  const canvas = root.querySelector("canvas");
  const context = canvas.getContext("2d");
  const readout = root.querySelector(".readout");
  const select = { left: root.querySelector(".left"), right: root.querySelector(".right") };
  const mode = root.querySelector(".mode");
  const world = bounds(data.entries);
  const aspect = (world.x1 - world.x0) / (world.y1 - world.y0);
  // centre in metres of the image plane; zoom 1 shows the whole picture; split is a share of the width
  const view = { x: (world.x0 + world.x1) / 2, y: (world.y0 + world.y1) / 2, zoom: 1, split: 0.5 };
  let drag = null;
  const touches = new Map();

  function bounds(entries) {
    const xs = entries.flatMap((entry) => entry.x_m);
    const ys = entries.flatMap((entry) => entry.y_m);
    return { x0: Math.min(...xs), x1: Math.max(...xs), y0: Math.min(...ys), y1: Math.max(...ys) };
  }

  async function unpacked(text, itemsize) {
    const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
    const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
    const rows = new Uint8Array(await new Response(stream).arrayBuffer());
    if (itemsize === 1) return rows;
    const count = rows.length / itemsize;
    const out = new Uint32Array(count);
    for (let byte = 0; byte < itemsize; byte++) {
      for (let i = 0; i < count; i++) out[i] += rows[byte * count + i] * 2 ** (8 * byte);
    }
    return out;
  }

  async function load(entry) {
    entry.picture = document.getElementById(entry.image);
    await entry.picture.decode();
    if (!data.told) return;
    const upper = await unpacked(entry.luminance, 2);
    entry.cd_m2 = new Float32Array(Uint32Array.from(upper, (bits) => bits << 16).buffer);
    if (entry.instance) entry.instances = await unpacked(entry.instance, 4);
    if (entry.snr) entry.snrs = await unpacked(entry.snr, 1);
    if (!entry.raw) return;
    entry.raws = await Promise.all(entry.raw.map((plane) => unpacked(plane, 4)));
    if (entry.raw_is_float) entry.raws = entry.raws.map((bits) => new Float32Array(bits.buffer));
    entry.saturations = await Promise.all(entry.saturated.map((plane) => unpacked(plane, 1)));
    entry.mosaic = await unpacked(entry.filter, 1);
  }

  function falseColours(entry) {
    if (entry.coloured) return entry.coloured;
    const { low, high, ramp } = data.false_colours;
    const image = new ImageData(entry.width, entry.height);
    const steps = ramp.length / 3 - 1;
    for (let i = 0; i < entry.cd_m2.length; i++) {
      const share = Math.log(Math.max(entry.cd_m2[i], low) / low) / Math.log(high / low);
      const step = 3 * Math.round(steps * Math.min(share, 1));
      image.data.set([ramp[step], ramp[step + 1], ramp[step + 2], 255], 4 * i);
    }
    entry.coloured = document.createElement("canvas");
    entry.coloured.width = entry.width;
    entry.coloured.height = entry.height;
    entry.coloured.getContext("2d").putImageData(image, 0, 0);
    return entry.coloured;
  }

  function chosen(side) {
    return data.entries[Number(select[side].value)];
  }

  function scale() {
    return (canvas.width / (world.x1 - world.x0)) * view.zoom;
  }

  function keepInside() {
    const half = { x: (world.x1 - world.x0) / 2 / view.zoom, y: (world.y1 - world.y0) / 2 / view.zoom };
    view.x = Math.min(Math.max(view.x, world.x0 + half.x), world.x1 - half.x);
    view.y = Math.min(Math.max(view.y, world.y0 + half.y), world.y1 - half.y);
  }

  function drawSide(entry, from, to) {
    const pixels = scale();
    const left = (entry.x_m[0] - view.x) * pixels + canvas.width / 2;
    const top = (entry.y_m[0] - view.y) * pixels + canvas.height / 2;
    const width = (entry.x_m[1] - entry.x_m[0]) * pixels;
    const height = (entry.y_m[1] - entry.y_m[0]) * pixels;
    const source = mode && mode.value === "luminance" ? falseColours(entry) : entry.picture;
    context.save();
    context.beginPath();
    context.rect(from, 0, to - from, canvas.height);
    context.clip();
    context.imageSmoothingEnabled = width < entry.width;
    context.drawImage(source, left, top, width, height);
    context.restore();
  }

  function draw() {
    const ratio = window.devicePixelRatio || 1;
    canvas.width = Math.round(canvas.clientWidth * ratio);
    canvas.height = Math.round((canvas.clientWidth * ratio) / aspect);
    canvas.style.height = `${canvas.height / ratio}px`;
    keepInside();
    const divider = Math.round(view.split * canvas.width);
    drawSide(chosen("left"), 0, divider);
    drawSide(chosen("right"), divider, canvas.width);
    context.fillStyle = "#fff";
    context.fillRect(divider - ratio, 0, 2 * ratio, canvas.height);
    context.beginPath();
    context.arc(divider, canvas.height / 2, 9 * ratio, 0, 2 * Math.PI);
    context.fill();
  }

  function metres(event) {
    const box = canvas.getBoundingClientRect();
    const ratio = canvas.width / box.width;
    return {
      x: view.x + ((event.clientX - box.left) * ratio - canvas.width / 2) / scale(),
      y: view.y + ((event.clientY - box.top) * ratio - canvas.height / 2) / scale(),
      share: (event.clientX - box.left) / box.width,
    };
  }

  function digits(value) {
    if (!Number.isFinite(value)) return "\u2013";
    return Math.abs(value) >= 1e4 ? value.toExponential(1) : String(Number(value.toPrecision(2)));
  }

  function described(entry, at) {
    const column = Math.floor(((at.x - entry.x_m[0]) / (entry.x_m[1] - entry.x_m[0])) * entry.width);
    const row = Math.floor(((at.y - entry.y_m[0]) / (entry.y_m[1] - entry.y_m[0])) * entry.height);
    if (column < 0 || row < 0 || column >= entry.width || row >= entry.height) return ["outside"];
    const i = row * entry.width + column;
    const parts = [`column ${column}, row ${row}`];
    if (!data.told) return parts;
    parts.push(`${digits(entry.cd_m2[i])} cd/m\u00b2`);
    if (entry.snrs) {
      const step = entry.snrs[i];
      const snr = step ? `${(data.lowest_db + step * data.step_db).toFixed(1)} dB` : "unknown";
      parts.push(`${entry.snr_name} ${snr}`);
    }
    if (entry.raws) {
      const values = entry.raws.map((plane, k) => {
        const name = entry.captures.length > 1 ? `${entry.captures[k]} ` : "";
        const value = Number(plane[i].toPrecision(8)); // whole DN have 8 digits at most
        return `${name}${value}${entry.saturations[k][i] ? " saturated" : ""}`;
      });
      parts.push(`DN ${values.join(", ")}`, `filter ${entry.filters[entry.mosaic[i]] ?? "none"}`);
    }
    if (entry.instances) parts.push(entry.names[entry.instances[i]] ?? "no object");
    return parts;
  }

  function tell(event) {
    const at = metres(event);
    readout.replaceChildren(
      ...["left", "right"].map((side) => {
        const line = document.createElement("div");
        const name = document.createElement("b");
        name.textContent = `${chosen(side).title}: `;
        line.append(name, described(chosen(side), at).join("; "));
        return line;
      }),
    );
  }

  function zoomBy(factor, at) {
    const centre = at || view;
    const zoom = Math.min(Math.max(view.zoom * factor, 1), 256);
    view.x = centre.x + (view.x - centre.x) * (view.zoom / zoom);
    view.y = centre.y + (view.y - centre.y) * (view.zoom / zoom);
    view.zoom = zoom;
    draw();
  }

  function gap() {
    const [a, b] = [...touches.values()];
    return Math.hypot(a.clientX - b.clientX, a.clientY - b.clientY);
  }

  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    touches.set(event.pointerId, event);
    const at = metres(event);
    const near = Math.abs(at.share - view.split) * canvas.clientWidth < 16;
    drag = touches.size > 1 ? { gap: gap() } : { split: near || view.zoom === 1, at };
    tell(event);
  });
  canvas.addEventListener("pointermove", (event) => {
    if (touches.has(event.pointerId)) touches.set(event.pointerId, event);
    tell(event);
    if (!drag) return;
    if (touches.size > 1) {
      zoomBy(gap() / drag.gap, metres(event));
      drag.gap = gap();
      return;
    }
    const at = metres(event);
    if (drag.split) {
      view.split = Math.min(Math.max(at.share, 0), 1);
    } else if (drag.at) {
      view.x += drag.at.x - at.x;
      view.y += drag.at.y - at.y;
    }
    draw();
  });
  for (const name of ["pointerup", "pointercancel"]) {
    canvas.addEventListener(name, (event) => {
      touches.delete(event.pointerId);
      drag = null;
    });
  }
  canvas.addEventListener(
    "wheel",
    (event) => {
      // the wheel scrolls the page unless the picture has the focus or Ctrl is pressed
      if (document.activeElement !== canvas && !event.ctrlKey) return;
      event.preventDefault();
      zoomBy(Math.exp(-event.deltaY / 400), metres(event));
    },
    { passive: false },
  );
  canvas.addEventListener("keydown", (event) => {
    const step = (world.x1 - world.x0) / view.zoom / 10;
    const moves = { ArrowLeft: [-step, 0], ArrowRight: [step, 0], ArrowUp: [0, -step], ArrowDown: [0, step] };
    if (event.key === "+" || event.key === "=") zoomBy(1.5);
    else if (event.key === "-") zoomBy(1 / 1.5);
    else if (moves[event.key]) {
      view.x += moves[event.key][0];
      view.y += moves[event.key][1];
      draw();
    } else return;
    event.preventDefault();
  });
  root.querySelector(".closer").addEventListener("click", () => zoomBy(2));
  root.querySelector(".farther").addEventListener("click", () => zoomBy(0.5));
  root.querySelector(".whole").addEventListener("click", () => zoomBy(0));
  root.querySelector(".pixels").addEventListener("click", () => {
    const entry = chosen("right");
    const wanted = entry.width / (entry.x_m[1] - entry.x_m[0]);
    zoomBy((wanted * (window.devicePixelRatio || 1)) / scale());
  });
  for (const control of [select.left, select.right, mode]) {
    if (control) control.addEventListener("change", draw);
  }
  window.addEventListener("resize", draw);

  (async () => {
    if (data.false_colours) data.false_colours.ramp = await unpacked(data.false_colours.colours, 1);
    await Promise.all(data.entries.map(load));
    root.hidden = false;
    draw();
  })();
})();
