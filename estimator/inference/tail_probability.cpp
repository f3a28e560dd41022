#include "estimator/inference/tail_probability.hpp"

#include <algorithm>
#include <boost/math/special_functions/gamma.hpp>
#include <cmath>
#include <numbers>

namespace diastole::inference {

double chi_square_tail(double value, double dofs) {
  if (!(value > 0.0)) return 1.0;
  return boost::math::gamma_q(0.5 * dofs, 0.5 * value);
}

double normal_tail(double sds) { return 0.5 * std::erfc(sds / std::numbers::sqrt2); }

double discovery_limit(std::vector<double> p_values, double rate) {
  std::sort(p_values.begin(), p_values.end());
  for (size_t k = p_values.size(); k > 0; --k) {
    const double limit = rate * static_cast<double>(k) / static_cast<double>(p_values.size());
    if (p_values[k - 1] <= limit) return p_values[k - 1];
  }
  return 0.0;
}

}  // namespace diastole::inference
