#include "estimator/reconstruction/coverage.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

namespace diastole {
namespace {

constexpr double low_place = 0.21132486540518712;  // (1 - 1/sqrt 3) / 2

const std::array<std::string, 12> affine_names{"shift along x",    "shift along y",    "shift along z",
                                               "turn about x",     "turn about y",     "turn about z",
                                               "stretch along x",  "stretch along y",  "stretch along z",
                                               "shear of y and z", "shear of x and z", "shear of x and y"};

/// Unknowns of the twelve affine motions, one a column, each of 1 mm RMS over the body.
Eigen::MatrixXd affine_motions(const FieldForms& forms) {
  const HermiteMesh& mesh = forms.space.mesh();
  const NodeField& reference = mesh.reference();
  Eigen::Vector3d centre_mm = Eigen::Vector3d::Zero();
  for (size_t node = 0; node < mesh.node_count(); ++node)
    centre_mm += Eigen::Map<const Eigen::Vector3d>(&reference[dof_of(node, 0, 0)]) /
                 static_cast<double>(mesh.node_count());
  Eigen::MatrixXd motions(forms.space.unknowns(), 12);
  for (size_t mode = 0; mode < 12; ++mode) {
    const auto k = static_cast<Eigen::Index>(mode % 3), next = (k + 1) % 3, after = (k + 2) % 3;
    Eigen::Matrix3d A = Eigen::Matrix3d::Zero();
    if (mode >= 3 && mode < 6) A(next, after) = -1, A(after, next) = 1;
    if (mode >= 6 && mode < 9) A(k, k) = 1;
    if (mode >= 9) A(next, after) = A(after, next) = 1;
    NodeField field(reference.size(), 0.0);
    for (size_t node = 0; node < mesh.node_count(); ++node) {
      for (size_t d = 0; d < nodal_derivatives; ++d) {
        Eigen::Vector3d place = Eigen::Map<const Eigen::Vector3d>(&reference[dof_of(node, d, 0)]);
        if (d == 0) place -= centre_mm;
        Eigen::Map<Eigen::Vector3d> moved(&field[dof_of(node, d, 0)]);
        moved = A * place;
        if (mode < 3 && d == 0) moved[k] = 1.0;
      }
    }
    const Eigen::VectorXd q = forms.space.unknowns_of(field);
    motions.col(static_cast<Eigen::Index>(mode)) =
        q / std::sqrt(forms.quadratic.apply(forms.sobolev.mean_square, q));
  }
  return motions;
}

/// The eight places of an element at which errors are computed.
std::array<Xi, element_probes> probe_places() {
  std::array<Xi, element_probes> places;
  for (size_t p = 0; p < element_probes; ++p) {
    for (size_t k = 0; k < 3; ++k)
      places[p][k] = ((p >> k) & 1) != 0 ? 1.0 - low_place : low_place;
  }
  return places;
}

/// Shares of a motion's mean square along x, y and z.
Eigen::Vector3d shares_along(const FieldForms& forms, const Eigen::VectorXd& q) {
  const HermiteMesh& mesh = forms.space.mesh();
  const NodeField field = forms.space.field_of(q);
  Eigen::Vector3d squares = Eigen::Vector3d::Zero();
  for (size_t e = 0; e < mesh.element_count(); ++e) {
    for (const Xi& xi : probe_places())
      squares += forms.sobolev.element_volume_mm3[e] * mesh.value(field, {e, xi}).cwiseAbs2();
  }
  return squares / squares.sum();
}

std::vector<AffineMode> affine_modes(const FieldForms& forms, const SmoothedSystem& seeing) {
  constexpr double part_of_a_mode = 0.4;
  const Eigen::MatrixXd motions = affine_motions(forms);
  const Eigen::MatrixXd seen = seeing.weighted_rows() * motions;
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> modes(seen.transpose() * seen);
  const double least = 1e-12 * std::max(modes.eigenvalues().maxCoeff(), 1e-300);
  std::vector<AffineMode> result;
  for (Eigen::Index i = 0; i < 12; ++i) {
    const double information = modes.eigenvalues()[i];
    AffineMode mode{
        "", information > least ? 1.0 / std::sqrt(information) : std::numeric_limits<double>::infinity(),
        shares_along(forms, motions * modes.eigenvectors().col(i))};
    for (Eigen::Index part = 0; part < 12; ++part) {
      if (std::abs(modes.eigenvectors()(part, i)) < part_of_a_mode) continue;
      mode.words += (mode.words.empty() ? "" : " and ") + affine_names[static_cast<size_t>(part)];
    }
    if (mode.words.empty()) mode.words = "a mixture of shifts, turns and shears";
    result.push_back(mode);
  }
  return result;
}

std::vector<Functional> probes_of(const HermiteMesh& mesh) {
  std::vector<Functional> functionals;
  for (size_t e = 0; e < mesh.element_count(); ++e) {
    for (const Xi& xi : probe_places()) {
      for (int k = 0; k < 3; ++k)
        functionals.push_back(displacement_along(mesh, {e, xi}, Eigen::Vector3d::Unit(k)));
    }
  }
  return functionals;
}

/// What the rows in each element know, and along which direction they know least.
void count_rows(const FrameField& field, std::vector<ElementCoverage>& elements) {
  std::vector<Eigen::Matrix3d> known(elements.size(), Eigen::Matrix3d::Zero());
  for (const FieldRow& row : field.rows) {
    if (row.rejected) continue;
    ++elements[row.point.element].rows;
    known[row.point.element] += row.normal * row.normal.transpose();
  }
  for (size_t e = 0; e < elements.size(); ++e) {
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> principal(known[e]);
    elements[e].weakest = principal.eigenvectors().col(0);
    elements[e].weakest_rows = std::max(0.0, principal.eigenvalues()[0]);
  }
}

}  // namespace

double between_probes(const std::array<double, element_probes>& values, const Xi& xi) {
  Xi inner{};
  for (size_t k = 0; k < 3; ++k)
    inner[k] = std::clamp((xi[k] - low_place) / (1.0 - 2.0 * low_place), 0.0, 1.0);
  const std::array<double, corners> weights = trilinear_basis(inner);
  double sum = 0.0;
  for (size_t p = 0; p < element_probes; ++p)
    sum += weights[p] * values[p];
  return sum;
}

Coverage coverage_of(const FieldForms& forms, const FrameField& field) {
  const HermiteMesh& mesh = forms.space.mesh();
  Coverage coverage;
  coverage.elements.resize(mesh.element_count());
  count_rows(field, coverage.elements);
  // Along the tags' own normals: what a tag shows of the motion along its plane, where the deformation has turned it, is
  // of second order and no knowledge to build on.
  std::vector<ObservationRow> rows;
  for (const FieldRow& row : field.rows) {
    rows.push_back(
        {displacement_along(mesh, row.point, row.normal), 0.0, row.sigma_mm, row.rejected ? 0.0 : 1.0});
  }
  SmoothedSystem seeing(forms);
  seeing.set_rows(rows);
  seeing.factorise_without_smoothness(mode_amplitude_mm);
  coverage.affine_modes = affine_modes(forms, seeing);
  coverage.modes = static_cast<size_t>(forms.space.unknowns());
  coverage.modes_seen = stochastic_trace(seeing, seen_signs(seeing));

  const std::vector<Functional> probes = probes_of(mesh);
  const std::vector<double> with_smoothness = field.system->variances(probes);
  const std::vector<double> with_tags = seeing.variances(probes);
  SmoothedSystem without(forms);
  without.set_rows({});
  without.factorise_without_smoothness(mode_amplitude_mm);
  const std::vector<double> without_tags = without.variances(probes);

  size_t at = 0;
  for (ElementCoverage& element : coverage.elements) {
    double variance = 0.0;
    for (size_t p = 0; p < element_probes; ++p, at += 3) {
      const auto sum = [at](const std::vector<double>& v) { return v[at] + v[at + 1] + v[at + 2]; };
      element.probe_se_mm[p] = std::sqrt(sum(with_smoothness) / 3.0);
      element.probe_unseen[p] = sum(with_tags) / sum(without_tags);
      variance += sum(with_smoothness) / 3.0;
      element.unseen += element.probe_unseen[p] / static_cast<double>(element_probes);
    }
    element.se_mm = std::sqrt(variance / static_cast<double>(element_probes));
  }
  return coverage;
}

}  // namespace diastole
