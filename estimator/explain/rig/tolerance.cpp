#include "estimator/explain/rig/tolerance.hpp"

#include <deque>

namespace diastole::explain {
namespace {

/// Square of a channel's error over its noise; a slow error passes the whitening as the noise does or weaker.
double relative_variance(const rig::RigProblem& problem, const std::string& channel,
                         const ModelFloor& floor) {
  if (channel == "cavity_mL") return floor.volume_sigmas * floor.volume_sigmas;
  const rig::Channel kind =
      channel == name_of(rig::Channel::pump) ? rig::Channel::pump : rig::Channel::cavity;
  const double error_kPa = kind == rig::Channel::pump ? floor.pump_kPa : floor.cavity_kPa;
  const double ratio = error_kPa / problem.noise().channels.at(kind).sd_kPa;
  return ratio * ratio;
}

/// Adds `part` of the largest squared change within some samples, which lasts as long as an error rings.
void add_largest_around(const Eigen::VectorXd& change, const rig::ResidualBlock& block, double part,
                        Eigen::VectorXd& variance) {
  constexpr size_t reach = 15;  // samples at 300 Hz
  const auto square = [&](size_t k) {
    const double value = change[static_cast<Eigen::Index>(block.first + k)];
    return value * value;
  };
  std::deque<size_t> falling;  // places of squares that may still be the largest
  for (size_t next = 0; next < block.count + reach; ++next) {
    if (next < block.count) {
      while (!falling.empty() && square(falling.back()) <= square(next))
        falling.pop_back();
      falling.push_back(next);
    }
    if (next < reach) continue;
    const size_t k = next - reach;
    while (falling.front() + reach < k)
      falling.pop_front();
    variance[static_cast<Eigen::Index>(block.first + k)] += part * square(falling.front());
  }
}

}  // namespace

Eigen::VectorXd model_variance(const rig::RigProblem& problem, const Eigen::VectorXd& change,
                               const ModelFloor& floor) {
  Eigen::VectorXd variance;
  for (const rig::ResidualBlock& block : problem.blocks()) {
    const auto first = static_cast<Eigen::Index>(block.first);
    const auto count = static_cast<Eigen::Index>(block.count);
    variance.conservativeResize(first + count);
    variance.segment(first, count).setConstant(relative_variance(problem, block.channel, floor));
  }
  if (change.size() != variance.size()) return variance;
  for (const rig::ResidualBlock& block : problem.blocks()) {
    const double part = block.channel == name_of(rig::Channel::pump) ? floor.part_of_change_pump
                                                                     : floor.part_of_change_cavity;
    add_largest_around(change, block, part * part, variance);
  }
  return variance;
}

}  // namespace diastole::explain
