#include "estimator/io/study.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "protocol/contract/input_error.hpp"
#include "protocol/contract/table_reader.hpp"
#include "protocol/contract/text.hpp"

namespace diastole {
namespace {

// Beyond these the direct factorisation no longer fits a workstation.
constexpr std::array<int, 3> max_elements = {64, 64, 16};
constexpr int most_halvings = 4;
constexpr int min_circumferential = 3;  // fewer elements than this cannot close a circle

std::array<int, 3> read_mesh(TableReader& table) {
  std::array<int, 3> counts{};
  const std::vector<int64_t> mesh = table.integers("mesh", 3, {.at_least = 1});
  for (size_t axis = 0; axis < 3; ++axis) {
    if (mesh[axis] > max_elements[axis]) {
      table.fail("mesh", fmt::format("{} elements in direction {} are too many", mesh[axis], axis + 1),
                 fmt::format("Use at most [{}].", fmt::join(max_elements, ", ")));
    }
    counts[axis] = static_cast<int>(mesh[axis]);
  }
  if (counts[0] < min_circumferential) {
    table.fail("mesh", fmt::format("{} circumferential elements cannot close a circle", counts[0]),
               fmt::format("Use at least {}; the usual mesh is [8, 4, 1].", min_circumferential));
  }
  return counts;
}

template <class Kind>
void read_ends(TableReader& table, Kind& specimen) {
  specimen.ends = table.choice("ends", {"fixed", "sprung"});
  if (specimen.ends == "fixed") return;
  specimen.end_springs = EndSprings{table.number("bond_normal_kPa_per_mm", {.at_least = 0}),
                                    table.number("bond_tangential_kPa_per_mm", {.at_least = 0})};
}

AnnulusSpecimen read_annulus(TableReader& table) {
  AnnulusSpecimen annulus{};
  annulus.inner_radius_mm = table.number("inner_radius_mm", {.above = 0});
  annulus.outer_radius_mm = table.number("outer_radius_mm", {.above = annulus.inner_radius_mm});
  annulus.height_mm = table.number("height_mm", {.above = 0});
  annulus.mesh = read_mesh(table);
  read_ends(table, annulus);
  return annulus;
}

EllipsoidSpecimen read_ellipsoid(TableReader& table) {
  EllipsoidSpecimen ellipsoid{};
  const std::vector<double> inner = table.numbers("inner_axes_mm", 2, {.above = 0});
  const std::vector<double> outer = table.numbers("outer_axes_mm", 2, {.above = 0});
  for (size_t axis = 0; axis < 2; ++axis) {
    ellipsoid.inner_axes_mm[axis] = inner[axis];
    ellipsoid.outer_axes_mm[axis] = outer[axis];
    if (!(inner[axis] < outer[axis])) {
      table.fail("outer_axes_mm", fmt::format("{} is not beyond the inner {}", outer[axis], inner[axis]),
                 "Give [across z, along z] of the outer wall, each larger than the inner wall's.");
    }
  }
  ellipsoid.base_z_mm = table.number("base_z_mm", {.above = -inner[1]});
  if (!(ellipsoid.base_z_mm < inner[1])) {
    table.fail("base_z_mm", fmt::format("{} does not cut the inner wall", ellipsoid.base_z_mm),
               fmt::format("Choose it between -{0} and {0}, the inner semi-axis along z.", inner[1]));
  }
  for (const auto& [key, angle_deg] : {std::pair{"fibre_endo_deg", &ellipsoid.fibre_endo_deg},
                                       std::pair{"fibre_epi_deg", &ellipsoid.fibre_epi_deg}}) {
    if (!table.has("fibres"))
      *angle_deg = table.number(key, {.at_least = -180, .at_most = 180});
    else if (table.has(key))
      table.fail(key, "stands beside measured fibres", "Leave one of them out: fibres replaces the angles.");
  }
  ellipsoid.mesh = read_mesh(table);
  read_ends(table, ellipsoid);
  return ellipsoid;
}

MeshSpecimen read_mesh_specimen(TableReader& table, const std::filesystem::path& folder) {
  MeshSpecimen mesh{};
  // Both words were given to it: a fitted ventricle's mesh is named mesh_file, any other body's file.
  mesh.file = folder / table.text(table.has("mesh_file") ? "mesh_file" : "file");
  read_ends(table, mesh);
  return mesh;
}

std::optional<ImagedLoad> read_imaged_load(TableReader& table) {
  if (!table.has("imaged_at_kPa")) {
    if (table.has("imaged_at_sigma_kPa"))
      table.fail("imaged_at_sigma_kPa", "stands without imaged_at_kPa",
                 "Give the pressure at which the shape was imaged too, or leave it out.");
    return {};
  }
  return ImagedLoad{table.number("imaged_at_kPa", {.at_least = -100, .at_most = 100}),
                    table.number_or("imaged_at_sigma_kPa", 0.0, {.at_least = 0})};
}

/// What [specimen] says besides its kind.
struct SpecimenTable {
  Specimen specimen;
  std::optional<std::filesystem::path> fibres;
  std::optional<ImagedLoad> imaged_at;
};

SpecimenTable read_specimen(TableReader& root, const std::filesystem::path& folder) {
  TableReader table = root.table("specimen");
  const std::string kind = table.choice("kind", {"annulus", "ellipsoid", "mesh", "fitted-lv"});
  SpecimenTable read;
  if (kind == "mesh" || kind == "fitted-lv") {
    read.specimen = read_mesh_specimen(table, folder);
  } else if (kind == "ellipsoid") {
    read.specimen = read_ellipsoid(table);
  } else {
    read.specimen = read_annulus(table);
  }
  if (table.has("fibres")) read.fibres = folder / table.text("fibres");
  read.imaged_at = read_imaged_load(table);
  table.finish();
  return read;
}

StudyParameter read_parameter(const std::string& name, TableReader& table) {
  StudyParameter parameter{};
  parameter.name = name;
  const std::vector<double> bounds = table.numbers("bounds", 2);
  parameter.lower = bounds[0];
  parameter.upper = bounds[1];
  if (!(parameter.lower < parameter.upper)) {
    table.fail("bounds", fmt::format("[{}, {}] is not an interval", bounds[0], bounds[1]),
               "Write [lower, upper] with lower < upper.");
  }
  parameter.start = table.number("start", {.at_least = parameter.lower, .at_most = parameter.upper});
  const bool has_vary = table.has("vary");
  const std::string vary = has_vary ? table.choice("vary", {"whole", "element"}) : "whole";
  parameter.vary = vary == "element" ? Variation::element : Variation::whole;
  if (table.has("smooth") && table.choice("smooth", {"evidence", "none"}) == "none") {
    parameter.smoothness.kind = Smoothness::Kind::none;
  }
  if (table.has("smooth_step")) {
    if (table.has("smooth")) table.fail("smooth_step", "is given beside \"smooth\"", "Give one of the two.");
    parameter.smoothness = {Smoothness::Kind::given, table.number("smooth_step", {.above = 0})};
  }
  if (parameter.vary == Variation::whole && (table.has("smooth") || table.has("smooth_step"))) {
    table.fail(table.has("smooth") ? "smooth" : "smooth_step",
               "says how values of elements differ, but there is only one",
               "Write vary = \"element\", or leave it out.");
  }
  table.finish();
  return parameter;
}

StudyLaw read_law(TableReader& root, const std::filesystem::path& folder) {
  TableReader table = root.table("law");
  StudyLaw law;
  if (table.has("file")) {
    law.file = folder / table.text("file");
    law.name = law.file->string();
    if (table.has("name"))
      table.fail("name", "stands beside file", "Leave one of them out: the file is the law.");
  } else {
    law.name = table.text("name");
  }
  TableReader parameters = table.table("parameters");
  for (auto& [name, parameter] : parameters.named_tables()) {
    law.parameters.push_back(read_parameter(name, parameter));
  }
  if (law.parameters.empty()) {
    table.fail("parameters", "no parameter is given",
               "Add one table for each parameter of the law, as [law.parameters.C1_kPa].");
  }
  parameters.finish();
  table.finish();
  return law;
}

std::optional<StudyChamber> read_chamber(TableReader& root) {
  std::optional<TableReader> table = root.table_if("chamber");
  if (!table) return {};
  StudyChamber chamber;
  chamber.sealing_pressure_kPa = table->number_or("sealing_pressure_kPa", 0.0);
  if (table->has("compliance_mL_per_kPa"))
    chamber.compliance_mL_per_kPa = table->number("compliance_mL_per_kPa", {.above = 0});
  table->finish();
  return chamber;
}

/// [model.parameters.ID.NAME] start = ... and [[model.moments.ID]] of the effects of the list.
std::vector<StudyEffect> read_effect_values(TableReader& model, const std::vector<std::string>& effects) {
  std::vector<StudyEffect> list;
  std::optional<TableReader> parameters = model.table_if("parameters");
  std::optional<TableReader> moments = model.table_if("moments");
  for (const std::string& id : effects) {
    StudyEffect effect{id, {}, {}};
    if (parameters && parameters->has(id)) {
      for (auto& [name, parameter] : parameters->table(id).named_tables()) {
        effect.starts[name] = parameter.number("start");
        parameter.finish();
      }
    }
    if (moments) {
      for (TableReader& moment : moments->tables(id)) {
        effect.moments.push_back({moment.text("run"), moment.number("time_s", {.at_least = 0})});
        moment.finish();
      }
    }
    if (!effect.starts.empty() || !effect.moments.empty()) list.push_back(std::move(effect));
  }
  // Tables of effects that are not in the list are errors.
  if (parameters) parameters->finish();
  if (moments) moments->finish();
  return list;
}

StudyCompression read_compression(TableReader& model) {
  StudyCompression compression;
  if (model.has("bulk_modulus_kPa"))
    compression.bulk_modulus_kPa = model.number("bulk_modulus_kPa", {.above = 0});
  compression.volume_stiffness_kPa = model.number_or("volume_stiffness_kPa", 0.0, {.at_least = 0});
  if (compression.bulk_modulus_kPa && compression.volume_stiffness_kPa > 0) {
    model.fail("volume_stiffness_kPa", "would add to the bulk modulus",
               "It is for incompressible material; leave one of the two out.");
  }
  return compression;
}

StudyData read_data(TableReader& root, const std::filesystem::path& folder) {
  StudyData data;
  std::optional<TableReader> table = root.table_if("data");
  if (!table) return data;
  for (const std::string& run : table->texts_or("runs", {}))
    data.runs.push_back(folder / run);
  for (const std::string& study : table->texts_or("reference", {}))
    data.reference.push_back(folder / study);
  const auto path_if = [&](std::string_view key) -> std::optional<std::filesystem::path> {
    if (!table->has(key)) return std::nullopt;
    return folder / table->text(key);
  };
  data.tags = path_if("tags");
  data.points = path_if("points");
  data.frames = path_if("frames");
  data.images = path_if("images");
  if (data.images && (data.tags || data.points))
    table->fail("images", "stands beside tags or points",
                "Leave one of them out: tags are made of the images.");
  if ((data.tags || data.points || data.images) && !data.frames) {
    table->fail("frames", "missing, although tags, points or images are given",
                "Name the file with each frame's pressure: frames = \"NAME.frames.csv\".");
  }
  table->finish();
  return data;
}

void read_images(TableReader& root, StudyData& data) {
  std::optional<TableReader> images = root.table_if("images");
  if (!images) return;
  constexpr double absent = 0;
  const double spacing_mm = images->number_or("tag_spacing_mm", absent, {.above = 0.0});
  if (spacing_mm != absent) data.tag_spacing_mm = spacing_mm;
  if (data.tag_spacing_mm && !data.images)
    images->fail("tag_spacing_mm", "given, and no images are named",
                 "Name them, images = \"dicom/\" in [data], or leave it out.");
  std::optional<StudyPose>& pose = data.to_specimen;
  if (std::optional<TableReader> table = images->table_if("to_specimen")) {
    pose.emplace();
    const auto vector = [&](std::string_view key) -> std::array<double, 3> {
      const std::vector<double> numbers = table->numbers(key, 3);
      return {numbers[0], numbers[1], numbers[2]};
    };
    pose->origin_mm = vector("origin_mm");
    pose->axes = {vector("x_axis"), vector("y_axis"), vector("z_axis")};
    constexpr double tolerance = 1e-3;
    for (size_t i = 0; i < 3; ++i) {
      for (size_t j = 0; j <= i; ++j) {
        double product = 0;
        for (size_t k = 0; k < 3; ++k)
          product += pose->axes[i][k] * pose->axes[j][k];
        if (std::abs(product - (i == j ? 1.0 : 0.0)) > tolerance)
          table->fail("x_axis", "and y_axis, z_axis are not of length 1 and at right angles",
                      "Give the specimen's axes in patient coordinates, with five digits or more.");
      }
    }
    const auto& [x, y, z] = pose->axes;
    const double handedness = (x[1] * y[2] - x[2] * y[1]) * z[0] + (x[2] * y[0] - x[0] * y[2]) * z[1] +
                              (x[0] * y[1] - x[1] * y[0]) * z[2];
    if (handedness < 0)
      table->fail("z_axis", "points against x_axis cross y_axis: these axes are a mirror's",
                  "Turn one of the three round; a specimen's axes are right-handed.");
    table->finish();
  }
  images->finish();
}

[[noreturn]] void refuse_option(std::string_view option, std::string_view value, std::string problem,
                                std::string remedy) {
  throw InputError({"", fmt::format("{} {}", option, value), std::move(problem), std::move(remedy)});
}

}  // namespace

Study read_study(const std::filesystem::path& path) {
  std::error_code unreadable;  // what cannot be looked at is refused when it is read
  if (std::filesystem::is_directory(path, unreadable))
    throw InputError({path.string(), "", "is a folder, and this command reads a study",
                      "Name a *.study.toml; `diastole images FOLDER -o NAME.study.toml` begins one for a "
                      "folder of images."});
  TableReader root = TableReader::from_file(path);
  root.expect_format("diastole-study", 1);
  SpecimenTable specimen = read_specimen(root, path.parent_path());
  Study study{.file = path,
              .specimen = std::move(specimen.specimen),
              .fibres = std::move(specimen.fibres),
              .imaged_at = specimen.imaged_at,
              .law = read_law(root, path.parent_path()),
              .data = {},
              .effects = {},
              .refine = {}};
  study.data = read_data(root, path.parent_path());
  read_images(root, study.data);
  study.chamber = read_chamber(root);
  if (auto model = root.table_if("model")) {
    study.effects = model->texts_or("effects", {});
    study.effect_values = read_effect_values(*model, study.effects);
    for (const std::string& file : model->texts_or("effect_files", {}))
      study.effect_files.push_back(path.parent_path() / file);
    study.compression = read_compression(*model);
    if (auto error = model->table_if("error")) {
      for (const auto& [key, percent] : {std::pair{"cavity_percent", &study.model_error.cavity_percent},
                                         std::pair{"pump_percent", &study.model_error.pump_percent},
                                         std::pair{"volume_percent", &study.model_error.volume_percent}})
        if (error->has(key)) *percent = error->number(key, {.above = 0, .at_most = 50});
      error->finish();
    }
    if (model->has("refine")) {
      const std::vector<int64_t> halvings =
          model->integers("refine", 3, {.at_least = 0, .at_most = most_halvings});
      std::transform(halvings.begin(), halvings.end(), study.refine.begin(),
                     [](int64_t count) { return static_cast<int>(count); });
    }
    model->finish();
  }
  root.finish();
  return study;
}

std::vector<std::filesystem::path> inputs_of(const Study& study) {
  std::vector<std::filesystem::path> inputs = study.data.runs;
  inputs.push_back(study.file);
  inputs.insert(inputs.end(), study.effect_files.begin(), study.effect_files.end());
  if (study.law.file) inputs.push_back(*study.law.file);
  if (const auto* mesh = std::get_if<MeshSpecimen>(&study.specimen)) inputs.push_back(mesh->file);
  for (const auto& data : {study.fibres, study.data.tags, study.data.points, study.data.frames}) {
    if (data) inputs.push_back(*data);
  }
  return inputs;
}

void set_start(Study& study, std::string_view assignment) {
  const size_t equals = assignment.find('=');
  const auto value = parse_number<double>(assignment.substr(equals + 1));
  if (equals == std::string_view::npos || !value) {
    refuse_option("--set", assignment, "is not NAME=NUMBER", "Write for example --set C1_kPa=7.5.");
  }
  const std::string_view name = assignment.substr(0, equals);
  std::vector<std::string> known;
  for (StudyParameter& parameter : study.law.parameters) {
    known.push_back(parameter.name);
    if (parameter.name != name) continue;
    if (!(*value >= parameter.lower && *value <= parameter.upper)) {
      refuse_option("--set", assignment,
                    fmt::format("lies outside the bounds [{}, {}]", parameter.lower, parameter.upper),
                    "Choose a value inside, or widen `bounds` in the study.");
    }
    parameter.start = *value;
    return;
  }
  refuse_option("--set", assignment, fmt::format("\"{}\" is not a parameter of the study", name),
                fmt::format("It has: {}.", fmt::join(known, ", ")));
}

void set_smoothness(Study& study, std::string_view choice) {
  Smoothness smoothness;
  if (choice == "none") {
    smoothness.kind = Smoothness::Kind::none;
  } else if (choice != "evidence") {
    smoothness.kind = Smoothness::Kind::given;
    smoothness.step = parse_number<double>(choice).value_or(0.0);
    if (!(smoothness.step > 0)) {
      refuse_option("--smooth", choice, "is neither evidence, none nor a positive number",
                    "Give the usual relative difference between neighbouring elements, as --smooth 0.05.");
    }
  }
  for (StudyParameter& parameter : study.law.parameters)
    parameter.smoothness = smoothness;
}

std::vector<int> mesh_of(const Specimen& specimen) {
  return std::visit(
      [](const auto& kind) -> std::vector<int> {
        if constexpr (requires { kind.mesh; }) {
          return {kind.mesh.begin(), kind.mesh.end()};
        } else {
          return {};
        }
      },
      specimen);
}

namespace {

/// "8,8,4" as three whole numbers.
std::array<int, 3> three_counts(std::string_view option, std::string_view text, std::string_view example) {
  const auto counts = parse_numbers<int, 3>(text);
  if (!counts)
    refuse_option(option, text, "is not three whole numbers",
                  fmt::format("Write for example {} {}.", option, example));
  return *counts;
}

}  // namespace

void set_refinement(Study& study, std::string_view halvings) {
  study.refine = three_counts("--refine", halvings, "0,1,1");
  for (const int count : study.refine) {
    if (count < 0 || count > most_halvings) {
      refuse_option("--refine", halvings, fmt::format("halves elements {} times", count),
                    fmt::format("Halve 0 to {} times along each direction.", most_halvings));
    }
  }
}

void set_mesh(Study& study, std::string_view counts) {
  const std::array<int, 3> mesh = three_counts("--mesh", counts, "8,8,4");
  for (size_t axis = 0; axis < 3; ++axis) {
    const int least = axis == 0 ? min_circumferential : 1;
    if (mesh[axis] < least || mesh[axis] > max_elements[axis]) {
      refuse_option("--mesh", counts, fmt::format("has {} elements in direction {}", mesh[axis], axis + 1),
                    fmt::format("Use {} to {} there.", least, max_elements[axis]));
    }
  }
  std::visit(
      [&](auto& kind) {
        if constexpr (requires { kind.mesh; }) {
          kind.mesh = mesh;
        } else {
          refuse_option("--mesh", counts, "does not go with a mesh file",
                        "Halve its elements with --refine 1,1,1.");
        }
      },
      study.specimen);
}

}  // namespace diastole
