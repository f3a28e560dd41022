#include "estimator/montecarlo/paper_table.hpp"

#include <algorithm>
#include <cmath>

namespace diastole {
namespace {

struct Row {
  double noise_mm;
  int frames;
  std::array<double, 4> sd_percent;
};

constexpr std::array<Row, 12> table{{{0.4, 1, {5, 4, 3, 4}},
                                     {0.4, 3, {1, 1, 1, 1}},
                                     {0.4, 5, {1, 1, 1, 1}},
                                     {0.8, 1, {10, 7, 7, 13}},
                                     {0.8, 3, {1, 2, 1, 2}},
                                     {0.8, 5, {2, 2, 2, 3}},
                                     {1.6, 1, {21, 16, 13, 22}},
                                     {1.6, 3, {4, 4, 7, 5}},
                                     {1.6, 5, {6, 4, 6, 8}},
                                     {3.2, 1, {57, 28, 20, 43}},
                                     {3.2, 3, {15, 12, 14, 20}},
                                     {3.2, 5, {6, 5, 9, 9}}}};

}  // namespace

std::optional<std::array<double, 4>> paper_sd_percent(double noise_mm, int frames) {
  const auto found = std::find_if(table.begin(), table.end(), [&](const Row& row) {
    return std::abs(row.noise_mm - noise_mm) < 1e-9 && row.frames == frames;
  });
  if (found == table.end()) return {};
  return found->sd_percent;
}

}  // namespace diastole
