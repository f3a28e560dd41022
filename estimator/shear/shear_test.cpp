#include "estimator/shear/shear_test.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "estimator/io/number_table.hpp"
#include "estimator/io/whole_file.hpp"
#include "protocol/contract/angle.hpp"
#include "protocol/contract/input_error.hpp"
#include "protocol/contract/text.hpp"

namespace diastole {
namespace {

constexpr std::array<std::string_view, 7> per_string_columns = {
    "inner_radius_mm",    "outer_radius_mm", "height_mm",   "arm_mm",
    "force_per_string_N", "radius_mm",       "rotation_deg"};
constexpr std::array<std::string_view, 7> total_columns = {"inner_radius_mm", "outer_radius_mm", "height_mm",
                                                           "arm_mm",          "force_total_N",   "radius_mm",
                                                           "rotation_deg"};
constexpr std::array<std::string_view, 6> moment_columns = {
    "inner_radius_mm", "outer_radius_mm", "height_mm", "moment_Nmm", "radius_mm", "rotation_deg"};

/// One form of the file: its header, and the strings that pull with the force of its load column.
struct Form {
  std::string_view load;
  std::span<const std::string_view> columns;
  double strings;  ///< 0: the load is the moment itself
};

constexpr std::array<Form, 3> forms = {Form{"force_per_string_N", per_string_columns, 2},
                                       Form{"force_total_N", total_columns, 1},
                                       Form{"moment_Nmm", moment_columns, 0}};

constexpr size_t fewest_rows = 3;
constexpr double half_turn_deg = 180;

const Form& form_of(std::string_view text, const std::string& file) {
  const std::string_view header = text.substr(0, text.find('\n'));
  const auto found =
      std::ranges::find_if(forms, [&](const Form& form) { return header.find(form.load) != text.npos; });
  if (found != forms.end()) return *found;
  throw InputError({file, "line 1", "no column says what the load is",
                    "The header must name one of force_per_string_N (the pull of each of the two strings), "
                    "force_total_N (of both together) or moment_Nmm, as in: "
                    "inner_radius_mm,outer_radius_mm,height_mm,arm_mm,force_per_string_N,radius_mm,"
                    "rotation_deg"});
}

double positive(const NumberTable& table, size_t row, size_t column) {
  const double value = table.at(row, column);
  if (value <= 0)
    table.fail(row, column, fmt::format("{} is not a length above zero", value), "Give it in mm.");
  return value;
}

ShearRow row_of(const NumberTable& table, size_t row, const Form& form) {
  const Annulus annulus = {positive(table, row, 0), positive(table, row, 1), positive(table, row, 2)};
  if (annulus.inner_radius_mm >= annulus.outer_radius_mm) {
    table.fail(row, 0,
               fmt::format("the inner radius {} mm is not below the outer radius {} mm",
                           annulus.inner_radius_mm, annulus.outer_radius_mm),
               "Give the gel's inner and outer radius: half of its diameters.");
  }
  const bool has_arm = form.strings > 0;
  const size_t load = has_arm ? 4 : 3;
  const double lever = has_arm ? form.strings * positive(table, row, 3) : 1;
  if (table.at(row, load) == 0) {
    table.fail(row, load, "a load of zero: the rotation per load does not exist",
               "Leave the unloaded rows out; rotations count from the unloaded state.");
  }
  const double radius_mm = positive(table, row, load + 1);
  if (radius_mm < annulus.inner_radius_mm || radius_mm > annulus.outer_radius_mm) {
    table.fail(row, load + 1,
               fmt::format("a marker at {} mm is not in the gel, which reaches from {} to {} mm", radius_mm,
                           annulus.inner_radius_mm, annulus.outer_radius_mm),
               "Give radii from the axis in mm, not diameters; leave markers on the cylinders out.");
  }
  const double rotation_deg = table.at(row, load + 2);
  if (std::abs(rotation_deg) > half_turn_deg) {
    table.fail(row, load + 2, fmt::format("a rotation of {} degrees is beyond half a turn", rotation_deg),
               "Give the rotation from the unloaded state in degrees, between -180 and 180.");
  }
  return {annulus, lever * table.at(row, load), radius_mm, rotation_deg * rad_per_deg, row + 2};
}

}  // namespace

bool is_shear_test(std::string_view content) {
  return without_byte_order_mark(content).starts_with(per_string_columns[0]);
}

ShearTest read_shear_test(const std::filesystem::path& path) {
  return shear_test_from_text(read_whole_file(path), path.string());
}

ShearTest shear_test_from_text(std::string_view text, const std::string& file) {
  if (text.find_first_not_of(" \t\r\n") == text.npos) {
    (void)NumberTable::from_text(text, file, per_string_columns);
  }
  const Form& form = form_of(text, file);
  const NumberTable table = NumberTable::from_text(text, file, form.columns);
  table.expect_measurable();
  ShearTest test = {file, std::string(form.load), {}};
  for (size_t row = 0; row < table.rows(); ++row)
    test.rows.push_back(row_of(table, row, form));
  if (test.rows.size() < fewest_rows) {
    throw InputError(
        {file, "", fmt::format("{} rows cannot tell the scatter", test.rows.size()),
         fmt::format("Give {} rows or more, one for each marker under each load.", fewest_rows)});
  }
  const auto off_the_bond = [](const ShearRow& row) { return row.radius_mm > row.annulus.inner_radius_mm; };
  if (std::ranges::none_of(test.rows, off_the_bond)) {
    throw InputError({file, "", "every marker lies on the fixed inner cylinder, where nothing rotates",
                      "Give markers between the inner and the outer radius."});
  }
  if (std::ranges::all_of(test.rows, [](const ShearRow& row) { return row.rotation_rad == 0; })) {
    throw InputError({file, "", "every rotation is zero", "Give the markers' rotations in degrees."});
  }
  return test;
}

}  // namespace diastole
