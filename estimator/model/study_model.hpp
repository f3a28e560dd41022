#pragma once
// The forward model that a study describes: its mesh, law, start values and supports.

#include "estimator/fe/elastic_model.hpp"
#include "estimator/io/finding.hpp"
#include "estimator/io/study.hpp"
#include "estimator/mesh/mesh_file.hpp"
#include "estimator/mesh/placed_mesh.hpp"

namespace diastole {

/// The specimen's mesh, refined as the study says, and its fibres: those that the study has measured, if any. Throws InputError if a mesh
/// file is wrong or cannot be refined, or if measured fibres are not in the mesh. `findings` gets what is doubtful about these: they lie
/// beside the mesh, or are not what a field in it can be.
MeshBody study_body(const Study& study, std::vector<Finding>* findings = nullptr);

/// These findings alone.
std::vector<Finding> fibre_findings(const Study& study);

/// Whether the study's law has a modulus of that name (LawParameter::is_modulus). Throws InputError if the law is unknown.
bool is_modulus(const Study& study, const StudyParameter& parameter);

/// From the specimen's axes to the images': [images.to_specimen]; nothing moves without it.
Placement placement_of(const Study& study);

/// What a study's forward model is made of.
struct SpecimenParts {
  MeshBody body;
  const Law* law;
  ElasticOptions options;
};

/// Parameters take their `start`. Throws InputError if the law is unknown, if the study lacks one of its
/// parameters or has one that it does not know, if a start lies outside the law's bounds, or if it names
/// an effect (the model has none), if the law needs axes and the body has no fibres, if the mesh file names no face
/// to hold, or if it names no outer wall for the chamber, or one with a free rim for a sealed one.
/// `findings` as study_body's.
SpecimenParts specimen_parts(const Study& study, SolveOptions options = {},
                             std::vector<Finding>* findings = nullptr);
ElasticModel make_model(const Study& study, SolveOptions options = {},
                        std::vector<Finding>* findings = nullptr);

/// Throws InputError if the model has no wall for a cavity pressure to push on (a mesh file without `inner`).
void require_cavity(const Study& study, const ElasticModel& model);
/// The same if that wall encloses no volume: its rim is neither held nor at plates.
void require_closed_cavity(const Study& study, const ElasticModel& model);

}  // namespace diastole
