#pragma once
// A line chart as SVG text: for the figures of docs/.

#include <string>
#include <vector>

namespace diastole {

struct ChartPoint {
  double x;
  double y;
};

struct ChartSeries {
  std::string label;
  std::vector<ChartPoint> points;
  bool markers_only = false;  ///< open circles instead of a line
};

struct LineChart {
  std::string title;
  std::string x_label;
  std::string y_label;
  ChartPoint least;  ///< lower left corner of the plotted range
  ChartPoint most;   ///< upper right corner
  ChartPoint tick;   ///< distance of the tick marks
  std::vector<ChartSeries> series;
};

std::string to_svg(const LineChart& chart);

}  // namespace diastole
