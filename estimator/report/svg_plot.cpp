#include "estimator/report/svg_plot.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <numeric>

#include "estimator/report/html_text.hpp"

namespace diastole::report {
namespace {

constexpr double left_margin = 62, right_margin = 14, top_margin = 12, bottom_margin = 46;
constexpr double legend_height = 24, legend_row = 18;
constexpr double letter_width = 6.4;  // mean advance of the legend's 12 px type

std::vector<double> copied(std::span<const double> values) { return {values.begin(), values.end()}; }

struct Interval {
  double low = std::numeric_limits<double>::infinity();
  double high = -std::numeric_limits<double>::infinity();

  void cover(std::span<const double> values, bool only_positive) {
    for (const double value : values) {
      if (!std::isfinite(value) || (only_positive && !(value > 0))) continue;
      low = std::min(low, value);
      high = std::max(high, value);
    }
  }
  /// Never empty and never of zero width.
  [[nodiscard]] Interval drawable() const {
    if (!(low <= high)) return {0, 1};
    if (low < high) return *this;
    const double slack = low == 0 ? 1 : std::abs(low) * 0.05;
    return {low - slack, high + slack};
  }
};

std::string tick_text(double value, double step) {
  const int decimals = std::clamp(-static_cast<int>(std::floor(std::log10(step) + 1e-9)), 0, 9);
  const double shown = std::abs(value) < step * 1e-6 ? 0.0 : value;
  return fmt::format("{}{:.{}f}", shown < 0 ? "\u2212" : "", std::abs(shown), decimals);
}

}  // namespace

SvgPlot residual_histogram(std::span<const double> edges, std::span<const double> counts) {
  SvgPlot plot({.x = {.label = "residual / its standard deviation"}, .y = {.label = "residuals"}});
  plot.bars(edges, counts, "a", "measured");
  std::vector<double> x, normal;
  if (edges.size() > 1) {
    const double all = std::accumulate(counts.begin(), counts.end(), 0.0) * (edges[1] - edges[0]);
    constexpr int samples = 121;
    for (int i = 0; i < samples; ++i) {
      x.push_back(edges.front() + (edges.back() - edges.front()) * i / (samples - 1));
      normal.push_back(all * std::exp(-x.back() * x.back() / 2) / std::sqrt(2 * M_PI));
    }
  }
  plot.line(x, normal, "b", "expected of the stated noise");
  return plot;
}

std::vector<double> ticks_over(double from, double to, int count) {
  const double raw = (to - from) / std::max(count, 1);
  const double power = std::pow(10.0, std::floor(std::log10(raw)));
  const double scaled = raw / power;
  const double step = power * (scaled < 1.5 ? 1 : scaled < 3.5 ? 2 : scaled < 7.5 ? 5 : 10);
  std::vector<double> ticks;
  const auto first = static_cast<long>(std::floor(from / step + 1e-9));
  const auto last = static_cast<long>(std::ceil(to / step - 1e-9));
  for (long k = first; k <= last; ++k)
    ticks.push_back(static_cast<double>(k) * step);
  return ticks;
}

std::vector<double> decades_over(double from, double to) {
  const int first = static_cast<int>(std::floor(std::log10(from) + 1e-9));
  const int last = std::max(first + 1, static_cast<int>(std::ceil(std::log10(to) - 1e-9)));
  std::vector<double> ticks;
  for (int k = first; k <= last; ++k) {
    for (const double part : {1.0, 2.0, 5.0}) {
      if (part == 1.0 || (last - first <= 3 && k < last)) ticks.push_back(part * std::pow(10.0, k));
    }
  }
  return ticks;
}

/// x0 ... y1 are the natural ends of the axes.
struct SvgPlot::Frame {
  double left, top, width, height;
  double x0, x1, y0, y1;
  std::vector<double> x_ticks, y_ticks;
  bool log_x, log_y;

  [[nodiscard]] static double part(double value, double from, double to, bool logarithmic) {
    return logarithmic ? std::log(value / from) / std::log(to / from) : (value - from) / (to - from);
  }
  [[nodiscard]] double px(double x) const { return left + width * part(x, x0, x1, log_x); }
  [[nodiscard]] double py(double y) const { return top + height * (1.0 - part(y, y0, y1, log_y)); }
};

void SvgPlot::line(std::span<const double> x, std::span<const double> y, std::string style,
                   std::string name) {
  series_.push_back({Kind::line, copied(x), copied(y), {}, std::move(style), std::move(name)});
}
void SvgPlot::points(std::span<const double> x, std::span<const double> y, std::string style,
                     std::string name) {
  series_.push_back({Kind::points, copied(x), copied(y), {}, std::move(style), std::move(name)});
}
void SvgPlot::error_bars(std::span<const double> x, std::span<const double> y, std::span<const double> error,
                         std::string style) {
  std::vector<double> low, high;
  for (size_t i = 0; i < x.size(); ++i) {
    low.push_back(y[i] - error[i]);
    high.push_back(y[i] + error[i]);
  }
  series_.push_back({Kind::error_bars, copied(x), std::move(low), std::move(high), std::move(style), {}});
}
void SvgPlot::band(std::span<const double> x, std::span<const double> low, std::span<const double> high,
                   std::string style, std::string name) {
  series_.push_back({Kind::band, copied(x), copied(low), copied(high), std::move(style), std::move(name)});
}
void SvgPlot::bars(std::span<const double> edges, std::span<const double> heights, std::string style,
                   std::string name) {
  series_.push_back({Kind::bars, copied(edges), copied(heights), {0.0}, std::move(style), std::move(name)});
}
void SvgPlot::marks(std::span<const double> x, std::string style, std::string name) {
  series_.push_back({Kind::marks, copied(x), {}, {}, std::move(style), std::move(name)});
}

SvgPlot::Frame SvgPlot::frame() const {
  Interval x_range, y_range;
  bool has_legend = false;
  for (const Series& series : series_) {
    x_range.cover(series.x, options_.x.logarithmic);
    y_range.cover(series.y, options_.y.logarithmic);
    y_range.cover(series.y2, options_.y.logarithmic);
    has_legend = has_legend || !series.name.empty();
  }
  const Interval x = x_range.drawable(), y = y_range.drawable();
  Frame frame{};
  frame.left = left_margin;
  frame.top = has_legend ? legend_places().back()[1] + legend_height - 4 : top_margin;
  frame.width = options_.width - left_margin - right_margin;
  frame.height = options_.height - frame.top - bottom_margin;
  const auto ticks = [](const PlotAxis& axis, const Interval& range, int count) {
    const double from = axis.from.value_or(range.low), to = axis.to.value_or(range.high);
    if (!axis.logarithmic) return ticks_over(from, to, count);
    return from > 0 ? decades_over(from, to) : decades_over(0.1, 1);
  };
  frame.log_x = options_.x.logarithmic;
  frame.log_y = options_.y.logarithmic;
  frame.x_ticks = ticks(options_.x, x, 7);
  frame.y_ticks = ticks(options_.y, y, 6);
  frame.x0 = options_.x.from.value_or(frame.x_ticks.front());
  frame.x1 = options_.x.to.value_or(frame.x_ticks.back());
  frame.y0 = options_.y.from.value_or(frame.y_ticks.front());
  frame.y1 = options_.y.to.value_or(frame.y_ticks.back());
  if (options_.equal_scale) {
    const double scale = std::min(frame.width / (frame.x1 - frame.x0), frame.height / (frame.y1 - frame.y0));
    frame.width = scale * (frame.x1 - frame.x0);
    frame.height = scale * (frame.y1 - frame.y0);
  }
  return frame;
}

std::string SvgPlot::drawn(const Series& series, const Frame& frame) {
  std::string path;
  const auto to = [&](char command, double x, double y) {
    fmt::format_to(std::back_inserter(path), "{}{:.1f} {:.1f}", command, frame.px(x), frame.py(y));
  };
  const size_t count = series.x.size();
  const char* shape = "line";
  switch (series.kind) {
    case Kind::line:
      for (size_t i = 0; i < count; ++i) {
        const auto shown = [&](size_t k) {
          return std::isfinite(frame.px(series.x[k])) && std::isfinite(frame.py(series.y[k]));
        };
        if (!shown(i)) continue;
        const bool starts = i == 0 || !shown(i - 1);
        to(starts ? 'M' : 'L', series.x[i], series.y[i]);
      }
      break;
    case Kind::points:
      shape = "dots";
      // A stroke of no length with round caps is a dot.
      for (size_t i = 0; i < count; ++i) {
        to('M', series.x[i], series.y[i]);
        path += "h0";
      }
      break;
    case Kind::error_bars:
      for (size_t i = 0; i < count; ++i) {
        to('M', series.x[i], series.y[i]);
        to('L', series.x[i], series.y2[i]);
      }
      break;
    case Kind::band:
      shape = "band";
      for (size_t i = 0; i < count; ++i)
        to(i == 0 ? 'M' : 'L', series.x[i], series.y[i]);
      for (size_t i = count; i-- > 0;)
        to('L', series.x[i], series.y2[i]);
      break;
    case Kind::bars:
      shape = "bars";
      for (size_t i = 0; i + 1 < count; ++i) {
        to('M', series.x[i], 0);
        to('L', series.x[i], series.y[i]);
        to('L', series.x[i + 1], series.y[i]);
        to('L', series.x[i + 1], 0);
      }
      break;
    case Kind::marks:
      shape = "mark";
      for (const double x : series.x) {
        to('M', x, frame.y0);
        to('L', x, frame.y1);
      }
      break;
  }
  return fmt::format("<path class=\"{} {}\" d=\"{}\"/>", shape, series.style, path);
}

std::string SvgPlot::axes(const Frame& frame) const {
  std::string grid, texts;
  const double bottom = frame.top + frame.height, right = frame.left + frame.width;
  const auto text_of = [](double tick, const std::vector<double>& ticks, bool logarithmic) {
    if (logarithmic) return chosen(tick);
    return tick_text(tick, ticks.size() > 1 ? ticks[1] - ticks[0] : 1.0);
  };
  for (const double tick : frame.x_ticks) {
    if (tick < frame.x0 - 1e-9 || tick > frame.x1 + 1e-9) continue;
    grid += fmt::format("M{:.1f} {:.1f}V{:.1f}", frame.px(tick), frame.top, bottom);
    texts += fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"middle\">{}</text>", frame.px(tick),
                         bottom + 17, text_of(tick, frame.x_ticks, frame.log_x));
  }
  for (const double tick : frame.y_ticks) {
    if (tick < frame.y0 - 1e-9 || tick > frame.y1 + 1e-9) continue;
    grid += fmt::format("M{:.1f} {:.1f}H{:.1f}", frame.left, frame.py(tick), right);
    texts += fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"end\">{}</text>", frame.left - 7,
                         frame.py(tick) + 4, text_of(tick, frame.y_ticks, frame.log_y));
  }
  if (options_.equal_scale) {
    // A drawing gets a frame only: lines across it would be taken for the specimen's.
    grid =
        fmt::format("M{:.1f} {:.1f}H{:.1f}V{:.1f}H{:.1f}Z", frame.left, frame.top, right, bottom, frame.left);
  }
  return fmt::format(
      "<path class=\"grid\" d=\"{}\"/>{}"
      "<text class=\"label\" x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"middle\">{}</text>"
      "<text class=\"label\" transform=\"translate(14 {:.1f}) rotate(-90)\" text-anchor=\"middle\">{}</text>",
      grid, texts, frame.left + frame.width / 2, bottom + 38, escaped(options_.x.label),
      frame.top + frame.height / 2, escaped(options_.y.label));
}

std::vector<std::array<double, 2>> SvgPlot::legend_places() const {
  std::vector<std::array<double, 2>> places;
  double x = left_margin, y = top_margin + 4;
  for (const Series& series : series_) {
    const double width =
        series.name.empty() ? 0 : 40 + letter_width * static_cast<double>(series.name.size());
    if (x > left_margin && x + width - 18 > options_.width) {
      x = left_margin;
      y += legend_row;
    }
    places.push_back({x, y});
    x += width;
  }
  return places;
}

std::string SvgPlot::legend() const {
  const std::vector<std::array<double, 2>> places = legend_places();
  std::string result;
  for (const Series& series : series_) {
    if (series.name.empty()) continue;
    const auto [x, y] = places[static_cast<size_t>(&series - series_.data())];
    const char* shape = series.kind == Kind::points  ? "dots"
                        : series.kind == Kind::line  ? "line"
                        : series.kind == Kind::marks ? "mark"
                                                     : "swatch";
    const double start = series.kind == Kind::points ? x + 8 : x;
    result += fmt::format("<path class=\"{} {}\" d=\"M{:.1f} {:.1f}h{}\"/>", shape, series.style, start, y,
                          series.kind == Kind::points ? 0 : 16);
    result += fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\">{}</text>", x + 22, y + 4, escaped(series.name));
  }
  return result;
}

std::string SvgPlot::svg() const {
  const Frame placed = frame();
  std::string body = axes(placed);
  for (const Series& series : series_)
    body += drawn(series, placed) + "\n";
  return drawing(placed.left + placed.width + right_margin, placed.top + placed.height + bottom_margin,
                 body + legend());
}

}  // namespace diastole::report
