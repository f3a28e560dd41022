#include "estimator/fit/work_energy.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <sstream>
#include <string>
#include <string_view>

#include "estimator/io/number_table.hpp"
#include "estimator/io/whole_file.hpp"
#include "estimator/motion_residuals/motion_residuals.hpp"
#include "protocol/contract/input_error.hpp"

namespace diastole {
namespace {

using Point = WorkLoop::Point;

constexpr std::array<std::string_view, 5> columns{"phase_s", "volume_mL", "volume_sigma_mL", "pressure_kPa",
                                                  "pressure_sigma_kPa"};
constexpr size_t fewest_points = 8;
constexpr double even = 0.02;  // of the spacing

/// The lines without what stands behind the fifth column: a loop's stiffness is empty where the flow turns.
std::string first_columns(const std::string& text) {
  std::istringstream lines(text);
  std::string cut;
  for (std::string line; std::getline(lines, line);) {
    size_t end = 0;
    for (size_t column = 0; column < columns.size() && end != std::string::npos; ++column)
      end = line.find(',', end + (column > 0 ? 1 : 0));
    cut += line.substr(0, end) + "\n";
  }
  return cut;
}

Point between_points(const Point& a, const Point& b, double phase_s) {
  const double share = (phase_s - a.phase_s) / (b.phase_s - a.phase_s);
  const auto mean = [&](double Point::*of) { return a.*of + share * (b.*of - a.*of); };
  return {phase_s, mean(&Point::volume_mL), mean(&Point::volume_sigma_mL), mean(&Point::pressure_kPa),
          mean(&Point::pressure_sigma_kPa)};
}

/// Integral of p dV along chords.
double work_mJ(const std::vector<Point>& path) {
  double sum = 0;
  for (size_t i = 1; i < path.size(); ++i)
    sum +=
        0.5 * (path[i].pressure_kPa + path[i - 1].pressure_kPa) * (path[i].volume_mL - path[i - 1].volume_mL);
  return sum;
}

/// Its variance, errors of the points being independent.
double work_variance(const std::vector<Point>& path) {
  double sum = 0;
  for (size_t i = 0; i < path.size(); ++i) {
    const Point& before = path[i > 0 ? i - 1 : i];
    const Point& after = path[std::min(i + 1, path.size() - 1)];
    double by_volume = 0.5 * (before.pressure_kPa - after.pressure_kPa);
    if (i == 0) by_volume -= path.front().pressure_kPa;
    if (i + 1 == path.size()) by_volume += path.back().pressure_kPa;
    const double by_pressure = 0.5 * (after.volume_mL - before.volume_mL);
    sum += std::pow(by_volume * path[i].volume_sigma_mL, 2) +
           std::pow(by_pressure * path[i].pressure_sigma_kPa, 2);
  }
  return sum;
}

}  // namespace

double WorkLoop::period_s() const {
  const auto count = static_cast<double>(points.size());
  return (points.back().phase_s - points.front().phase_s) * count / (count - 1);
}

MeasuredWork WorkLoop::between(double from_s, double to_s) const {
  // A cycle before and one behind, so that both times lie between points.
  std::vector<Point> all;
  for (const int cycle : {-1, 0, 1}) {
    for (Point point : points) {
      point.phase_s += cycle * period_s();
      all.push_back(point);
    }
  }
  const auto at = [&](double phase_s) {
    const auto next = std::ranges::upper_bound(all, phase_s, {}, &Point::phase_s);
    return between_points(*(next - 1), *next, phase_s);
  };
  std::vector<Point> path{at(from_s)};
  for (const Point& point : all)
    if (point.phase_s > from_s && point.phase_s < to_s) path.push_back(point);
  path.push_back(at(to_s));
  std::vector<Point> cycle = points;
  cycle.push_back(points.front());
  const double area_mJ = work_mJ(cycle);
  return {0, work_mJ(path) - 0.5 * area_mJ, std::sqrt(work_variance(path) + area_mJ * area_mJ / 12),
          path.back().volume_mL - path.front().volume_mL};
}

WorkLoop read_work_loop(const std::filesystem::path& file) {
  const NumberTable table =
      NumberTable::from_text(first_columns(read_whole_file(file)), file.string(), columns);
  constexpr const char* remedy =
      "Give a table that `diastole flow --run RUN --loop NAME.loop.csv` wrote, or one like it.";
  WorkLoop loop;
  for (size_t row = 0; row < table.rows(); ++row) {
    loop.points.push_back(
        {table.at(row, 0), table.at(row, 1), table.at(row, 2), table.at(row, 3), table.at(row, 4)});
    for (const size_t sigma : {size_t{2}, size_t{4}})
      if (table.at(row, sigma) < 0) table.fail(row, sigma, "is negative", "Give standard errors.");
    if (row > 0 && !(table.at(row, 0) > table.at(row - 1, 0)))
      table.fail(row, 0, "does not rise", "Sort the rows by their phase.");
  }
  if (table.rows() < fewest_points)
    throw InputError({file.string(), "", fmt::format("{} points are no loop", table.rows()), remedy});
  const double spacing_s = loop.period_s() / static_cast<double>(loop.points.size());
  for (size_t row = 1; row < table.rows(); ++row) {
    if (std::abs(table.at(row, 0) - table.at(row - 1, 0) - spacing_s) > even * spacing_s)
      table.fail(row, 0, "is not as far from the last as the others are",
                 "Give a whole cycle in even steps: its period is read from them.");
  }
  return loop;
}

MeasuredWork measured_work(const WorkLoop& loop, const Measurement& measurement,
                           const std::filesystem::path& file) {
  const std::vector<int> loaded = loaded_frames(measurement);
  if (loaded.empty())
    throw InputError({file.string(), "", "is of no use: no frame under load has points",
                      "Give points of the frame up to which the pressure has done work."});
  const auto load = [&](int frame) { return measurement.frames[static_cast<size_t>(frame)]; };
  const int frame = *std::ranges::max_element(loaded, {}, [&](int f) { return load(f).pressure_kPa; });
  const double from_s = load(0).time_s, to_s = load(frame).time_s;
  if (from_s < 0 || !(to_s > from_s) || to_s > loop.period_s())
    throw InputError({file.string(), "",
                      fmt::format("frames 0 and {} at {:.4g} and {:.4g} s are not of a cycle of {:.4g} s",
                                  frame, from_s, to_s, loop.period_s()),
                      "Give frames whose time_s counts from the same trigger as the loop's phase_s."});
  MeasuredWork work = loop.between(from_s, to_s);
  work.frame = frame;
  if (!(work.work_mJ > 0) || !(work.sigma_mJ > 0))
    throw InputError(
        {file.string(), "",
         fmt::format("from frame 0 to frame {} the pressure does a work of {:.3g} \u00b1 {:.2g} mJ", frame,
                     work.work_mJ, work.sigma_mJ),
         "Give a loop with errors, in which the cavity is filled on that way."});
  return work;
}

}  // namespace diastole
