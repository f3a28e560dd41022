#pragma once
// How much more equal cycles differ from each other than by the instruments' noise: what comes at random (a seal that
// sticks at some turns, pickup at a frequency of its own) and what no model of a repeated motion explains.
//
// Of successive cycles of a segment the difference of what the model leaves, without what a common factor, a shift in
// time, an offset and a drift make of it, up to the highest frequency of the features. Half of its square, less what
// the noise has there, is the scatter: that of the lower quarter of a segment's pairs, since what happens in some
// cycles (a step lost, a zero that jumps) is an event and no scatter. Its square has an error: of so few pairs, and of the
// noise, which is known from a limited record.

#include <array>
#include <vector>

#include "estimator/rig_fit/session_problem.hpp"

namespace diastole::rig {

struct SegmentScatter {
  size_t run = 0;
  size_t segment = 0;
  size_t pairs = 0;          ///< of cycles
  double square_kPa2 = 0.0;  ///< without the noise's; may be negative
  double noise_kPa2 = 0.0;
  std::array<double, 10> phase{};  ///< how the square lies over the cycle, tenth by tenth
};

struct CycleScatter {
  Signal signal = Signal::cavity;
  double rms_kPa = 0.0;    ///< 0 where cycles differ by less than the noise
  double noise_kPa = 0.0;  ///< in the same band
  double sds = 0.0;        ///< how many standard errors the logarithm of both is above that of the noise
  std::vector<SegmentScatter> segments;
};

/// Of each sensor's pressure; none of a session with fewer than four pairs of equal cycles.
std::vector<CycleScatter> cycle_scatter(const SessionProblem& problem, const SessionModel& model);

}  // namespace diastole::rig
