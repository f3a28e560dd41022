// Replaces each time chart's picture by a zoomable trace: drag to zoom, double-click to see everything again.
for (const holder of document.querySelectorAll("[data-chart]")) {
  const chart = charts[Number(holder.dataset.chart)];
  const style = getComputedStyle(document.documentElement);
  const colour = (name) => style.getPropertyValue("--" + name).trim();
  const grid = { stroke: colour("rule"), width: 1 };
  const text = { stroke: colour("soft"), grid, ticks: grid, font: "12px " + getComputedStyle(document.body).fontFamily };
  const drawMarks = (plot) => {
    const context = plot.ctx;
    context.save();
    context.strokeStyle = colour("muted");
    context.lineWidth = devicePixelRatio;
    context.setLineDash([2 * devicePixelRatio, 3 * devicePixelRatio]);
    context.beginPath();
    for (const mark of chart.marks) {
      if (mark < plot.scales.x.min || mark > plot.scales.x.max) continue;
      const x = Math.round(plot.valToPos(mark, "x", true));
      context.moveTo(x, plot.bbox.top);
      context.lineTo(x, plot.bbox.top + plot.bbox.height);
    }
    context.stroke();
    context.restore();
  };
  const width = () => Math.max(320, holder.clientWidth);
  const options = {
    width: width(), height: 300,
    scales: { x: { time: false } },
    axes: [{ ...text, label: "time (s)", labelFont: text.font }, { ...text, label: chart.label, labelFont: text.font, size: 62 }],
    series: [{ label: "time (s)" }].concat(chart.traces.map((trace) => ({
      label: trace.name, stroke: colour(trace.style), width: 1.4, spanGaps: false,
      value: (plot, value) => (value == null ? "–" : value.toFixed(3)),
    }))),
    hooks: { drawClear: [drawMarks] },
  };
  holder.replaceChildren();
  const plot = new uPlot(options, chart.data, holder);
  addEventListener("resize", () => plot.setSize({ width: width(), height: 300 }));
}
