#pragma once
// The piston's motion behind a run's commanded volume.
//
// A run file holds steps x volume per step; the motion that they follow is smooth, and its acceleration is what the
// pressure at the pump mostly shows. Differences of counted steps would be far too rough (one step in 1/300 s is
// 2.3 mL/s), so the motion is found again as the chain of *strokes* whose rounding gives the counts:
//
//   stroke     from v0 to v1 in [t0, t1]: a cosine, or a ramp with parabolic ends of part b each
//              (b = 1/2 is the parabolic waveform, which has no ramp)
//   spreading  the whole motion averaged over a window W that lies symmetrically about the time: accelerations that
//              jump are spread over W
//
// Volume, flow and acceleration are differences of the strokes' exact integrals over W. `find_motion` tries the
// waveforms of /protocol/segments first, then cycles of them that turn at other phases and are rounded otherwise (another
// maker's sawtooth), strokes fitted to the counts elsewhere, and W from none to 0.1 s, and accepts what stays within a
// step everywhere; what nothing explains is smoothed, and `explain` says so.

#include <vector>

#include "protocol/runfile/run.hpp"

namespace diastole::rig {

struct Stroke {
  double start_s = 0.0;
  double end_s = 0.0;
  double from_mL = 0.0;
  double to_mL = 0.0;
  double round = 0.5;   ///< part of the duration at each end with constant acceleration, in (0, 1/2]
  bool cosine = false;  ///< instead

  [[nodiscard]] double volume_mL(double time_s) const;
  /// Integral of the volume from start_s, mL s; beyond the end it goes on with to_mL.
  [[nodiscard]] double integral_mL_s(double time_s) const;
  [[nodiscard]] double flow_mL_per_s(double time_s) const;
};

class Motion {
 public:
  Motion() = default;
  /// Strokes in order of time, each starting where the one before ended or rested.
  Motion(std::vector<Stroke> strokes, double rest_mL, double spread_s);

  struct State {
    double volume_mL = 0.0;
    double flow_mL_per_s = 0.0;
    double acceleration_mL_per_s2 = 0.0;
  };
  [[nodiscard]] State at(double time_s) const;
  [[nodiscard]] const std::vector<Stroke>& strokes() const { return strokes_; }
  [[nodiscard]] double rest_mL() const { return rest_mL_; }
  [[nodiscard]] double spread_s() const { return spread_s_; }

 private:
  struct Ideal {
    double volume_mL, integral_mL_s, flow_mL_per_s;
  };
  [[nodiscard]] Ideal ideal(double time_s) const;

  std::vector<Stroke> strokes_;
  std::vector<double> integral_before_;  ///< at each stroke's start
  double rest_mL_ = 0.0;
  double spread_s_ = 0.0;
};

/// A segment's strokes from its start_s on; none for a waveform whose shape the contract does not fix.
std::vector<Stroke> strokes_of(const runfile::Segment& segment);

struct FoundMotion {
  Motion motion;
  double worst_mL = 0.0;   ///< farthest from the counted steps
  double step_mL = 0.0;    ///< the quantum
  bool explained = false;  ///< worst_mL within one step
};

/// Precondition: the run was read and checked, its pump trace is not empty.
FoundMotion find_motion(const runfile::RecordedRun& run);

}  // namespace diastole::rig
