#pragma once
// The pressure-volume curves of a study's specimen and of its neighbours: what finite elasticity says about another
// inner radius, a stiffening law, ends that slip. All at a modulus of 1 kPa, computed once each and kept, a cylinder's in
// the user's cache too (estimator/io/cache.hpp).
//
// A cylinder's plain curve comes from a coarse mesh at all volumes and from a fine one at every fourth: their difference
// is so smooth that the curve is the fine mesh's within 1e-6 of its pressure. Neighbours differ from it by what they
// differ on the coarse mesh, at every fourth volume too, and between the computed ones by a polynomial. A cylinder is
// symmetric about its axis, so that four elements around it are enough: shapes agree with those of finer meshes within
// 2e-5.

#include <array>
#include <cstddef>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "estimator/io/study.hpp"
#include "estimator/rig/specimen_curve.hpp"

namespace diastole::rig {

/// How finely curves are computed. A cylinder's meshes are these; another specimen has its own.
struct SpecimenResolution {
  std::array<int, 3> fine{4, 10, 2};
  std::array<int, 3> coarse{4, 4, 1};
  double spacing_mL = 3.5;
  size_t points_inflated = 16;
  size_t points_emptied = 4;
  size_t stride = 4;  ///< between volumes at which meshes are compared; divides both numbers of points

  /// The same with more points, up to a larger volume, if need be: curves go on straight beyond their ends. No wider ones: emptied as far
  /// as it is to be filled no cavity is a body any more.
  [[nodiscard]] SpecimenResolution reaching(double volume_mL) const;
};

/// How far a specimen was filled from rest.
struct SpecimenReach {
  double volume_mL = 0.0;
  double pressure_kPa = 0.0;
  bool is_end = false;  ///< beyond there is no equilibrium, or the pressure rises no further
};

class SpecimenFamily final : public SpecimenCurves {
 public:
  /// Throws InputError if the study's law or mesh is wrong or the cavity is open.
  explicit SpecimenFamily(Study study, const SpecimenResolution& resolution = {});

  /// Of the study's own specimen and law, its parameters at their starts divided by the modulus.
  [[nodiscard]] const SpecimenCurve& plain() const override;
  /// Begins to compute plain() and the low-fidelity neighbours beside other work, so that they are at hand when asked for. One
  /// thread: the other work has the rest. Stopped by the destructor, after the curve at work.
  void compute_ahead();
  /// To the first of the volumes at which meshes are compared that is no less than `volume_mL` or at which it holds `pressure_kPa`, or to the
  /// last one before it ends. Of a cylinder on the coarse mesh; not kept.
  [[nodiscard]] SpecimenReach reach(double volume_mL, double pressure_kPa) const;
  /// The first parameter of the law in kPa: all of the law's moduli are scaled with it.
  [[nodiscard]] double modulus_start_kPa() const { return modulus_kPa_; }
  [[nodiscard]] const StudyParameter& modulus() const;

  [[nodiscard]] bool has_neighbours() const override;
  [[nodiscard]] SpecimenCurve neighbour(Difference what, double value, bool low_fidelity) const override;

 private:
  /// Specimens that differ by one value.
  struct Neighbours {
    std::string name;
    std::vector<double> nodes;  ///< values at which they are solved for; 0 is the plain one
    double refined_at = 0.0;  ///< a node for which the fine mesh is asked too; 0 if the coarse one is enough
    std::function<void(double, Study&)> change;
  };
  static Neighbours of(Difference what);
  /// At every `stride`-th volume; kept by its name.
  [[nodiscard]] const SpecimenCurve& computed(const std::string& name, const Study& study,
                                              size_t stride) const;
  /// A neighbour at one of its nodes.
  [[nodiscard]] const SpecimenCurve& solved(const Neighbours& of, double node,
                                            const std::array<int, 3>& mesh) const;
  /// The study's cylinder on another mesh.
  [[nodiscard]] Study on(const std::array<int, 3>& mesh) const;
  /// What plain() returns.
  [[nodiscard]] SpecimenCurve combined() const;
  /// plain() and what the neighbour differs from it on the coarse mesh, at `value` by the polynomial through the nodes;
  /// what the fine mesh changes at one node is taken as a constant part of the difference.
  [[nodiscard]] SpecimenCurve between(const Neighbours& of, double value, bool low_fidelity) const;
  [[nodiscard]] SpecimenCurve compute(const Study& study, size_t stride) const;

  Study study_;
  SpecimenResolution resolution_;
  double modulus_kPa_ = 1.0;
  double solved_at_kPa_ = 1.0;  ///< the modulus in study_
  size_t modulus_index_ = 0;
  static inline std::mutex
      solving_;  ///< held while finite elements are solved: the solver below bears one at a time
  mutable std::mutex keeping_;  ///< held while curves_ or plain_ are looked at or added to
  mutable std::map<std::string, SpecimenCurve> curves_;  ///< that were solved for
  mutable std::optional<SpecimenCurve> plain_;
  std::jthread ahead_;
};

}  // namespace diastole::rig
