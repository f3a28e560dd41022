#pragma once
// A line chart as an SVG file: for the figures of docs/.

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
  bool markers_only = false;  ///< dots instead of a line
};

struct LineChart {
  std::string title;
  std::string x_label;
  std::string y_label;
  ChartPoint least;  ///< lower left corner of the plotted range
  ChartPoint most;   ///< upper right corner
  std::vector<ChartSeries> series;
};

std::string to_svg(const LineChart& chart);

/// What a figure's program does: `make` prints the table on standard output, the chart goes to the file that is the one
/// argument. Returns the exit code.
int write_figure(int argc, char** argv, const char* program, LineChart (*make)());

}  // namespace diastole
