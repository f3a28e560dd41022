#pragma once
// Land's problems, solved and held to be converged and stable.

#include <gtest/gtest.h>

#include "tools/benchmarks/verification/land_problems.hpp"

namespace diastole {

inline Eigen::Vector3d land_beam_tip_mm(std::array<size_t, 3> elements) {
  const LandBeam beam = land_beam(elements);
  EXPECT_TRUE(beam.solution.report.converged()) << beam.solution.report.describe();
  EXPECT_EQ(beam.solution.report.negative_pivots, beam.pressure_unknowns);
  return beam.tip_mm;
}

inline LandVentricle stable(LandVentricle ventricle) {
  EXPECT_TRUE(ventricle.solution.report.converged()) << ventricle.solution.report.describe();
  EXPECT_EQ(ventricle.solution.report.negative_pivots, ventricle.model.pressure_dofs());
  return ventricle;
}

}  // namespace diastole
