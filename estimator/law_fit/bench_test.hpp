#pragma once
// A bench test of tissue as a CSV file; its header's first column says which (test_kinds.hpp):
//
//   stretch,nominal_kPa
//   planar_stretch,nominal_kPa
//   stretch_1,stretch_2,nominal_1_kPa,nominal_2_kPa
//   shear,shear_stress_kPa
//   cylinder_radius_mm,cylinder_height_mm,axial_stretch,twist_deg,moment_Nmm[,axial_force_N]
//   unloaded_inner_radius_mm,unloaded_outer_radius_mm,axial_stretch,outer_radius_mm,pressure_kPa[,axial_force_N]
//   inner_radius_mm,outer_radius_mm,height_mm,...,radius_mm,rotation_deg      the file of `diastole shear`
//
// All but the last may end in ,fibre_deg: where the fibre lies, for laws that have one. One row is one reading at rest.

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "estimator/law_fit/test_kinds.hpp"

namespace diastole {

struct Reading {
  std::vector<double> controls;  ///< as the kind's columns
  std::vector<double> measured;  ///< as `channels`
  double fibre_rad = 0;
};

struct Channel {
  std::string name;  ///< its column
  double rms;        ///< of what was measured; above zero
};

struct BenchTest {
  std::string file;
  const TestKind* kind;
  bool has_fibre = false;
  std::vector<Channel> channels;
  std::vector<Reading> readings;  ///< three or more
};

/// Throws InputError, with line and column, for a header of no kind, for fewer than three rows and for values that cannot be:
/// stretches beyond a twentieth or twentyfold, lengths that are not positive, a tube that would be closed or turned inside out,
/// a uniaxial test off the fibre's axes, a channel in which nothing was measured.
BenchTest read_bench_test(const std::filesystem::path& path);

/// The same for text in memory; `file` stands for it in messages.
BenchTest bench_test_from_text(std::string_view text, const std::string& file);

}  // namespace diastole
