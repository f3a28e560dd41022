// Orders of convergence in the mesh size, between coarse meshes.

#include "tests/estimator/fe/convergence_orders.hpp"

namespace diastole {
namespace {

TEST(ConvergenceOrders, OfDisplacementAndPressureToMadeUpSolutions) {
  for (const ManufacturedCase& made_up : manufactured_cases())
    expect_orders(made_up, 2, 3);
}

}  // namespace
}  // namespace diastole
