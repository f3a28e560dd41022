#include "estimator/fit/finer_mesh.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "estimator/mesh/node_field.hpp"

namespace diastole {

Study on_finer_mesh(Study study) {
  const auto twice = [](std::array<int, 3>& mesh) {
    for (int& elements : mesh)
      elements *= 2;
  };
  if (auto* annulus = std::get_if<AnnulusSpecimen>(&study.specimen)) {
    twice(annulus->mesh);
  } else if (auto* ellipsoid = std::get_if<EllipsoidSpecimen>(&study.specimen)) {
    twice(ellipsoid->mesh);
  } else {
    for (int& halvings : study.refine)
      ++halvings;
  }
  return study;
}

std::optional<Eigen::VectorXd> finer_mesh_correction(MotionModel& finer, const CoarseMotions& coarse,
                                                     const MotionResiduals& rows, LocatorOptions locator) {
  const PointLocator reference(finer.mesh(), finer.mesh().reference(), locator);
  const MotionResiduals there = rows.relocated(reference);
  Eigen::VectorXd correction(rows.size());
  std::vector<size_t> slots(
      coarse.pressures_kPa.size());  // the lowest pressure first: each solution begins at the last
  std::iota(slots.begin(), slots.end(), size_t{0});
  std::ranges::sort(slots, {}, [&](size_t slot) { return std::abs(coarse.pressures_kPa[slot]); });
  for (const size_t slot : slots) {
    const MotionOutcome outcome = finer.solve(slot, coarse.values, coarse.pressures_kPa[slot]);
    if (!outcome.position_mm) return {};
    const NodeField fine_mm = difference(*outcome.position_mm, finer.mesh().reference());
    const NodeField coarse_mm = difference(coarse.position_mm[slot], coarse.mesh.reference());
    const NodeField* const fine[] = {&fine_mm};
    const NodeField* const own[] = {&coarse_mm};
    auto here = correction.segment(rows.first(slot), rows.count(slot));
    here = there.columns(slot, finer.mesh(), fine) - rows.columns(slot, coarse.mesh, own);
    for (Eigen::Index i = 0; i < here.size(); ++i)
      if (there.rows()[static_cast<size_t>(rows.first(slot) + i)].by_motion.isZero()) here[i] = 0.0;
  }
  return correction;
}

}  // namespace diastole
