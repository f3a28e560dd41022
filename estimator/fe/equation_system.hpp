#pragma once
// The sparse symmetric system of free displacement dofs and Lagrange pressures, filled by blocks.
//
//        u (node by node)   p    f
//     +-------------------+----+---+   stored: the lower triangle, as coordinate triplets (rows(), columns()
//   u |  node-pair blocks | .. |...|   count from 1 as the factorisation wants them). A block of two different
//     +-------------------+----+---+   nodes is a full rectangle, a node's own block a packed lower triangle,
//   p |  pressure rows    | d  |   |   a pressure unknown has one row piece for each node it meets. d is empty
//     +-------------------+----+---+   for incompressible material, else one packed triangle an element.
//   f |  one row a fluid  |    | c |   f: pressures of fluids whose volume matters, numbered from `unknowns`;
//     +-------------------+----+---+   a row has all unknowns of the fluid's surface, then its diagonal c.
//
// The last fluid is the cavity. With the cavity's pressure given, its row and unknown are left off the end.
//
// A dof that is tied to another node's (HermiteMesh::ties) has that one's equation, and belongs to the blocks
// of that node, its host.
//
// The pattern depends on mesh, supports and pressure map only; values are added per element and elements are
// grouped into colours that share no unknown, so that a parallel sum has one fixed order.

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "estimator/fe/element_mechanics.hpp"
#include "estimator/fe/face_points.hpp"
#include "estimator/fe/supports.hpp"

namespace diastole {

/// The tri-linear Lagrange pressure: eight values an element, either its own (discontinuous) or shared at the
/// nodes. Corners that coincide on a collapsed edge share one value either way, so that the pressure is single
/// there. The solver's default is the discontinuous one: docs/decisions/0010-hermite-meshes-with-a-discontinuous-pressure.md.
enum class PressureSpace { per_element, continuous };

struct PressureMap {
  std::vector<std::array<size_t, corners>> unknown;  ///< unknown[e][corner]: number of the pressure value
  size_t count = 0;
};

PressureMap make_pressure_map(const HermiteMesh& mesh, PressureSpace space);

/// One fluid's row: pressure unknown `unknown`, entries entry ... over `columns` (from 0), then the diagonal's.
struct FluidRow {
  size_t unknown = 0;
  size_t entry = 0;
  std::vector<size_t> columns;

  [[nodiscard]] size_t diagonal() const { return entry + columns.size(); }
};

struct EquationOptions {
  bool compressible = false;                     ///< the block d is stored
  std::vector<std::vector<ElementFace>> fluids;  ///< surfaces; the cavity's last
};

class EquationSystem {
 public:
  EquationSystem(const HermiteMesh& mesh, const HeldDofs& held, const PressureMap& pressures,
                 const EquationOptions& options = {});

  [[nodiscard]] size_t displacement_unknowns() const { return displacement_unknowns_; }
  [[nodiscard]] size_t pressure_unknowns() const { return pressure_unknowns_; }
  /// Without the cavity's pressure, and with it if the cavity's volume is given instead.
  [[nodiscard]] size_t unknowns(bool cavity_held = false) const {
    return cavity_held ? all_unknowns_ : all_unknowns_ - (fluid_rows_.empty() ? 0 : 1);
  }

  /// Equation of a nodal dof (numbered as in a NodeField), or `none` when it is held.
  [[nodiscard]] size_t equation(size_t dof) const { return equation_of_dof_[dof]; }
  static constexpr size_t none = static_cast<size_t>(-1);

  [[nodiscard]] const std::vector<std::vector<size_t>>& colours() const { return colours_; }

  /// Stored entries, counted like unknowns().
  [[nodiscard]] size_t entries(bool cavity_held = false) const {
    return cavity_held || fluid_rows_.empty() ? rows_.size() : fluid_rows_.back().entry;
  }
  [[nodiscard]] std::span<const int> rows() const { return rows_; }
  [[nodiscard]] std::span<const int> columns() const { return columns_; }
  [[nodiscard]] const std::vector<FluidRow>& fluid_rows() const { return fluid_rows_; }
  /// Equation of component i of an element's function a, or `none`.
  [[nodiscard]] size_t equation(size_t element, size_t a, size_t i) const {
    return maps_[element].equation[3 * a + i];
  }

  // Adding: `values` has one number for each stored entry. Different elements of one colour may be added at
  // the same time from several threads.
  void add_tangent(size_t element, const ElementTangent& tangent, std::span<double> values) const;
  void add_force(size_t element, const ElementField& force, std::span<double> right_side) const;
  /// Adds a symmetric matrix over the element's eight Lagrange pressures. Precondition: compressible.
  void add_compliance(size_t element, const Eigen::Matrix<double, corners, corners>& matrix,
                      std::span<double> values) const;
  /// Adds factor * symmetric matrix over the given Hermite functions of one element; row 3 j + i belongs to
  /// functions[j], component i.
  void add_face_tangent(size_t element, std::span<const size_t> functions,
                        const Eigen::Ref<const Eigen::MatrixXd>& matrix, double factor,
                        std::span<double> values) const;

 private:
  /// The corners' nodes, and those that their dofs are tied to: one more for each layer of a collapsed edge.
  static constexpr size_t most_hosts = corners + 2;

  struct ElementMap {
    std::array<size_t, most_hosts> nodes;  ///< the hosts; the corners' nodes come first
    size_t hosts = corners;
    std::array<size_t, most_hosts> free_dofs;               ///< of each host
    std::array<size_t, 3 * hermite_functions> host;         ///< of local dof 3 a + i: place in `nodes`
    std::array<size_t, 3 * hermite_functions> equation;     ///< of local dof 3 a + i, or none
    std::array<size_t, 3 * hermite_functions> within_node;  ///< its place among its host's free dofs
    std::array<double, hermite_functions> scale;
    std::array<size_t, most_hosts * most_hosts> node_block;    ///< first entry of the block of two hosts
    std::array<size_t, corners * most_hosts> pressure_piece;   ///< first entry of pressure corner m, host h
    std::array<size_t, corners*(corners + 1) / 2> compliance;  ///< entry of pressure corners m >= n
  };

  void number_equations(const HermiteMesh& mesh, const HeldDofs& held);
  void map_elements(const HermiteMesh& mesh, const PressureMap& pressures);
  [[nodiscard]] ElementMap map_dofs(const HermiteMesh& mesh, size_t element) const;
  void colour_elements();
  void map_compliance(const PressureMap& pressures);
  void add_fluid_row(const std::vector<ElementFace>& surface);
  /// Both counted from 0.
  void add_entry(size_t row, size_t column) {
    rows_.push_back(static_cast<int>(row + 1));
    columns_.push_back(static_cast<int>(column + 1));
  }
  size_t make_node_block(size_t high_node, size_t low_node);
  size_t make_pressure_piece(size_t pressure, size_t node);
  /// Stored entry of the local dofs 3 a + i and 3 b + k; none if either is held.
  [[nodiscard]] static size_t entry(const ElementMap& map, size_t dof, size_t other_dof);
  /// How often a pair of local dofs, met once, counts in its entry: two different dofs of one equation stand
  /// for both off-diagonal numbers of their symmetric matrix.
  [[nodiscard]] static double multiplicity(const ElementMap& map, size_t dof, size_t other_dof) {
    return dof != other_dof && map.equation[dof] == map.equation[other_dof] ? 2.0 : 1.0;
  }

  size_t displacement_unknowns_ = 0;
  size_t pressure_unknowns_ = 0;
  size_t all_unknowns_ = 0;
  std::vector<size_t> equation_of_dof_;
  std::vector<size_t> host_of_dof_;
  std::vector<size_t> first_equation_;  // of a node
  std::vector<size_t> free_dofs_;       // of a node
  std::vector<ElementMap> maps_;
  std::vector<std::vector<size_t>> colours_;
  std::vector<int> rows_;
  std::vector<int> columns_;
  std::vector<FluidRow> fluid_rows_;
};

}  // namespace diastole
