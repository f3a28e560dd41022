#include "tests/estimator/explain/simulated_tags.hpp"

#include <cmath>
#include <numbers>
#include <optional>
#include <random>
#include <stdexcept>

#include "estimator/fe/elastic_system.hpp"
#include "estimator/fe/gauss_points.hpp"
#include "estimator/mesh/annulus.hpp"
#include "estimator/model/inclusion_stiffness.hpp"
#include "estimator/motion_residuals/tag_match.hpp"

namespace diastole::explain {
namespace {

using Eigen::Index;
using Eigen::Vector3d;

constexpr std::array<double, 5> shares{0.2, 0.4, 0.6, 0.8, 1.0};
constexpr double degree = std::numbers::pi / 180.0;

/// Positions in each loaded frame, and the mesh that they are of.
struct Motion {
  HermiteMesh mesh;
  std::vector<NodeField> seen_mm;
};

ElasticState with_moved_top(const HermiteMesh& mesh, ElasticState state, const OutsideMotion& outside,
                            double share) {
  HeldDofs top = hold_nothing(mesh);
  hold_face(mesh, mesh.faces().top, top);
  const double angle = share * outside.twist_deg * degree;
  Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
  turn.topLeftCorner<2, 2>() << std::cos(angle), -std::sin(angle), std::sin(angle), std::cos(angle);
  for (size_t node = 0; node < mesh.node_count(); ++node) {
    for (size_t d = 0; d < nodal_derivatives; ++d) {
      Vector3d here;
      for (size_t i = 0; i < 3; ++i)
        here[static_cast<Index>(i)] = mesh.reference()[dof_of(node, d, i)];
      Vector3d there = turn * here;
      if (d == 0) there += share * Vector3d(outside.shift_mm[0], outside.shift_mm[1], 0.0);
      for (size_t i = 0; i < 3; ++i)
        if (top[dof_of(node, d, i)] != 0)
          state.position_mm[dof_of(node, d, i)] = there[static_cast<Index>(i)];
    }
  }
  return state;
}

/// Linear response to a force along x on all of the body.
NodeField sag(FieldSolver& solver, size_t slot) {
  const ElasticSystem& system = solver.elastic().system();
  std::vector<double> target(solver.elastic().dofs(), 0.0);
  for (size_t e = 0; e < system.mesh().element_count(); ++e) {
    ElementField force = ElementField::Zero();
    for (size_t q = 0; q < gauss_points; ++q) {
      const MaterialPoint point{e, gauss_tables().xi[q]};
      const double volume = gauss_tables().weight[q] *
                            system.mesh().xi_gradient(system.mesh().reference(), point).determinant();
      const HermiteBasis basis = hermite_basis(point.xi);
      for (size_t a = 0; a < hermite_functions; ++a)
        force(0, static_cast<Index>(a)) += volume * basis.value[a];
    }
    system.equations().add_force(e, force, target);
  }
  return solver.responses(slot, {target}).front();
}

Motion motion_by_solver(const SimulatedTags& wanted, std::array<size_t, 3> elements) {
  FieldSolver solver(elements, {});
  solver.set(wanted.truth, wanted.C1_kPa);
  Motion motion{solver.mesh(), {}};
  const OutsideMotion& outside = wanted.outside;
  const bool moves = outside.twist_deg != 0.0 || outside.shift_mm != std::array<double, 2>{};
  for (size_t slot = 0; slot < shares.size(); ++slot) {
    const double pressure_kPa = shares[slot] * wanted.highest_kPa;
    if (!solver.solve(slot, pressure_kPa)) throw std::runtime_error("no equilibrium");
    NodeField seen = solver.seen_displacement_mm(slot);
    if (moves) {
      const Solution moved = solver.elastic().solve(
          pressure_kPa, with_moved_top(motion.mesh, solver.state(slot), outside, shares[slot]));
      if (!moved.report.converged()) throw std::runtime_error("no equilibrium with the plate moved");
      seen = moved.state.position_mm;
      for (size_t dof = 0; dof < seen.size(); ++dof)
        seen[dof] -= motion.mesh.reference()[dof];
    }
    if (outside.body_force_kPa_per_mm != 0.0) {
      const NodeField sagging = sag(solver, slot);
      for (size_t dof = 0; dof < seen.size(); ++dof)
        seen[dof] += shares[slot] * outside.body_force_kPa_per_mm * sagging[dof];
    }
    for (size_t dof = 0; dof < seen.size(); ++dof)
      seen[dof] += motion.mesh.reference()[dof];
    motion.seen_mm.push_back(std::move(seen));
  }
  return motion;
}

/// On a mesh that is fine at the inclusion and fits it in another way than inclusion_fit's.
Motion motion_around(const SimulatedTags& wanted, const Inclusion& inclusion) {
  AnnulusGrid grid;
  for (const double offset_deg :
       {-150.0, -105.0, -65.0, -40.0, -24.0, -12.0, 0.0, 12.0, 24.0, 40.0, 65.0, 105.0})
    grid.angles_deg.push_back(inclusion.theta_deg + offset_deg + 5.0);
  const FieldModel& body = wanted.truth;
  for (const double share : {-0.5, -0.42, -0.3, -0.2, -0.1, 0.0, 0.1, 0.2, 0.3, 0.42, 0.5})
    grid.heights_mm.push_back(share * body.height_mm);
  for (const double depth : {0.0, 0.3, 0.65, 1.0})
    grid.radii_mm.push_back(std::lerp(body.inner_radius_mm, body.outer_radius_mm, depth));
  ElasticOptions options;
  options.parameters = {wanted.C1_kPa};
  options.stiffness = stiffness_field(inclusion);
  ElasticModel model(make_annulus_on(grid), *find_law("neo-hookean"), std::move(options));
  Motion motion{model.mesh(), {}};
  Solution solution = model.solve(shares[0] * wanted.highest_kPa);
  for (const double share : shares) {
    solution = model.solve(share * wanted.highest_kPa, solution.state);
    if (!solution.report.converged()) throw std::runtime_error("no equilibrium with the inclusion");
    motion.seen_mm.push_back(solution.state.position_mm);
  }
  return motion;
}

bool alone(const FieldModel& model) {
  FieldModel without = model;
  without.inclusion.reset();
  return without == FieldModel{};
}

Motion motion_of(const SimulatedTags& wanted) {
  const OutsideMotion& outside = wanted.outside;
  if (wanted.truth.inclusion && alone(wanted.truth)) return motion_around(wanted, *wanted.truth.inclusion);
  if (wanted.truth.inclusion) return motion_by_solver(wanted, {14, 8, 3});
  const bool even = outside.shift_mm == std::array<double, 2>{} && outside.body_force_kPa_per_mm == 0.0;
  return motion_by_solver(wanted, even ? std::array<size_t, 3>{4, 10, 4} : std::array<size_t, 3>{10, 8, 2});
}

/// Where stripes may be: a slice's point for two random numbers, its normals.
struct Slice {
  bool short_axis;
  double z_mm;       ///< short axis
  double angle_deg;  ///< long axis
  [[nodiscard]] Vector3d across() const {
    return {std::cos(angle_deg * degree), std::sin(angle_deg * degree), 0.0};
  }
};

class Camera {
 public:
  Camera(const SimulatedTags& wanted, const Motion& motion)
      : wanted_(wanted),
        motion_(motion),
        random_(wanted.seed),
        reference_(motion.mesh, motion.mesh.reference()) {
    for (int i = 0; i < 6; ++i) {
      slices_.push_back({true, wanted.truth.height_mm * (i - 2.5) / 6.5, 0.0});
      slices_.push_back({false, 0.0, 30.0 * i});
    }
    for (double& phase : phase_mm_)
      phase = 5.0 * share_(random_);
  }

  void take(int frame, const NodeField& seen_mm, std::vector<TagPoint>& tags) {
    const PointLocator deformed(motion_.mesh, seen_mm);
    for (size_t accepted = 0; accepted < wanted_.tags;) {
      if (auto tag = one(frame, deformed)) {
        tags.push_back(*tag);
        ++accepted;
      }
    }
  }

  std::mt19937& random() { return random_; }

 private:
  [[nodiscard]] std::optional<TagPoint> one(int frame, const PointLocator& deformed) {
    const auto index = static_cast<size_t>(12.0 * share_(random_)) % slices_.size();
    const Slice& slice = slices_[index];
    const bool other = share_(random_) < 0.5;
    const double radius_mm = wanted_.truth.outer_radius_mm + 4.0;
    Vector3d place;
    Vector3d normal;
    if (slice.short_axis) {
      place = {radius_mm * (2.0 * share_(random_) - 1.0), radius_mm * (2.0 * share_(random_) - 1.0),
               slice.z_mm};
      normal = Vector3d(1.0, other ? -1.0 : 1.0, 0.0) / std::numbers::sqrt2;
    } else {
      place = radius_mm * (2.0 * share_(random_) - 1.0) * slice.across();
      place[2] = wanted_.truth.height_mm * (share_(random_) - 0.5);
      normal = (slice.across() + (other ? -1.0 : 1.0) * Vector3d::UnitZ()) / std::numbers::sqrt2;
    }
    const auto material = deformed.find(place);
    if (!material || material->overshoot_xi > 0.0) return {};
    const Vector3d X_mm = motion_.mesh.value(motion_.mesh.reference(), material->point);
    const double phase_mm = phase_mm_[2 * index + (other ? 1 : 0)];
    const double plane_mm = phase_mm + 5.0 * std::round((normal.dot(X_mm) - phase_mm) / 5.0);
    TagPoint tag{
        frame, {normal[0], normal[1], normal[2]}, plane_mm, {place[0], place[1], place[2]}, wanted_.sigma_mm};
    const auto match = match_tag(reference_, deformed.elements(), tag, material->point);
    if (!match) return {};
    const Vector3d on_stripe = motion_.mesh.value(motion_.mesh.reference(), match->point);
    const double depth_mm = std::hypot(on_stripe[0], on_stripe[1]);
    constexpr double margin_mm = 1.0;
    if (depth_mm < wanted_.truth.inner_radius_mm + margin_mm ||
        depth_mm > wanted_.truth.outer_radius_mm - margin_mm ||
        std::abs(on_stripe[2]) > 0.5 * wanted_.truth.height_mm - margin_mm)
      return {};
    const double error_mm = wanted_.sigma_mm * normal_(random_) - match->error_mm;
    for (size_t i = 0; i < 3; ++i)
      tag.x_mm[i] += error_mm * tag.normal[i];
    return tag;
  }

  const SimulatedTags& wanted_;
  const Motion& motion_;
  std::mt19937 random_;
  std::uniform_real_distribution<double> share_{0.0, 1.0};
  std::normal_distribution<double> normal_;
  PointLocator reference_;
  std::vector<Slice> slices_;
  std::array<double, 24> phase_mm_{};
};

}  // namespace

FieldCase simulated_tags(const SimulatedTags& wanted) {
  constexpr double sigma_kPa = 0.02;
  const Motion motion = motion_of(wanted);
  FieldCase result;
  Camera camera(wanted, motion);
  std::normal_distribution<double> normal;
  result.measurement.frames.push_back({0.0, 0.0, sigma_kPa});
  camera.take(0, motion.mesh.reference(), result.measurement.tags);
  for (size_t slot = 0; slot < shares.size(); ++slot) {
    const int frame = static_cast<int>(slot) + 1;
    const double pressure_kPa = shares[slot] * wanted.highest_kPa + sigma_kPa * normal(camera.random());
    result.measurement.frames.push_back({0.1 * frame, pressure_kPa, sigma_kPa});
    camera.take(frame, motion.seen_mm[slot], result.measurement.tags);
  }
  result.C1_start_kPa = {6.0, 0.0};
  result.C1_bounds_kPa = {1.0, 15.0};
  if (wanted.C1_known) {
    const double sigma = 0.007 * wanted.C1_kPa;
    result.C1_start_kPa = {wanted.C1_kPa + sigma * normal(camera.random()), sigma};
    result.C1_bounds_kPa = {0.2 * wanted.C1_kPa, 5.0 * wanted.C1_kPa};
  }
  result.inner_radius_mm = seen_inner_radius(result.measurement, result.base.outer_radius_mm);
  return result;
}

}  // namespace diastole::explain
