#pragma once
// `diastole solve -o FILE ...`: the files a solution is written to, chosen by their endings.
//
//   .vtkhdf       Bezier hexahedra for ParaView (estimator/solution/solution_grid.hpp)
//   .vtu .xdmf    plain hexahedra for other programs (estimator/solution/hexahedral_grid.hpp)
//   .feb          the study for FEBio (estimator/grids/feb_file.hpp)
//   .csv          strain and stress at the Gauss points (estimator/solution/solution_grid.hpp)
//   .json         sections and profiles of the last frame for `diastole report` (estimator/io/solution_file.hpp)

#include <span>
#include <string>

#include "estimator/cli/output_files.hpp"
#include "estimator/io/study.hpp"
#include "estimator/solution/solution_grid.hpp"

namespace diastole {

struct SolutionOutputs {
  OutputFiles files;
  std::string cells = "4,4,4";

  /// The object must live until the command has run.
  void add_options(CLI::App& command);
  /// Before the work. Throws InputError if a file has another ending, may not be replaced, or cannot hold several frames.
  void require(const Study& study, bool several_frames) const;
  /// Throws InputError, besides, if FEBio has nothing that is the same as this model.
  void write(const Study& study, const ElasticModel& model, std::span<const SolvedFrame> frames) const;
};

}  // namespace diastole
