#pragma once
// The factor of an elastic system's tangent, in whichever form the problem at hand needs:
//
//   condensed              cavity pressure given, material incompressible, equilibrium stable (condensed_factor.hpp)
//   symmetric              cavity pressure given, otherwise
//   symmetric, one larger  cavity volume given: the cavity's row and column added
//   general                a fluid's surface has a free rim, and the tangent a skew part there
//
// Each form's ordering is found when it is first used.

#include <memory>
#include <span>
#include <vector>

#include "estimator/fe/equation_system.hpp"
#include "estimator/fe/face_edge.hpp"
#include "estimator/fe/sparse_factor.hpp"

namespace diastole {

class CondensedFactor;
class CondensedPattern;

/// The skew part that the free rims of a fluid's surface add to the tangent (face_edge.hpp), as triplets.
class RimSkew {
 public:
  RimSkew(const EquationSystem& equations, std::vector<FaceEdge> rim);

  [[nodiscard]] bool empty() const { return rim_.empty(); }
  /// One half of the skew matrix, equations counted from 0; the other half is minus its mirror image.
  [[nodiscard]] std::span<const int> rows() const { return rows_; }
  [[nodiscard]] std::span<const int> columns() const { return columns_; }
  /// factor * skew, one number for each triplet.
  [[nodiscard]] std::vector<double> values(const HermiteMesh& mesh, const NodeField& position_mm,
                                           double factor) const;

 private:
  /// A pair of the edge's dofs 3 a + i that both have an equation.
  struct Pair {
    size_t edge;
    size_t row;
    size_t column;
  };
  std::vector<FaceEdge> rim_;
  std::vector<Pair> pairs_;
  std::vector<int> rows_;
  std::vector<int> columns_;
};

class TangentFactor {
 public:
  TangentFactor(std::shared_ptr<const EquationSystem> equations, std::shared_ptr<const RimSkew> skew)
      : equations_(std::move(equations)), skew_(std::move(skew)) {}
  /// The copy shares the ordering of condensed tangents and a condensed factor; other forms it factorises anew.
  TangentFactor(const TangentFactor& other)
      : equations_(other.equations_),
        skew_(other.skew_),
        may_condense_(other.may_condense_),
        pattern_(other.pattern_),
        condensed_(other.condensed_) {}
  TangentFactor& operator=(const TangentFactor&) = delete;

  /// `values`: one for each of equations.entries(cavity_held). solve() uses this factor until the next call.
  FactorResult factorise_symmetric(std::span<double> values, bool cavity_held);
  /// The same with the rim's skew part, `skew` having one number for each of its triplets. Negative pivots are not
  /// counted.
  FactorResult factorise_general(std::span<const double> values, std::span<const double> skew);

  void solve(std::span<double> right_sides, size_t count);
  /// Numbers stored in the last factor; 0 before there is one.
  [[nodiscard]] size_t entries() const;

  /// The factor that solve() uses, to be used again later; none if it is not condensed.
  [[nodiscard]] std::shared_ptr<const CondensedFactor> kept() const { return condensed_; }
  /// Lets solve() use a factor that was kept until the next call of another function.
  void use(std::shared_ptr<const CondensedFactor> factor) { condensed_ = std::move(factor); }

 private:
  /// Whether tangents of given cavity pressure have a pattern that can be condensed.
  bool may_condense();
  void prepare_general();

  std::shared_ptr<const EquationSystem> equations_;
  std::shared_ptr<const RimSkew> skew_;
  bool may_condense_ = true;
  std::shared_ptr<CondensedPattern> pattern_;
  std::shared_ptr<const CondensedFactor> condensed_;  // in use, if there is one
  std::unique_ptr<SparseFactor> pressure_given_;
  std::unique_ptr<SparseFactor> volume_given_;
  std::unique_ptr<SparseFactor> general_;
  std::vector<int> general_rows_;
  std::vector<int> general_columns_;
  std::vector<double> general_values_;
  SparseFactor* current_ = nullptr;
};

}  // namespace diastole
