#pragma once
// The orders that the made-up solutions of tools/benchmarks/verification/manufactured_solution.hpp must converge with.
//
// Tri-cubic displacement alone has order 4 in L2 and 3 in H1, which it shows where the pressure's space holds the
// exact pressure. A curved pressure is met to order 2 by tri-linear functions and takes the displacement along: 3 and
// 2. The discontinuous pressure itself carries a weakly controlled sawtooth (one linear function in all elements, of
// which the divergence of a C1 displacement sees only the body's ends) and converges slower; averaged at the nodes,
// where a sawtooth cancels, it has its order 2, and so has the stress that is shown.

#include <gtest/gtest.h>

#include "tools/benchmarks/verification/manufactured_solution.hpp"

namespace diastole {

inline void expect_orders(const ManufacturedCase& made_up, size_t coarse_n, size_t fine_n) {
  SCOPED_TRACE(made_up.name);
  const ManufacturedErrors coarse = solve_manufactured(made_up, coarse_n);
  const ManufacturedErrors fine = solve_manufactured(made_up, fine_n);
  for (const ManufacturedErrors* errors : {&coarse, &fine}) {
    ASSERT_TRUE(errors->converged);
    EXPECT_EQ(errors->negative_pivots, errors->pressure_unknowns);
  }
  const auto order = [&](double ManufacturedErrors::*error) {
    return convergence_order(coarse.*error, fine.*error, coarse_n, fine_n);
  };
  const double pressure_order = made_up.pressure_wave_kPa > 0.0 ? 2.0 : 3.0;
  constexpr double slack = 0.15;
  EXPECT_GT(order(&ManufacturedErrors::displacement_L2_mm), pressure_order + 1.0 - slack);
  EXPECT_GT(order(&ManufacturedErrors::displacement_H1), pressure_order - slack);
  EXPECT_GT(order(&ManufacturedErrors::averaged_pressure_L2_kPa), pressure_order - slack);
  EXPECT_GT(order(&ManufacturedErrors::stress_L2_kPa), pressure_order - slack);
  EXPECT_GT(order(&ManufacturedErrors::pressure_L2_kPa), 0.9);
}

}  // namespace diastole
