// A player of one slice's images, phase by phase: what is drawn over them are its overlays, in their order.
class CinePlayer {
  constructor(holder, slice) {
    this.holder = holder;
    this.slice = slice;
    this.canvas = holder.querySelector("canvas");
    this.range = holder.querySelector(".cine-phase");
    this.button = holder.querySelector(".cine-play");
    this.scale = Math.max(2, Math.round(640 / slice.columns));
    this.canvas.width = this.scale * slice.columns;
    this.canvas.height = Math.round(this.scale * slice.rows * slice.pixel_mm[1] / slice.pixel_mm[0]);
    this.overlays = [];
    this.range.addEventListener("input", () => this.draw());
    this.button.addEventListener("click", () => this.play(this.timer === undefined));
  }
  get phase() { return Number(this.range.value); }
  get image() { return this.slice.images[this.phase]; }
  // Canvas coordinates of a place in pixels of the image, and back.
  xy(column, row) { return [(column + 0.5) * this.canvas.width / this.slice.columns, (row + 0.5) * this.canvas.height / this.slice.rows]; }
  place(event) {
    const box = this.canvas.getBoundingClientRect();
    return { column: (event.clientX - box.left) / box.width * this.slice.columns - 0.5, row: (event.clientY - box.top) / box.height * this.slice.rows - 0.5 };
  }
  play(on) {
    clearInterval(this.timer);
    this.timer = on ? setInterval(() => { this.range.value = (this.phase + 1) % this.slice.images.length; this.draw(); }, 120) : undefined;
    this.button.textContent = on ? "\u25a0" : "\u25b6";
  }
  bitmap() {
    const { slice, image } = this;
    if (image.bitmap) return image.bitmap;
    const grey = Uint8Array.from(atob(image.picture), (c) => c.charCodeAt(0)), data = new ImageData(slice.columns, slice.rows);
    grey.forEach((value, i) => data.data.set([value, value, value, 255], 4 * i));
    image.bitmap = document.createElement("canvas");
    image.bitmap.width = slice.columns;
    image.bitmap.height = slice.rows;
    image.bitmap.getContext("2d").putImageData(data, 0, 0);
    return image.bitmap;
  }
  draw() {
    const context = this.canvas.getContext("2d"), image = this.image;
    context.imageSmoothingEnabled = false;
    context.clearRect(0, 0, this.canvas.width, this.canvas.height);
    context.drawImage(this.bitmap(), 0, 0, this.canvas.width, this.canvas.height);
    for (const overlay of this.overlays) overlay(context);
    this.holder.querySelector(".cine-time").textContent = `phase ${image.frame}, ${image.trigger_ms.toFixed(0)} ms`;
  }
  path(context, points) {
    context.beginPath();
    for (let i = 0; i < points.length; i += 2) context.lineTo(...this.xy(points[i], points[i + 1]));
    context.closePath();
  }
}

// Cine players of tracked slices: images with their lines in the colour of the standard error, phase by phase.
const cineShown = { lines: true, rejected: true, outlines: true };
const cinePlayers = (tracking) => {
  // From blue to orange, all bright enough for a dark image.
  const stops = ["#2f9bff", "#25c5e8", "#3fe0b0", "#a4ee5b", "#ffe94a", "#ffc53d", "#ff9d2e", "#ff7a1f", "#ff7a1f"].map((c) =>
    [1, 3, 5].map((i) => parseInt(c.slice(i, i + 2), 16)));
  const colour = (share) => {
    const at = Math.min(Math.max(share, 0), 1) * 7, low = Math.floor(at), part = at - low;
    return `rgb(${stops[low].map((v, i) => Math.round(v + part * (stops[low + 1][i] - v))).join(",")})`;
  };
  const sigmas = tracking.slices.flatMap((s) => s.images.flatMap((image) => image.points.filter((_, i) => i % 5 === 4))).sort((a, b) => a - b);
  const most = sigmas.length ? Math.max(sigmas[Math.floor(0.98 * (sigmas.length - 1))], 1e-3) : 1;
  const shown = cineShown;
  const players = [];

  // Points of one tag in their order along it; a gap of more than a spacing and a half breaks the line.
  const lines = (slice, image) => {
    if (image.lines) return image.lines;
    const tags = new Map();
    for (let i = 0; i < image.points.length; i += 5) {
      const [direction, tag, column, row, sigma] = image.points.slice(i, i + 5);
      const key = `${direction}/${tag}`;
      if (!tags.has(key)) tags.set(key, { direction, tag, points: [] });
      tags.get(key).points.push({ column, row, sigma });
    }
    image.lines = [...tags.values()];
    for (const line of image.lines) {
      const angle = slice.directions[line.direction].angle_deg * Math.PI / 180;
      const along = (p) => -Math.sin(angle) * p.column * slice.pixel_mm[0] + Math.cos(angle) * p.row * slice.pixel_mm[1];
      line.points.sort((a, b) => along(a) - along(b));
      line.breaks = line.points.map((p, i) => i === 0 || Math.abs(along(p) - along(line.points[i - 1])) > 1.5 * slice.directions[line.direction].spacing_mm);
    }
    return image.lines;
  };

  class TaggedPlayer extends CinePlayer {
    constructor(holder) {
      super(holder, tracking.slices[Number(holder.dataset.slice)]);
      this.overlays.push((context) => this.drawTags(context));
      this.canvas.addEventListener("pointermove", (event) => this.showNearest(event));
      this.chart();
      this.draw();
    }
    drawTags(context) {
      if (shown.outlines) this.drawOutlines(context, this.image);
      if (shown.lines) this.drawLines(context, this.image);
      if (shown.rejected) this.drawRejected(context, this.image);
      this.holder.querySelector(".cine-mark").setAttribute("x", this.chartX(this.phase) - 2);
    }
    drawOutlines(context, image) {
      context.strokeStyle = "#ffffffb0";
      context.lineWidth = Math.max(1, 0.2 * this.scale);
      context.setLineDash([this.scale, this.scale]);
      for (const outline of image.outlines ?? []) {
        this.path(context, outline);
        context.stroke();
      }
      context.setLineDash([]);
    }
    drawLines(context, image) {
      context.lineWidth = Math.max(2, 0.5 * this.scale);
      for (const line of lines(this.slice, image)) {
        for (let i = 0; i < line.points.length; ++i) {
          const p = line.points[i];
          context.strokeStyle = context.fillStyle = colour(p.sigma / most);
          const [x, y] = this.xy(p.column, p.row);
          if (!line.breaks[i]) {
            context.beginPath();
            context.moveTo(...this.xy(line.points[i - 1].column, line.points[i - 1].row));
            context.lineTo(x, y);
            context.stroke();
          } else if (i + 1 === line.points.length || line.breaks[i + 1]) {
            context.fillRect(x - context.lineWidth, y - context.lineWidth, 2 * context.lineWidth, 2 * context.lineWidth);
          }
        }
      }
    }
    drawRejected(context, image) {
      context.strokeStyle = "#ff5a4d";
      context.lineWidth = Math.max(1.2, 0.3 * this.scale);
      const arm = 0.9 * this.scale;
      context.beginPath();
      for (let i = 0; i < image.rejected.length; i += 4) {
        const [x, y] = this.xy(image.rejected[i + 2], image.rejected[i + 3]);
        context.moveTo(x - arm, y - arm);
        context.lineTo(x + arm, y + arm);
        context.moveTo(x + arm, y - arm);
        context.lineTo(x - arm, y + arm);
      }
      context.stroke();
    }
    showNearest(event) {
      const at = this.place(event), image = this.image;
      let nearest, least = 3;
      const consider = (column, row, words) => {
        const apart = Math.hypot(column - at.column, row - at.row);
        if (apart < least) [least, nearest] = [apart, words];
      };
      for (let i = 0; i < image.points.length; i += 5) consider(image.points[i + 2], image.points[i + 3], `tag ${image.points[i + 1]}: \u00b1 ${image.points[i + 4].toFixed(3)} px`);
      for (let i = 0; i < image.rejected.length; i += 4) consider(image.rejected[i + 2], image.rejected[i + 3], tracking.dropped[image.rejected[i + 1]].reason);
      this.holder.querySelector(".cine-at").textContent = nearest ?? "";
    }
    chartX(phase) { return 6 + 308 * (phase + 0.5) / this.slice.images.length; }
    chart() {
      const images = this.slice.images, highest = Math.max(...images.map((image) => image.residual)), wide = 308 / images.length;
      const bars = images.map((image, k) => {
        const height = 34 * image.residual / highest;
        return `<rect class="bars a" x="${this.chartX(k) - 0.4 * wide}" y="${38 - height}" width="${0.8 * wide}" height="${height}"><title>phase ${image.frame}: residual ${image.residual.toFixed(1)} %, ${image.points.length / 5} points</title></rect>`;
      }).join("");
      this.holder.querySelector(".cine-residual").innerHTML = `<svg viewBox="0 0 320 44" preserveAspectRatio="none" role="img" aria-label="residuals"><rect class="cine-mark" x="${this.chartX(0) - 2}" y="40" width="4" height="3" fill="#cf5f1c"/>${bars}</svg><small>Residual of each phase, up to ${highest.toFixed(1)} % of white</small>`;
    }
  }

  for (const holder of document.querySelectorAll(".cine")) players.push(new TaggedPlayer(holder));
  for (const name of ["lines", "rejected", "outlines"]) {
    const box = document.getElementById(`cine-${name}`);
    box.checked = shown[name];
    box.addEventListener("change", (event) => {
      shown[name] = event.target.checked;
      players.forEach((player) => player.draw());
    });
  }
  const legend = document.querySelector(".cine-legend canvas").getContext("2d");
  for (let i = 0; i < 160; ++i) {
    legend.fillStyle = colour(i / 159);
    legend.fillRect(i, 0, 1, 10);
  }
  document.querySelector(".cine-most").textContent = `${most.toPrecision(2)} px`;
  return { players, lines };
};
