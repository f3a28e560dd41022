#include <fmt/format.h>

#include <iostream>
#include <memory>
#include <optional>

#include "estimator/cli/commands.hpp"
#include "estimator/io/member_json.hpp"
#include "estimator/io/whole_file.hpp"
#include "estimator/report/page.hpp"
#include "estimator/report/sections.hpp"
#include "estimator/shear/shear_fit.hpp"
#include "protocol/contract/json_text.hpp"
#include "protocol/contract/named_members.hpp"

namespace diastole {

DIASTOLE_MEMBERS(ShearLoad, moment_Nmm, rows, C1_kPa, se_kPa, rms_deg)
DIASTOLE_MEMBERS(ShearOutlier, line, residual_deg, deviations)

namespace {

struct ShearArguments {
  std::filesystem::path data;
  std::optional<std::filesystem::path> page;
  ShearForm form = ShearForm::normalised;
  bool force = false;
};

std::string to_json(const ShearTest& test, const ShearFit& fit, ShearForm form) {
  const Json json = {DIASTOLE_NAMED(fit, C1_kPa, se_kPa, ci95_kPa, r2),
                     {"r2_kind", "uncentred: 1 - SSE / sum of squares about zero"},
                     DIASTOLE_NAMED(fit, r2_about_mean, swapped_C1_kPa, determined),
                     {"rows", test.rows.size()},
                     {"dof", fit.dof},
                     {"load", test.load},
                     {"form", form == ShearForm::normalised ? "normalised" : "rotation"},
                     DIASTOLE_NAMED(fit, rms_deg, largest_shear),
                     {"loads", written(fit.loads)},
                     {"outliers", written(fit.outliers)},
                     {"remarks", fit.remarks}};
  return json_text(json, 1) + "\n";
}

void print_fit(const ShearTest& test, const ShearFit& fit) {
  if (fit.determined) {
    fmt::print("C1 = {:.3f} \u00b1 {:.3f} kPa (95 % interval {:.3f} to {:.3f} kPa)\n", fit.C1_kPa, fit.se_kPa,
               fit.ci95_kPa[0], fit.ci95_kPa[1]);
  } else {
    fmt::print("C1 is not determined by these data.\n");
  }
  fmt::print("R\u00b2 = {:.4f} about zero, {:.4f} about the mean; {} rows, residuals {:.3f} degrees RMS\n",
             fit.r2, fit.r2_about_mean, test.rows.size(), fit.rms_deg);
  fmt::print("Load read as {}; largest shear {:.3f}\n", test.load, fit.largest_shear);
  fmt::print("With the axes swapped, as the paper plots them, the slope is {:.3f} kPa\n\n",
             fit.swapped_C1_kPa);
  fmt::print("  moment (N mm)  rows  C1 by itself (kPa)  standard error  RMS (degrees)\n");
  for (const ShearLoad& load : fit.loads) {
    fmt::print("  {:>13.5g}  {:>4}  {:>18.3f}  {:>14.3f}  {:>13.3f}\n", load.moment_Nmm, load.rows,
               load.C1_kPa, load.se_kPa, load.rms_deg);
  }
  if (!fit.remarks.empty()) fmt::print("\n");
  for (const std::string& remark : fit.remarks)
    fmt::print("{}\n", remark);
}

ExitCode run_shear(const ShearArguments& arguments, const CommandOutput& out) {
  if (arguments.page) require_output({*arguments.page, {arguments.data}, report::page_mark, arguments.force});
  const ShearTest test = read_shear_test(arguments.data);
  const ShearFit fit = fit_shear(test, arguments.form);
  if (arguments.page) {
    report::Page page("Material stiffness");
    report::add_shear(page, test, fit);
    write_whole_file(*arguments.page, page.html());
  }
  if (out.json) {
    std::cout << to_json(test, fit, arguments.form);
  } else {
    print_fit(test, fit);
    if (arguments.page) fmt::print("\nThe plots are in {}\n", arguments.page->string());
  }
  return fit.determined ? ExitCode::done : ExitCode::negative;
}

}  // namespace

void add_shear(CommandLine& line) {
  auto arguments = std::make_shared<ShearArguments>();
  CLI::App* command = line.add(
      "shear", "C1 from a rotational shear test of a bonded annulus (Eq. 1)",
      "  diastole shear examples/shear-test.csv\n"
      "  diastole shear examples/shear-test.csv -o shear.html\n"
      "  diastole shear examples/shear-test.csv --form rotation --json\n\n"
      "DATA.csv, one row a marker under a load:\n"
      "  inner_radius_mm,outer_radius_mm,height_mm,arm_mm,force_per_string_N,radius_mm,rotation_deg\n"
      "The load may also be force_total_N (both strings), or moment_Nmm without arm_mm. docs/shear.md says "
      "more.");
  command->add_option("DATA", arguments->data, "rotations of the markers")->required();
  command->add_option("-o,--output", arguments->page, "a page with the plots, to write");
  command->add_flag("--force", arguments->force, "replace an output file that is no report");
  const std::map<std::string, ShearForm> forms = {{"normalised", ShearForm::normalised},
                                                  {"rotation", ShearForm::rotation}};
  command
      ->add_option("--form", arguments->form,
                   "normalised: rotation per load, as in the paper; rotation: right if every rotation has "
                   "the same error")
      ->transform(CLI::CheckedTransformer(forms))
      ->option_text("normalised|rotation [normalised]");
  line.on_run(command, [arguments](const CommandOutput& out) { return run_shear(*arguments, out); });
}

}  // namespace diastole
