"""What a notebook shows of a run, a study or a result: a heading, a plot where there is something to plot, and a table."""

from __future__ import annotations

import dataclasses
import html
import math
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

from diastole import results
from diastole.record import Record

if TYPE_CHECKING:
    from diastole.run import Run
    from diastole.study import Study

COLOURS = ("#1c6fb0", "#cf5f1c", "#2a8c63", "#7a5fa8")
MOST_POINTS = 1200


def number(value: Any) -> str:
    return "" if value is None else f"{value:.4g}" if isinstance(value, float) else str(value)


def table(header: Sequence[str], rows: Iterable[Sequence[Any]]) -> str:
    def row(cells: Sequence[Any], tag: str) -> str:
        return "<tr>" + "".join(f"<{tag}>{html.escape(number(cell))}</{tag}>" for cell in cells) + "</tr>"

    return f"<table>{row(header, 'th')}{''.join(row(each, 'td') for each in rows)}</table>"


def plot(curves: Sequence[tuple[str, Sequence[float], Sequence[float]]], x_label: str, y_label: str) -> str:
    """Lines of (name, x, y) as SVG; NaN breaks a line."""
    xs = [value for _, x, _ in curves for value in x if math.isfinite(value)]
    ys = [value for _, _, y in curves for value in y if math.isfinite(value)]
    if not xs or not ys:
        return ""
    width, height, left, bottom, margin = 640.0, 260.0, 58.0, 40.0, 10.0
    x0, x1, y0, y1 = min(xs), max(xs), min(ys), max(ys)
    x_span, y_span = (x1 - x0) or 1.0, (y1 - y0) or 1.0
    parts: list[str] = []
    for i, (name, x, y) in enumerate(curves):
        path, pen = "", "M"
        for a, b in zip(x, y):
            if not (math.isfinite(a) and math.isfinite(b)):
                pen = "M"
                continue
            at = left + (width - left - margin) * (a - x0) / x_span
            up = height - bottom - (height - bottom - 2 * margin) * (b - y0) / y_span
            path += f"{pen}{at:.1f} {up:.1f}"
            pen = "L"
        colour = COLOURS[i % len(COLOURS)]
        parts.append(f'<path d="{path}" fill="none" stroke="{colour}" stroke-width="1.4"/>')
        parts.append(f'<text x="{left + 8 + 150 * i:.0f}" y="12" fill="{colour}">{html.escape(name)}</text>')
    frame = f'<path d="M{left} {margin}V{height - bottom}H{width - margin}" fill="none" stroke="#5c6b7a"/>'
    for text, at, up, anchor in ((f"{x0:.4g}", left, height - 24, "start"), (f"{x1:.4g}", width - margin, height - 24, "end"),
                                 (f"{y0:.4g}", left - 4, height - bottom, "end"), (f"{y1:.4g}", left - 4, 24, "end"),
                                 (x_label, (left + width) / 2, height - 8, "middle"), (y_label, 4, height / 2, "start")):
        frame += f'<text x="{at:.0f}" y="{up:.0f}" text-anchor="{anchor}" fill="#5c6b7a">{html.escape(text)}</text>'
    return f'<svg viewBox="0 0 {width:.0f} {height:.0f}" width="{width:.0f}" font-size="11" font-family="sans-serif">{"".join(parts)}{frame}</svg>'


def of_run(run: Run) -> str:
    time_s, cavity_kPa, volume_mL = run.time_s, run.cavity_kPa, run.volume_mL()
    every = max(1, len(time_s) // MOST_POINTS)
    facts = {**run.session, **{f"note by {note.author}": note.text for note in run.notes}}
    shown = plot([("cavity_kPa", time_s[::every].tolist(), cavity_kPa[::every].tolist())], "time_s", "kPa")
    shown += plot([("commanded_mL", time_s[::every].tolist(), volume_mL[::every].tolist())], "time_s", "mL")
    head = f"<b>{html.escape(run.path.name)}</b> of {run.started_utc}, {len(run.trigger_s)} triggers"
    return head + shown + (table(list(facts), [list(facts.values())]) if facts else "")


def of_study(study: Study) -> str:
    rows = [(name, spec.get("start"), spec.get("bounds")) for name, spec in study.table.get("law", {}).get("parameters", {}).items()]
    specimen, law = study.table.get("specimen", {}).get("kind"), study.table.get("law", {}).get("name")
    return f"<b>{html.escape(study.path.name)}</b>: {specimen}, {law}" + table(("parameter", "start", "bounds"), rows)


def of_fit(fit: results.Fit) -> str:
    rows = [(name, p.value, p.se, p.ci95[0], p.ci95[1]) for name, p in fit.parameters.items()]
    edges, counts = fit.residuals.edges, fit.residuals.counts
    steps_x = [x for edge in edges for x in (edge, edge)]
    steps_y = [0.0] + [float(c) for count in counts for c in (count, count)] + [0.0]
    head = f"<b>{html.escape(fit.law)}</b>: rms {fit.rms_mm:.3g} mm, {fit.reason}"
    return head + table(("parameter", "value", "se", "95 % from", "to"), rows) + plot([("residuals", steps_x, steps_y)], "in sigmas", "points")


def of_explanation(found: results.Explanation) -> str:
    head = f"<b>{found.verdict}</b>: {html.escape(found.summary or '')}"
    rows = [(effect.id, name, p.value, p.ci90[0], p.ci90[1]) for effect in found.effects for name, p in effect.parameters.items()]
    shown = table(("effect", "parameter", "value", "90 % from", "to"), rows) if rows else ""
    for trace in found.traces[:1]:
        every = max(1, len(trace.time_s) // MOST_POINTS)
        curves = [(name, trace.time_s[::every], values[::every]) for name, values in
                  (("measured", trace.measured), ("before", trace.before), ("after", trace.after))]
        shown += plot([(n, x, [math.nan if v is None else v for v in y]) for n, x, y in curves], "time_s", trace.channel)
    return f"{head}<br>gap {number(found.gap.before)} before, {number(found.gap.after)} after, floor {number(found.gap.floor)}{shown}"


def of_comparison(found: results.Comparison) -> str:
    shown = f"<b>traces {'not tested' if not found.is_tested else 'differ' if found.beyond_noise else 'may agree or differ' if found.undecided else 'agree'}</b>"
    shown += table(("", "", *found.runs), [(d.group, d.place, *d.values) for d in found.differences])
    for overlay in found.overlays:
        shown += plot([(found.runs[c.run], overlay.phase, [math.nan if v is None else v for v in c.mean_kPa]) for c in overlay.cycles],
                      "phase", overlay.channel)
    return shown


def of(record: Any) -> str:
    """Records without a picture of their own are a table of their plain members."""
    own: dict[type, Any] = {results.Fit: of_fit, results.Explanation: of_explanation, results.Comparison: of_comparison}
    if type(record) in own:
        return str(own[type(record)](record))
    plain = [(f.name, getattr(record, f.name)) for f in dataclasses.fields(record)]
    return f"<b>{type(record).__name__}</b>" + table(("", ""), [(n, v) for n, v in plain if not isinstance(v, (list, dict, Record))])
