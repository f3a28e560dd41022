#pragma once
// Two grids of coloured cells side by side, before and after, on one scale with one colour bar.
//
//   +-----------+   +-----------+  ▄ +6
//   |  before   |   |   after   |  █  0     signed: blue - white - red; else viridis
//   +-----------+   +-----------+  ▀ -6

#include <array>
#include <string>
#include <vector>

#include "estimator/explain/verdict/explanation.hpp"

namespace diastole::report {

using CellGrid = std::vector<std::vector<double>>;  ///< rows from the top; NaN leaves a hole

struct HeatMapLabels {
  std::string x, y, bar;
  std::array<double, 2> x_range{};  ///< of the columns' outer edges
  std::array<double, 2> y_range{};  ///< top edge, bottom edge
  bool is_signed = true;
  std::vector<std::array<double, 2>> marks = {};  ///< rings in both grids, in the ranges' units
};

/// The scale covers 995 of 1000 cells of both grids, and at least +-2 (signed) or 0 to 2.
std::string heat_map(const CellGrid& before, const CellGrid& after, const HeatMapLabels& labels);

// The gap after each added effect as bars on a logarithmic scale, with the noise floor:
//
//   base model        |██████████████████████████| 14.2
//   + hose-compliance |██|░░░░░░░░░░░░░░░░░░░░░░░| 1.1        ░ what this effect took away
//                      ┆ 1: noise

/// Precondition: `steps` is not empty; the first is the base model.
std::string waterfall(const std::vector<explain::Step>& steps, double floor);

}  // namespace diastole::report
