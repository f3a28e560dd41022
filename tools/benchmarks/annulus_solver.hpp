#pragma once
// The programs that solve the 6 kPa gel annulus (docs/verification.md) for a comparison: this project's solver and
// its peers, each as a process of its own with one thread.

#include <array>
#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "tools/benchmarks/timed_process.hpp"

namespace diastole {

using AnnulusElements = std::array<size_t, 3>;  ///< around, up, through the wall

inline constexpr std::array<double, 5> annulus_radii_mm{22.5, 30.0, 36.25, 43.0, 50.0};
/// Converged displacements at these radii and mid-height for 6 kPa, C1 = 6.5 kPa.
inline constexpr std::array<double, 5> annulus_radial_mm{8.0557, 6.6906, 5.8081, 4.9988, 4.2197};

struct AnnulusAnswer {
  AnnulusElements elements{};
  size_t unknowns = 0;
  std::string newton;  ///< steps of Newton's method, in words
  std::array<double, 5> radial_mm{};
  ProcessCost process;
  size_t factor_entries = 0;  ///< numbers in the factorised tangent; 0 if the program does not say
  double solve_wall_s =
      0.0;  ///< from the undeformed state to the answer; the whole process if not timed separately
  double solve_processor_s = 0.0;

  [[nodiscard]] double inner_error() const { return radial_mm[0] / annulus_radial_mm[0] - 1.0; }
  /// The error of largest size over the five radii.
  [[nodiscard]] double worst_error() const;
};

/// A way to solve it. Places in commands: {0} {1} {2} elements, {3} the result's file, {4} the peers' folder.
struct AnnulusSolver {
  std::string name;
  std::string discretisation;
  std::vector<std::string> probe;       ///< succeeds if the program is installed; empty: it is
  std::vector<std::string> prepare;     ///< not timed; may be empty
  std::vector<std::string> solve;       ///< timed
  std::vector<std::string> read;        ///< not timed; may be empty
  std::vector<AnnulusElements> ladder;  ///< meshes from coarse to fine
};

/// This project's, run by `own_program --solve`, then the peers.
std::vector<AnnulusSolver> annulus_solvers(const std::string& own_program);

/// Where commands run and leave their files; made if it is not there.
struct AnnulusWorkplace {
  std::filesystem::path folder;
  std::filesystem::path peers;
};

bool is_installed(const AnnulusSolver& solver, const AnnulusWorkplace& place);

/// Throws std::runtime_error, with the place of its log, if the program fails or does not converge.
AnnulusAnswer solve_annulus(const AnnulusSolver& solver, const AnnulusElements& elements,
                            const AnnulusWorkplace& place);

/// Solves it with this project's solver in this process and writes the result's file.
void solve_annulus_here(const AnnulusElements& elements, const std::filesystem::path& result);

}  // namespace diastole
