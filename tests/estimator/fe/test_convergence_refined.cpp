// Orders of convergence in the mesh size, between finer meshes.

#include "tests/estimator/fe/convergence_orders.hpp"

namespace diastole {
namespace {

TEST(ConvergenceOrdersRefined, OfDisplacementAndPressureToMadeUpSolutions) {
  for (const ManufacturedCase& made_up : manufactured_cases())
    expect_orders(made_up, 4, 7);
}

}  // namespace
}  // namespace diastole
