#include "estimator/solution/hexahedral_grid.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <stdexcept>
#include <unordered_map>

#include "estimator/fe/point_fields.hpp"
#include "estimator/mesh/collapsed_edge.hpp"

namespace diastole {
namespace {

using Eigen::Vector3d;

/// Places that are the same but for rounding are one point.
class MergedPoints {
 public:
  MergedPoints(std::vector<double>& points, double tolerance_mm)
      : points_(points), tolerance_mm_(tolerance_mm) {}

  size_t number(const Vector3d& place) {
    const std::array<long, 3> box = box_of(place);
    for (long offset = 0; offset < 27; ++offset) {
      const std::array<long, 3> near{box[0] + offset % 3 - 1, box[1] + offset / 3 % 3 - 1,
                                     box[2] + offset / 9 - 1};
      const auto [from, to] = in_box_.equal_range(key(near));
      for (auto found = from; found != to; ++found)
        if ((Eigen::Map<const Vector3d>(&points_[3 * found->second]) - place).norm() < tolerance_mm_)
          return found->second;
    }
    const size_t number = points_.size() / 3;
    points_.insert(points_.end(), place.begin(), place.end());
    in_box_.emplace(key(box), number);
    return number;
  }

 private:
  [[nodiscard]] std::array<long, 3> box_of(const Vector3d& place) const {
    std::array<long, 3> box;
    for (size_t i = 0; i < 3; ++i)
      box[i] = std::lround(std::floor(place[static_cast<Eigen::Index>(i)] / (2.0 * tolerance_mm_)));
    return box;
  }
  static size_t key(const std::array<long, 3>& box) {
    return static_cast<size_t>(box[0]) * 73856093U ^ static_cast<size_t>(box[1]) * 19349663U ^
           static_cast<size_t>(box[2]) * 83492791U;
  }
  std::vector<double>& points_;
  double tolerance_mm_;
  std::unordered_multimap<size_t, size_t> in_box_;
};

/// Points of a face in their order around it, each once.
std::vector<size_t> once_around(std::vector<size_t> points) {
  points.erase(std::unique(points.begin(), points.end()), points.end());
  if (points.size() > 1 && points.front() == points.back()) points.pop_back();
  return points;
}

/// A hexahedron whose eight (VTK's order) may coincide in pairs.
GridCell cell_of(const std::array<size_t, 8>& eight) {
  if (std::set(eight.begin(), eight.end()).size() == 8)
    return {CellShape::hexahedron, {eight.begin(), eight.end()}};
  constexpr std::array<std::array<size_t, 8>, 3> opposite{
      {{0, 1, 2, 3, 4, 5, 6, 7}, {0, 4, 5, 1, 3, 7, 6, 2}, {0, 3, 7, 4, 1, 2, 6, 5}}};
  for (const auto& pair : opposite) {
    std::vector<size_t> first, second;
    for (size_t i = 0; i < 4; ++i) {
      first.push_back(eight[pair[i]]);
      second.push_back(eight[pair[4 + i]]);
    }
    first = once_around(first);
    second = once_around(second);
    if (first.size() != 3 || second.size() != 3) continue;
    first.insert(first.end(), second.begin(), second.end());
    return {CellShape::wedge, first};
  }
  return {CellShape::hexahedron, {eight.begin(), eight.end()}};
}

/// Of a sample where the wall has no direction.
constexpr double beside = 0.01;

Xi xi_of(size_t sample, const Sampling& n) {
  const std::array<size_t, 3> index{sample % (n[0] + 1), sample / (n[0] + 1) % (n[1] + 1),
                                    sample / ((n[0] + 1) * (n[1] + 1))};
  Xi xi;
  for (size_t k = 0; k < 3; ++k)
    xi[k] = static_cast<double>(index[k]) / static_cast<double>(n[k]);
  return xi;
}

/// The eight samples around cell i, j, k of an element, in VTK's order.
std::array<size_t, 8> samples_of_cell(const std::array<size_t, 3>& cell, const Sampling& n) {
  constexpr std::array<std::array<size_t, 3>, 8> eight{
      {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}}};
  std::array<size_t, 8> samples;
  for (size_t c = 0; c < 8; ++c)
    samples[c] =
        cell[0] + eight[c][0] + (n[0] + 1) * (cell[1] + eight[c][1] + (n[1] + 1) * (cell[2] + eight[c][2]));
  return samples;
}

template <class Visit>
void each_cell(const Sampling& n, Visit&& visit) {
  for (size_t k = 0; k < n[2]; ++k)
    for (size_t j = 0; j < n[1]; ++j)
      for (size_t i = 0; i < n[0]; ++i)
        visit(std::array{i, j, k});
}

GridStep step_of(const ElasticModel& model, const SolvedFrame& frame, const HexahedralMesh& sampled) {
  const HermiteMesh& mesh = model.mesh();
  GridArray displacement{"displacement_mm", 3, std::vector<double>(sampled.grid.points.size())};
  std::vector<GridArray> arrays = sampled_arrays(static_cast<bool>(model.system().material_axes()));
  for (GridArray& array : arrays)
    array.values.assign(array.components * sampled.grid.point_count(), 0.0);
  std::vector<double> meeting(sampled.grid.point_count(), 0.0);
  for (size_t e = 0; e < mesh.element_count(); ++e) {
    for (size_t sample = 0; sample < sampled.points[e].size(); ++sample) {
      const size_t number = sampled.points[e][sample];
      const MaterialPoint point{e, xi_of(sample, sampled.sampling)};
      const Vector3d moved = mesh.value(frame.state.position_mm, point) - mesh.value(mesh.reference(), point);
      std::copy(moved.begin(), moved.end(), &displacement.values[3 * number]);
      const Eigen::VectorXd fields =
          sampled_fields(point_fields(model.system(), frame.state, beside_collapse(mesh, point, beside)));
      Eigen::Index column = 0;
      for (GridArray& array : arrays)
        for (size_t i = 0; i < array.components; ++i)
          array.values[array.components * number + i] += fields[column++];
      meeting[number] += 1.0;
    }
  }
  for (GridArray& array : arrays)
    for (size_t i = 0; i < array.values.size(); ++i)
      array.values[i] /= meeting[i / array.components];
  arrays.insert(arrays.begin(), std::move(displacement));
  return {frame.time_s, std::move(arrays), {{"pressure_kPa", 1, {frame.state.pressure_kPa}}}};
}

/// What FEBio calls the law, nearly incompressible by a bulk modulus k if the body is incompressible.
FebMaterial febio_material(const ElasticSystem& system) {
  constexpr double bulk_over_shear = 500.0;  // Poisson's ratio 0.499
  const std::span<const double> p = system.parameters(0);
  for (size_t e = 1; e < system.mesh().element_count(); ++e)
    if (!std::ranges::equal(p, system.parameters(e)))
      throw std::invalid_argument(
          "the file holds one material, and the parameters differ from element to element");
  const auto bulk_kPa = [&](double shear_kPa) {
    return system.compressibility_per_kPa() > 0.0 ? 1.0 / system.compressibility_per_kPa()
                                                  : bulk_over_shear * shear_kPa;
  };
  const std::string_view law = system.law().name();
  if (law == "neo-hookean") return {"Mooney-Rivlin", {{"c1", p[0]}, {"c2", 0.0}, {"k", bulk_kPa(2 * p[0])}}};
  if (law == "mooney-rivlin")
    return {"Mooney-Rivlin", {{"c1", p[0]}, {"c2", p[1]}, {"k", bulk_kPa(2 * (p[0] + p[1]))}}};
  if (law == "guccione") {
    // c Q of FEBio is the sum of mu_a, lambda_ab over E (its theory manual, Fung orthotropic): without coupling of normal strains
    // E_a = c b_a and G_ab = c b_ab / 2, b_ab the factor of 2 E_ab^2.
    const double c = p[0];
    return {"Fung orthotropic",
            {{"E1", c * p[1]},
             {"E2", c * p[2]},
             {"E3", c * p[2]},
             {"G12", c * p[3] / 2},
             {"G23", c * p[2] / 2},
             {"G31", c * p[3] / 2},
             {"v12", 0.0},
             {"v23", 0.0},
             {"v31", 0.0},
             {"c", c},
             {"k", bulk_kPa(c * std::max({p[1], p[2], p[3]}) / 2)}}};
  }
  throw std::invalid_argument(
      fmt::format("FEBio has no law that is {}; neo-hookean, mooney-rivlin and guccione have theirs", law));
}

}  // namespace

std::vector<GridCell> HexahedralMesh::faces(const ElementFace& face) const {
  constexpr std::array<std::array<size_t, 2>, 3> number{
      {{5, 3}, {2, 4}, {0, 1}}};  // among faces_of(hexahedron)
  const std::vector<size_t> around = faces_of(CellShape::hexahedron)[number[face.direction][face.side]];
  std::vector<GridCell> found;
  each_cell(sampling, [&](const std::array<size_t, 3>& cell) {
    if (cell[face.direction] != face.side * (sampling[face.direction] - 1)) return;
    const std::array<size_t, 8> samples = samples_of_cell(cell, sampling);
    std::vector<size_t> eight;
    for (const size_t corner : around)
      eight.push_back(points[face.element][samples[corner]]);
    eight = once_around(eight);
    if (eight.size() < 3) return;
    found.push_back({eight.size() == 3 ? CellShape::triangle : CellShape::quadrilateral, std::move(eight)});
  });
  return found;
}

HexahedralMesh hexahedral_mesh(const HermiteMesh& mesh, const Sampling& sampling) {
  constexpr double rounding = 1e-7;  // of the body's extent
  HexahedralMesh result;
  result.sampling = sampling;
  MergedPoints merged(result.grid.points, rounding * mesh.extent_mm());
  GridArray elements{"element", 1, {}};
  const size_t samples = (sampling[0] + 1) * (sampling[1] + 1) * (sampling[2] + 1);
  for (size_t e = 0; e < mesh.element_count(); ++e) {
    std::vector<size_t>& numbers = result.points.emplace_back();
    for (size_t sample = 0; sample < samples; ++sample)
      numbers.push_back(merged.number(mesh.value(mesh.reference(), {e, xi_of(sample, sampling)})));
    each_cell(sampling, [&](const std::array<size_t, 3>& cell) {
      std::array<size_t, 8> eight = samples_of_cell(cell, sampling);
      for (size_t& corner : eight)
        corner = numbers[corner];
      result.grid.cells.push_back(cell_of(eight));
      elements.values.push_back(static_cast<double>(e));
      MaterialPoint& centre = result.centres.emplace_back(MaterialPoint{e, {}});
      for (size_t k = 0; k < 3; ++k)
        centre.xi[k] = (static_cast<double>(cell[k]) + 0.5) / static_cast<double>(sampling[k]);
    });
  }
  result.grid.cell_data.push_back(std::move(elements));
  return result;
}

FieldGrid hexahedral_grid(const ElasticModel& model, std::span<const SolvedFrame> frames,
                          const Sampling& sampling) {
  HexahedralMesh sampled = hexahedral_mesh(model.mesh(), sampling);
  FieldGrid grid = sampled.grid;
  for (const SolvedFrame& frame : frames)
    grid.steps.push_back(step_of(model, frame, sampled));
  return grid;
}

FebModel febio_model(const ElasticModel& model, std::span<const SolvedFrame> frames,
                     const HexahedralMesh& sampled) {
  const ElasticSystem& system = model.system();
  const MeshFaces& faces = model.mesh().faces();
  FebModel result{.grid = &sampled.grid,
                  .material = febio_material(system),
                  .axes = {},
                  .held = {},
                  .pressed = {},
                  .pressures_kPa = {}};
  if (system.chamber()) throw std::invalid_argument("the file holds no fluid around the body ([chamber])");
  if (system.stiffness())
    throw std::invalid_argument("the file holds one material, and an inclusion is of another stiffness");
  std::set<size_t> held;
  for (const auto* ends : {&faces.bottom, &faces.top}) {
    for (const ElementFace& face : *ends) {
      if (system.on_springs(face))
        throw std::invalid_argument("the file holds ends that are fixed, not on springs");
      for (const GridCell& cell : sampled.faces(face))
        held.insert(cell.points.begin(), cell.points.end());
    }
  }
  result.held.assign(held.begin(), held.end());
  for (const ElementFace& face : faces.inner)
    for (GridCell& cell : sampled.faces(face))
      result.pressed.push_back(std::move(cell));
  for (const SolvedFrame& frame : frames) {
    if (frame.state.fibre_tension_kPa != 0.0)
      throw std::invalid_argument("the file holds passive material alone");
    result.pressures_kPa.push_back(frame.state.pressure_kPa);
  }
  if (!system.material_axes()) return result;
  for (const MaterialPoint& centre : sampled.centres) {
    const MaterialAxes axes = system.material_axes()(model.mesh(), centre);
    std::array<double, 6>& row = result.axes.emplace_back();
    std::copy_n(axes.data(), 6, row.begin());
  }
  return result;
}

}  // namespace diastole
