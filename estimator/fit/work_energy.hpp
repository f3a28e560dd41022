#pragma once
// The work-energy equation: what the cavity's pressure has done on the wall is what the wall stores (A. Nasopoulou et al., Biomech. Model.
// Mechanobiol. 16 (2017) 971: it separates the scale of an exponential law from its exponents, which one loaded shape leaves on a ridge).
//
//   W = integral of p dV from frame 0 to the most loaded frame  =  U(x) - U(X),     U = integral of the law's energy over the body     (mJ)
//
// In a model that is in equilibrium in every frame this holds by itself for the model's own volumes and pressures (virtual work). It adds
// information where the volume was measured apart from the tags, as by phase contrast: the table that `diastole flow --loop` writes.
// Pressures that read too high by an offset o make W too large by o dV.
//
// W is the chords' sum over the loop's points between the two times. What a whole cycle does not return, the loop's area A, is spent on
// the way: before the loaded frame between nothing and all of it, evenly likely, so that W - A/2 with A/sqrt(12) is stored. Errors of the
// points count as independent of each other and of the frames' but for the offset; those of a volume that was integrated from flow are
// alike in part, for which this is too large.

#include <filesystem>
#include <vector>

#include "estimator/io/measurement.hpp"

namespace diastole {

struct MeasuredWork {
  int frame = 0;  ///< the most loaded one that has points
  double work_mJ = 0;
  double sigma_mJ = 0;
  double volume_change_mL = 0;  ///< since frame 0
};

/// One cycle, phases even and rising.
struct WorkLoop {
  struct Point {
    double phase_s, volume_mL, volume_sigma_mL, pressure_kPa, pressure_sigma_kPa;
  };
  std::vector<Point> points;

  /// From the cycle's `from_s` on, to a later time of the same cycle. Precondition: from_s < to_s, both within the cycle.
  [[nodiscard]] MeasuredWork between(double from_s, double to_s) const;
  [[nodiscard]] double period_s() const;
};

/// A table as `diastole flow --loop` writes it. Throws InputError for a table that is no cycle.
WorkLoop read_work_loop(const std::filesystem::path& file);

/// Throws InputError if the frames' times are none of the loop's cycle, or if the loop does no work on the way.
MeasuredWork measured_work(const WorkLoop& loop, const Measurement& measurement,
                           const std::filesystem::path& file);

}  // namespace diastole
