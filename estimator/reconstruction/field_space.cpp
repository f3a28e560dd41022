#include "estimator/reconstruction/field_space.hpp"

#include <algorithm>
#include <stdexcept>

namespace diastole {
namespace {

constexpr Eigen::Index local(size_t function, size_t component) {
  return static_cast<Eigen::Index>(3 * function + component);
}

}  // namespace

FieldSpace::FieldSpace(const HermiteMesh& mesh)
    : mesh_(mesh), unknown_of_dof_(mesh.node_count() * dofs_per_node, 0) {
  for (const size_t dof : mesh.ties().zero)
    unknown_of_dof_[dof] = -1;
  for (const auto& [dof, other] : mesh.ties().same)
    unknown_of_dof_[dof] = -1;
  int next = 0;
  for (int& unknown : unknown_of_dof_) {
    if (unknown == 0) unknown = next++;
  }
  for (const auto& [dof, other] : mesh.ties().same)
    unknown_of_dof_[dof] = unknown_of_dof_[other];
  unknowns_ = next;
  for (size_t e = 0; e < mesh.element_count(); ++e) {
    auto& unknowns = element_unknowns_.emplace_back();
    for (size_t a = 0; a < hermite_functions; ++a) {
      for (size_t i = 0; i < 3; ++i) {
        unknowns[3 * a + i] =
            unknown_of_dof_[dof_of(mesh.element(e)[hermite_corner(a)], hermite_derivative(a), i)];
      }
    }
  }
}

NodeField FieldSpace::field_of(const Eigen::VectorXd& q) const {
  NodeField field(unknown_of_dof_.size(), 0.0);
  for (size_t dof = 0; dof < field.size(); ++dof) {
    if (unknown_of_dof_[dof] >= 0) field[dof] = q[unknown_of_dof_[dof]];
  }
  return field;
}

Eigen::VectorXd FieldSpace::unknowns_of(std::span<const double> field) const {
  Eigen::VectorXd q(unknowns_);
  for (size_t dof = 0; dof < field.size(); ++dof) {
    if (unknown_of_dof_[dof] >= 0) q[unknown_of_dof_[dof]] = field[dof];
  }
  return q;
}

void FieldSpace::add_to(Eigen::Ref<Eigen::VectorXd> c, const Functional& functional) const {
  const auto& unknowns = element_unknowns_[functional.element];
  for (size_t l = 0; l < element_coefficients; ++l) {
    if (unknowns[l] >= 0) c[unknowns[l]] += functional.coefficients[static_cast<Eigen::Index>(l)];
  }
}

Functional displacement_along(const HermiteMesh& mesh, const MaterialPoint& point,
                              const Eigen::Vector3d& direction) {
  const HermiteBasis basis = hermite_basis(point.xi);
  Functional functional{point.element, {}};
  for (size_t a = 0; a < hermite_functions; ++a) {
    const double value = mesh.scale(point.element, a) * basis.value[a];
    functional.coefficients.segment<3>(local(a, 0)) = value * direction;
  }
  return functional;
}

Functional volume_change(const HermiteMesh& mesh, std::span<const double> position_mm,
                         const MaterialPoint& point) {
  const Eigen::Matrix3d to_reference = mesh.xi_gradient(mesh.reference(), point).inverse();
  const Eigen::Matrix3d F = mesh.xi_gradient(position_mm, point) * to_reference;
  const Eigen::Matrix3d cofactor = F.determinant() * F.inverse().transpose();
  const HermiteBasis basis = hermite_basis(point.xi);
  Functional functional{point.element, {}};
  for (size_t a = 0; a < hermite_functions; ++a) {
    const Eigen::Vector3d slope(basis.slope[0][a], basis.slope[1][a], basis.slope[2][a]);
    functional.coefficients.segment<3>(local(a, 0)) =
        mesh.scale(point.element, a) * (cofactor * (to_reference.transpose() * slope));
  }
  return functional;
}

QuadraticForms::QuadraticForms(const FieldSpace& space) {
  const size_t elements = space.mesh().element_count();
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(elements * element_coefficients * (element_coefficients + 1) / 2);
  const auto each_pair = [&](size_t e, auto&& visit) {
    const auto& unknowns = space.element_unknowns(e);
    for (size_t row = 0; row < element_coefficients; ++row) {
      for (size_t column = 0; column <= row; ++column)
        visit(unknowns[row], unknowns[column]);
    }
  };
  for (size_t e = 0; e < elements; ++e) {
    each_pair(e, [&](int row, int column) {
      if (row >= 0 && column >= 0) entries.emplace_back(std::min(row, column), std::max(row, column), 0.0);
    });
  }
  pattern_.resize(space.unknowns(), space.unknowns());
  pattern_.setFromTriplets(entries.begin(), entries.end());
  pattern_.makeCompressed();
  for (size_t e = 0; e < elements; ++e) {
    std::vector<Place>& places = places_.emplace_back();
    size_t pair = 0, diagonal = 0;  // counts along the lower triangle, and where its diagonal entries stand
    each_pair(e, [&](int row, int column) {
      const bool own_diagonal = pair == diagonal * (diagonal + 3) / 2;
      if (own_diagonal) ++diagonal;
      ++pair;
      if (row < 0 || column < 0) return places.push_back({-1, 0.0F});
      const int* begin = pattern_.innerIndexPtr() + pattern_.outerIndexPtr()[std::max(row, column)];
      const int* end = pattern_.innerIndexPtr() + pattern_.outerIndexPtr()[std::max(row, column) + 1];
      const int* found = std::lower_bound(begin, end, std::min(row, column));
      // Two coefficients that share an unknown (a collapsed edge): both of their products meet on its diagonal.
      const bool shared = row == column && !own_diagonal;
      places.push_back({static_cast<int>(found - pattern_.innerIndexPtr()), shared ? 2.0F : 1.0F});
    });
  }
}

void QuadraticForms::add(Values& values, size_t element, const ElementMatrix& matrix) const {
  const std::vector<Place>& places = places_[element];
  size_t at = 0;
  for (Eigen::Index row = 0; row < matrix.rows(); ++row) {
    for (Eigen::Index column = 0; column <= row; ++column, ++at) {
      if (places[at].index < 0) continue;
      values[static_cast<size_t>(places[at].index)] +=
          static_cast<double>(places[at].factor) * matrix(row, column);
    }
  }
}

Eigen::VectorXd QuadraticForms::times(const Values& values, const Eigen::VectorXd& q) const {
  const Eigen::Map<const Eigen::SparseMatrix<double>> matrix(pattern_.rows(), pattern_.cols(),
                                                             pattern_.nonZeros(), pattern_.outerIndexPtr(),
                                                             pattern_.innerIndexPtr(), values.data());
  return matrix.selfadjointView<Eigen::Upper>() * q;
}

std::shared_ptr<const CholeskyPattern> QuadraticForms::factor_pattern() const {
  const int* starts = pattern_.outerIndexPtr();
  const int* rows = pattern_.innerIndexPtr();
  auto pattern =
      CholeskyPattern::of({starts, starts + pattern_.cols() + 1}, {rows, rows + pattern_.nonZeros()});
  if (!pattern) throw std::length_error("the mesh is too fine to reconstruct motion on");
  return pattern;
}

double QuadraticForms::apply(const Values& values, const Eigen::VectorXd& q) const {
  return q.dot(times(values, q));
}

}  // namespace diastole
