#include "estimator/explain/imaging/field_modes.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>

#include "estimator/explain/imaging/field_solver.hpp"
#include "estimator/explain/imaging/linear_evidence.hpp"
#include "estimator/fe/elastic_system.hpp"
#include "estimator/fe/gauss_points.hpp"
#include "estimator/mesh/node_field.hpp"
#include "estimator/mesh/wall_coordinates.hpp"

namespace diastole::explain {
namespace {

using Eigen::Index;
using Eigen::Vector3d;

/// A function of the undeformed place, from -1 to 1.
struct Harmonic {
  std::function<double(const WallPlace&)> value;
  std::string name;
  bool smooth;
  bool rough;
};

double legendre(int order, double x) {
  switch (order) {
    case 0:
      return 1.0;
    case 1:
      return x;
    case 2:
      return 1.5 * x * x - 0.5;
    default:
      return 2.5 * x * x * x - 1.5 * x;
  }
}

std::vector<Harmonic> harmonics() {
  std::vector<Harmonic> result;
  for (int turn = 0; turn < 5; ++turn) {
    const int m = (turn + 1) / 2;
    const bool sine = turn > 0 && turn % 2 == 0;
    for (int k = 0; k < 4; ++k) {
      for (int l = 0; l < 2; ++l) {
        const auto value = [=](const WallPlace& place) {
          const double theta = m * place.turn_rad;
          return (sine ? std::sin(theta) : std::cos(theta)) * legendre(k, place.height) *
                 legendre(l, 2.0 * place.depth - 1.0);
        };
        result.push_back(
            {value,
             fmt::format("{} around, order {} along z, {} through the wall",
                         m == 0 ? "even" : fmt::format("{}({} theta)", sine ? "sin" : "cos", m), k, l),
             m + k + l <= 2 && m < 2, m + k + l >= 4});
      }
    }
  }
  return result;
}

/// Held dofs of the top face moved by a rigid motion: 0-2 along x, y, z, 3-5 about them (by one radian).
NodeField rigid(const HermiteMesh& mesh, const NodeField& position_mm, size_t motion,
                const std::vector<unsigned char>& moved) {
  NodeField field(position_mm.size(), 0.0);
  for (size_t node = 0; node < mesh.node_count(); ++node) {
    for (size_t d = 0; d < nodal_derivatives; ++d) {
      Vector3d change = Vector3d::Zero();
      if (motion < 3) {
        if (d == 0) change[static_cast<Index>(motion)] = 1.0;
      } else {
        const Vector3d here(position_mm[dof_of(node, d, 0)], position_mm[dof_of(node, d, 1)],
                            position_mm[dof_of(node, d, 2)]);
        change = Vector3d::Unit(static_cast<Index>(motion - 3)).cross(here);
      }
      for (size_t i = 0; i < 3; ++i)
        if (moved[dof_of(node, d, i)] != 0) field[dof_of(node, d, i)] = change[static_cast<Index>(i)];
    }
  }
  return field;
}

std::vector<unsigned char> held_at_top(const ElasticSystem& system) {
  HeldDofs top = hold_nothing(system.mesh());
  hold_face(system.mesh(), system.mesh().faces().top, top);
  return top;
}

/// - K w over the free unknowns, by the residual's central difference.
std::vector<double> resistance(const ElasticSystem& system, const ElasticState& state,
                               const NodeField& motion) {
  constexpr double step = 1e-4;
  ElasticState up = state;
  ElasticState down = state;
  add_scaled(up.position_mm, step, motion);
  add_scaled(down.position_mm, -step, motion);
  std::vector<double> result = system.residual(down).values;
  const std::vector<double> above = system.residual(up).values;
  for (size_t i = 0; i < result.size(); ++i)
    result[i] = (result[i] - above[i]) / (2.0 * step);
  return result;
}

/// Sum over the Gauss points of  direction * N_a dV.
std::vector<double> body_force(const ElasticSystem& system, size_t unknowns, const Vector3d& direction) {
  std::vector<double> target(unknowns, 0.0);
  const GaussTables& tables = gauss_tables();
  for (size_t e = 0; e < system.mesh().element_count(); ++e) {
    ElementField force = ElementField::Zero();
    for (size_t q = 0; q < gauss_points; ++q) {
      const MaterialPoint point{e, tables.xi[q]};
      const double volume =
          tables.weight[q] * system.mesh().xi_gradient(system.mesh().reference(), point).determinant();
      const HermiteBasis basis = hermite_basis(point.xi);
      for (size_t a = 0; a < hermite_functions; ++a)
        force.col(static_cast<Index>(a)) += volume * basis.value[a] * direction;
    }
    system.equations().add_force(e, force, target);
  }
  return target;
}

class Builder {
 public:
  Builder(const MotionResiduals& rows, ElasticModel& body, const ElasticState& state,
          const std::vector<double>& pressures_kPa)
      : rows_(rows),
        body_(body),
        state_(state),
        pressures_kPa_(pressures_kPa),
        wall_(body.mesh()),
        harmonics_(harmonics()) {}

  FieldModes build() {
    describe();
    FieldModes result{modes_, Eigen::MatrixXd::Zero(rows_.size(), static_cast<Index>(modes_.size()))};
    const std::vector<NodeField> fields = elastic_fields();
    for (size_t slot = 0; slot < pressures_kPa_.size(); ++slot)
      fill(slot, fields, result.columns);
    return possible(std::move(result));
  }

 private:
  static constexpr size_t rigid_motions = 6;
  static constexpr size_t courses = 2;
  static constexpr size_t driven = 2 * rigid_motions + 3;  // in a course: plates, pose, body force

  /// Of a body that hangs from one end no plate moves against the other, and how that end moves with the load is an effect.
  [[nodiscard]] FieldModes possible(FieldModes all) const {
    const MeshFaces& faces = body_.mesh().faces();
    if (!faces.bottom.empty() && !faces.top.empty()) return all;
    FieldModes result;
    std::vector<Index> kept;
    for (size_t i = 0; i < all.modes.size(); ++i) {
      const size_t course = i / driven;
      const size_t in_course = i % driven;
      const bool moves_with_the_load =
          course == 0 && in_course >= rigid_motions && in_course < rigid_motions + 3;
      if (all.modes[i].family == "plates" || moves_with_the_load) continue;
      kept.push_back(static_cast<Index>(i));
      result.modes.push_back(all.modes[i]);
    }
    result.columns = all.columns(Eigen::all, kept);
    return result;
  }

  void describe() {
    static constexpr std::array<const char*, rigid_motions> motions{
        "moves along x", "moves along y", "moves along z", "turns about x", "turns about y", "turns about z"};
    static constexpr std::array<const char*, courses> course{"with the load",
                                                             "from the first loaded frame on"};
    for (size_t c = 0; c < courses; ++c) {
      for (const char* motion : motions)
        modes_.push_back(
            {"plates", fmt::format("the top plate {} against the bottom one, {}", motion, course[c]), true});
      for (const char* motion : motions)
        modes_.push_back({"pose", fmt::format("the whole specimen {}, {}", motion, course[c]), true});
      for (const char axis : {'x', 'y', 'z'})
        modes_.push_back(
            {"body force", fmt::format("a force along {} on all of the body, {}", axis, course[c]), true});
    }
    for (size_t h = 1; h < harmonics_.size(); ++h)
      modes_.push_back({"stiffness", "stiffness: " + harmonics_[h].name, harmonics_[h].smooth});
    static constexpr std::array<const char*, 3> along{"outwards", "around", "along z"};
    for (const char* component : along)
      for (const Harmonic& harmonic : harmonics_)
        modes_.push_back(
            {"motion", fmt::format("motion {}: {}", component, harmonic.name), false, harmonic.rough});
  }

  [[nodiscard]] double course_at(size_t course, size_t slot) const {
    return course == 0
               ? pressures_kPa_[slot] / *std::max_element(pressures_kPa_.begin(), pressures_kPa_.end())
               : 1.0;
  }

  void fill(size_t slot, const std::vector<NodeField>& fields, Eigen::MatrixXd& columns) const {
    const Eigen::MatrixXd elastic = rows_.columns(slot, body_.mesh(), pointers_to(fields));
    const Index first = rows_.first(slot);
    const Index rows = rows_.count(slot);
    constexpr auto of_a_course = static_cast<Index>(driven);
    constexpr Index of_courses = static_cast<Index>(courses) * of_a_course;
    for (size_t c = 0; c < courses; ++c)
      columns.block(first, static_cast<Index>(c) * of_a_course, rows, of_a_course) =
          course_at(c, slot) * elastic.leftCols(of_a_course);
    const Index stiffness = elastic.cols() - of_a_course;
    columns.block(first, of_courses, rows, stiffness) = course_at(0, slot) * elastic.rightCols(stiffness);
    const auto count = static_cast<Index>(harmonics_.size());
    const Index motion = of_courses + stiffness;
    for (Index i = 0; i < rows; ++i) {
      const ResidualRow& row = rows_.rows()[static_cast<size_t>(first + i)];
      const Eigen::RowVector3d along = by_cylindrical_motion(row);
      const WallPlace place = wall_.at(body_.mesh(), row.point);
      for (Index h = 0; h < count; ++h) {
        const double value = course_at(0, slot) * harmonics_[static_cast<size_t>(h)].value(place);
        for (Index k = 0; k < 3; ++k)
          columns(first + i, motion + k * count + h) = value * along[k];
      }
    }
  }

  /// Responses to plates, pose, body force, stiffness harmonics; they hardly depend on the load, but for the last, which grow
  /// with it.
  [[nodiscard]] std::vector<NodeField> elastic_fields() const {
    const ElasticSystem& system = body_.system();
    const std::vector<unsigned char> top = held_at_top(system);
    const std::vector<unsigned char> all(top.size(), 1);
    std::vector<std::vector<double>> sides;
    std::vector<NodeField> prescribed;
    for (size_t motion = 0; motion < rigid_motions; ++motion) {
      prescribed.push_back(rigid(system.mesh(), state_.position_mm, motion, top));
      sides.push_back(resistance(system, state_, prescribed.back()));
    }
    for (Index axis = 0; axis < 3; ++axis)
      sides.push_back(body_force(system, body_.dofs(), Vector3d::Unit(axis)));
    std::vector<GaussNumbers> stiffness;
    for (size_t h = 1; h < harmonics_.size(); ++h)
      stiffness.push_back(at_gauss_points(system.mesh(), [&](const MaterialPoint& point) {
        return harmonics_[h].value(wall_.at(system.mesh(), point));
      }));
    std::ranges::move(stiffness_sides(system, state_, stiffness), std::back_inserter(sides));
    std::vector<NodeField> responses = explain::responses(body_, state_, sides);
    std::vector<NodeField> fields;
    for (size_t motion = 0; motion < rigid_motions; ++motion) {
      fields.push_back(std::move(responses[motion]));
      add_scaled(fields.back(), 1.0, prescribed[motion]);
    }
    for (size_t motion = 0; motion < rigid_motions; ++motion)
      fields.push_back(rigid(system.mesh(), state_.position_mm, motion, all));
    std::move(responses.begin() + rigid_motions, responses.end(), std::back_inserter(fields));
    return fields;
  }

  const MotionResiduals& rows_;
  ElasticModel& body_;
  const ElasticState& state_;
  const std::vector<double>& pressures_kPa_;
  WallCoordinates wall_;
  std::vector<Harmonic> harmonics_;
  std::vector<FieldMode> modes_;
};

}  // namespace

FieldModes field_modes(const MotionResiduals& rows, ElasticModel& body, const ElasticState& state,
                       const std::vector<double>& pressures_kPa) {
  return Builder(rows, body, state, pressures_kPa).build();
}

}  // namespace diastole::explain
