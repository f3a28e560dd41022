#pragma once
// Displacement fields over a mesh as vectors of free unknowns, and linear functionals of them.
//
// A field's unknowns are the 24 nodal numbers of estimator/mesh/hermite_mesh.hpp without those that a collapsed
// edge ties to others or holds at zero. In an element the field has 192 local coefficients, 3 a + i for function a
// and component i; coefficient = scale(e, a) * nodal value, exactly as HermiteMesh::gather makes it.

#include <Eigen/Dense>
#include <Eigen/Sparse>
#include <array>
#include <memory>
#include <span>
#include <vector>

#include "estimator/mesh/hermite_mesh.hpp"
#include "estimator/sparse/sparse_cholesky.hpp"

namespace diastole {

inline constexpr size_t element_coefficients = 3 * hermite_functions;
using ElementRow = Eigen::Matrix<double, static_cast<int>(element_coefficients), 1>;
using ElementMatrix = Eigen::MatrixXd;  ///< 192 x 192

/// L(u) = coefficients · (local coefficients of u in one element).
struct Functional {
  size_t element = 0;
  ElementRow coefficients;
};

class FieldSpace {
 public:
  /// The mesh must outlive this object.
  explicit FieldSpace(const HermiteMesh& mesh);

  [[nodiscard]] const HermiteMesh& mesh() const { return mesh_; }
  [[nodiscard]] Eigen::Index unknowns() const { return unknowns_; }
  /// The unknown behind each local coefficient of an element, or -1 where it is zero.
  [[nodiscard]] const std::array<int, element_coefficients>& element_unknowns(size_t element) const {
    return element_unknowns_[element];
  }
  [[nodiscard]] NodeField field_of(const Eigen::VectorXd& q) const;
  [[nodiscard]] Eigen::VectorXd unknowns_of(std::span<const double> field) const;
  /// The vector c with L(u) = c · q.
  void add_to(Eigen::Ref<Eigen::VectorXd> c, const Functional& functional) const;

 private:
  const HermiteMesh& mesh_;
  Eigen::Index unknowns_ = 0;
  std::vector<int> unknown_of_dof_;
  std::vector<std::array<int, element_coefficients>> element_unknowns_;
};

/// direction · u(point).
Functional displacement_along(const HermiteMesh& mesh, const MaterialPoint& point,
                              const Eigen::Vector3d& direction);
/// d(det F) = cof F : grad u, at deformed positions `position_mm`; dimensionless (u in mm).
Functional volume_change(const HermiteMesh& mesh, std::span<const double> position_mm,
                         const MaterialPoint& point);

/// The sparsity that every quadratic form made of element matrices has, and forms over it (upper triangles).
class QuadraticForms {
 public:
  explicit QuadraticForms(const FieldSpace& space);

  using Values = std::vector<double>;
  [[nodiscard]] Values zero() const { return Values(static_cast<size_t>(pattern_.nonZeros()), 0.0); }
  /// Adds a symmetric element matrix (its lower triangle is read).
  void add(Values& values, size_t element, const ElementMatrix& matrix) const;
  /// K q.
  [[nodiscard]] Eigen::VectorXd times(const Values& values, const Eigen::VectorXd& q) const;
  /// qᵀ K q.
  [[nodiscard]] double apply(const Values& values, const Eigen::VectorXd& q) const;

  /// Of matrices with such values.
  [[nodiscard]] std::shared_ptr<const CholeskyPattern> factor_pattern() const;

 private:
  struct Place {
    int index;     ///< among the values; -1 where nothing is
    float factor;  ///< 2 where two entries of an element fall on one diagonal entry
  };
  Eigen::SparseMatrix<double> pattern_;     // upper triangle
  std::vector<std::vector<Place>> places_;  ///< of each element's lower triangle, row by row
};

}  // namespace diastole
