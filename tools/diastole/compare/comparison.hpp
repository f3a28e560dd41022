#pragma once
// What distinguishes runs: what was known and set, and the pressure over the cycle against the noise of both.
//
// Of each segment and channel the cycles are averaged in equal parts of the period (protocol/runfile/frame_bins.hpp), which gives a
// mean m and its variance v from the scatter over n cycles. Run b differs from the first, a, in a part beyond noise if
//
//   |m_b - m_a| > t(nu, 1 %) sqrt(v_a + v_b)
//
// with Student's t for Welch's number of degrees of freedom nu, and 1 % shared out over all parts of all segments, channels and runs
// that are tested: a comparison of equal runs says so wrongly once in a hundred. Wild cycles are left out of mean and scatter (frame_bins.hpp)
// and named. Where the noise allows a difference beyond a tenth of the trace's range, that none was found means nothing.

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "protocol/runfile/reader.hpp"
#include "protocol/runfile/session.hpp"

namespace diastole::comparison {

/// One thing that is not the same in all runs.
struct Difference {
  std::string group;                ///< session, protocol, rig, calibration
  std::string place;                ///< "segment 1 stroke_mL", "hose_length_m"
  std::vector<std::string> values;  ///< of each run; empty: it has none
};

/// A run's mean cycle.
struct MeanCycle {
  size_t run = 0;                 ///< number of the run
  size_t cycles = 0;              ///< that were averaged, without wild ones
  std::vector<double> mean_kPa;   ///< of each part
  std::vector<double> sd_kPa;     ///< over the cycles
  std::vector<double> error_kPa;  ///< of the mean
};

enum class Outcome {
  agrees,
  differs,
  undecided  ///< the noise is not known, or is large beside the trace
};

/// A run's mean cycle against the first run's.
struct Departure {
  size_t run = 0;
  double offset_Pa = 0;        ///< mean over the parts
  double gain = 1;             ///< slope of this run's pressure over the first one's
  double rms_Pa = 0;           ///< of the difference, offset included
  double worst_Pa = 0;         ///< the difference where it is largest in errors
  double worst_phase = 0;      ///< there
  double worst_in_errors = 0;  ///< there
  double limit_in_errors = 0;  ///< beyond it, it is no noise
  double allowed_Pa = 0;       ///< the largest difference in any part that may be noise
  double range_Pa = 0;         ///< of the mean cycle that has less
  [[nodiscard]] Outcome outcome() const {
    constexpr double most_of_range = 0.1;
    if (worst_in_errors > limit_in_errors) return Outcome::differs;
    return allowed_Pa > 0 && allowed_Pa <= most_of_range * range_Pa ? Outcome::agrees : Outcome::undecided;
  }
};

struct Overlay {
  size_t segment = 0;
  std::string channel;  ///< "cavity_kPa"
  double period_s = 0;  ///< of the first run
  std::vector<double> phase = {};
  std::vector<MeanCycle> cycles = {};      ///< of the runs that have some
  std::vector<Departure> departures = {};  ///< of those whose motion is the first one's
};

struct Comparison {
  std::vector<std::string> files;
  std::vector<Difference> differences;
  std::vector<Overlay> overlays;
  std::vector<std::string> remarks;  ///< what is not sound, was left out or could not be compared, and why

  /// In how many segments and channels pressure against noise ends so.
  [[nodiscard]] size_t count(Outcome outcome) const;
  /// A run differs if any of its traces does, and agrees if any does: one that stands still says nothing of the others. All agree where
  /// each run does. None if there is no pressure to test.
  [[nodiscard]] std::optional<Outcome> outcome() const;
};

/// `sessions` of the same runs; `parts` of the period. Precondition: two or more runs.
Comparison compare(const std::vector<runfile::RunFile>& runs, const std::vector<runfile::Session>& sessions,
                   size_t parts);

/// Self-contained, with the mean cycles and their differences, each with its band of noise.
std::string comparison_page(const Comparison& comparison);

}  // namespace diastole::comparison
