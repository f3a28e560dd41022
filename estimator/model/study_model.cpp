#include "estimator/model/study_model.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "estimator/fe/elastic_system.hpp"
#include "estimator/io/fibre_points.hpp"
#include "estimator/io/study_refusal.hpp"
#include "estimator/materials/file_law.hpp"
#include "estimator/mesh/annulus.hpp"
#include "estimator/mesh/ellipsoid.hpp"
#include "estimator/mesh/fibres_through_points.hpp"
#include "estimator/mesh/refinement.hpp"
#include "protocol/contract/table_reader.hpp"

namespace diastole {
namespace {

const Law& law_of(const Study& study) {
  if (study.law.file) return law_of_file(*study.law.file);
  if (const Law* law = find_law(study.law.name)) return *law;
  std::vector<std::string> known;
  for (const Law* law : all_laws())
    known.emplace_back(law->name());
  refuse(study, "law.name", fmt::format("no law is called \"{}\"", study.law.name),
         fmt::format("{}Known: {}.", did_you_mean(study.law.name, known), fmt::join(known, ", ")));
}

std::vector<double> start_values(const Study& study, const Law& law) {
  std::vector<std::string> known;
  for (const LawParameter& parameter : law.parameters())
    known.emplace_back(parameter.name);
  for (const StudyParameter& given : study.law.parameters) {
    if (law.parameter_index(given.name) == law.parameters().size()) {
      refuse(study, "law.parameters." + given.name,
             fmt::format("the law {} has no such parameter", law.name()),
             fmt::format("{}It has {}.", did_you_mean(given.name, known), fmt::join(known, ", ")));
    }
  }
  std::vector<double> values;
  for (const LawParameter& parameter : law.parameters()) {
    const auto given = std::find_if(study.law.parameters.begin(), study.law.parameters.end(),
                                    [&](const StudyParameter& p) { return p.name == parameter.name; });
    if (given == study.law.parameters.end()) {
      refuse(study, "law.parameters", fmt::format("{} is missing ({})", parameter.name, parameter.meaning),
             fmt::format("Add [law.parameters.{}] with start and bounds.", parameter.name));
    }
    if (!(given->start > parameter.above)) {
      refuse(study, fmt::format("law.parameters.{}.start", parameter.name),
             fmt::format("{} is not above {}", given->start, parameter.above), "Choose a larger start.");
    }
    if (given->start > parameter.at_most) {
      refuse(study, fmt::format("law.parameters.{}.start", parameter.name),
             fmt::format("{} is above {}", given->start, parameter.at_most),
             "Choose a smaller start, or widen the bounds in the law's file.");
    }
    values.push_back(given->start);
  }
  return values;
}

std::array<size_t, 3> counts(const std::array<int, 3>& mesh) {
  return {static_cast<size_t>(mesh[0]), static_cast<size_t>(mesh[1]), static_cast<size_t>(mesh[2])};
}

MeshBody make_body(const MeshSpecimen& specimen) { return read_mesh_file(specimen.file); }

MeshBody make_body(const AnnulusSpecimen& specimen) {
  return {make_annulus(AnnulusShape{.inner_radius_mm = specimen.inner_radius_mm,
                                    .outer_radius_mm = specimen.outer_radius_mm,
                                    .height_mm = specimen.height_mm,
                                    .elements = counts(specimen.mesh)}),
          {}};
}

MeshBody make_body(const EllipsoidSpecimen& specimen) {
  const EllipsoidShape shape{.inner_axes_mm = specimen.inner_axes_mm,
                             .outer_axes_mm = specimen.outer_axes_mm,
                             .base_z_mm = specimen.base_z_mm,
                             .elements = counts(specimen.mesh)};
  return {make_ellipsoid(shape), ellipsoid_fibres(shape, specimen.fibre_endo_deg, specimen.fibre_epi_deg)};
}

/// The same body in elements that are halved so many times along each direction.
MeshBody refined(MeshBody body, const std::array<int, 3>& halvings) {
  for (size_t direction = 0; direction < 3; ++direction) {
    for (int i = 0; i < halvings[direction]; ++i) {
      const Refinement finer(body.mesh, direction);
      if (body.fibres) body.fibres = body.fibres->prolonged(finer);
      body.mesh = finer.mesh();
    }
  }
  return body;
}

/// Without [images.to_specimen] the points are in the specimen's own axes.
std::vector<FibrePoint> measured_directions(const Study& study) {
  const Placement to_images = placement_of(study);
  std::vector<FibrePoint> points;
  for (const FibrePointRow& row : read_fibre_points(*study.fibres)) {
    const Eigen::Vector3d place(row.place_mm.data()), direction(row.direction.data());
    points.push_back({to_images.back(place), to_images.rotation.transpose() * direction, row.sigma_deg});
  }
  return points;
}

/// In place of assumed ones.
FibresThroughPoints measured_fibres(const Study& study, const HermiteMesh& mesh,
                                    const std::vector<FibrePoint>& points) {
  try {
    return fibres_through_points(mesh, points);
  } catch (const std::invalid_argument& error) {
    refuse(study, "specimen.fibres", fmt::format("{}: {}", study.fibres->string(), error.what()),
           "They are of another specimen or place. The file has patient coordinates: [images.to_specimen] "
           "says where the specimen lies in them.");
  }
}

/// The springs' plates are rigid, plane and across z, and the gaps along a wall's rim are counted from them.
void require_plane(const Study& study, const HermiteMesh& mesh, const char* name,
                   const std::vector<ElementFace>& faces) {
  const double allowed_mm = 1e-6 * mesh.extent_mm();
  std::optional<double> plate_z_mm;
  for (const ElementFace& face : faces) {
    for (size_t sample = 0; sample < 9; ++sample) {
      MaterialPoint point{face.element, {}};
      point.xi[face.direction] = static_cast<double>(face.side);
      point.xi[(face.direction + 1) % 3] = 0.5 * static_cast<double>(sample % 3);
      point.xi[(face.direction + 2) % 3] = 0.5 * static_cast<double>(sample / 3);
      const double z_mm = mesh.value(mesh.reference(), point)[2];
      if (!plate_z_mm) plate_z_mm = z_mm;
      if (std::abs(z_mm - *plate_z_mm) <= allowed_mm) continue;
      refuse(study, "specimen.ends",
             fmt::format("the faces {} are not in one plane across z, as the plates are that \"sprung\" ends "
                         "are glued to: element {} is at z = {:g} mm, element {} at {:g} mm",
                         name, faces.front().element, *plate_z_mm, face.element, z_mm),
             "Turn the mesh so that its ends lie across z, name only such faces bottom and top, or hold "
             "them: ends = \"fixed\".");
    }
  }
}

/// End faces on springs, if the study's are.
std::vector<BondedFaces> bonded_ends(const Study& study, const HermiteMesh& mesh) {
  const std::optional<EndSprings> springs =
      std::visit([](const auto& specimen) { return specimen.end_springs; }, study.specimen);
  if (!springs) return {};
  const SpringBond bond{springs->normal_kPa_per_mm, springs->tangential_kPa_per_mm};
  require_plane(study, mesh, "bottom", mesh.faces().bottom);
  require_plane(study, mesh, "top", mesh.faces().top);
  std::vector<BondedFaces> bonded;
  for (const std::vector<ElementFace>* faces : {&mesh.faces().bottom, &mesh.faces().top}) {
    if (!faces->empty()) bonded.push_back({*faces, bond});
  }
  return bonded;
}

/// Without them an anisotropic law would have its fibres along x, which nobody asked for.
void require_axes(const Study& study, const Law& law, const MeshBody& body) {
  if (!law.needs_axes() || body.fibres) return;
  std::vector<std::string_view> isotropic;
  for (const Law* other : all_laws()) {
    if (!other->needs_axes()) isotropic.push_back(other->name());
  }
  const bool from_file = std::holds_alternative<MeshSpecimen>(study.specimen);
  refuse(study, study.law.file ? "law.file" : "law.name",
         fmt::format("the law {} needs to know where the fibres run, and {}", law.name(),
                     from_file ? "the mesh file has no fibre_deg" : "this kind of specimen has no fibres"),
         fmt::format("{} (docs/mesh-file.md), or choose a law without fibres: {}.",
                     from_file ? "Give all nodes of the mesh file a fibre_deg"
                               : "Export the body by `diastole mesh export STUDY -o BODY.mesh.toml`, give "
                                 "all its nodes a fibre_deg and name it in the study",
                     fmt::join(isotropic, ", ")));
}

Chamber chamber_of(const StudyChamber& given) {
  Chamber chamber{.sealing_pressure_kPa = given.sealing_pressure_kPa};
  if (given.compliance_mL_per_kPa) chamber.compliance_mL_per_kPa = *given.compliance_mL_per_kPa;
  return chamber;
}

/// What a mesh file must have, reported at the study's key for it.
void require_of_mesh(const Study& study, bool fulfilled, std::string problem, std::string remedy) {
  if (!fulfilled) refuse(study, "specimen.file", std::move(problem), std::move(remedy));
}

void require_ends(const Study& study, const HermiteMesh& mesh) {
  require_of_mesh(
      study, !mesh.faces().bottom.empty() || !mesh.faces().top.empty(),
      "the mesh names no face bottom or top, so that nothing holds the body",
      "Name the faces that specimen.ends is to hold in the mesh file, as faces = [\"bottom xi2=0\"].");
}

void require_chamber_wall(const Study& study, const ElasticModel& model) {
  if (!study.chamber) return;
  require_of_mesh(study, !model.mesh().faces().outer.empty(),
                  "the mesh names no face outer, which the fluid in the [chamber] would push on",
                  "Name the outer wall in the mesh file, as faces = [\"outer xi3=1\"], or remove [chamber].");
  require_of_mesh(study, !model.system().chamber()->sealed() || model.system().chamber_closed(),
                  "the outer faces have a free rim, so that a sealed [chamber] has no volume",
                  "Name all of the outer wall outer and the ends that its rim lies on bottom and top, or "
                  "leave out chamber.compliance_mL_per_kPa for constant pressure around the specimen.");
}

MeshBody refined_body(const Study& study) {
  MeshBody body = std::visit([](const auto& specimen) { return make_body(specimen); }, study.specimen);
  try {
    body = refined(std::move(body), study.refine);
  } catch (const std::invalid_argument& error) {
    refuse(study, "model.refine", error.what(), "Leave the mesh as the file has it.");
  }
  return body;
}

void add_fibre_findings(const Study& study, const std::vector<FibrePoint>& points,
                        const FibresThroughPoints& found, std::vector<Finding>& findings) {
  const auto add = [&](const char* id, std::string what, double number, const char* unit) {
    findings.push_back({Severity::warning, id, std::move(what), study.fibres->string(), number, unit,
                        "Check that the fibres are this specimen's, and where it lies in them "
                        "([images.to_specimen])."});
  };
  constexpr double most_beside = 0.1;
  const auto beside = static_cast<double>(points.size() - found.used);
  if (beside > most_beside * static_cast<double>(points.size()))
    add("fibres-beside", fmt::format("{} of {} fibre directions lie beside the mesh", beside, points.size()),
        beside, "points");
  double squares = 0;
  for (const FibrePoint& point : points)
    squares += point.sigma_deg * point.sigma_deg / static_cast<double>(points.size());
  constexpr double most_sigmas = 3.0;
  if (found.rms_deg > most_sigmas * std::sqrt(squares))
    add("fibres-misfit",
        fmt::format(
            "fibre directions differ by {:.1f} degrees RMS from the smoothest field through them, and "
            "their errors are {:.1f}",
            found.rms_deg, std::sqrt(squares)),
        found.rms_deg, "degrees");
}

}  // namespace

MeshBody study_body(const Study& study, std::vector<Finding>* findings) {
  MeshBody body = refined_body(study);
  if (!study.fibres) return body;
  const std::vector<FibrePoint> points = measured_directions(study);
  FibresThroughPoints found = measured_fibres(study, body.mesh, points);
  if (findings != nullptr) add_fibre_findings(study, points, found, *findings);
  body.fibres = std::move(found.fibres);
  return body;
}

std::vector<Finding> fibre_findings(const Study& study) {
  std::vector<Finding> findings;
  if (study.fibres) (void)study_body(study, &findings);
  return findings;
}

Placement placement_of(const Study& study) {
  Placement placement;
  if (!study.data.to_specimen) return placement;
  placement.origin_mm = Eigen::Vector3d(study.data.to_specimen->origin_mm.data());
  for (size_t axis = 0; axis < 3; ++axis)
    placement.rotation.col(static_cast<Eigen::Index>(axis)) =
        Eigen::Vector3d(study.data.to_specimen->axes[axis].data());
  return placement;
}

bool is_modulus(const Study& study, const StudyParameter& parameter) {
  const Law& law = law_of(study);
  const size_t index = law.parameter_index(parameter.name);
  return index < law.parameters().size() && law.parameters()[index].is_modulus();
}

SpecimenParts specimen_parts(const Study& study, SolveOptions options, std::vector<Finding>* findings) {
  const Law& law = law_of(study);
  if (!study.effects.empty()) {
    refuse(study, "model.effects", fmt::format("the model has no effect \"{}\"", study.effects.front()),
           "Leave the list empty.");
  }
  ElasticOptions elastic;
  elastic.parameters = start_values(study, law);
  elastic.solve = std::move(options);
  MeshBody body = study_body(study, findings);
  require_axes(study, law, body);
  require_ends(study, body.mesh);
  if (body.fibres) elastic.material_axes = material_axes_of(*body.fibres);
  elastic.bonded = bonded_ends(study, body.mesh);
  if (study.chamber) elastic.chamber = chamber_of(*study.chamber);
  elastic.bulk_modulus_kPa = study.compression.bulk_modulus_kPa;
  elastic.volume_stiffness_kPa = study.compression.volume_stiffness_kPa;
  return {std::move(body), &law, std::move(elastic)};
}

ElasticModel make_model(const Study& study, SolveOptions options, std::vector<Finding>* findings) {
  SpecimenParts parts = specimen_parts(study, std::move(options), findings);
  ElasticModel model(std::move(parts.body.mesh), *parts.law, std::move(parts.options));
  require_chamber_wall(study, model);
  return model;
}

void require_cavity(const Study& study, const ElasticModel& model) {
  require_of_mesh(study, !model.mesh().faces().inner.empty(),
                  "the mesh names no face inner, which a cavity pressure would push on",
                  "Name the cavity's wall in the mesh file, as faces = [\"inner xi3=0\"].");
}

void require_closed_cavity(const Study& study, const ElasticModel& model) {
  require_cavity(study, model);
  require_of_mesh(study, model.system().cavity_closed(),
                  "the inner faces have a free rim, so that the cavity has no volume to be led to",
                  "Name all of the cavity's wall inner and the ends that its rim lies on bottom and top, or "
                  "solve for a pressure: `diastole solve STUDY --pressure-kPa 1`.");
}

}  // namespace diastole
