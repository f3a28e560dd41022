#include "tools/sim_scanner/pulse_train.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <numeric>

namespace diastole::scanner {

double tagged_magnetisation(std::span<const double> weights, double flip_rad, double phase_rad) {
  const double all = std::accumulate(weights.begin(), weights.end(), 0.0);
  const Eigen::AngleAxisd turn(phase_rad, Eigen::Vector3d::UnitZ());
  Eigen::Vector3d magnetisation = Eigen::Vector3d::UnitZ();
  for (size_t i = 0; i < weights.size(); ++i) {
    if (i > 0) magnetisation = turn * magnetisation;
    magnetisation = Eigen::AngleAxisd(flip_rad * weights[i] / all, Eigen::Vector3d::UnitX()) * magnetisation;
  }
  return magnetisation.z();
}

double recovered(double magnetisation, double time_s, double T1_s) {
  return 1 - (1 - magnetisation) * std::exp(-time_s / T1_s);
}

}  // namespace diastole::scanner
