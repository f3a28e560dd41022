#pragma once
// A small writer of plots as inline SVG. Colours come from the page's style sheet (page.css): a series names
// a class (`a` blue, `b` orange, `c` green, `muted` grey), never a colour.
//
//   SvgPlot plot({.x = {.label = "time in the cycle (s)"}, .y = {.label = "pressure (kPa)"}});
//   plot.band(time_s, low_kPa, high_kPa, "a");
//   plot.line(time_s, mean_kPa, "a", "mean");
//   page.figure(plot.svg(), "Pressure over the cycle.");
//
// The axes reach over everything that was added, rounded outwards to ticks at 1, 2 or 5 times a power of ten.
// A NaN breaks a line. Lengths are viewBox units (CSS pixels at full size).

#include <array>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace diastole::report {

struct PlotAxis {
  std::string label;                ///< with its unit
  std::optional<double> from = {};  ///< fixed end instead of the data's
  std::optional<double> to = {};
  bool logarithmic = false;  ///< values that are not positive are left out; not for bars
};

struct PlotOptions {
  PlotAxis x;
  PlotAxis y;
  double width = 560;
  double height = 330;
  bool equal_scale = false;  ///< a millimetre across is a millimetre up: for drawings of the specimen
};

class SvgPlot {
 public:
  explicit SvgPlot(PlotOptions options) : options_(std::move(options)) {}

  /// `name` is shown in the legend; unnamed series are not.
  void line(std::span<const double> x, std::span<const double> y, std::string style, std::string name = {});
  void points(std::span<const double> x, std::span<const double> y, std::string style, std::string name = {});
  /// Bars from y - error to y + error.
  void error_bars(std::span<const double> x, std::span<const double> y, std::span<const double> error,
                  std::string style);
  /// The area between two lines.
  void band(std::span<const double> x, std::span<const double> low, std::span<const double> high,
            std::string style, std::string name = {});
  /// A histogram: edges.size() == heights.size() + 1.
  void bars(std::span<const double> edges, std::span<const double> heights, std::string style,
            std::string name = {});
  /// Vertical marks over the plot's whole height (triggers, boundaries).
  void marks(std::span<const double> x, std::string style, std::string name = {});

  [[nodiscard]] std::string svg() const;

 private:
  enum class Kind { line, points, error_bars, band, bars, marks };
  struct Series {
    Kind kind;
    std::vector<double> x, y, y2;
    std::string style, name;
  };
  struct Frame;  // maps data to the viewBox

  [[nodiscard]] Frame frame() const;
  [[nodiscard]] static std::string drawn(const Series& series, const Frame& frame);
  [[nodiscard]] std::string axes(const Frame& frame) const;
  /// Where each series' name stands: in as many rows as are needed.
  [[nodiscard]] std::vector<std::array<double, 2>> legend_places() const;
  [[nodiscard]] std::string legend() const;

  PlotOptions options_;
  std::vector<Series> series_;
};

/// One coordinate of each item: a member, or what a function makes of it.
template <class Items, class Of>
std::vector<double> numbers_of(const Items& items, const Of& of) {
  std::vector<double> numbers;
  for (const auto& item : items)
    numbers.push_back(std::invoke(of, item));
  return numbers;
}

/// Residuals over their standard deviations as a histogram, with the bell that they should fill.
SvgPlot residual_histogram(std::span<const double> edges, std::span<const double> counts);

/// Ticks at multiples of 1, 2 or 5 x 10^k, from the last at or below `from` to the first at or above `to`;
/// about `count` of them.
std::vector<double> ticks_over(double from, double to, int count);

/// Ticks for a logarithmic axis: powers of ten, with twice and five times each where there are no more than three.
/// Precondition: 0 < from <= to.
std::vector<double> decades_over(double from, double to);

}  // namespace diastole::report
