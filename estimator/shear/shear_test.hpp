#pragma once
// The rotational shear test: an annulus of gel bonded between a fixed inner and a loaded outer cylinder, markers
// on its face, each marker's rotation under each load. One row of the file is one marker under one load; every
// row carries its annulus, so that a file stays whole when it is sorted, cut or joined with another.
//
//   inner_radius_mm,outer_radius_mm,height_mm,arm_mm,force_per_string_N,radius_mm,rotation_deg
//   8,19,24,19,0.25,8.36,0.1013
//
// The load column's name says what was measured, for the moment of the couple depends on it:
//   force_per_string_N   the pull of each of the two parallel strings   moment = 2 * force * arm
//   force_total_N        the pull of both strings together              moment = force * arm
//   moment_Nmm           the moment itself (no arm_mm column then)
// `arm_mm` reaches from the axis to a string. `radius_mm` is the marker's distance from the axis, `rotation_deg`
// its rotation from the unloaded state; load and rotation may be negative, if both count the same way round.

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace diastole {

struct Annulus {
  double inner_radius_mm;
  double outer_radius_mm;
  double height_mm;
  bool operator==(const Annulus&) const = default;
};

struct ShearRow {
  Annulus annulus;
  double moment_Nmm;
  double radius_mm;
  double rotation_rad;
  size_t line;  ///< of the file
};

struct ShearTest {
  std::string file;
  std::string load;  ///< the load column's name
  std::vector<ShearRow> rows;
};

/// True if `content` starts like the header of a shear test.
bool is_shear_test(std::string_view content);

/// Throws InputError, with line and column, for a wrong header and for values that cannot be: lengths that are
/// not positive, an inner radius not below the outer, a marker outside the gel, a load of zero, a rotation
/// beyond half a turn; for fewer than 3 rows; if no marker lies off the inner radius or none turns.
ShearTest read_shear_test(const std::filesystem::path& path);

/// The same for text in memory; `file` stands for it in messages.
ShearTest shear_test_from_text(std::string_view text, const std::string& file);

}  // namespace diastole
