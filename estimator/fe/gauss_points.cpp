#include "estimator/fe/gauss_points.hpp"

#include <cmath>

namespace diastole {
namespace {

/// From the nodes in -1..1 (the positive half, outermost first) to 0..1.
template <size_t Count>
LineRule<Count> on_unit_interval(const std::array<double, Count / 2>& node,
                                 const std::array<double, Count / 2>& weight, double middle_weight) {
  LineRule<Count> rule;
  for (size_t i = 0; i < Count / 2; ++i) {
    rule.place[i] = 0.5 * (1.0 - node[i]);
    rule.place[Count - 1 - i] = 0.5 * (1.0 + node[i]);
    rule.weight[i] = rule.weight[Count - 1 - i] = 0.5 * weight[i];
  }
  if constexpr (Count % 2 == 1) {
    rule.place[Count / 2] = 0.5;
    rule.weight[Count / 2] = 0.5 * middle_weight;
  }
  return rule;
}

GaussTables make_tables() {
  GaussTables tables;
  const LineRule<4> rule = line_rule_4();
  for (size_t q = 0; q < line_points; ++q) {
    tables.line[0][q] = hermite_values(rule.place[q]);
    tables.line[1][q] = hermite_slopes(rule.place[q]);
  }
  for (size_t q = 0; q < gauss_points; ++q) {
    const std::array<size_t, 3> index{q & 3, (q >> 2) & 3, q >> 4};
    tables.weight[q] = 1.0;
    for (size_t k = 0; k < 3; ++k) {
      tables.xi[q][k] = rule.place[index[k]];
      tables.weight[q] *= rule.weight[index[k]];
    }
    tables.slope[q] = hermite_basis(tables.xi[q]).slope;
    tables.trilinear[q] = trilinear_basis(tables.xi[q]);
  }
  return tables;
}

}  // namespace

LineRule<4> line_rule_4() {
  const double spread = 2.0 / 7.0 * std::sqrt(6.0 / 5.0);
  const double tilt = std::sqrt(30.0) / 36.0;
  return on_unit_interval<4>({std::sqrt(3.0 / 7.0 + spread), std::sqrt(3.0 / 7.0 - spread)},
                             {0.5 - tilt, 0.5 + tilt}, 0.0);
}

LineRule<5> line_rule_5() {
  const double spread = 2.0 * std::sqrt(10.0 / 7.0);
  const double tilt = 13.0 * std::sqrt(70.0);
  return on_unit_interval<5>({std::sqrt(5.0 + spread) / 3.0, std::sqrt(5.0 - spread) / 3.0},
                             {(322.0 - tilt) / 900.0, (322.0 + tilt) / 900.0}, 128.0 / 225.0);
}

const GaussTables& gauss_tables() {
  static const GaussTables tables = make_tables();
  return tables;
}

}  // namespace diastole
