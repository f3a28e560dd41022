#include "estimator/explain/tolerance.hpp"

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
  if (change.size() == variance.size())
    variance += floor.part_of_change * floor.part_of_change * change.cwiseAbs2();
  return variance;
}

}  // namespace diastole::explain
