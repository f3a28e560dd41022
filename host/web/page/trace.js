// The live trace: pressure as sampled and low-passed, a mark at each trigger.

const keptSeconds = 90;
const colour = (name) => getComputedStyle(document.body).getPropertyValue("--" + name).trim();

export class Trace {
  constructor(holder) {
    this.holder = holder;
    this.window_s = 15;
    this.forget("");
    addEventListener("resize", () => this.plot?.setSize(this.size()));
  }

  forget(runId) {
    this.runId = runId;
    this.rows = [[], [], []];  // time_s, kPa, filtered_kPa
    this.triggers = [];
    this.nextRow = this.nextTrigger = 0;
  }

  /// What to ask the daemon for next.
  get wanted() { return { run_id: this.runId, first_row: this.nextRow, first_trigger: this.nextTrigger }; }
  get length() { return this.rows[0].length; }
  get last_s() { return this.rows[0].at(-1) ?? 0; }
  get last_kPa() { return this.rows[2].at(-1) ?? this.rows[1].at(-1) ?? null; }

  /// The answer to run.trace; true if it brought something.
  add(answer) {
    if (answer.run_id !== this.runId) this.forget(answer.run_id);
    this.nextRow = answer.first_row + answer.time_s.length;
    this.nextTrigger = answer.first_trigger + answer.trigger_s.length;
    this.triggers.push(...answer.trigger_s);
    [answer.time_s, answer.kPa, answer.filtered_kPa].forEach((column, i) => this.rows[i].push(...column));
    const old = this.rows[0].findIndex((time) => time > this.last_s - keptSeconds);
    if (old > 3000) this.rows.forEach((column) => column.splice(0, old));
    while (this.triggers[0] < this.last_s - keptSeconds) this.triggers.shift();
    return answer.time_s.length > 0;
  }

  size() { return { width: this.holder.clientWidth, height: this.holder.clientHeight }; }

  show(window_s = this.window_s) {
    this.window_s = window_s;
    if (!this.length) return;
    this.plot ??= this.make();
    const max = Math.max(this.last_s, this.window_s);
    this.plot.batch(() => {
      this.plot.setData(this.rows, false);
      this.plot.setScale("x", { min: max - this.window_s, max });
    });
  }

  /// Anew in the colours of the present theme.
  repaint() {
    this.plot?.destroy();
    this.plot = null;
    this.show();
  }

  make() {
    const font = "500 13px " + getComputedStyle(document.body).fontFamily;
    const grid = { stroke: colour("rule"), width: 1 };
    const axis = { stroke: colour("soft"), grid, ticks: { show: false }, font, labelFont: font };
    const steps = (min, max, least) => {
      const span = Math.max(max - min, least), middle = (min + max) / 2;
      return [middle - 0.58 * span, middle + 0.58 * span];
    };
    return new uPlot({
      ...this.size(),
      cursor: { show: false }, legend: { show: false }, padding: [12, 14, 0, 0],
      scales: { x: { time: false }, y: { range: (_, min, max) => (min == null ? [0, 1] : steps(min, max, 0.5)) } },
      axes: [{ ...axis, size: 30, values: (_, all) => all.map((value) => value + " s"), space: 90 },
             { ...axis, size: 58, values: (_, all) => all.map((value) => value.toFixed(1)), space: 44 }],
      series: [{},
               { stroke: colour("raw"), width: 1, points: { show: false } },
               { stroke: colour("trace"), width: 2.5, points: { show: false } }],
      hooks: { drawClear: [(plot) => this.mark(plot)] },
    }, this.rows, this.holder);
  }

  mark(plot) {
    const { ctx, bbox, scales } = plot;
    const ratio = devicePixelRatio;
    ctx.save();
    ctx.strokeStyle = ctx.fillStyle = colour("mark");
    ctx.lineWidth = ratio;
    for (const time of this.triggers) {
      if (time < scales.x.min || time > scales.x.max) continue;
      const x = Math.round(plot.valToPos(time, "x", true));
      ctx.globalAlpha = 0.45;
      ctx.beginPath();
      ctx.moveTo(x, bbox.top);
      ctx.lineTo(x, bbox.top + bbox.height);
      ctx.stroke();
      ctx.globalAlpha = 1;
      ctx.beginPath();
      ctx.moveTo(x - 5 * ratio, bbox.top);
      ctx.lineTo(x + 5 * ratio, bbox.top);
      ctx.lineTo(x, bbox.top + 8 * ratio);
      ctx.fill();
    }
    ctx.restore();
  }
}
