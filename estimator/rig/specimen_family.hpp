#pragma once
// The pressure-volume curves of a study's specimen and of its neighbours: what finite elasticity says about another
// inner radius, a stiffening law, ends that slip. All at a modulus of 1 kPa, computed once each and kept.
//
// The plain curve comes from a fine mesh; neighbours differ from it by what they differ on a coarse mesh, and between
// the computed ones by a polynomial. A cylinder is symmetric about its axis, so that four elements around it are enough:
// shapes agree with those of finer meshes within 1e-4.

#include <array>
#include <cstddef>
#include <functional>
#include <map>
#include <mutex>
#include <string>
#include <vector>

#include "estimator/io/study.hpp"
#include "estimator/rig/specimen_curve.hpp"

namespace diastole::rig {

/// How finely curves are computed. A cylinder's meshes are these; another specimen has its own.
struct SpecimenResolution {
  std::array<int, 3> fine{4, 10, 3};
  std::array<int, 3> coarse{4, 4, 1};
  double spacing_mL = 4.0;
  size_t points_inflated = 14;
  size_t points_emptied = 4;
};

class SpecimenFamily {
 public:
  /// Throws InputError if the study's law or mesh is wrong or the cavity is open.
  explicit SpecimenFamily(Study study, const SpecimenResolution& resolution = {});

  /// Of the study's own specimen and law, its parameters at their starts divided by the modulus.
  [[nodiscard]] const SpecimenCurve& plain() const;
  /// The first parameter of the law in kPa: all of the law's moduli are scaled with it.
  [[nodiscard]] double modulus_start_kPa() const { return modulus_kPa_; }
  [[nodiscard]] const StudyParameter& modulus() const;

  /// Neighbours exist for a cylinder of neo-Hookean material.
  [[nodiscard]] bool has_neighbours() const;
  /// The inner radius is larger by this part, within +-0.1.
  [[nodiscard]] SpecimenCurve with_inner_radius(double fraction) const;
  /// W = C1/beta (exp(beta (I1 - 3)) - 1), beta in [0, 3].
  [[nodiscard]] SpecimenCurve stiffened(double beta) const;
  /// The plates hold the ends along the axis; across it they yield by this compliance times C1, mm.
  [[nodiscard]] SpecimenCurve slipping(double compliance_mm) const;

 private:
  using Neighbour = std::function<Study(double)>;
  [[nodiscard]] const SpecimenCurve& computed(const std::string& name, const Study& study) const;
  /// plain() and the coarse meshes' difference between neighbour and plain, at `value`, by the polynomial through `nodes`.
  [[nodiscard]] SpecimenCurve between(const std::string& name, const std::vector<double>& nodes, double value,
                                      const Neighbour& neighbour) const;

  [[nodiscard]] SpecimenCurve compute(const Study& study) const;

  Study study_;
  SpecimenResolution resolution_;
  double modulus_kPa_ = 1.0;
  size_t modulus_index_ = 0;
  mutable std::mutex mutex_;
  mutable std::map<std::string, SpecimenCurve> curves_;
};

}  // namespace diastole::rig
